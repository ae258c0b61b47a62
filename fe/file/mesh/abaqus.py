"""Read the mesh of an Abaqus or CalculiX input deck: nodes, elements, sets and element surfaces.

Written here because meshio's reader drops the data after a comment line, loses members of an element set that spans
several `*ELEMENT` blocks, and cannot read `*SURFACE`. Materials are read separately; steps and supports are not read.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.element import ELEMENTS
from fe.errors import MeshError
from fe.file.calculix_deck import format_mesh
from fe.file.dof_table import LARGEST_LABEL
from fe.file.keyword_deck import KeywordBlock, read_keyword_blocks
from fe.file.mesh import MESH_FORMATS
from fe.file.mesh_content import FileMesh
from fe.file.registry import FileFormat, FileMaterial
from fe.mesh import Mesh

#: Labels of faces, in the order of their numbers.
LABELS = ("S1", "S2", "S3", "S4", "S5", "S6")
#: Pattern, cell type and number of nodes of element types that `ELEMENTS` lacks: solids are refused by their name,
#: surfaces and lines define sets.
OTHER_TYPES = (
    (r"C3D27[A-Z]*", "hexahedron27", 27),
    (r"C3D4[A-Z]*", "tetra", 4),
    (r"C3D6[A-Z]*", "wedge", 6),
    (r"C3D15[A-Z]*", "wedge15", 15),
    (r"C3D5[A-Z]*", "pyramid", 5),
    (r"C3D13[A-Z]*", "pyramid13", 13),
    (r"T[23]D2[A-Z]*|B[23]1[A-Z]*|R2D2|RAX2", "line", 2),
    (r"T[23]D3[A-Z]*|B[23]2[A-Z]*", "line3", 3),
    (r"(S|CPS|CPE|CAX|M3D|SFM3D|R3D|STRI)3[A-Z]*", "triangle", 3),
    (r"(S|CPS|CPE|CAX|M3D|SFM3D|R3D)4[A-Z0-9]*", "quad", 4),
    (r"(S|CPS|CPE|CAX|M3D|SFM3D)6[A-Z]*|STRI65", "triangle6", 6),
    (r"(S|CPS|CPE|CAX|M3D|SFM3D)8[A-Z0-9]*", "quad8", 8),
)
#: Keywords that generate or move nodes and elements by a rule: skipping them would silently lose parts of the mesh.
GENERATORS = ("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM")
#: Keywords that join elements or add stiffness or mass; they are not read.
LEFT_OUT = (
    "TIE", "EQUATION", "MPC", "RIGID BODY", "COUPLING", "KINEMATIC COUPLING", "DISTRIBUTING COUPLING",
    "EMBEDDED ELEMENT", "FASTENER", "PRE-TENSION SECTION", "CYCLIC SYMMETRY MODEL", "NONSTRUCTURAL MASS",
    "BEAM SECTION", "BEAM GENERAL SECTION",
)  # fmt: skip
#: Largest number of set members that one line may generate; more than any mesh has.
MOST_GENERATED = 20_000_000
FLATTEN = 'write the deck "flat", without parts and instances, from the program that made it'


SetParts = dict[str, list[NDArray[np.int64]]]


@dataclass(kw_only=True)
class _Sets:
    """Members of each set; names keep their first spelling and are not case-sensitive, as in Abaqus and CalculiX."""

    nodes: SetParts = field(default_factory=dict)
    cells: SetParts = field(default_factory=dict)
    faces: SetParts = field(default_factory=dict)

    def select_kind(self, kind: str) -> SetParts:
        """Sets of "nodes", "cells" or "faces"."""
        result: SetParts = getattr(self, kind)
        return result


@dataclass(kw_only=True)
class _Deck:
    """Content of the deck read so far."""

    path: Path
    points: list[NDArray[np.float64]] = field(default_factory=list)
    node_labels: list[NDArray[np.int64]] = field(default_factory=list)
    blocks: list[tuple[str, NDArray[np.int64]]] = field(default_factory=list)
    cell_labels: list[NDArray[np.int64]] = field(default_factory=list)
    part: _Sets = field(default_factory=_Sets)
    assembly: _Sets = field(default_factory=_Sets)
    is_in_assembly: bool = False
    instance: str | None = None
    is_in_instance: bool = False
    placement: list[list[float]] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)

    @property
    def is_above_parts(self) -> bool:
        """Whether the current block belongs to the assembly, whose names and labels are separate from the part's."""
        return self.is_in_assembly and not self.is_in_instance

    @property
    def sets(self) -> _Sets:
        """Sets of the part or of the assembly, whichever is being read; a flat deck is a part."""
        return self.assembly if self.is_above_parts else self.part

    def damaged(self, reason: str) -> MeshError:
        return MeshError(f"mesh file {self.path} cannot be read as an Abaqus or CalculiX deck: {reason}")


