"""One integral for all solid elements: stiffness and mass of a batch of cells from the element's table."""

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.element import Element
from fe.errors import InvertedCell, MeshError

CellPoints = Float[NDArray[np.float64], "cell node 3"]
PerCell = Float[NDArray[np.float64], " cell"]


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
        What the cells are called in a refusal, shape (n_cell,) [-]; by default they count from 0.

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
    reference = element.gradient(at)
    # J[j, i] = dx_i / dxi_j, so that physical gradients are inv(J) applied to reference ones.
    J = np.einsum("eai,qaj->eqji", points, reference, optimize=True)
    with np.errstate(invalid="ignore"):  # a missing coordinate is reported below
        determinant = np.linalg.det(J)
    bad = np.flatnonzero(~(determinant > 0).all(axis=1))
    if bad.size:
        first = bad[0] if number is None else number[bad[0]]
        if not np.isfinite(points[bad[0]]).all():
            raise MeshError(f"{element.name} cell {first} has a node whose coordinates are not finite: mend the mesh")
        raise InvertedCell(
            f"{element.name} cell {first} is inverted or collapsed (det J {determinant[bad[0]].min():.3g} m^3): "
            "reorder its nodes or remesh it"
        )
    physical = np.matmul(reference, np.linalg.inv(J).swapaxes(-1, -2))
    return determinant, physical


def element_matrices(
    element: Element,
    points: CellPoints,
    lame: PerCell,
    shear: PerCell,
    density: PerCell,
    number: Int[NDArray[np.int64], " cell"] | None = None,
) -> tuple[Float[NDArray[np.float64], "cell dof dof"], Float[NDArray[np.float64], "cell node node"]]:
    r"""Stiffness and consistent mass of isotropic solid cells, one quadrature rule for both.

    .. math:: K_{ai,bj} = \int \lambda\, N_{a,i} N_{b,j} + \mu\, (N_{a,j} N_{b,i} + \delta_{ij} N_{a,k} N_{b,k})\, dV,
              \qquad M_{ab} = \int \rho\, N_a N_b\, dV

    Parameters
    ----------
    element
        The element's table.
    points
        Node coordinates of each cell, shape (n_cell, n_node, 3) [m].
    lame, shear, density
        Of each cell, shape (n_cell,) [Pa, Pa, kg/m^3].
    number
        What the cells are called in a refusal, as in `jacobian`.

    Returns
    -------
    Stiffness, shape (n_cell, 3 n_node, 3 n_node), degree of freedom 3 a + i [N/m]; mass of one direction, shape
    (n_cell, n_node, n_node) [kg]. Both exactly symmetric.

    Raises
    ------
    InvertedCell
        det J is not positive at a quadrature point; the message names the first such cell.
    MeshError
        A coordinate is not a finite number.

    References
    ----------
    Zienkiewicz and Taylor, The Finite Element Method, vol. 1, ch. 6 and 8.
    """
    at, weights = element.rule
    determinant, gradient = jacobian(element, points, at, number)
    n_cell, n_point, n_node = gradient.shape[:3]
    volume = determinant * weights
    B = gradient.reshape(n_cell, n_point, 3 * n_node)
    outer = np.matmul((B * volume[..., None]).swapaxes(1, 2), B).reshape(n_cell, n_node, 3, n_node, 3)
    trace = np.einsum("eakbk->eab", outer)
    stiffness = lame[:, None, None, None, None] * outer
    stiffness += shear[:, None, None, None, None] * outer.swapaxes(2, 4)
    for direction in range(3):
        stiffness[:, :, direction, :, direction] += shear[:, None, None] * trace
    stiffness = stiffness.reshape(n_cell, 3 * n_node, 3 * n_node)
    shape = element.shape(at)
    pairs = (shape[:, :, None] * shape[:, None, :]).reshape(n_point, -1)
    mass = ((density[:, None] * volume) @ pairs).reshape(n_cell, n_node, n_node)
    # Round-off alone separates the triangles; taking the mean makes every assembled matrix symmetric to the last bit.
    return (stiffness + stiffness.swapaxes(1, 2)) / 2, mass
