"""Nastran bulk data: grid points and elements, with sets from properties, SET1, SPC and SPC1 cards.

Nastran has numbers instead of names. The name of a property comes from a comment of Femap or HyperMesh, else it is
"property_7"; node sets are called "set_5" and "spc_5". Shells on faces of solid elements define face sets.

Written here because meshio's reader silently skips elements in fields of 16 characters, included files, and everything
that joins or loads elements, and cannot read continuation lines whose trailing blanks were removed.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from jaxtyping import Int
from numpy.typing import NDArray

from fe.errors import MeshError
from fe.file.bulk_data import BulkCard, read_bulk_cards
from fe.file.matrix_content import read_fortran_real
from fe.file.mesh import MESH_FORMATS
from fe.file.mesh_content import FileMesh
from fe.file.registry import FileFormat, FileMaterial

#: Cell type and number of nodes, without and with midside nodes.
SOLIDS = {
    "CTETRA": (("tetra", 4), ("tetra10", 10)),
    "CPYRAM": (("pyramid", 5), ("pyramid13", 13)),
    "CPYRA": (("pyramid", 5), ("pyramid13", 13)),
    "CPENTA": (("wedge", 6), ("wedge15", 15)),
    "CHEXA": (("hexahedron", 8), ("hexahedron20", 20)),
}
#: Surfaces and lines, which define sets: only their corners are read.
OTHERS = {
    **dict.fromkeys(("CTRIA3", "CTRIAR", "CTRIA6"), ("triangle", 3)),
    **dict.fromkeys(("CQUAD4", "CQUADR", "CQUAD8", "CSHEAR"), ("quad", 4)),
    **dict.fromkeys(("CBAR", "CBEAM", "CROD", "CTUBE", "CBUSH"), ("line", 2)),
}
#: Nastran's node places in VTK's order, where the two differ: Nastran lists the midside nodes of the edges between the
#: two end faces before those of the second end face.
ORDER = {
    "hexahedron20": [*range(12), 16, 17, 18, 19, 12, 13, 14, 15],
    "wedge15": [*range(9), 12, 13, 14, 9, 10, 11],
}
#: Cards that join elements or add stiffness or mass; they are not read.
LEFT_OUT = re.compile(
    r"R(BE1|BE2|BE3|BAR1?|ROD|JOINT|TRPLT|SSCON|SPLINE)|MPC|MPCADD|CONM[12]|CMASS\d|NSML?1?|CELAS\d|CDAMP\d|CVISC|CGAP"
    r"|CBUSH(1D|2D)?|CFAST|CWELD|CSEAM|CBAR|CBEAM3?|CBEND|CROD|CONROD|CTUBE|GENEL|DMIG"
)
#: "$HMNAME PROP 7"clamp" 4" and "$ Femap Property 7 : clamp".
NAMES = re.compile(r'^\$(?:HMNAME\s+PROP\s+(\d+)\s*"([^"]+)"|\s*Femap\b.*\bProperty\s+(\d+)\s*:\s*(.*\S))')
#: Number of fields before the members of a set, and prefix of the set's name.
SET_CARDS = {"SET1": (1, "set"), "SPC1": (2, "spc")}

Indices = Int[NDArray[np.int64], " _"]


@dataclass(kw_only=True)
class _Cells:
    """Elements of one type: their labels, properties and node labels."""

    label: list[int] = field(default_factory=list)
    property_: list[int] = field(default_factory=list)
    nodes: list[list[int]] = field(default_factory=list)


@dataclass(kw_only=True)
class _Model:
    """Content of the model read so far."""

    points: dict[int, list[float]] = field(default_factory=dict)
    cells: dict[str, _Cells] = field(default_factory=dict)
    sets: list[BulkCard] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)


def read_bdf(path: Path) -> FileMesh:
    """Read a bulk data file with its includes.

    Raises
    ------
    MeshError
        A card that cannot be read, or grid points in local coordinate systems; the message names the remedy.
    """
    model = _Model()
    for card in read_bulk_cards(path):
        try:
            _take(path, model, card)
        except (ValueError, LookupError, OverflowError) as error:
            if isinstance(error, MeshError):
                raise
            raise MeshError(
                f"mesh file {path} has a {card.name} {card.field(0)} that cannot be read ({error}): correct the card"
            ) from None
    label = np.array(list(model.points), dtype=np.int64)
    property_ = np.array([number for cells in model.cells.values() for number in cells.property_], dtype=np.int64)
    called = dict(_read_names(path.read_text(encoding="latin-1").splitlines()))
    names = {int(number): called.get(int(number), f"property_{number}") for number in np.unique(property_)}
    if len(set(names.values())) < len(names):
        twice = next(name for name in names.values() if list(names.values()).count(name) > 1)
        raise MeshError(f'mesh file {path} has two properties called "{twice}": rename one')
    labels = np.array([number for cells in model.cells.values() for number in cells.label], dtype=np.int64)
    if len(np.unique(labels)) < len(labels):
        values, count = np.unique(labels, return_counts=True)
        raise MeshError(f"mesh file {path} has two elements {values[count > 1][0]}: renumber them")
    return FileMesh(
        points=np.array(list(model.points.values()), dtype=np.float64).reshape(-1, 3),
        blocks=tuple(
            (cell_type, _number_nodes(path, label, cell_type, cells)) for cell_type, cells in model.cells.items()
        ),
        node_sets=_read_node_sets(path, model.sets, label),
        cell_sets={name: np.flatnonzero(property_ == number) for number, name in names.items()},
        labels=labels,
        left_out=tuple(dict.fromkeys(model.left_out)),
    )


def _take(path: Path, model: _Model, card: BulkCard) -> None:
    if card.name == "GRID":
        _refuse_own_system(path, card.field(1))
        number, point = int(card.field(0)), [_number(card.field(k)) or 0.0 for k in (2, 3, 4)]
        if model.points.setdefault(number, point) != point:
            raise MeshError(f"mesh file {path} has two grid points {number}: renumber them")
    elif card.name == "GRDSET":
        _refuse_own_system(path, card.field(1))
    elif card.name in SOLIDS or card.name in OTHERS:
        _add_cell(model, card)
    elif card.name in SET_CARDS or card.name == "SPC":
        model.sets.append(card)
    if LEFT_OUT.fullmatch(card.name):
        model.left_out.append(card.name)


def _refuse_own_system(path: Path, system: str) -> None:
    if system not in {"", "0"}:
        raise MeshError(f"mesh file {path} gives grid points in a local coordinate system: write them in the basic one")


def _add_cell(model: _Model, card: BulkCard) -> None:
    number = int(card.field(0))
    if card.name in OTHERS:
        cell_type, n_node = OTHERS[card.name]
    else:
        linear, quadratic = SOLIDS[card.name]
        cell_type, n_node = linear if len(card.fields) <= 2 + linear[1] else quadratic
    nodes = [card.field(2 + k) for k in range(n_node)]
    if "" in nodes and cell_type != "line":  # one end of a spring may be on the ground
        raise ValueError(f"{nodes.count('')} of {n_node} nodes are missing; give all midside nodes or none")
    cells = model.cells.setdefault(cell_type, _Cells())
    cells.label.append(number)
    cells.property_.append(int(card.field(1) or number))
    cells.nodes.append([int(node or nodes[0]) for node in nodes])


def _number_nodes(path: Path, label: Indices, cell_type: str, cells: _Cells) -> Int[NDArray[np.int64], "_ _"]:
    """Indices of the nodes of cells among the grid points, in VTK's order."""
    nodes = np.array(cells.nodes, dtype=np.int64)
    place = _place(label, nodes)
    if (place < 0).any():
        cell, node = np.argwhere(place < 0)[0]
        raise MeshError(
            f"mesh file {path} has the element {cells.label[cell]} on grid point {nodes[cell, node]}, which does not "
            "exist: write it again"
        )
    return place[:, ORDER.get(cell_type, slice(None))]