def read_inp(path: Path) -> FileMesh:
    """Read nodes, elements, `*NSET`, `*ELSET` and `*SURFACE` of a deck of one part, with its includes.

    If the part and the assembly have sets of the same name, the part's set is called "INSTANCE.NAME", as in Abaqus.

    Raises
    ------
    MeshError
        The deck is cut short, damaged, built of several parts, or generates nodes by rule; the message names the
        remedy.
    """
    deck = _Deck(path=path)
    readers = {
        "NODE": _read_nodes, "ELEMENT": _read_elements, "NSET": _set, "ELSET": _set, "SURFACE": _read_surface,
        "ASSEMBLY": _begin_assembly, "END ASSEMBLY": _end_assembly, "INSTANCE": _begin_instance,
        "END INSTANCE": _end_instance,
    }  # fmt: skip
    for block in read_keyword_blocks(path):
        if block.keyword in GENERATORS or (block.keyword == "NODE" and "SYSTEM" in block.parameters):
            raise deck.damaged(f"*{block.keyword} generates or moves nodes by a rule, so write all nodes explicitly")
        if block.keyword in LEFT_OUT:
            deck.left_out.append(f"*{block.keyword}")
        reader = readers.get(block.keyword)
        if reader is not None:
            try:
                reader(deck, block)
            except (ValueError, OverflowError) as error:
                if isinstance(error, MeshError):
                    raise
                raise deck.damaged(f"a line of *{block.keyword} is truncated or not numeric ({error})") from error
    if not deck.points or not deck.blocks:
        raise deck.damaged(f"it has no {'*ELEMENT' if deck.points else '*NODE'} lines, so export the mesh with it")
    return _make_file_mesh(deck)


def write_inp(mesh: Mesh, path: Path, point_data: Mapping[str, Float[NDArray[np.float64], "node ..."]]) -> None:
    """Write nodes, elements and sets, as `fe.file.calculix_deck.format_mesh` does; a deck cannot store fields.

    Raises
    ------
    MeshError
        A field, or a set name that a deck cannot store.
    """
    if point_data:
        raise MeshError(
            f'an .inp file carries no fields, so "{next(iter(point_data))}" would be lost: write {path.stem}.vtu'
        )
    # The text is complete before the file is opened: an error in a set name leaves no incomplete file.
    text = "".join(format_mesh(mesh))
    path.write_text(text, encoding="ascii")


def read_inp_materials(path: Path) -> tuple[FileMaterial, ...]:
    """Materials of the solid sections of a deck, or all of them if it has no such section.

    Raises
    ------
    MeshError
        A line without the required numbers.
    """
    deck, result, used, current = _Deck(path=path), dict[str, FileMaterial](), set[str](), ""
    for block in read_keyword_blocks(path):
        if block.keyword == "SOLID SECTION":
            used.add(block.parameters.get("MATERIAL", "").upper())
        elif block.keyword == "MATERIAL":
            current = block.parameters.get("NAME", "")
            result[current.upper()] = FileMaterial(name=current)
        elif block.keyword in {"ELASTIC", "DENSITY"} and current.upper() in result:
            try:
                result[current.upper()] = _with_property(result[current.upper()], block)
            except (ValueError, IndexError) as error:
                raise deck.damaged(
                    f'the *{block.keyword} of material "{current}" is truncated or not numeric ({error})'
                ) from error
    return tuple(material for name, material in result.items() if name in used or not used)


