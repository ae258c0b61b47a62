"""Gmsh mesh files: read with meshio, written as MSH 4.1 text with every set as a physical group.

The writer is not meshio's, because meshio allows one physical group per volume, while cell sets may overlap.
"""

import contextlib
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.element import Element
from fe.errors import MeshError
from fe.file.mesh import MESH_FORMATS
from fe.file.mesh_content import FileMesh
from fe.file.meshio_reader import read_with_meshio
from fe.file.registry import FileFormat
from fe.mesh import Mesh
from geometry.trial_process import read_in_trial_process

#: Gmsh's element types: triangle or quadrangle by its number of nodes, and point.
GMSH_FACES = {3: 2, 4: 3, 6: 9, 8: 16}
GMSH_POINT = 15
#: Versions of the format that are read.
VERSIONS = ("4.1", "2.2", "2.1", "2")
#: Largest node or element label that is allowed in a file of any size: meshio's tables then need less than a gigabyte.
LARGEST_NUMBER = 100_000_000
#: A whole number of nine digits or more among the first 31 numbers of a line.
WHOLE_NUMBER = re.compile(rb"^[ \t]*(?:\d{1,8}[ \t]+){0,30}(\d{9,})\b", re.MULTILINE)
#: Reading speed of a binary file on a slow machine [byte/s], and memory per byte of the file [-].
SPEED, MEMORY = 5e6, 50
DIMENSION_NAMES = ("point", "curve", "surface", "volume")


def read_msh(path: Path) -> FileMesh:
    """Read cells and physical groups; a group without a name is named by its kind and number, such as "surface_3".

    Raises
    ------
    MeshError
        The file cannot be read.
    """
    _refuse_version(path)
    _refuse_duplicate_names(path)
    _refuse_impossible_number(path)
    with _meshio_as_gmsh_writes():
        result = read_with_meshio(path, "gmsh")
    blocks = tuple((block.type, np.asarray(block.data, dtype=np.int64)) for block in result.cells)
    starts = np.cumsum([0, *(len(nodes) for _, nodes in blocks)])
    members: dict[str, list[NDArray[np.int64]]] = {}
    named = {name: parts for name, parts in result.cell_sets.items() if name != "gmsh:bounding_entities"}
    for name, parts in named.items():
        members[name] = [
            np.asarray(part) + start for part, start in zip(parts, starts, strict=False) if part is not None
        ]
    # MSH 2 keeps groups as one number per cell; in MSH 4 the same array holds groups that have no name.
    names = {(int(tag), int(dimension)): name for name, (tag, dimension) in result.field_data.items()}
    for tags, block, start in zip(result.cell_data.get("gmsh:physical", []), result.cells, starts, strict=False):
        groups = np.abs(tags)  # negative for reversed cells of a group
        for tag in np.unique(groups[groups > 0]).tolist():
            name = names.get((tag, block.dim), f"{DIMENSION_NAMES[block.dim]}_{tag}")
            if name not in named:
                members.setdefault(name, []).append(np.flatnonzero(groups == tag) + start)
    return FileMesh(
        points=np.asarray(result.points, dtype=np.float64),
        blocks=blocks,
        cell_sets={name: np.concatenate(parts).astype(np.int64) for name, parts in members.items() if parts},
    )


