"""Content of a mesh file, and its conversion to a mesh of solid cells with named sets."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.element import ELEMENTS
from fe.errors import MeshError
from fe.mesh import Mesh
from geometry.errors import InputWarning

#: The length of an axis named "_" may differ between arrays.
Indices = Int[NDArray[np.int64], " _"]
Faces = Int[NDArray[np.int64], "_ 2"]

#: Prefixes of the names of surface cells, and of all point, curve and surface cells: they define sets and are dropped.
SURFACES = ("triangle", "quad", "polygon")
LOWER_DIMENSIONAL = ("vertex", "line", *SURFACES)


@dataclass(frozen=True, kw_only=True, eq=False)
class FileMesh:
    """Points, blocks of cells of any dimension and named sets of a mesh file.

    Parameters
    ----------
    points
        Coordinates in the file's unit of length, shape (n_point, 3).
    blocks
        Pairs of meshio cell type and node numbers (n_cell, n_node_of_cell), in the order of the file.
    node_sets, cell_sets
        Node numbers, and cell numbers counted over all blocks, by name [-].
    face_sets
        Cell number counted over all blocks and local face by name, each (k, 2) [-].
    labels
        Cell labels of the file, if it has them, shape (n_cell,) [-].
    left_out
        Parts of the model in the file that are not read, such as "*TIE".
    """

    points: Float[NDArray[np.float64], "point 3"]
    blocks: tuple[tuple[str, Int[NDArray[np.int64], "_ _"]], ...]
    node_sets: Mapping[str, Indices] = field(default_factory=dict)
    cell_sets: Mapping[str, Indices] = field(default_factory=dict)
    face_sets: Mapping[str, Faces] = field(default_factory=dict)
    labels: Indices | None = None
    left_out: tuple[str, ...] = ()


def make_solid_mesh(file_mesh: FileMesh, *, source: str, length_unit_in_metre: float) -> tuple[Mesh, Indices | None]:
    """Keep the solid cells and their nodes, and turn sets of surface, curve and point cells into face or node sets.

    Nodes that no solid cell uses are dropped, and all sets are renumbered. A named set of surface cells becomes a face
    set if all of them are faces of solid cells, else the set of its nodes, with a warning. Another warning lists the
    parts of the model that are not read.

    Parameters
    ----------
    file_mesh
        Content of the file.
    source
        Name of the file, for messages.
    length_unit_in_metre
        The file's unit of length [m].

    Returns
    -------
    The mesh, and the file's label of each of its cells, if the file has labels.

    Raises
    ------
    MeshError
        Cells of an unsupported type, no solid cells, linear and quadratic cells that touch, two cells on the same
        nodes, or node numbers that do not exist.
    """
    _refuse_other_solids(file_mesh, source)
    _refuse_nonfinite_points(file_mesh, source)
    cells, number = _gather_solid_cells(file_mesh)
    _refuse_mixed_order(cells, source)
    _refuse_duplicate_cells(cells, source)

    used = np.unique(np.concatenate([nodes.ravel() for nodes in cells.values()]))
    new_node = np.full(len(file_mesh.points), -1)
    new_node[used] = np.arange(len(used))

    node_sets = {name: _keep_numbered(new_node, nodes) for name, nodes in file_mesh.node_sets.items()}
    face_sets = {
        name: np.column_stack([number[faces[:, 0]], faces[:, 1]])[number[faces[:, 0]] >= 0]
        for name, faces in file_mesh.face_sets.items()
    }
    cell_sets, detached = {}, []
    for name, members in file_mesh.cell_sets.items():
        cell_sets[name] = _keep_numbered(number, members)
        lower = members[number[members] < 0]
        if lower.size:
            carried = _select_cells(file_mesh, lower)
            result = _match_faces(cells, carried)
            if result is not None:
                face_sets[name] = result
            else:
                node_sets[name] = _keep_numbered(new_node, np.concatenate([np.ravel(nodes) for _, nodes in carried]))
                detached += [name] if any(cell_type.startswith(SURFACES) for cell_type, _ in carried) else []
    if file_mesh.left_out:
        _warn(source, f"the model contains only the solid cells, without {' and '.join(file_mesh.left_out)}")
    if detached:
        names = " and ".join(f'"{name}"' for name in detached)
        _warn(
            source,
            f"shells of {names} do not lie on faces of solid cells: they only define node sets and add no stiffness",
        )
    mesh = Mesh(
        points=file_mesh.points[used] * length_unit_in_metre,
        cells={cell_type: new_node[nodes] for cell_type, nodes in cells.items()},
        node_sets={name: nodes for name, nodes in node_sets.items() if nodes.size},
        face_sets={name: faces for name, faces in face_sets.items() if faces.size},
        cell_sets={name: members for name, members in cell_sets.items() if members.size},
    )
    labels = None
    if file_mesh.labels is not None:
        labels = np.empty(mesh.n_cell, dtype=np.int64)
        labels[number[number >= 0]] = file_mesh.labels[number >= 0]
    return mesh, labels


def _warn(source: str, what: str) -> None:
    warnings.warn(f"mesh file {source}: {what}", InputWarning, stacklevel=4)


def _is_solid(cell_type: str) -> bool:
    return not cell_type.startswith(LOWER_DIMENSIONAL)


def _keep_numbered(new: Indices, old: Indices) -> Indices:
    """New numbers of the kept items, each once and in the old order, because stations on a line are ordered."""
    _, first = np.unique(old, return_index=True)
    kept = new[old[np.sort(first)]]
    return np.asarray(kept[kept >= 0])


def _refuse_other_solids(file_mesh: FileMesh, source: str) -> None:
    count: dict[str, int] = {}
    for cell_type, nodes in file_mesh.blocks:
        count[cell_type] = count.get(cell_type, 0) + len(nodes)
    wanted = " or ".join(sorted(ELEMENTS))
    if count.get("tetra") and "tetra" not in ELEMENTS:
        # A clamped blade of such cells was 30 to 90 % too stiff at any affordable size.
        raise MeshError(
            f"mesh file {source} has {count['tetra']} tetra cells of 4 nodes, which are far too stiff in bending: "
            'convert them to 10 nodes ("second order") in the program that made them'
        )
    unsupported = {t: n for t, n in count.items() if _is_solid(t) and t not in ELEMENTS and n}
    if unsupported:
        listed = ", ".join(f"{n} {cell_type}" for cell_type, n in unsupported.items())
        # A mesher fills corners between linear hexahedra with wedges and pyramids.
        why = ", which are far too stiff in bending" if set(unsupported) <= {"wedge", "pyramid"} else ""
        raise MeshError(
            f"mesh file {source} has cells that are not supported ({listed}{why}): remesh with {wanted} only"
        )
    if not any(count.get(cell_type) for cell_type in ELEMENTS):
        listed = ", ".join(f"{n} {cell_type}" for cell_type, n in count.items() if n) or "no cells at all"
        raise MeshError(f"mesh file {source} has no solid cells ({listed}): export the volume mesh, {wanted}")


def _refuse_nonfinite_points(file_mesh: FileMesh, source: str) -> None:
    n_point = len(file_mesh.points)
    for cell_type, nodes in file_mesh.blocks:
        if cell_type in ELEMENTS and nodes.shape[1] != ELEMENTS[cell_type].n_node:
            raise MeshError(
                f"mesh file {source} gives {nodes.shape[1]} nodes to a {cell_type}, which has "
                f"{ELEMENTS[cell_type].n_node}: it may be cut short or damaged, so write it again"
            )
        if nodes.size and (nodes.min() < 0 or nodes.max() >= n_point):
            bad_node = nodes.max() if nodes.max() >= n_point else nodes.min()
            raise MeshError(
                f"mesh file {source} has a {cell_type} with node {bad_node} of {n_point} (counted from 0): "
                "it may be cut short or damaged, so write it again"
            )
    if not np.isfinite(file_mesh.points).all():
        node = int(np.flatnonzero(~np.isfinite(file_mesh.points).all(axis=1))[0])
        raise MeshError(
            f"mesh file {source} gives node {node} (counted from 0) coordinates that are not finite: write it again"
        )


def _refuse_mixed_order(cells: Mapping[str, Int[NDArray[np.int64], "_ _"]], source: str) -> None:
    """Refuse linear cells that touch quadratic ones, and quadrilaterals on triangles: gaps would open between them."""
    types = list(cells)
    for k, first in enumerate(types):
        for second in types[k + 1 :]:
            shared = np.intersect1d(cells[first], cells[second])
            unlike = ELEMENTS[first].degree != ELEMENTS[second].degree
            if shared.size and (unlike or _is_quadrilateral_on_triangles(cells, (first, second), shared)):
                raise MeshError(
                    f"mesh file {source} joins {first} and {second} cells at {shared.size} nodes, where midside nodes "
                    "would not be connected: remesh with only one of the two"
                )


def _is_quadrilateral_on_triangles(
    cells: Mapping[str, Int[NDArray[np.int64], "_ _"]], types: tuple[str, str], shared: Indices
) -> bool:
    corners: dict[int, set[tuple[int, ...]]] = {3: set(), 4: set()}
    for cell_type in types:
        for face in ELEMENTS[cell_type].corner_faces:
            on = np.sort(cells[cell_type][:, face], axis=1)
            corners[len(face)].update(map(tuple, on[np.isin(on, shared).sum(axis=1) >= 3].tolist()))
    return any(not corners[3].isdisjoint(combinations(square, 3)) for square in corners[4])


def _refuse_duplicate_cells(cells: Mapping[str, Int[NDArray[np.int64], "_ _"]], source: str) -> None:
    """Refuse two cells on the same nodes in another order: their stiffness and mass would be counted twice."""
    n_duplicate = sum(len(nodes) - len(_find_distinct(np.sort(nodes, axis=1))[0]) for nodes in cells.values())
    if n_duplicate:
        raise MeshError(
            f"mesh file {source} has {n_duplicate} cells on the same nodes as other ones: remove the duplicates"
        )


def _gather_solid_cells(file_mesh: FileMesh) -> tuple[dict[str, Int[NDArray[np.int64], "_ _"]], Indices]:
    """Solid cells by type, and the mesh's number of each cell of the file (-1 if it is not solid).

    Cells with the same nodes in the same order are one cell: MSH 2 repeats a cell for each group that it belongs to.
    """
    starts = np.cumsum([0, *(len(nodes) for _, nodes in file_mesh.blocks)])
    number = np.full(starts[-1], -1)
    cells = {}
    n_cell = 0
    for cell_type in dict.fromkeys(t for t, nodes in file_mesh.blocks if t in ELEMENTS and len(nodes)):
        gathered, places = [], []
        for (block_type, nodes), start in zip(file_mesh.blocks, starts, strict=False):
            if block_type == cell_type:
                gathered.append(nodes)
                places.append(start + np.arange(len(nodes)))
        kept, which = _find_distinct(np.concatenate(gathered))
        number[np.concatenate(places)] = n_cell + which
        n_cell += len(kept)
        cells[cell_type] = kept
    return cells, number


def _find_distinct(cells: Int[NDArray[np.int64], "cell node"]) -> tuple[Int[NDArray[np.int64], "kept node"], Indices]:
    """Distinct rows in the order of first appearance, and the index of every row among them."""
    rows = np.ascontiguousarray(cells).view(f"V{cells.dtype.itemsize * cells.shape[1]}").ravel()
    _, first, which = np.unique(rows, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return cells[first[order]], rank[which]


def _select_cells(file_mesh: FileMesh, members: Indices) -> list[tuple[str, Int[NDArray[np.int64], "_ _"]]]:
    starts = np.cumsum([0, *(len(nodes) for _, nodes in file_mesh.blocks)])
    result = []
    for (cell_type, nodes), start in zip(file_mesh.blocks, starts, strict=False):
        here = members[(members >= start) & (members < start + len(nodes))] - start
        if here.size:
            result.append((cell_type, nodes[here]))
    return result


def _match_faces(
    cells: Mapping[str, Int[NDArray[np.int64], "_ _"]],
    surfaces: list[tuple[str, Int[NDArray[np.int64], "_ _"]]],
) -> Faces | None:
    """Face of a solid cell at each surface cell, or None if a surface cell does not lie on a face of a solid cell."""
    if not all(cell_type.startswith(("quad", "triangle")) for cell_type, _ in surfaces):
        return None
    wanted = [
        tuple(corners)
        for cell_type, nodes in surfaces
        for corners in np.sort(nodes[:, : 4 if cell_type.startswith("quad") else 3], axis=1).tolist()
    ]
    near = np.unique(np.concatenate([nodes.ravel() for _, nodes in surfaces]))
    known: dict[tuple[int, ...], tuple[int, int]] = {}
    start = 0
    for cell_type, nodes in cells.items():
        touched = np.isin(nodes, near)
        for local, corners in enumerate(ELEMENTS[cell_type].corner_faces):
            here = np.flatnonzero(touched[:, corners].all(axis=1))
            for cell, key in zip(here.tolist(), np.sort(nodes[here][:, corners], axis=1).tolist(), strict=True):
                # A face inside the body belongs to two cells: the first cell is used.
                known.setdefault(tuple(key), (start + cell, local))
        start += len(nodes)
    result = [known.get(corners) for corners in wanted]
    if None in result:
        return None
    return np.array(result, dtype=np.int64)
