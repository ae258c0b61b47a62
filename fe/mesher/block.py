"""Mesh of blocks: each block is a smooth map of the unit cube, sampled at the nodes of the elements."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from fe.element import Element
from fe.element.table import BRICK
from fe.errors import MeshError
from fe.mesh import Mesh

Lattice = Float[NDArray[np.float64], "*lattice"]
Coordinates = tuple[Lattice, Lattice, Lattice]
Map = Callable[[Lattice, Lattice, Lattice], Coordinates]
Interval = tuple[float, float]
#: Names of the six sides of the unit cube, in the order of the faces of a hexahedron.
SIDES = ("u0", "u1", "v0", "v1", "w0", "w1")
#: Distance below which nodes are joined [m].
COINCIDENT = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class Block:
    """A mapped cube.

    Parameters
    ----------
    shape
        Map from u, v, w in [0, 1] (arrays of one shape) to x, y, z [m].
    counts
        Numbers of cells along u, v and w [-].
    faces
        Names for sides of the block: "u0", "u1", "v0", "v1", "w0", "w1" -> face set.
    """

    shape: Map
    counts: tuple[int, int, int]
    faces: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def box(cls, sides: Sequence[Interval], counts: tuple[int, int, int], faces: Mapping[str, str]) -> "Block":
        """Box between two x, two y and two z [m]."""

        def shape(u: Lattice, v: Lattice, w: Lattice) -> Coordinates:
            x, y, z = (low + (high - low) * t for (low, high), t in zip(sides, (u, v, w), strict=True))
            return x, y, z

        return cls(shape=shape, counts=counts, faces=faces)


def subdivide(blocks: Sequence[Block], times: int) -> list[Block]:
    """Blocks with every cell divided into times^3 cells; the meshes of 1, 2, 4, ... are nested."""
    return [
        replace(block, counts=(block.counts[0] * times, block.counts[1] * times, block.counts[2] * times))
        for block in blocks
    ]


def mesh_blocks(blocks: Sequence[Block], element: Element) -> Mesh:
    """Cells of all blocks, joined where their nodes coincide; for tetrahedra each hexahedron is cut into six.

    The map is sampled at half-cell steps, so that midside nodes on a curved side lie exactly on the surface.

    Parameters
    ----------
    blocks
        Conforming blocks: common sides have the same lattice.
    element
        Any element.

    Raises
    ------
    MeshError
        A block without cells, or a block with coincident nodes in a cell.
    """
    # Tetrahedra need all nodes of the half-cell lattice, because the middles of diagonals lie at centres of sides and
    # cells.
    used = np.unique(element.from_brick(np.arange(len(BRICK))[None])[1])
    points, cells = [], []
    face_sets: dict[str, list[NDArray[np.int64]]] = {}
    n_point = n_cell = 0
    for block in blocks:
        if min(block.counts) < 1:
            raise MeshError(f"a block has {block.counts} cells along its sides: give at least one in each direction")
        lattice, block_cells, mirrored = _make_lattice_cells(block, BRICK[used])
        points.append(lattice)
        cells.append(block_cells + n_point)
        position = np.stack(np.unravel_index(np.arange(len(block_cells)), block.counts), axis=1)
        for side, name in block.faces.items():
            axis, end = divmod(SIDES.index(side), 2)
            on_side = np.flatnonzero(position[:, axis] == (block.counts[axis] - 1 if end else 0))
            local = 2 * axis + (1 - end if mirrored and axis == 2 else end)
            face_sets.setdefault(name, []).append(np.stack([on_side + n_cell, np.full_like(on_side, local)], axis=1))
        n_point += len(lattice)
        n_cell += len(block_cells)
    joined_points, joined = _join(np.concatenate(points), np.concatenate(cells))
    bricks = np.full((len(joined), len(BRICK)), -1)
    bricks[:, used] = joined
    brick, places = element.from_brick(bricks)
    on_side = _number_sides(element, places)
    named = {}
    for name, parts in face_sets.items():
        sides = np.concatenate(parts) @ np.array([len(SIDES), 1])
        named[name] = np.argwhere((on_side >= 0) & np.isin(len(SIDES) * brick[:, None] + on_side, sides))
    return Mesh(points=joined_points, cells={element.cell_type: bricks[brick[:, None], places]}, face_sets=named)


def _number_sides(element: Element, places: Int[NDArray[np.int64], "cell node"]) -> Int[NDArray[np.int64], "cell face"]:
    """Side of the brick on which each face of a cell lies, -1 for faces inside the brick."""
    side = np.full((len(places), len(element.faces)), -1)
    for local, corners in enumerate(element.corner_faces):
        on = BRICK[places[:, corners]]
        for axis in range(3):
            for end in (0, 1):
                side[(on[:, :, axis] == 2 * end).all(axis=1), local] = 2 * axis + end
    return side


def _make_lattice_cells(
    block: Block, offsets: Int[NDArray[np.int64], "node 3"]
) -> tuple[NDArray[np.float64], NDArray[np.int64], bool]:
    """Points of the half-cell lattice, the cells, and whether the map is left-handed."""
    u, v, w = np.meshgrid(*(np.linspace(0, 1, 2 * count + 1) for count in block.counts), indexing="ij")
    lattice = np.stack(np.broadcast_arrays(*block.shape(u, v, w)), axis=-1).astype(np.float64)
    edges = np.stack([lattice[2, 0, 0], lattice[0, 2, 0], lattice[0, 0, 2]]) - lattice[0, 0, 0]
    mirrored = bool(np.linalg.det(edges) < 0)
    offset = offsets.copy()
    if mirrored:
        # Reversing w makes the cells right-handed; it also exchanges the two local z faces.
        offset[:, 2] = 2 - offset[:, 2]
    first = 2 * np.stack(np.unravel_index(np.arange(np.prod(block.counts)), block.counts), axis=1)
    node = first[:, None, :] + offset
    number = np.ravel_multi_index((node[..., 0], node[..., 1], node[..., 2]), u.shape)
    return lattice.reshape(-1, 3), number.astype(np.int64), mirrored


def _join(
    points: Float[NDArray[np.float64], "m 3"], cells: Int[NDArray[np.int64], "cell node"]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    used, cells_of_used = np.unique(cells, return_inverse=True)
    candidates = points[used]
    pairs = cKDTree(candidates).query_pairs(COINCIDENT, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(used), len(used)))
    _, label = connected_components(graph, directed=False)
    count = np.bincount(label)
    joined = np.stack([np.bincount(label, candidates[:, axis]) / count for axis in range(3)], axis=1)
    joined_cells = label[cells_of_used.reshape(cells.shape)].astype(np.int64)
    if (np.diff(np.sort(joined_cells, axis=1), axis=1) == 0).any():
        raise MeshError(f"a cell collapses: two of its nodes are closer than {COINCIDENT:g} m")
    return joined, joined_cells
