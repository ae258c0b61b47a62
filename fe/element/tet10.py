"""Ten-node tetrahedron: complete quadratics, 4 quadrature points for stiffness and mass (CalculiX C3D10).

The 4-point rule is exact to degree 2, which suffices for the stiffness of a straight-edged cell. The mass, of degree 4,
is not integrated exactly; the error of the frequencies is smaller than the discretisation error.
"""

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.element.hex8 import CORNER_FACES
from fe.element.hex8 import CORNERS as BRICK_CORNERS
from fe.element.registry import REGISTRY
from fe.element.table import Element, ReferencePoints, find_brick_places
from fe.quadrature import gauss_tetrahedron

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
#: Corners of each edge; node 4 + k is on edge k.
EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
NODES = np.vstack([CORNERS, [(CORNERS[a] + CORNERS[b]) / 2 for a, b in EDGES]])
#: Derivatives of the four barycentric coordinates with respect to xi, eta, zeta.
SLOPES = np.array([[-1, -1, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
#: Faces by node, anticlockwise from outside, in the order S1 to S4 of CalculiX and Abaqus.
FACES = ((0, 2, 1, 6, 5, 4), (0, 1, 3, 4, 8, 7), (1, 2, 3, 5, 9, 8), (2, 0, 3, 6, 7, 9))


def barycentric(points: ReferencePoints) -> Float[NDArray[np.float64], "point 4"]:
    """Barycentric coordinates: the shape functions of the four-node tetrahedron."""
    return np.column_stack([1 - points.sum(axis=1), points])


def shape(points: ReferencePoints) -> Float[NDArray[np.float64], "point 10"]:
    """Shape functions L_a (2 L_a - 1) at corners and 4 L_a L_b on edges (Zienkiewicz and Taylor, vol. 1)."""
    L = barycentric(points)
    return np.column_stack([L * (2 * L - 1), *(4 * L[:, a] * L[:, b] for a, b in EDGES)])


def gradient(points: ReferencePoints) -> Float[NDArray[np.float64], "point 10 3"]:
    """Derivatives of the shape functions with respect to xi, eta, zeta."""
    L = barycentric(points)[:, :, None]
    corners = (4 * L - 1) * SLOPES
    edges = [4 * (L[:, a] * SLOPES[b] + L[:, b] * SLOPES[a]) for a, b in EDGES]
    return np.concatenate([corners, np.stack(edges, axis=1)], axis=1)


def from_brick(
    bricks: Int[NDArray[np.int64], "brick 27"],
) -> tuple[Int[NDArray[np.int64], " tetrahedron"], Int[NDArray[np.int64], "tetrahedron 10"]]:
    """Cut each brick into six tetrahedra of ten nodes that conform with those of neighbours of any orientation.

    The corner with the lowest number is the apex of all six; their bases are the triangles of the three faces that do
    not contain it. Each face is cut from its corner with the lowest number, so that both bricks beside it cut it in the
    same way.

    Parameters
    ----------
    bricks
        Node numbers of right-handed bricks at the places `fe.element.table.BRICK`, shape (n_brick, 27) [-].

    Returns
    -------
    Brick of each tetrahedron, and the places of its nodes in the brick; six per brick, in the order of the bricks.

    References
    ----------
    Dompierre et al., How to subdivide pyramids, prisms and hexahedra into tetrahedra, 8th Int. Meshing Roundtable
    (1999): the rule of the lowest number.
    """
    corner_places = (BRICK_CORNERS + 1).astype(np.int64)
    number = bricks[:, find_brick_places(corner_places)]
    apex = number.argmin(axis=1)
    owner, corners = [], []
    for face in np.array(CORNER_FACES):
        away = np.flatnonzero(~np.isin(apex, face))
        first = number[away][:, face].argmin(axis=1)
        turned = face[(first[:, None] + np.arange(4)) % 4]
        for triangle in ([0, 2, 1], [0, 3, 2]):
            owner.append(away)
            # Anticlockwise seen from the apex, which is inside.
            corners.append(np.column_stack([turned[:, triangle], apex[away]]))
    order = np.argsort(np.concatenate(owner), kind="stable")
    places = corner_places[np.concatenate(corners)[order]]
    middles = np.stack([(places[:, a] + places[:, b]) // 2 for a, b in EDGES], axis=1)
    return np.concatenate(owner)[order], find_brick_places(np.concatenate([places, middles], axis=1))


TET10 = REGISTRY.register(
    Element(
        name="tet10",
        cell_type="tetra10",
        abaqus="C3D10",
        abaqus_faces=(0, 1, 2, 3),
        gmsh=11,
        gmsh_order=(0, 1, 2, 3, 4, 5, 6, 7, 9, 8),
        nodes=NODES,
        n_corner=4,
        shape=shape,
        gradient=gradient,
        corner_shape=barycentric,
        faces=FACES,
        rule=gauss_tetrahedron(),
        stress_points=gauss_tetrahedron()[0],
        degree=2,
        regular_corner=float(np.sqrt(0.5)),
        from_brick=from_brick,
    )
)
