"""Nastran bulk data, read through meshio: grid points and elements, with sets from properties, SET1 and SPC1 cards.

Nastran gives numbers and no names. A property is called as a comment of Femap or HyperMesh calls it, else
"property_7"; node sets are called "set_5" and "spc_5". Shells on faces of solid elements name these faces.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Int
from numpy.typing import NDArray

from fe.errors import MeshError
from fe.file.mesh import MESH_FORMATS
from fe.file.mesh_content import FileMesh
from fe.file.meshio_reader import read_with_meshio
from fe.file.registry import FileFormat, FileMaterial

#: Cards that meshio reads; with a star, in fields of 16 characters, it passes over elements without a word.
SOLIDS = ("CTETRA", "CHEXA", "CPENTA", "CPYRAM", "CPYRA")
#: "$HMNAME PROP 7"clamp" 4" and "$ Femap Property 7 : clamp".
NAMES = re.compile(r'^\$(?:HMNAME\s+PROP\s+(\d+)\s*"([^"]+)"|\s*Femap\b.*\bProperty\s+(\d+)\s*:\s*(.*\S))')
#: Fields of a card that come before the members of a set, and what the set is called.
SET_CARDS = {"SET1": (2, "set"), "SPC1": (3, "spc")}

Indices = Int[NDArray[np.int64], " _"]


def read_bdf(path: Path) -> FileMesh:
    """Read a bulk data file.

    Raises
    ------
    MeshError
        The file cannot be read, holds solid elements in fields of 16 characters, or grid points in coordinate systems
        of their own; the message names the remedy.
    """
    text = path.read_text(encoding="latin-1")
    lines = text.splitlines()
    starred = next((line for line in lines if line.upper().startswith(tuple(f"{card}*" for card in SOLIDS))), None)
    if starred is not None:
        raise MeshError(
            f'mesh file {path} has elements in fields of 16 characters ("{starred[:8].strip()}"): write it with fields '
            "of 8 (grid points may keep 16)"
        )
    begin = next((number for number, line in enumerate(lines) if line.strip().upper().startswith("BEGIN BULK")), None)
    if begin is None:
        raise MeshError(f'mesh file {path} has no line "BEGIN BULK": write it with one, and with ENDDATA at its end')
    if not any(line.startswith("ENDDATA") for line in lines[begin:]):  # meshio would look for it for ever
        raise MeshError(f'mesh file {path} has no line "ENDDATA" behind "BEGIN BULK": it is cut short, write it again')
    found = read_with_meshio(path, "nastran")
    if np.any(np.asarray(found.point_data.get("nastran:ref", 0)) != 0):
        raise MeshError(
            f"mesh file {path} gives grid points in a coordinate system of their own: write them in the basic one"
        )
    label = np.asarray(found.points_id, dtype=np.int64)
    sizes = [len(block.data) for block in found.cells]
    references = found.cell_data.get("nastran:ref", [])
    if references and [len(part) for part in references] != sizes:
        raise MeshError(f"mesh file {path} has elements with and without a property: give one to each")
    given = [np.asarray(part, dtype=np.int64) for part in references]
    property_ = np.concatenate(given or [np.zeros(sum(sizes), dtype=np.int64)])
    called = dict(_names(lines))
    names = {int(number): called.get(int(number), f"property_{number}") for number in np.unique(property_)}
    if len(set(names.values())) < len(names):
        twice = next(name for name in names.values() if list(names.values()).count(name) > 1)
        raise MeshError(f'mesh file {path} has two properties called "{twice}": rename one')
    return FileMesh(
        points=np.asarray(found.points, dtype=np.float64),
        blocks=tuple((block.type, np.asarray(block.data, dtype=np.int64)) for block in found.cells),
        node_sets=_node_sets(path, lines, label),
        cell_sets={name: np.flatnonzero(property_ == number) for number, name in names.items() if references},
        labels=np.concatenate([np.asarray(part, dtype=np.int64) for part in found.cells_id]),
    )


def _names(lines: list[str]) -> Iterator[tuple[int, str]]:
    for line in lines:
        match = NAMES.match(line)
        if match:
            number, name = match[1] or match[3], match[2] or match[4]
            yield int(number), name


def _node_sets(path: Path, lines: list[str], label: Indices) -> dict[str, Indices]:
    """Members of SET1 and SPC1 cards that are grid points; of a SET1 of elements there are none."""
    order = np.argsort(label)
    members: dict[str, list[int]] = {}
    for fields in _cards(lines):
        card = fields[0].upper().rstrip("*")
        if card not in SET_CARDS:
            continue
        first, kind = SET_CARDS[card]
        try:
            members.setdefault(f"{kind}_{int(fields[1])}", []).extend(_listed(fields[first:], label))
        except (ValueError, LookupError, OverflowError) as error:
            raise MeshError(f"mesh file {path} has a {card} card that cannot be read ({error}): mend it") from None
    found = {}
    for name, numbers in members.items():
        wanted = np.array(numbers, dtype=np.int64)
        place = order[np.searchsorted(label, wanted, sorter=order).clip(max=len(label) - 1)]
        kept = place[label[place] == wanted]
        if len(kept):
            found[name] = kept
    return found


def read_bdf_materials(path: Path) -> tuple[FileMaterial, ...]:
    """MAT1 cards of the PSOLID properties, or all of them if there is no such property.

    Raises
    ------
    MeshError
        A field that is no number.
    """
    found, used = dict[str, FileMaterial](), set[str]()
    for fields in _cards(path.read_text(encoding="latin-1").splitlines()):
        card, values = fields[0].upper().rstrip("*"), [*fields[1:], *[""] * 6]
        if card == "PSOLID":
            used.add(values[1])
        elif card in {"MAT9", "MAT11"}:
            found[values[0]] = FileMaterial(name=values[0], obstacle=f"is given by {card}, which is not isotropic")
        elif card == "MAT1":
            # In fields of 16 characters the density stands behind the continuation.
            numbers = [field for field in values[1:] if field not in {"*", "+"}]
            try:
                young, shear, poisson, density = (_number(field) for field in numbers[:4])
            except ValueError as error:
                raise MeshError(
                    f"mesh file {path}: MAT1 {values[0]} cannot be read ({error}): mend the card"
                ) from error
            if poisson is None and young is not None and shear:
                poisson = young / (2 * shear) - 1
            if young is None and poisson is not None and shear is not None:
                young = 2 * shear * (1 + poisson)
            found[values[0]] = FileMaterial(name=values[0], young=young, poisson=poisson, density=density)
    return tuple(material for name, material in found.items() if name in used or not used)


def _number(field: str) -> float | None:
    """Number of a field, whose exponent may stand without a letter: "7.85-9"; None if it is blank."""
    return float(re.sub(r"(?<=[\d.])([+-]\d+)$", r"e\1", field.upper().replace("D", "E"))) if field else None


def _cards(lines: list[str]) -> Iterator[list[str]]:
    """Fields of each card with its continuations."""
    card: list[str] = []
    for raw in lines:
        line = raw.split("$")[0].rstrip().expandtabs(8)
        if not line:
            continue
        if "," in line:
            fields = [field.strip() for field in line.split(",")]
        else:
            width = 16 if "*" in line[:8] else 8
            fields = [line[:8].strip(), *(line[k : k + width].strip() for k in range(8, min(len(line), 72), width))]
        if line[0] in " +*," and card:
            card += fields[1:9]
        else:
            if card:
                yield card
            card = fields[:9]
    if card:
        yield card


def _listed(fields: list[str], label: Indices) -> list[int]:
    """Numbers, and those of "3 THRU 9" that are labels of grid points."""
    found: list[int] = []
    filled = [field for field in fields if field and not field.startswith("+")]
    for k, field in enumerate(filled):
        if field.upper() == "THRU":
            # The last one follows as a number; few of a long range may be grid points.
            found.extend(label[(label > found[-1]) & (label < int(filled[k + 1]))].tolist())
        else:
            found.append(int(field))
    return found


MESH_FORMATS.register(
    FileFormat(
        name="nastran",
        suffixes=(".bdf", ".nas"),
        recognise=lambda head: b"BEGIN BULK" in head.upper() or b"GRID" in head.upper(),
        read=read_bdf,
        write=None,
        materials=read_bdf_materials,
    )
)
