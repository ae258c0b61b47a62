"""Write CalculiX and Abaqus input decks: a mesh with its sets, and a frequency step.

Written here because meshio writes lines of 21 entries and the element type C3D20RH; CalculiX accepts neither.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.errors import MeshError
from fe.material import Material
from fe.mesh import Mesh

#: CalculiX reads at most 16 entries per line, 20 characters each: a number with 13 digits is 19 long.
ENTRIES = 16
NUMBER = "%.12E"
#: Set of all cells in the frequency deck of a mesh with one material.
ALL_CELLS = "ALL_CELLS"


@dataclass(frozen=True, kw_only=True, eq=False)
class NodeSpring:
    """Spring between two nodes that acts on their relative displacement in one direction.

    Parameters
    ----------
    node, other
        Nodes of the mesh [-].
    direction
        Unit vector, shape (3,) [-].
    stiffness
        Stiffness [N/m].
    """

    node: int
    other: int
    direction: Float[NDArray[np.float64], "3"]
    stiffness: float


class FrequencyOutput(Enum):
    """Output of a `*FREQUENCY` step; the value is the parameter that requests it."""

    EIGENVALUES = ""
    #: Also the binary .eig file, with the eigenvalues in full double precision.
    BINARY = ", STORAGE=YES"
    #: Mass and stiffness as text in .mas and .sti, without a solution.
    MATRICES = ", SOLVER=MATRIXSTORAGE"


def write_calculix(
    mesh: Mesh,
    path: Path,
    materials: Material | Mapping[str, Material],
    fixed: Int[NDArray[np.int64], "k 2"],
    n_mode: int,
    output: FrequencyOutput = FrequencyOutput.EIGENVALUES,
    springs: Sequence[NodeSpring] = (),
) -> None:
    """Write a deck that computes natural frequencies, in SI units, so that frequencies come out in Hz.

    Parameters
    ----------
    mesh
        The mesh; its node and cell numbers are those of the deck minus one.
    path
        File to write, by custom with the suffix .inp.
    materials
        One material for all cells, or one for each cell set, as in `fe.assembly.assemble`.
    fixed
        Fixed degrees of freedom: node and direction (0, 1, 2), shape (k, 2) [-].
    n_mode
        Number of modes [-].
    output
        Output of the step.
    springs
        Springs between nodes.

    Raises
    ------
    MeshError
        A material for an unknown cell set, or a set name that a deck cannot store.
    """
    by_set = {ALL_CELLS: materials} if isinstance(materials, Material) else dict(materials)
    unknown = [name for name in by_set if name != ALL_CELLS and name not in mesh.cell_sets]
    if unknown:
        known = ", ".join(sorted(mesh.cell_sets)) or "none"
        raise MeshError(f'a material is given for the cell set "{unknown[0]}", but the mesh has {known}')
    with path.open("w", encoding="ascii") as deck:
        deck.writelines(format_mesh(mesh))
        if ALL_CELLS in by_set:
            deck.writelines(_format_set("ELSET", ALL_CELLS, np.arange(mesh.n_cell)))
        for number, (name, material) in enumerate(by_set.items(), start=1):
            # Numbered, because the name of a cell set may be invalid for a material.
            deck.write(f"*MATERIAL, NAME=MATERIAL_{number}\n*ELASTIC\n")
            deck.write(
                f"{NUMBER}, {NUMBER}\n*DENSITY\n{NUMBER}\n" % (material.young, material.poisson, material.density)
            )
            deck.write(f"*SOLID SECTION, ELSET={name}, MATERIAL=MATERIAL_{number}\n")
        for number, spring in enumerate(springs, start=1):
            deck.writelines(_format_spring(mesh.n_cell + number, number, spring))
        fixed = np.asarray(fixed).reshape(-1, 2)
        if fixed.size:
            deck.write("*BOUNDARY\n")
            deck.write(
                _format_rows("%d, %d, %d\n", np.column_stack([fixed[:, 0] + 1, fixed[:, 1] + 1, fixed[:, 1] + 1]))
            )
        deck.write(f"*STEP\n*FREQUENCY{output.value}\n{n_mode}\n*END STEP\n")


def format_mesh(mesh: Mesh) -> Iterator[str]:
    """Nodes, elements and all sets (`*NSET`, `*ELSET`, `*SURFACE`) as pieces of a flat deck; empty sets are left out.

    Raises
    ------
    MeshError
        A set name that a deck cannot store.
    """
    _refuse_names(mesh)
    yield "** Mesh in metres.\n*NODE\n"
    yield _format_rows(
        f"%d, {NUMBER}, {NUMBER}, {NUMBER}\n", np.column_stack([np.arange(1, mesh.n_node + 1), mesh.points])
    )
    for start, element, cells in mesh.blocks():
        entries = 1 + cells.shape[1]
        # All entries but the last of a full line are followed by a comma on the same line.
        parts = [", ".join(["%d"] * len(range(k, min(k + ENTRIES, entries)))) for k in range(0, entries, ENTRIES)]
        yield f"*ELEMENT, TYPE={element.abaqus}\n"
        yield _format_rows(",\n".join(parts) + "\n", np.column_stack([start + 1 + np.arange(len(cells)), cells + 1]))
    for name, nodes in mesh.node_sets.items():
        yield from _format_set("NSET", name, nodes)
    for name, members in mesh.cell_sets.items():
        yield from _format_set("ELSET", name, members)
    for name, faces in mesh.face_sets.items():
        if len(faces):
            label = np.empty(len(faces), dtype=np.int64)
            for here, element, local, _ in mesh.face_groups(faces):
                label[here] = element.abaqus_faces.index(local) + 1
            yield f"*SURFACE, NAME={name}, TYPE=ELEMENT\n"
            yield _format_rows("%d, S%d\n", np.column_stack([faces[:, 0] + 1, label]))


def _format_spring(element: int, number: int, spring: NodeSpring) -> Iterator[str]:
    """Lines of a spring along the first axis of a local frame."""
    across = np.zeros(3)
    across[np.argmin(np.abs(spring.direction))] = 1.0
    frame = ", ".join(NUMBER % float(value) for value in (*spring.direction, *across))
    yield f"*ORIENTATION, NAME=FRAME_{number}, SYSTEM=RECTANGULAR\n{frame}\n"
    yield f"*ELEMENT, TYPE=SPRING2, ELSET=SPRING_{number}\n{element}, {spring.node + 1}, {spring.other + 1}\n"
    yield f"*SPRING, ELSET=SPRING_{number}, ORIENTATION=FRAME_{number}\n1, 1\n{NUMBER % spring.stiffness}\n"


def _format_set(keyword: str, name: str, members: Int[NDArray[np.int64], " k"]) -> Iterator[str]:
    if not len(members):
        return
    yield f"*{keyword}, {keyword}={name}\n"
    numbers = [str(member + 1) for member in members.tolist()]
    for k in range(0, len(numbers), ENTRIES):
        yield ", ".join(numbers[k : k + ENTRIES]) + ",\n"


def _format_rows(form: str, table: NDArray[np.float64] | NDArray[np.int64]) -> str:
    """Rows of a table in one format; a single formatting call is ten times faster than one per row."""
    return form * len(table) % tuple(table.ravel().tolist())


def _refuse_names(mesh: Mesh) -> None:
    for kind, sets in (("node", mesh.node_sets), ("face", mesh.face_sets), ("cell", mesh.cell_sets)):
        seen: dict[str, str] = {}
        for name in sets:
            if not (name.isascii() and re.fullmatch(r"[A-Za-z][^\s,=*\"]{0,79}", name)):
                raise MeshError(
                    f'the {kind} set "{name}" cannot be written to an .inp file: give it a name that begins with a '
                    "letter and has at most 80 ASCII characters, without blanks, commas, equals signs, stars or "
                    "quotes"
                )
            if name.upper() in seen:
                raise MeshError(
                    f'the {kind} sets "{seen[name.upper()]}" and "{name}" are the same set in an .inp file, which '
                    "does not distinguish upper and lower case: rename one"
                )
            seen[name.upper()] = name
