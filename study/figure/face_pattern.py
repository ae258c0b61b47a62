"""Where a quadrilateral or triangular face is sampled, and how the samples make facets and edges."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.element.tet10 import gradient as tetrahedron_gradient
from fe.element.tet10 import shape as tetrahedron_shape

#: Corners of the reference square, then the middles of its sides.
SQUARE = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [0, -1], [1, 0], [0, 1], [-1, 0]], dtype=float)
TRIANGLE = np.array([[0, 0], [1, 0], [0, 1]], dtype=float)
#: Nodes of the reference tetrahedron on its side zeta = 0: the functions of the triangle are its own there.
ON_TRIANGLE = [0, 1, 2, 4, 5, 6]

Weights = Float[NDArray[np.float64], "point node_of_face"]


@dataclass(frozen=True, kw_only=True, eq=False)
class FacePattern:
    """The samples of one face.

    Parameters
    ----------
    value, along_u, along_v
        Shape functions and their two derivatives at the samples, shape (n_point, n_node_of_face) [-]; the cross
        product of the derivatives points out of the cell.
    facets
        Samples of each facet, anticlockwise, shape (n_facet, 4) [-].
    rims
        Samples along each side, from corner to corner, shape (n_side, n_along + 1) [-].
    """

    value: Weights
    along_u: Weights
    along_v: Weights
    facets: Int[NDArray[np.int64], "facet 4"]
    rims: Int[NDArray[np.int64], "side along"]


@cache
def face_pattern(n_node: int, n_along: int) -> FacePattern:
    """The pattern of a face of 4 or 8 nodes, or of a triangle of 6, with an even number of facets along its sides."""
    return _triangle(n_along) if n_node == 6 else _square(n_node, n_along)


def _square(n_node: int, n: int) -> FacePattern:
    local = np.linspace(-1, 1, n + 1)
    grid = np.array([(u, v) for v in local for u in local])
    index = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    value, du, dv = _square_functions(n_node, grid)
    rims = np.stack([index[0], index[:, -1], index[-1, ::-1], index[::-1, 0]])
    return FacePattern(value=value, along_u=du, along_v=dv, facets=_facets(index), rims=rims)


def _triangle(n: int) -> FacePattern:
    """Three quadrilaterals, each between a corner, the middles of the two sides there and the centre."""
    half = n // 2
    a, b = (grid.ravel()[:, None] for grid in np.meshgrid(*[np.linspace(0, 1, half + 1)] * 2))
    centre = TRIANGLE.mean(axis=0)
    points, facets, index = [], [], []
    for k, corner in enumerate(TRIANGLE):
        after, before = ((corner + TRIANGLE[(k + step) % 3]) / 2 for step in (1, 2))
        points.append((1 - a) * (1 - b) * corner + a * (1 - b) * after + a * b * centre + (1 - a) * b * before)
        index.append((half + 1) ** 2 * k + np.arange((half + 1) ** 2).reshape(half + 1, half + 1))
        facets.append(_facets(index[-1]))
    rims = [np.concatenate([index[k][0], index[(k + 1) % 3][-2::-1, 0]]) for k in range(3)]
    flat = np.column_stack([np.concatenate(points), np.zeros(3 * len(a))])
    slope = tetrahedron_gradient(flat)[:, ON_TRIANGLE]
    return FacePattern(
        value=tetrahedron_shape(flat)[:, ON_TRIANGLE],
        along_u=slope[..., 0],
        along_v=slope[..., 1],
        facets=np.concatenate(facets),
        rims=np.stack(rims),
    )


def _facets(index: Int[NDArray[np.int64], "v u"]) -> Int[NDArray[np.int64], "facet 4"]:
    return np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=-1).reshape(-1, 4)


def _square_functions(n_node: int, at: Float[NDArray[np.float64], "point 2"]) -> tuple[NDArray[np.float64], ...]:
    """Shape functions of a face with 4 or 8 nodes, and their two derivatives, each (n_point, n_node)."""
    u, v = at[:, :1], at[:, 1:]
    value, du, dv = np.empty((3, len(at), n_node))
    corner = slice(0, 4)
    a, b = SQUARE[corner].T
    value[:, corner] = (1 + a * u) * (1 + b * v) / 4
    du[:, corner] = a * (1 + b * v) / 4
    dv[:, corner] = b * (1 + a * u) / 4
    if n_node == 8:
        for side, (a_side, b_side) in enumerate(SQUARE[4:], start=4):
            if a_side == 0:
                new = (1 - u**2) * (1 + b_side * v) / 2, -u * (1 + b_side * v), (1 - u**2) * b_side / 2
            else:
                new = (1 + a_side * u) * (1 - v**2) / 2, a_side * (1 - v**2) / 2, -v * (1 + a_side * u)
            for array, column in zip((value, du, dv), new, strict=True):
                array[:, side] = column.ravel()
                # Each corner beside the side gives up half of what the middle takes.
                for beside in (side - 4, (side - 3) % 4):
                    array[:, beside] -= column.ravel() / 2
    return value, du, dv
