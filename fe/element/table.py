"""Table of an element: nodes, shape functions, faces, one quadrature rule, and its names in files."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.quadrature import Rule

ReferencePoints: TypeAlias = Float[NDArray[np.float64], "point 3"]
#: Function that fills bricks with cells: from node numbers at `BRICK`, shape (n_brick, 27), to the brick of each cell,
#: shape (n_cell,), and the places of its nodes in `BRICK`, shape (n_cell, n_node).
FromBrick: TypeAlias = Callable[
    [Int[NDArray[np.int64], "brick 27"]], tuple[Int[NDArray[np.int64], " cell"], Int[NDArray[np.int64], "cell node"]]
]

#: Places of the 27 nodes of a brick in half steps: corners, middles of edges and faces, centre.
BRICK = np.array([(i, j, k) for i in range(3) for j in range(3) for k in range(3)])


@dataclass(frozen=True, kw_only=True, eq=False)
class Element:
    """Isoparametric solid element.

    Parameters
    ----------
    name
        Short name used in case files ("hex8").
    cell_type
        meshio's name of the cell ("hexahedron"), used in meshes and by the readers of .vtu and Nastran files.
    abaqus
        Name in Abaqus and CalculiX ("C3D8").
    abaqus_faces
        Local face for each of the labels S1, S2, ... of Abaqus and CalculiX [-].
    gmsh
        Number of the cell in Gmsh [-].
    gmsh_order
        Place in VTK order of each of Gmsh's nodes [-].
    nodes
        Reference coordinates of the nodes in VTK order, corners first, shape (n_node, 3) [-].
    n_corner
        Number of corner nodes [-].
    shape
        Shape functions: (n_point, 3) -> (n_point, n_node) [-].
    gradient
        Derivatives of the shape functions: (n_point, 3) -> (n_point, n_node, 3) [-].
    corner_shape
        Shape functions of the element without midside nodes: (n_point, 3) -> (n_point, n_corner) [-].
    faces
        Local nodes of each face: corners anticlockwise seen from outside, then midside nodes in the same order.
    rule
        Quadrature rule of stiffness and mass.
    stress_points
        Points at which stress is computed before it is extrapolated to the nodes, as many as corners; quadratic
        elements are one order more accurate there than elsewhere (Barlow, Int. J. Num. Meth. Eng. 10, 1976), shape
        (n_corner, 3) [-].
    degree
        Polynomial degree p up to which the shape functions are complete [-].
    regular_corner
        Triple product of the unit edges at a corner of the regular cell, 1 for a cube [-].
    from_brick
        Function that fills bricks with cells of this element.
    """

    name: str
    cell_type: str
    abaqus: str
    abaqus_faces: tuple[int, ...]
    gmsh: int
    gmsh_order: tuple[int, ...]
    nodes: Float[NDArray[np.float64], "node 3"]
    n_corner: int
    shape: Callable[[ReferencePoints], Float[NDArray[np.float64], "point node"]]
    gradient: Callable[[ReferencePoints], Float[NDArray[np.float64], "point node 3"]]
    corner_shape: Callable[[ReferencePoints], Float[NDArray[np.float64], "point corner"]]
    faces: tuple[tuple[int, ...], ...]
    rule: Rule
    stress_points: ReferencePoints
    degree: int
    regular_corner: float
    from_brick: FromBrick

    @property
    def n_node(self) -> int:
        """Number of nodes [-]."""
        return len(self.nodes)

    @cached_property
    def corner_faces(self) -> tuple[tuple[int, ...], ...]:
        """Corners of each face: three or four."""
        return tuple(tuple(node for node in face if node < self.n_corner) for face in self.faces)


def fill_alike(*cells: Float[NDArray[np.float64], "node 3"]) -> FromBrick:
    """Function that fills every brick with the same cells.

    Parameters
    ----------
    cells
        Coordinates of the nodes of each cell in the brick [-1, 1]^3, each of shape (n_node, 3) [-].
    """
    places = np.stack([find_brick_places((nodes + 1).astype(np.int64)) for nodes in cells])

    def from_brick(
        bricks: Int[NDArray[np.int64], "brick 27"],
    ) -> tuple[Int[NDArray[np.int64], " cell"], Int[NDArray[np.int64], "cell node"]]:
        return np.repeat(np.arange(len(bricks)), len(places)), np.tile(places, (len(bricks), 1))

    return from_brick


def find_brick_places(half_steps: Int[NDArray[np.int64], "*where 3"]) -> Int[NDArray[np.int64], "*where"]:
    """Place in `BRICK` of nodes in half steps."""
    return np.asarray(half_steps @ np.array([9, 3, 1]))
