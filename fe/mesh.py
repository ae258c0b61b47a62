"""Finite-element mesh: points, cells, and named sets of nodes, faces and cells."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.element import ELEMENTS, Element
from fe.errors import MeshError
from geometry.read_only_array import freeze_fields, read_only

Points = Float[NDArray[np.float64], "node 3"]
#: The length of an axis named "_" may differ between arrays.
Cells = Int[NDArray[np.int64], "_ _"]
#: Names of the fields that are mappings.
_MAPS = ("cells", "node_sets", "face_sets", "cell_sets")


@dataclass(frozen=True, kw_only=True, eq=False)
class Mesh:
    """Points and cells with named sets; arrays are copied and read-only.

    Node order within a cell is VTK's (which is also Abaqus' and CalculiX' for these cells). Cells are numbered
    consecutively over the blocks in the order of `cells`; a face is a pair (cell number, local face number of its
    element).

    Parameters
    ----------
    points
        Coordinates, shape (n_node, 3) [m].
    cells
        Node numbers by meshio cell type ("hexahedron", "hexahedron20"), each of shape (n_cell, n_node_of_cell) [-].
    node_sets
        Node numbers by name, each of shape (k,) [-].
    face_sets
        Faces by name, each of shape (k, 2): cell number and local face [-].
    cell_sets
        Cell numbers by name, each of shape (k,) [-]; materials are assigned to these.

    Raises
    ------
    MeshError
        An unsupported cell type, or the number of a node, cell or face that does not exist.
    """

    points: Points
    cells: Mapping[str, Cells]
    node_sets: Mapping[str, Int[NDArray[np.int64], " _"]] = field(default_factory=dict)
    face_sets: Mapping[str, Int[NDArray[np.int64], "_ 2"]] = field(default_factory=dict)
    cell_sets: Mapping[str, Int[NDArray[np.int64], " _"]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        freeze_fields(self, "points", order="C")
        for name in _MAPS:
            frozen = {key: read_only(value, np.int64, "C") for key, value in getattr(self, name).items()}
            object.__setattr__(self, name, MappingProxyType(frozen))
        for cell_type, nodes in self.cells.items():
            if cell_type not in ELEMENTS:
                raise MeshError(
                    f'cells of type "{cell_type}" are not supported: mesh with one of {", ".join(sorted(ELEMENTS))}'
                )
            n_node = ELEMENTS[cell_type].n_node
            if nodes.ndim != 2 or nodes.shape[1] != n_node:
                raise MeshError(f'"{cell_type}" cells have shape {nodes.shape}, but each must have {n_node} nodes')
            _refuse_outside(f'a "{cell_type}" cell', "node", nodes, self.n_node)
        for name, node_set in self.node_sets.items():
            _refuse_outside(f'node set "{name}"', "node", node_set, self.n_node)
        for name, cell_set in self.cell_sets.items():
            _refuse_outside(f'cell set "{name}"', "cell", cell_set, self.n_cell)
        n_face = max((len(ELEMENTS[cell_type].faces) for cell_type in self.cells), default=0)
        for name, faces in self.face_sets.items():
            if not faces.size:
                continue
            if faces.ndim != 2 or faces.shape[1] != 2:
                raise MeshError(f'face set "{name}" has shape {faces.shape}, but each face is a cell and a local face')
            _refuse_outside(f'face set "{name}"', "cell", faces[:, 0], self.n_cell)
            _refuse_outside(f'face set "{name}"', "local face", faces[:, 1], n_face)

    def __reduce__(self) -> tuple[Any, ...]:
        # Read-only mappings cannot be pickled.
        return _rebuilt, (self.points, *(dict(getattr(self, name)) for name in _MAPS))

    @property
    def n_node(self) -> int:
        """Number of points [-]."""
        return len(self.points)

    @property
    def n_cell(self) -> int:
        """Number of cells of all types [-]."""
        return sum(len(nodes) for nodes in self.cells.values())

    def nodes(self, name: str) -> Int[NDArray[np.int64], " k"]:
        """Sorted node numbers of a node set, or of all nodes on a face set.

        Raises
        ------
        MeshError
            An unknown set; the message lists the existing sets.
        """
        if name in self.node_sets:
            return np.unique(self.node_sets[name])
        if name in self.face_sets:
            groups = self.face_groups(self.face_sets[name])
            on = [cells[:, element.faces[local]].ravel() for _, element, local, cells in groups]
            return np.unique(np.concatenate(on))
        known = ", ".join(sorted({*self.node_sets, *self.face_sets})) or "none"
        raise MeshError(f'the mesh has no node set or face set "{name}": it has {known}')

    def corner_nodes(self) -> Int[NDArray[np.int64], " k"]:
        """Sorted numbers of the corner nodes of all cells, without midside nodes."""
        return np.unique(np.concatenate([cells[:, : element.n_corner].ravel() for _, element, cells in self.blocks()]))

    def blocks(self) -> Iterator[tuple[int, Element, Cells]]:
        """Number of the first cell of each type, its element, and the nodes of its cells, (n_cell, n_node_of_cell)."""
        start = 0
        for cell_type, cells in self.cells.items():
            yield start, ELEMENTS[cell_type], cells
            start += len(cells)

    def face_groups(
        self, faces: Int[NDArray[np.int64], "k 2"]
    ) -> Iterator[tuple[Int[NDArray[np.int64], " e"], Element, int, Int[NDArray[np.int64], "e _"]]]:
        """Faces by element and local face: their indices in `faces`, and the nodes of their cells, (e, n_node_of_cell).

        Parameters
        ----------
        faces
            Cell number and local face of each, shape (k, 2) [-].
        """
        for start, element, cells in self.blocks():
            inside = (faces[:, 0] >= start) & (faces[:, 0] < start + len(cells))
            for local in range(len(element.faces)):
                here = np.flatnonzero(inside & (faces[:, 1] == local))
                yield here, element, local, cells[faces[here, 0] - start]


def _rebuilt(points: Points, *maps: Mapping[str, Any]) -> Mesh:
    return Mesh(points=points, **dict(zip(_MAPS, maps, strict=True)))


def _refuse_outside(who: str, kind: str, numbers: NDArray[np.int64], count: int) -> None:
    outside = numbers[(numbers < 0) | (numbers >= count)]
    if outside.size:
        raise MeshError(f"{who} names {kind} {outside[0]}, but there are {count}, numbered from 0")
