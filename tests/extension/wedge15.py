"""A fifteen-node wedge from outside: complete quadratics times the height, 9 quadrature points (CalculiX C3D15).

Three points in the plane of the triangle and three along the height: exact on straight cells for constant strain.
"""

import numpy as np
from numpy.typing import NDArray

from fe.element.registry import REGISTRY
from fe.element.table import Element, fill_alike

CORNERS = np.array([[0, 0, -1], [1, 0, -1], [0, 1, -1], [0, 0, 1], [1, 0, 1], [0, 1, 1]], dtype=float)
#: Corners of each edge; node 6 + k sits on edge k.
EDGES = ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5))
NODES = np.vstack([CORNERS, [(CORNERS[a] + CORNERS[b]) / 2 for a, b in EDGES]])
#: Faces by node, anticlockwise from outside, in the order S1 to S5 of CalculiX and Abaqus.
FACES = (
    (0, 2, 1, 8, 7, 6),
    (3, 4, 5, 9, 10, 11),
    (0, 1, 4, 3, 6, 13, 9, 12),
    (1, 2, 5, 4, 7, 14, 10, 13),
    (2, 0, 3, 5, 8, 12, 11, 14),
)
#: Derivatives of the barycentric coordinates of the triangle with respect to xi, eta.
SLOPES = np.array([[-1, -1], [1, 0], [0, 1]], dtype=float)

Array = NDArray[np.float64]


def barycentric(points: Array) -> Array:
    return np.column_stack([1 - points[:, 0] - points[:, 1], points[:, 0], points[:, 1]])


def corner_shape(points: Array) -> Array:
    """Linear in the triangle times linear along the height."""
    L, z = barycentric(points), points[:, 2:]
    return np.hstack([L * (1 - z) / 2, L * (1 + z) / 2])


def shape(points: Array) -> Array:
    """Serendipity shape functions (Zienkiewicz and Taylor, vol. 1, triangular prisms)."""
    L, z = barycentric(points), points[:, 2:]
    sides = np.column_stack([2 * L[:, a] * L[:, b] for a, b in EDGES[:3]])
    corners = [L * (2 * L - 1) * (1 + s * z) / 2 - L * (1 - z**2) / 2 for s in (-1, 1)]
    return np.hstack([*corners, sides * (1 - z), sides * (1 + z), L * (1 - z**2)])


def gradient(points: Array) -> Array:
    L, z = barycentric(points), points[:, 2:]
    dL = SLOPES[None]
    side = np.column_stack([2 * L[:, a] * L[:, b] for a, b in EDGES[:3]])
    slope = np.stack([2 * (L[:, [a]] * SLOPES[b] + L[:, [b]] * SLOPES[a]) for a, b in EDGES[:3]], axis=1)
    z3 = z[:, :, None]
    plane = [(4 * L[:, :, None] - 1) * dL * (1 + s * z3) / 2 - dL * (1 - z3**2) / 2 for s in (-1, 1)]
    plane += [slope * (1 - z3), slope * (1 + z3), np.repeat(dL, len(points), axis=0) * (1 - z3**2)]
    height = [s * L * (2 * L - 1) / 2 + L * z for s in (-1, 1)] + [-side, side, -2 * L * z]
    return np.concatenate([np.concatenate(plane, axis=1), np.hstack(height)[:, :, None]], axis=2)


def product_rule(heights: Array, weights: Array) -> tuple[Array, Array]:
    """Three points of the triangle, the k-th nearest to corner k, at each height."""
    triangle = np.full((3, 2), 1 / 6) + np.vstack([np.zeros(2), np.eye(2)]) / 2
    points = np.vstack([np.column_stack([triangle, np.full(3, z)]) for z in heights])
    return points, np.repeat(weights, 3) / 6


def in_brick(*triangle: int) -> Array:
    """Nodes of the wedge over three corners of the lower side of the brick [-1, 1]^3."""
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=float)
    return np.column_stack([barycentric(NODES) @ square[list(triangle)], NODES[:, 2]])


WEDGE15 = REGISTRY.register(
    Element(
        name="wedge15",
        cell_type="wedge15",
        abaqus="C3D15",
        abaqus_faces=(0, 1, 2, 3, 4),
        gmsh=18,
        gmsh_order=(0, 1, 2, 3, 4, 5, 6, 8, 12, 7, 13, 14, 9, 11, 10),
        nodes=NODES,
        n_corner=6,
        shape=shape,
        gradient=gradient,
        corner_shape=corner_shape,
        faces=FACES,
        rule=product_rule(*np.polynomial.legendre.leggauss(3)),
        stress_points=product_rule(*np.polynomial.legendre.leggauss(2))[0],
        degree=2,
        regular_corner=float(np.sqrt(0.75)),
        from_brick=fill_alike(in_brick(0, 1, 2), in_brick(0, 2, 3)),
    )
)
