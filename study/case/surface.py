"""The outer surface of a reduced body, coarsened for display in a browser, with its motion by reduced coordinates."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.face_integral import find_outer_faces
from fe.mesh import Mesh
from reduction.rom import ReducedModel

#: Largest number of points of one body.
MOST_POINTS = 2000
#: Initial number of grid cells along the longest side of a body, and the factor by which it decreases.
INITIAL_CELLS, CELL_FACTOR = 96, 0.85

Points = Float[NDArray[np.float64], "p 3"]
Triangles = Int[NDArray[np.int64], "t 3"]


@dataclass(frozen=True, kw_only=True, eq=False)
class BodySurface:
    """Triangles on the outer surface of a body.

    Parameters
    ----------
    points
        Coordinates of the retained nodes at rest, shape (p, 3) [m].
    triangles
        Indices of the points of each triangle, anticlockwise from outside, shape (t, 3) [-].
    motion
        Displacement of the points per unit of the r coordinates of the structure, shape (p, 3, r) [- and m].
    """

    points: Points
    triangles: Triangles
    motion: Float[NDArray[np.float64], "p 3 r"]


def make_surface(mesh: Mesh, rom: ReducedModel, columns: slice | None = None, n_dof: int | None = None) -> BodySurface:
    """Make the outer surface of a reduced body.

    Parameters
    ----------
    mesh
        Mesh of the body.
    rom
        Reduced model of the body, on the nodes of the mesh.
    columns, n_dof
        Indices of the body's coordinates in the structure, and number of coordinates of the structure; by default the
        body is the whole structure.
    """
    nodes, triangles = thin_surface(mesh.points, list_outer_triangles(mesh))
    n_dof = rom.n_dof if n_dof is None else n_dof
    own = columns or slice(0, rom.n_dof)
    row_of = np.full(3 * rom.n_node, -1)
    row_of[rom.free] = np.arange(len(rom.free))
    rows = row_of[3 * nodes[:, None] + np.arange(3)]
    motion = np.zeros((len(nodes), 3, n_dof))
    motion[..., own] = np.where(rows[..., None] >= 0, rom.recovery[rows], 0.0)
    return BodySurface(points=mesh.points[nodes], triangles=triangles, motion=motion)


def list_outer_triangles(mesh: Mesh) -> Triangles:
    """List the node indices of triangles between the corners of the outer faces, shape (t, 3) [-]."""
    result = []
    for _, element, local, cells in mesh.face_groups(find_outer_faces(mesh)):
        corners = cells[:, list(element.corner_faces[local])]
        result += [corners[:, [0, k, k + 1]] for k in range(1, corners.shape[1] - 1)]
    return np.concatenate(result)


def thin_surface(points: Points, triangles: Triangles) -> tuple[Int[NDArray[np.int64], " k"], Triangles]:
    """Coarsen a surface to at most `MOST_POINTS` nodes.

    In each cell of a grid the node nearest to the mean of the cell's nodes is retained (vertex clustering, Rossignac
    and Borrel 1993); triangles with two corners in one cell are removed.

    Parameters
    ----------
    points
        Coordinates of all nodes, shape (n, 3) [m].
    triangles
        Nodes of each triangle, shape (t, 3) [-].

    Returns
    -------
    Retained nodes, shape (k,), and triangles as indices into these, shape (u, 3) [-].
    """
    nodes = np.unique(triangles)
    stays, size, cells = nodes, np.ptp(points[nodes], axis=0).max(), INITIAL_CELLS
    while len(stays) > MOST_POINTS:
        grid = np.floor((points[nodes] - points[nodes].min(axis=0)) / size * cells).astype(np.int64)
        _, cell = np.unique(grid, axis=0, return_inverse=True)
        cell = cell.ravel()
        middle = np.stack([np.bincount(cell, column) for column in points[nodes].T], axis=1)
        away = np.linalg.norm(points[nodes] - (middle / np.bincount(cell)[:, None])[cell], axis=1)
        order = np.lexsort([away, cell])
        first = order[np.r_[True, np.diff(cell[order]) > 0]]
        stays, cells = nodes[first], int(CELL_FACTOR * cells)
        place = np.zeros(len(points), dtype=np.int64)
        place[nodes] = cell
    if stays is nodes:
        place = np.zeros(len(points), dtype=np.int64)
        place[nodes] = np.arange(len(nodes))
    corners = place[triangles]
    whole = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    return stays, np.unique(corners[whole], axis=0)
