"""VTK unstructured grids (.vtu), read and written with meshio; sets are integer arrays with documented names.

A point array "node_set:NAME" contains the place of each node in the set, from 1, and 0 for other nodes; a cell array
"cell_set:NAME" does so for cells; a cell array "face_set:NAME" has bit k set where local face k (for hexahedra x-, x+,
y-, y+, z-, z+) of the cell belongs to the set. ParaView shows them as ordinary arrays. A point array of another program
with one value per point, each 0 or 1, such as "fixed", is read as a node set of its name.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.errors import MeshError
from fe.file.mesh import MESH_FORMATS
from fe.file.mesh_content import FileMesh
from fe.file.meshio_reader import import_meshio, read_with_meshio
from fe.file.registry import FileFormat
from fe.mesh import Mesh

NODE_SET, CELL_SET, FACE_SET = "node_set:", "cell_set:", "face_set:"
#: Number of bits in the array of a face set: no cell has more faces than a hexahedron.
N_FACE = 6


def read_vtu(path: Path) -> FileMesh:
    """Read cells and sets; the sets are point and cell arrays.

    Raises
    ------
    MeshError
        The file cannot be read, or consists of several pieces.
    """
    # meshio silently keeps only the cells of the last piece.
    n_piece = path.read_bytes().count(b"<Piece")
    if n_piece > 1:
        raise MeshError(f"mesh file {path} consists of {n_piece} pieces: merge them into one and write it again")
    result = read_with_meshio(path, "vtu")
    cell_arrays = {name: np.concatenate([np.ravel(part) for part in parts]) for name, parts in result.cell_data.items()}
    n_point = len(result.points)
    point_arrays = {
        name: np.ravel(values) for name, values in (result.point_data or {}).items() if np.size(values) == n_point
    }
    return FileMesh(
        points=np.asarray(result.points, dtype=np.float64),
        blocks=tuple((block.type, np.asarray(block.data, dtype=np.int64)) for block in result.cells),
        node_sets=_find_marked_points(point_arrays)
        | {name: _list_members(values) for name, values in _select_kind(NODE_SET, point_arrays)},
        cell_sets={name: _list_members(values) for name, values in _select_kind(CELL_SET, cell_arrays)},
        face_sets={name: _list_faces(values) for name, values in _select_kind(FACE_SET, cell_arrays)},
    )


def write_vtu(mesh: Mesh, path: Path, point_data: Mapping[str, Float[NDArray[np.float64], "node ..."]]) -> None:
    """Write cells, sets and fields, compressed."""
    meshio = import_meshio()
    arrays: dict[str, NDArray[Any]] = {name: np.asarray(values) for name, values in point_data.items()}
    for name, nodes in mesh.node_sets.items():
        arrays[NODE_SET + name] = _number_members(mesh.n_node, nodes)
    cell_arrays: dict[str, NDArray[Any]] = {
        CELL_SET + name: _number_members(mesh.n_cell, members) for name, members in mesh.cell_sets.items()
    }
    for name, faces in mesh.face_sets.items():
        bits = np.zeros(mesh.n_cell, dtype=np.uint8)
        np.bitwise_or.at(bits, faces[:, 0], (1 << faces[:, 1]).astype(np.uint8))
        cell_arrays[FACE_SET + name] = bits
    ends = np.cumsum([len(cells) for cells in mesh.cells.values()])[:-1]
    written = meshio.Mesh(
        # Copies, because parts of meshio write into the arrays or refuse read-only ones.
        points=mesh.points.copy(),
        cells=[(cell_type, cells.copy()) for cell_type, cells in mesh.cells.items()],
        point_data=arrays,
        cell_data={name: np.split(values, ends) for name, values in cell_arrays.items()},
    )
    meshio.vtu.write(str(path), written)


def _select_kind(prefix: str, arrays: Mapping[str, NDArray[np.int64]]) -> list[tuple[str, NDArray[np.int64]]]:
    return [(name.removeprefix(prefix), values) for name, values in arrays.items() if name.startswith(prefix)]


def _find_marked_points(arrays: Mapping[str, NDArray[Any]]) -> dict[str, Int[NDArray[np.int64], " k"]]:
    """Node sets from arrays of zeros and ones: the points with value 1."""
    marks = {name: values for name, values in arrays.items() if not name.startswith(NODE_SET)}
    return {
        name: np.flatnonzero(values)
        for name, values in marks.items()
        if values.dtype.kind in "biuf" and values.any() and np.isin(values, (0, 1)).all()
    }


def _number_members(n: int, members: Int[NDArray[np.int64], " k"]) -> NDArray[np.int32]:
    places = np.zeros(n, dtype=np.int32)
    # In reverse order, so that a repeated member keeps its first place.
    places[members[::-1]] = np.arange(len(members), 0, -1)
    return places


def _list_members(places: NDArray[np.int64]) -> Int[NDArray[np.int64], " k"]:
    inside = np.flatnonzero(places)
    return inside[np.argsort(places[inside], kind="stable")]


def _list_faces(bits: NDArray[np.int64]) -> Int[NDArray[np.int64], "k 2"]:
    is_inside = (bits.astype(np.int64)[:, None] >> np.arange(N_FACE)) & 1
    return np.argwhere(is_inside)


MESH_FORMATS.register(
    FileFormat(
        name="vtk",
        suffixes=(".vtu",),
        recognise=lambda head: b"<VTKFile" in head,
        read=read_vtu,
        write=write_vtu,
    )
)
