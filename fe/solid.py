"""Stiffness and mass of a batch of cells of any solid element, from the element's table."""

from functools import cache
from itertools import product

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.element import Element
from fe.errors import InvertedCell, MeshError

CellPoints = Float[NDArray[np.float64], "cell node 3"]
PerCell = Float[NDArray[np.float64], " cell"]
#: Pairs of directions whose blocks define a symmetric stiffness.
DIRECTIONS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def jacobian(
    element: Element,
    points: CellPoints,
    at: Float[NDArray[np.float64], "point 3"],
    number: Int[NDArray[np.int64], " cell"] | None = None,
) -> tuple[Float[NDArray[np.float64], "cell point"], Float[NDArray[np.float64], "cell point node 3"]]:
    """Determinants of the isoparametric map, and the shape gradients in physical space.

    Parameters
    ----------
    element
        The element's table.
    points
        Node coordinates of each cell, shape (n_cell, n_node, 3) [m].
    at
        Reference points, shape (n_point, 3) [-].
    number
        Numbers of the cells for messages, shape (n_cell,) [-]; by default counted from 0.

    Returns
    -------
    det J, positive, shape (n_cell, n_point) [m^3], and dN/dx, shape (n_cell, n_point, n_node, 3) [1/m].

    Raises
    ------
    InvertedCell
        det J is not positive at one of the points.
    MeshError
        A coordinate is not a finite number.
    """
    return _jacobian(element, points, element.gradient(at).swapaxes(1, 2), number)


def _jacobian(
    element: Element,
    points: CellPoints,
    reference: Float[NDArray[np.float64], "point 3 node"],
    number: Int[NDArray[np.int64], " cell"] | None,
) -> tuple[Float[NDArray[np.float64], "cell point"], Float[NDArray[np.float64], "cell point node 3"]]:
    n_point, _, n_node = reference.shape
    J = np.matmul(reference.reshape(-1, n_node), points).reshape(-1, n_point, 3, 3)
    # J[j, i] = dx_i / dxi_j for all points and cells at once; a loop over 3 x 3 matrices takes five times as long.
    J = np.ascontiguousarray(J.transpose(2, 3, 1, 0))
    cofactor = np.empty_like(J)
    with np.errstate(invalid="ignore", over="ignore"):  # a missing coordinate is reported below
        for j, i in product(range(3), repeat=2):
            (j1, j2), (i1, i2) = ((k + 1) % 3 for k in (j, j + 1)), ((k + 1) % 3 for k in (i, i + 1))
            cofactor[j, i] = J[j1, i1] * J[j2, i2] - J[j1, i2] * J[j2, i1]
        determinant = (J[0] * cofactor[0]).sum(axis=0).T
    bad = np.flatnonzero(~(determinant > 0).all(axis=1))
    if bad.size:
        first = bad[0] if number is None else number[bad[0]]
        if not np.isfinite(points[bad[0]]).all():
            raise MeshError(f"{element.name} cell {first} has a node with coordinates that are not finite: correct it")
        raise InvertedCell(
            f"{element.name} cell {first} is inverted or collapsed (det J {determinant[bad[0]].min():.3g} m^3): "
            "reorder its nodes or remesh it"
        )
    inverse = (cofactor / determinant.T).transpose(2, 3, 1, 0).reshape(n_point, -1, 3)
    physical = np.matmul(inverse, reference).reshape(n_point, -1, 3, n_node)
    return determinant, physical.transpose(1, 0, 3, 2)


@cache
def _evaluate_at_quadrature(
    element: Element,
) -> tuple[Float[NDArray[np.float64], "point 3 node"], Float[NDArray[np.float64], "point pair"]]:
    """Reference gradients, and products of two shape functions, at the element's quadrature points."""
    at, _ = element.rule
    shape = element.shape(at)
    return element.gradient(at).swapaxes(1, 2), (shape[:, :, None] * shape[:, None, :]).reshape(len(at), -1)


def compute_element_blocks(
    element: Element,
    points: CellPoints,
    lame: PerCell,
    shear: PerCell,
    density: PerCell,
    number: Int[NDArray[np.int64], " cell"] | None = None,
) -> tuple[Float[NDArray[np.float64], "6 cell node node"], Float[NDArray[np.float64], "cell node node"]]:
    r"""Stiffness and consistent mass of isotropic solid cells, with the same quadrature rule.

    .. math:: K_{ai,bj} = \int \lambda\, N_{a,i} N_{b,j} + \mu\, (N_{a,j} N_{b,i} + \delta_{ij} N_{a,k} N_{b,k})\, dV,
              \qquad M_{ab} = \int \rho\, N_a N_b\, dV

    Parameters
    ----------
    element
        The element's table.
    points
        Node coordinates of each cell, shape (n_cell, n_node, 3) [m].
    lame, shear, density
        Lamé constants and density of each cell, shape (n_cell,) [Pa, Pa, kg/m^3].
    number
        Numbers of the cells for messages, as in `jacobian`.

    Returns
    -------
    Stiffness between the directions `DIRECTIONS`, shape (6, n_cell, n_node, n_node) [N/m]; the other three follow from
    K_{ai,bj} = K_{bj,ai}. Mass of one direction, shape (n_cell, n_node, n_node) [kg].

    Raises
    ------
    InvertedCell
        det J is not positive at a quadrature point; the message names the first of these cells.
    MeshError
        A coordinate is not a finite number.

    References
    ----------
    Zienkiewicz and Taylor, The Finite Element Method, vol. 1, ch. 6 and 8.
    """
    reference, pairs = _evaluate_at_quadrature(element)
    determinant, gradient = _jacobian(element, points, reference, number)
    n_cell, n_point, n_node = gradient.shape[:3]
    volume = determinant * element.rule[1]
    # Rows of quadrature points, columns of (direction, node): one product per cell gives all integrals of N_a,i N_b,j.
    B = gradient.swapaxes(2, 3).reshape(n_cell, n_point, 3 * n_node)
    outer = np.matmul((B * volume[..., None]).swapaxes(1, 2), B).reshape(n_cell, 3, n_node, 3, n_node)
    lame, shear = lame[:, None, None], shear[:, None, None]
    trace = shear * (outer[:, 0, :, 0] + outer[:, 1, :, 1] + outer[:, 2, :, 2])
    stiffness = np.empty((len(DIRECTIONS), n_cell, n_node, n_node))
    for block, (i, j) in zip(stiffness, DIRECTIONS, strict=True):
        if i == j:
            np.multiply(lame + shear, outer[:, i, :, i], out=block)
            block += trace
        else:
            np.multiply(lame, outer[:, i, :, j], out=block)
            block += shear * outer[:, j, :, i]
    mass = ((density[:, None] * volume) @ pairs).reshape(n_cell, n_node, n_node)
    return stiffness, mass