def _place(label: Indices, wanted: NDArray[np.int64]) -> NDArray[np.int64]:
    """Index of each wanted label, -1 where it does not exist."""
    if not len(label):
        return np.full(wanted.shape, -1)
    order = np.argsort(label)
    place = order[np.searchsorted(label, wanted, sorter=order).clip(max=len(label) - 1)]
    return np.where(label[place] == wanted, place, -1)


def _read_names(lines: list[str]) -> Iterator[tuple[int, str]]:
    for line in lines:
        match = NAMES.match(line)
        if match:
            number, name = match[1] or match[3], match[2] or match[4]
            yield int(number), name


def _read_node_sets(path: Path, cards: list[BulkCard], label: Indices) -> dict[str, Indices]:
    """Members of SET1, SPC and SPC1 cards that are grid points; a SET1 of elements has none."""
    members: dict[str, list[int]] = {}
    for card in cards:
        try:
            if card.name == "SPC":
                name, card_numbers = f"spc_{int(card.field(0))}", [int(card.field(k)) for k in (1, 4) if card.field(k)]
            else:
                first, kind = SET_CARDS[card.name]
                name, card_numbers = f"{kind}_{int(card.field(0))}", _list_numbers(card.fields[first:], label)
        except (ValueError, LookupError, OverflowError) as error:
            raise MeshError(
                f"mesh file {path} has a {card.name} card that cannot be read ({error}): correct it"
            ) from None
        members.setdefault(name, []).extend(card_numbers)
    places = {name: _place(label, np.array(numbers, dtype=np.int64)) for name, numbers in members.items()}
    return {name: place[place >= 0] for name, place in places.items() if (place >= 0).any()}


