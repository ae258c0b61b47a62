"""Twenty-node serendipity hexahedron, 3 x 3 x 3 Gauss points (CalculiX C3D20).

The shape functions are complete to degree 2 on affine cells, and to degree 1 only on distorted cells.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.element.hex8 import CORNER_FACES, CORNERS, LABELLED_FACES
from fe.element.hex8 import shape as corner_shape
from fe.element.registry import REGISTRY
from fe.element.table import Element, ReferencePoints, fill_alike
from fe.quadrature import gauss_hexahedron

#: Corners of each edge; node 8 + k is on edge k.
EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
NODES = np.vstack([CORNERS, [(CORNERS[a] + CORNERS[b]) / 2 for a, b in EDGES]])
#: Axis along which the edge of each midside node runs.
EDGE_AXIS = [int(np.flatnonzero(NODES[8 + k] == 0)[0]) for k in range(12)]


def _find_edge_node(a: int, b: int) -> int:
    return 8 + next(k for k, edge in enumerate(EDGES) if set(edge) == {a, b})


FACES = tuple(face + tuple(_find_edge_node(face[k], face[(k + 1) % 4]) for k in range(4)) for face in CORNER_FACES)


def shape(points: ReferencePoints) -> Float[NDArray[np.float64], "point 20"]:
    """Serendipity shape functions of degree 2 (Zienkiewicz and Taylor, vol. 1, hexahedral serendipity family)."""
    factors = 1 + points[:, None, :] * NODES
    result = factors.prod(axis=2) * (points @ NODES.T - 2) / 8
    for node, axis in enumerate(EDGE_AXIS, start=8):
        first, second = (other for other in range(3) if other != axis)
        result[:, node] = (1 - points[:, axis] ** 2) * factors[:, node, first] * factors[:, node, second] / 4
    return np.asarray(result)


def gradient(points: ReferencePoints) -> Float[NDArray[np.float64], "point 20 3"]:
    """Derivatives of the shape functions with respect to xi, eta, zeta."""
    factors = 1 + points[:, None, :] * NODES
    corner_sum = points @ NODES.T - 2
    result = np.empty(factors.shape)
    for axis in range(3):
        first, second = (other for other in range(3) if other != axis)
        result[..., axis] = (
            NODES[:, axis] * factors[..., first] * factors[..., second] * (corner_sum + factors[..., axis]) / 8
        )
    for node, along in enumerate(EDGE_AXIS, start=8):
        for axis in range(3):
            if axis == along:
                first, second = (other for other in range(3) if other != axis)
                value = -2 * points[:, axis] * factors[:, node, first] * factors[:, node, second]
            else:
                third = 3 - along - axis
                value = (1 - points[:, along] ** 2) * NODES[node, axis] * factors[:, node, third]
            result[:, node, axis] = value / 4
    return result


HEX20 = REGISTRY.register(
    Element(
        name="hex20",
        cell_type="hexahedron20",
        abaqus="C3D20",
        abaqus_faces=LABELLED_FACES,
        gmsh=17,
        gmsh_order=(*range(8), 8, 11, 16, 9, 17, 10, 18, 19, 12, 15, 13, 14),
        nodes=NODES,
        n_corner=8,
        shape=shape,
        gradient=gradient,
        corner_shape=corner_shape,
        faces=FACES,
        rule=gauss_hexahedron(3),
        stress_points=gauss_hexahedron(2)[0],
        degree=2,
        regular_corner=1.0,
        from_brick=fill_alike(NODES),
    )
)
