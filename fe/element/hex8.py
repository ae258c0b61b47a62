"""Eight-node hexahedron: trilinear, 2 x 2 x 2 Gauss points (CalculiX C3D8).

It is fully integrated and locks in bending because of parasitic shear, as the first rows of the paper's Table 1 show.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.element.registry import REGISTRY
from fe.element.table import Element, ReferencePoints, fill_alike
from fe.quadrature import gauss_hexahedron

CORNERS = np.array(
    [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]], dtype=float
)
#: Faces x-, x+, y-, y+, z-, z+ by corner, anticlockwise from outside.
CORNER_FACES = ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7))
#: Faces S1 to S6 of Abaqus and CalculiX: S1 is 1-2-3-4, S2 5-8-7-6, S3 1-5-6-2, S4 2-6-7-3, S5 3-7-8-4, S6 4-8-5-1
#: (CalculiX CrunchiX User's Manual 2.20, "Eight-node brick element").
LABELLED_FACES = (4, 5, 2, 1, 3, 0)


def shape(points: ReferencePoints) -> Float[NDArray[np.float64], "point 8"]:
    """Shape functions (1 + xi xi_a)(1 + eta eta_a)(1 + zeta zeta_a) / 8."""
    factors = 1 + points[:, None, :] * CORNERS
    return np.asarray(factors.prod(axis=2) / 8)


def gradient(points: ReferencePoints) -> Float[NDArray[np.float64], "point 8 3"]:
    """Derivatives of the shape functions with respect to xi, eta, zeta."""
    factors = 1 + points[:, None, :] * CORNERS
    result = np.empty(factors.shape)
    for axis in range(3):
        first, second = (other for other in range(3) if other != axis)
        result[..., axis] = CORNERS[:, axis] * factors[..., first] * factors[..., second] / 8
    return result


HEX8 = REGISTRY.register(
    Element(
        name="hex8",
        cell_type="hexahedron",
        abaqus="C3D8",
        abaqus_faces=LABELLED_FACES,
        gmsh=5,
        gmsh_order=tuple(range(8)),
        nodes=CORNERS,
        n_corner=8,
        shape=shape,
        gradient=gradient,
        corner_shape=shape,
        faces=CORNER_FACES,
        rule=gauss_hexahedron(2),
        stress_points=gauss_hexahedron(2)[0],
        degree=1,
        regular_corner=1.0,
        from_brick=fill_alike(CORNERS),
    )
)