def _list_numbers(fields: list[str], label: Indices) -> list[int]:
    """Numbers in the fields of a card; of a range "3 THRU 9" only the labels of grid points."""
    result: list[int] = []
    filled = [field for field in fields if field]
    for k, entry in enumerate(filled):
        if entry.upper() == "THRU":
            # The end of the range follows as a number. A long range may contain few grid points.
            result.extend(label[(label > result[-1]) & (label < int(filled[k + 1]))].tolist())
        else:
            result.append(int(entry))
    return result


def read_bdf_materials(path: Path) -> tuple[FileMaterial, ...]:
    """Materials of the PSOLID properties, or all materials if there is no PSOLID.

    Densities are multiplied by PARAM,WTMASS, as Nastran does.

    Raises
    ------
    MeshError
        A field that is not a number.
    """
    result, used, unit_of_mass = dict[str, FileMaterial](), set[str](), 1.0
    for card in read_bulk_cards(path):
        try:
            if card.name == "PSOLID":
                used.add(card.field(1))
            elif card.name in {"MAT9", "MAT11"}:
                obstacle = f"is given by {card.name}, which is not isotropic"
                result[card.field(0)] = FileMaterial(name=card.field(0), obstacle=obstacle)
            elif card.name == "MAT1":
                result[card.field(0)] = _read_material(card)
            elif card.name == "PARAM" and card.field(0).upper() == "WTMASS":
                unit_of_mass = read_fortran_real(card.field(1))
        except ValueError as error:
            raise MeshError(
                f"mesh file {path}: {card.name} {card.field(0)} cannot be read ({error}): correct the card"
            ) from error
    materials = [material for name, material in result.items() if name in used or not used]
    return tuple(
        material if material.density is None else replace(material, density=material.density * unit_of_mass)
        for material in materials
    )


def _read_material(card: BulkCard) -> FileMaterial:
    young, shear, poisson, density = (_number(card.field(k)) for k in range(1, 5))
    if poisson is None and young is not None and shear:
        poisson = young / (2 * shear) - 1
    if young is None and poisson is not None and shear is not None:
        young = 2 * shear * (1 + poisson)
    return FileMaterial(name=card.field(0), young=young, poisson=poisson, density=density)


def _number(text: str) -> float | None:
    """Number of a field; None if it is blank."""
    return read_fortran_real(text) if text else None


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