def _with_property(material: FileMaterial, block: KeywordBlock) -> FileMaterial:
    if len(block.lines) > 1:
        return replace(material, obstacle=f"has a *{block.keyword} that depends on temperature or fields")
    numbers = [float(entry) for entry in block.entries()]
    if block.keyword == "DENSITY":
        return replace(material, density=numbers[0])
    if block.parameters.get("TYPE", "ISOTROPIC").upper() not in {"ISOTROPIC", "ISO"}:
        return replace(material, obstacle="is not isotropic")
    return replace(material, young=numbers[0], poisson=numbers[1])


def _begin_assembly(deck: _Deck, _: KeywordBlock) -> None:
    deck.is_in_assembly = True


def _end_assembly(deck: _Deck, _: KeywordBlock) -> None:
    deck.is_in_assembly = False


def _begin_instance(deck: _Deck, block: KeywordBlock) -> None:
    if deck.instance is not None:
        raise deck.damaged(f"it holds several part instances, so {FLATTEN}")
    deck.instance, deck.is_in_instance = block.parameters.get("NAME", ""), True
    deck.placement = [[float(entry) for entry in line.rstrip(",").split(",")] for line in block.lines]
    if [len(row) for row in deck.placement] not in ([], [3], [3, 7]):
        raise ValueError("a translation has 3 numbers, and a rotation 7")


def _end_instance(deck: _Deck, _: KeywordBlock) -> None:
    deck.is_in_instance = False


def _read_nodes(deck: _Deck, block: KeywordBlock) -> None:
    if deck.is_above_parts or not block.lines:
        return  # reference points, which belong to no element
    rows = [line.rstrip(",").split(",") for line in block.lines]
    short = next((row for row in rows if len(row) < 4), None)
    if short is not None:
        raise deck.damaged(f"node {short[0].strip()} has {len(short) - 1} coordinates instead of 3, so complete it")
    table = np.array([row[:4] for row in rows], dtype=np.float64).reshape(-1, 4)
    labels = table[:, 0].astype(np.int64)
    deck.points.append(table[:, 1:])
    deck.node_labels.append(labels)
    if "NSET" in block.parameters:
        _open_set(deck, "nodes", block.parameters["NSET"], block.keyword).append(labels)


def _read_elements(deck: _Deck, block: KeywordBlock) -> None:
    name = block.parameters.get("TYPE", "").upper()
    # Letters after the number (R, H, I, T) change the integration of the element, not its nodes.
    own = ((f"{element.abaqus}[A-Z]*", element.cell_type, element.n_node) for element in ELEMENTS.values())
    known = next(((t, n) for pattern, t, n in (*own, *OTHER_TYPES) if re.fullmatch(pattern, name)), None)
    if known is None:
        wanted = ", ".join(sorted(element.abaqus for element in ELEMENTS.values()))
        raise deck.damaged(f'elements of type "{name}" are not supported, so keep {wanted} only')
    cell_type, n_node = known
    entries = np.array(block.entries(), dtype=np.int64)
    if entries.size % (n_node + 1):
        raise deck.damaged(f"a {name} element of {n_node} nodes is cut short, so write the file again")
    table = entries.reshape(-1, n_node + 1)
    deck.blocks.append((cell_type, table[:, 1:]))
    deck.cell_labels.append(table[:, 0])
    if "ELSET" in block.parameters:
        _open_set(deck, "cells", block.parameters["ELSET"], block.keyword).append(table[:, 0])


