"""What an element is: a table of nodes, shape functions, faces and one quadrature rule."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.quadrature import Rule

ReferencePoints = Float[NDArray[np.float64], "point 3"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Element:
    """An isoparametric solid element.

    Parameters
    ----------
    name
        Short name used in case files ("hex8").
    cell_type
        meshio's name of the cell ("hexahedron").
    calculix
        CalculiX' and Abaqus' name ("C3D8").
    nodes
        Reference coordinates of the nodes in VTK order, corners first, shape (n_node, 3) [-].
    n_corner
        Number of corner nodes [-].
    shape
        Shape functions: (n_point, 3) -> (n_point, n_node) [-].
    gradient
        Their derivatives: (n_point, 3) -> (n_point, n_node, 3) [-].
    corner_shape
        Shape functions of the corners alone, as if there were no other nodes: (n_point, 3) -> (n_point, n_corner) [-].
    faces
        Local nodes of each face, corners first, seen from outside anticlockwise.
    rule
        Quadrature of stiffness and mass alike.
    stress_points
        Where stress is taken before it goes to the nodes: as many points as corners, at which quadratic elements are
        one order more accurate than elsewhere (Barlow, Int. J. Num. Meth. Eng. 10, 1976), shape (n_corner, 3) [-].
    degree
        Polynomial degree p that the shape functions hold completely [-].
    """

    name: str
    cell_type: str
    calculix: str
    nodes: Float[NDArray[np.float64], "node 3"]
    n_corner: int
    shape: Callable[[ReferencePoints], Float[NDArray[np.float64], "point node"]]
    gradient: Callable[[ReferencePoints], Float[NDArray[np.float64], "point node 3"]]
    corner_shape: Callable[[ReferencePoints], Float[NDArray[np.float64], "point corner"]]
    faces: tuple[tuple[int, ...], ...]
    rule: Rule
    stress_points: ReferencePoints
    degree: int

    @property
    def n_node(self) -> int:
        """Number of nodes [-]."""
        return len(self.nodes)