def write_msh(mesh: Mesh, path: Path, point_data: Mapping[str, Float[NDArray[np.float64], "node ..."]]) -> None:
    """Write MSH 4.1 text: cell sets as physical volumes, face sets as physical surfaces, node sets as physical points.

    Cells are grouped by the sets that they belong to, so a reader gets them in another order. A group name can be used
    once only: a node set is left out if a face set of the same name has the same nodes.

    Raises
    ------
    MeshError
        Different sets with the same name, or a name with a quote.
    """
    sets = {3: mesh.cell_sets, 2: mesh.face_sets, 0: _without_repeats(mesh)}
    sets = {dimension: {name: part for name, part in named.items() if len(part)} for dimension, named in sets.items()}
    names = [(dimension, name) for dimension, named in sets.items() for name in named]
    tags = {name: tag for tag, (_, name) in enumerate(names, start=1)}
    if len(tags) < len(names):
        double = next(name for _, name in names if sum(name == other for _, other in names) > 1)
        raise MeshError(
            f'two sets of different kind are called "{double}", which an .msh file cannot distinguish: rename one'
        )
    quoted = [name for name in tags if '"' in name]
    if quoted:
        raise MeshError(f"the set {quoted[0]} has a quote in its name, which is not allowed in an .msh file: rename it")
    volumes = list(_group_volumes(mesh, sets[3]))
    with path.open("w", encoding="utf-8") as file:
        file.write("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n")
        if names:
            file.write(f"$PhysicalNames\n{len(names)}\n")
            file.writelines(f'{dimension} {tags[name]} "{name}"\n' for dimension, name in names)
            file.write("$EndPhysicalNames\n")
        low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
        box = " ".join(f"{x:.16g}" for x in (*low, *high))
        file.write(f"$Entities\n{len(sets[0])} 0 {len(sets[2])} {len(volumes)}\n")
        centre = " ".join(f"{x:.16g}" for x in (low + high) / 2)
        file.writelines(f"{k} {centre} 1 {tags[name]}\n" for k, name in enumerate(sets[0], 1))
        file.writelines(f"{k} {box} 1 {tags[name]} 0\n" for k, name in enumerate(sets[2], 1))
        for k, (groups, _, _) in enumerate(volumes, 1):
            file.write(f"{k} {box} {' '.join(str(n) for n in (len(groups), *(tags[name] for name in groups)))} 0\n")
        n = mesh.n_node
        file.write(f"$EndEntities\n$Nodes\n1 {n} 1 {n}\n3 1 0 {n}\n")
        file.write("%d\n" * n % tuple(range(1, n + 1)))
        file.write("%.16g %.16g %.16g\n" * n % tuple(mesh.points.ravel().tolist()))
        file.write("$EndNodes\n")
        blocks = [(3, k, kind.gmsh, kind.gmsh_order, cells) for k, (_, kind, cells) in enumerate(volumes, 1)]
        blocks += list(_group_surfaces(mesh, sets[2]))
        blocks += [(0, k, GMSH_POINT, (0,), nodes[:, None]) for k, nodes in enumerate(sets[0].values(), 1)]
        total = sum(len(cells) for *_, cells in blocks)
        file.write(f"$Elements\n{len(blocks)} {total} 1 {total}\n")
        first = 1
        for dimension, entity, kind, order, cells in blocks:
            file.write(f"{dimension} {entity} {kind} {len(cells)}\n")
            table = np.column_stack([np.arange(first, first + len(cells)), cells[:, order] + 1])
            file.write((" ".join(["%d"] * table.shape[1]) + "\n") * len(table) % tuple(table.ravel().tolist()))
            first += len(cells)
        file.write("$EndElements\n")
        for name, values in point_data.items():
            file.writelines(_format_node_data(name, np.asarray(values).reshape(n, -1)))


@contextlib.contextmanager
def _meshio_as_gmsh_writes() -> Iterator[None]:
    """Let meshio read two kinds of valid Gmsh files that it would refuse or misread.

    If only some entities belong to a physical group ("Save all elements"), meshio's array of group numbers lacks
    blocks, and its mesh class refuses the array, although the named groups are complete. During reading, the mesh class
    is therefore replaced by a function that leaves the array out. A reversed entity of a group has the negative number
    of the group, which meshio reads as another group; the signs are removed.
    """
    from meshio.gmsh import _gmsh41

    mesh_class, read_entities = _gmsh41.Mesh, _gmsh41._read_entities

    def tolerant(points: Any, cells: Any, cell_data: dict[str, Any], **rest: Any) -> Any:
        complete = {name: parts for name, parts in cell_data.items() if len(parts) == len(cells)}
        return mesh_class(points, cells, cell_data=complete, **rest)

    def without_signs(*arguments: Any) -> Any:
        groups, bounds = read_entities(*arguments)
        return tuple({tag: [abs(item) for item in result] for tag, result in kind.items()} for kind in groups), bounds

    _gmsh41.Mesh, _gmsh41._read_entities = tolerant, without_signs
    try:
        yield
    finally:
        _gmsh41.Mesh, _gmsh41._read_entities = mesh_class, read_entities


def _refuse_version(path: Path) -> None:
    """Refuse MSH 4.0, whose entries are in another order than in 4.1, and the .msh format of ANSYS."""
    with path.open("rb") as file:
        first, second = file.readline(100).strip(), file.readline(100).split()
    if first != b"$MeshFormat" or not second:
        raise MeshError(f'mesh file {path} does not begin with "$MeshFormat": save it with Gmsh as version 4.1')
    version = second[0].decode("ascii", "replace")
    if version not in VERSIONS:
        raise MeshError(f"mesh file {path} has MSH version {version}: save it with Gmsh as version 4.1 or 2.2")


