"""Where a quadrilateral or triangular face is sampled, and how the samples make facets and edges."""

from dataclasses import dataclass
from functools import cache
from typing import TypeAlias

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.element import Element
from fe.face_integral import find_face_frame

#: Corners of a triangle in the two directions of a face.
TRIANGLE = np.array([[0, 0], [1, 0], [0, 1]], dtype=float)
Weights = Float[NDArray[np.float64], "point node_of_face"]
Samples: TypeAlias = tuple[
    Float[NDArray[np.float64], "point 2"], Int[NDArray[np.int64], "facet 4"], Int[NDArray[np.int64], "side along"]
]


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
def face_pattern(element: Element, local: int, n: int) -> FacePattern:
    """The pattern of a face with `n` facets along its sides, an even number for triangles."""
    face = list(element.faces[local])
    at, facets, rims = (_triangle if len(element.corner_faces[local]) == 3 else _square)(n)
    origin, along = find_face_frame(element, local)
    value = element.shape(origin + at @ along)[:, face]
    u, v = np.einsum("qaj,tj->tqa", element.gradient(origin + at @ along)[:, face], along)
    return FacePattern(value=value, along_u=u, along_v=v, facets=facets, rims=rims)


def _square(n: int) -> Samples:
    """Places of the samples in the two directions of the face, facets and rims."""
    local = np.linspace(0, 1, n + 1)
    index = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    rims = np.stack([index[0], index[:, -1], index[-1, ::-1], index[::-1, 0]])
    return np.array([(u, v) for v in local for u in local]), _facets(index), rims


def _triangle(n: int) -> Samples:
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
    return np.concatenate(points), np.concatenate(facets), np.stack(rims)


def _facets(index: Int[NDArray[np.int64], "v u"]) -> Int[NDArray[np.int64], "facet 4"]:
    return np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=-1).reshape(-1, 4)