def _set(deck: _Deck, block: KeywordBlock) -> None:
    kind = "nodes" if block.keyword == "NSET" else "cells"
    members = _open_set(deck, kind, block.parameters.get(block.keyword, ""), block.keyword)
    if deck.is_above_parts and "INSTANCE" not in block.parameters and any(e.isdigit() for e in block.entries()):
        return  # a set of reference points
    if "GENERATE" in block.parameters:
        for line in block.lines:
            first, last, step = ([*(int(entry) for entry in line.rstrip(",").split(",")), 1])[:3]
            if not (0 < first <= last <= LARGEST_LABEL and step > 0 and (last - first) // step < MOST_GENERATED):
                raise deck.damaged(
                    f'*{block.keyword}, GENERATE gives "{line}": give first, last and step of at most {MOST_GENERATED} '
                    "members"
                )
            members.append(np.arange(first, last + 1, step))
        return
    if kind == "nodes" and "ELSET" in block.parameters:
        members.extend(_list_nodes(deck, block.parameters["ELSET"]))
    entries = block.entries()
    numbers = [int(entry) for entry in entries if entry.isdigit()]
    members.append(np.array(numbers, dtype=np.int64))
    for other in (entry for entry in entries if not entry.isdigit()):
        members.extend(_find_known_set(deck, kind, other))


def _list_nodes(deck: _Deck, name: str) -> Iterator[NDArray[np.int64]]:
    """Nodes of the elements of a set."""
    wanted = np.concatenate([np.zeros(0, dtype=np.int64), *_find_known_set(deck, "cells", name)])
    for labels, (_, nodes) in zip(deck.cell_labels, deck.blocks, strict=True):
        yield np.unique(nodes[np.isin(labels, wanted)])


def _read_surface(deck: _Deck, block: KeywordBlock) -> None:
    name = block.parameters.get("NAME", "")
    if block.parameters.get("TYPE", "ELEMENT").upper() == "NODE":
        members = _open_set(deck, "nodes", name, block.keyword)
        for entry in (line.split(",")[0].strip() for line in block.lines):
            members.extend([np.array([int(entry)])] if entry.isdigit() else _find_known_set(deck, "nodes", entry))
        return
    faces = _open_set(deck, "faces", name, block.keyword)
    if faces:
        raise deck.damaged(f'the surface "{name}" is defined twice, so rename one')
    for line in block.lines:
        entry, label = ([*map(str.strip, line.split(",")), ""])[:2]
        if label.upper() not in LABELS:
            raise deck.damaged(f'surface "{name}" names the face "{label}", which is not one of S1 to S6')
        cells = [np.array([int(entry)])] if entry.isdigit() else _find_known_set(deck, "cells", entry)
        # The local face depends on the type of the cell, so it is determined when all cells have been read.
        faces.extend(np.column_stack([part, np.full(len(part), LABELS.index(label.upper()))]) for part in cells)


def _open_set(deck: _Deck, kind: str, name: str, keyword: str) -> list[NDArray[np.int64]]:
    """Member list of a set by its name; a second definition adds to the first, as in Abaqus and CalculiX."""
    if not name:
        parameter = {"SURFACE": "NAME", "NODE": "NSET", "ELEMENT": "ELSET"}.get(keyword, keyword)
        raise deck.damaged(f"a set of *{keyword} has no name, so give it one: *{keyword}, {parameter}=NAME")
    sets = deck.sets.select_kind(kind)
    return sets.setdefault(_find_spelling(sets, name) or name, [])


def _find_known_set(deck: _Deck, kind: str, name: str) -> list[NDArray[np.int64]]:
    """Members of a set of the part or assembly being read, or of the part in the assembly."""
    of_part = name.upper().removeprefix(f"{deck.instance}.".upper())
    for sets, wanted in ((deck.sets.select_kind(kind), name), (deck.part.select_kind(kind), of_part)):
        if (spelt := _find_spelling(sets, wanted)) is not None:
            return list(sets[spelt])
    raise deck.damaged(f'a set or surface refers to the set "{name}", which is not defined before it')


def _find_spelling(sets: SetParts, name: str) -> str | None:
    return next((known for known in sets if known.upper() == name.upper()), None)


def _join_sets(deck: _Deck, kind: str) -> SetParts:
    """Sets of the part and of its assembly; both may have the same names, as in decks of Abaqus/CAE."""
    above = deck.assembly.select_kind(kind)
    part = deck.part.select_kind(kind)
    return {
        name if _find_spelling(above, name) is None else f"{deck.instance}.{name}": part[name] for name in part
    } | above


def _make_file_mesh(deck: _Deck) -> FileMesh:
    """Content of the deck, with its labels replaced by indices from 0."""
    nodes = _Numbering(deck, "node", np.concatenate(deck.node_labels))
    cells = _Numbering(deck, "element", np.concatenate(deck.cell_labels))
    face_sets = {}
    for name, parts in _join_sets(deck, "faces").items():
        faces = np.concatenate([*parts, np.empty((0, 2), dtype=np.int64)])
        face_sets[name] = _find_labelled_faces(deck, name, cells.find_places(faces[:, 0]), faces[:, 1])
    return FileMesh(
        points=_place_points(np.concatenate(deck.points), deck.placement),
        blocks=tuple((cell_type, nodes.find_places(table)) for cell_type, table in deck.blocks),
        node_sets={
            name: nodes.find_places(np.concatenate(parts)) for name, parts in _join_sets(deck, "nodes").items() if parts
        },
        cell_sets={
            name: cells.find_places(np.concatenate(parts)) for name, parts in _join_sets(deck, "cells").items() if parts
        },
        face_sets=face_sets,
        labels=np.concatenate(deck.cell_labels),
        left_out=tuple(dict.fromkeys(deck.left_out)),
    )


def _place_points(
    points: Float[NDArray[np.float64], "point 3"], placement: list[list[float]]
) -> Float[NDArray[np.float64], "point 3"]:
    """Points of a part at its instance: moved, then rotated about the axis through two points by degrees."""
    if placement:
        points = points + placement[0]
    if len(placement) > 1:
        first, second, angle = np.split(np.array(placement[1]), [3, 6])
        axis, angle = (second - first) / np.linalg.norm(second - first), np.deg2rad(angle)
        arm = points - first
        turned = np.cos(angle) * arm + np.sin(angle) * np.cross(axis, arm)
        points = first + turned + (1 - np.cos(angle)) * np.outer(arm @ axis, axis)
    return points


def _find_labelled_faces(
    deck: _Deck, name: str, cells: Int[NDArray[np.int64], " k"], labels: Int[NDArray[np.int64], " k"]
) -> Int[NDArray[np.int64], "k 2"]:
    """Cell and local face from cell and index in `LABELS`; cells of types not in `ELEMENTS` keep the index."""
    block = np.searchsorted(np.cumsum([len(table) for _, table in deck.blocks]), cells, side="right")
    local = labels.copy()
    for number, (cell_type, _) in enumerate(deck.blocks):
        here = block == number
        if cell_type in ELEMENTS and here.any():
            faces = ELEMENTS[cell_type].abaqus_faces
            if labels[here].max() >= len(faces):
                label = LABELS[labels[here].max()]
                raise deck.damaged(
                    f'surface "{name}" names the face "{label}" of a {cell_type}, which has S1 to S{len(faces)} only'
                )
            local[here] = np.array(faces)[labels[here]]
    return np.column_stack([cells, local])


class _Numbering:
    """Index of each label in the order of the deck."""

    def __init__(self, deck: _Deck, what: str, labels: Int[NDArray[np.int64], " n"]) -> None:
        self._deck, self._what = deck, what
        self._order = np.argsort(labels, kind="stable")
        self._sorted = labels[self._order]
        twice = self._sorted[1:][self._sorted[1:] == self._sorted[:-1]]
        if twice.size:
            raise deck.damaged(f"{what} {twice[0]} is defined twice, so {FLATTEN}")

    def find_places(self, labels: Int[NDArray[np.int64], "*shape"]) -> Int[NDArray[np.int64], "*shape"]:
        place = np.searchsorted(self._sorted, labels).clip(max=len(self._sorted) - 1)
        unknown = self._sorted[place] != labels
        if unknown.any():
            raise self._deck.damaged(
                f"{self._what} {labels[unknown][0]} is used but not defined, so write the file again"
            )
        return np.asarray(self._order[place])


MESH_FORMATS.register(
    FileFormat(
        name="abaqus",
        suffixes=(".inp",),
        recognise=lambda head: head.lstrip()[:1] == b"*",
        read=read_inp,
        write=write_inp,
        materials=read_inp_materials,
    )
)