def _refuse_impossible_number(path: Path) -> None:
    """Refuse numbers too large for the file: meshio allocates for the largest label and all announced blocks."""
    with path.open("rb") as file:
        is_binary = file.readline(100) and file.readline(100).split()[1:2] == [b"1"]
    if is_binary:
        defect = read_in_trial_process(lambda: read_with_meshio(path, "gmsh"), path, speed=SPEED, memory=MEMORY)
        if defect:
            raise MeshError(f"mesh file {path} is damaged, it {defect}: write it again")
        return
    text = path.read_bytes()
    limit = max(LARGEST_NUMBER, len(text))
    bad_number = next((match for match in WHOLE_NUMBER.finditer(text) if int(match[1][:20]) > limit), None)
    if bad_number is not None:
        raise MeshError(
            f"mesh file {path} holds the number {int(bad_number[1][:20])}, which is not possible in a file of "
            f"{len(text)} bytes: write it again with nodes and elements numbered from 1"
        )


def _refuse_duplicate_names(path: Path) -> None:
    """Refuse two groups of the same name, of which meshio would silently keep the last."""
    text = path.read_bytes()
    block = text.partition(b"$PhysicalNames")[2].partition(b"$EndPhysicalNames")[0]
    result = re.findall(r'^\s*(\d+)\s+\d+\s+"([^"]*)"', block.decode("utf-8", "replace"), re.MULTILINE)
    names = [name for _, name in result]
    for name in names:
        if names.count(name) > 1:
            kinds = " and a ".join(DIMENSION_NAMES[int(dimension)] for dimension, other in result if other == name)
            raise MeshError(f'mesh file {path} has several physical groups called "{name}" (a {kinds}): rename one')


def _without_repeats(mesh: Mesh) -> dict[str, Int[NDArray[np.int64], " _"]]:
    def repeats(name: str) -> bool:
        if name not in mesh.face_sets:
            return False
        alone = Mesh(points=mesh.points, cells=mesh.cells, face_sets={name: mesh.face_sets[name]})
        return np.array_equal(alone.nodes(name), np.unique(mesh.node_sets[name]))

    return {name: nodes for name, nodes in mesh.node_sets.items() if not repeats(name)}


def _group_volumes(
    mesh: Mesh, cell_sets: Mapping[str, Int[NDArray[np.int64], " _"]]
) -> Iterator[tuple[list[str], Element, Int[NDArray[np.int64], "cell node"]]]:
    """Cells of one type that belong to the same sets, with the names of these sets."""
    belongs = np.zeros((mesh.n_cell, len(cell_sets)), dtype=bool)
    for column, members in enumerate(cell_sets.values()):
        belongs[members, column] = True
    for start, element, cells in mesh.blocks():
        patterns, which = np.unique(belongs[start : start + len(cells)], axis=0, return_inverse=True)
        for k, pattern in enumerate(patterns):
            groups = [name for name, inside in zip(cell_sets, pattern, strict=True) if inside]
            yield groups, element, cells[which.ravel() == k]


def _group_surfaces(
    mesh: Mesh, face_sets: Mapping[str, Int[NDArray[np.int64], "_ 2"]]
) -> Iterator[tuple[int, int, int, tuple[int, ...], Int[NDArray[np.int64], "face node"]]]:
    for entity, faces in enumerate(face_sets.values(), 1):
        by_size: dict[int, dict[int, NDArray[np.int64]]] = {}
        for here, element, local, cells in mesh.face_groups(faces):
            nodes = cells[:, element.faces[local]]
            by_size.setdefault(nodes.shape[1], {}).update(zip(here.tolist(), nodes, strict=True))
        for n_node, nodes_of in by_size.items():
            if nodes_of:
                yield (
                    2,
                    entity,
                    GMSH_FACES[n_node],
                    tuple(range(n_node)),
                    np.stack([nodes_of[k] for k in sorted(nodes_of)]),
                )


def _format_node_data(name: str, values: Float[NDArray[np.float64], "node component"]) -> Iterator[str]:
    n, n_component = values.shape
    yield f'$NodeData\n1\n"{name}"\n1\n0.0\n3\n0\n{n_component}\n{n}\n'
    table = np.column_stack([np.arange(1, n + 1), values])
    yield ("%d" + " %.16g" * n_component + "\n") * n % tuple(table.ravel().tolist())
    yield "$EndNodeData\n"


MESH_FORMATS.register(
    FileFormat(
        name="gmsh",
        suffixes=(".msh",),
        recognise=lambda head: head.startswith(b"$MeshFormat"),
        read=read_msh,
        write=write_msh,
    )
)
