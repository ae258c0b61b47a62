"""Consistent element matrices of a beam in a plane frame and of a rectangular plate with 12 degrees of freedom."""

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]

#: Exponents of x and y in the polynomial of the deflection of the plate (Adini, Clough and Melosh).
TERMS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3), (3, 1), (1, 3))


def frame_element(begin: Matrix, end: Matrix, axial: float, bending: float, mass: float) -> tuple[Matrix, Matrix]:
    """Mass and stiffness over x, z, ry of both ends, shape (6, 6): a bar and an Euler-Bernoulli beam.

    Parameters
    ----------
    begin, end
        Points in the plane x, z, shape (3,) [m].
    axial, bending, mass
        EA [N], EI [N m^2], rho A [kg/m].
    """
    along = end - begin
    length = float(np.linalg.norm(along))
    cosine, sine = along[0] / length, along[2] / length
    l2 = length**2
    # Local: u along the beam, w across it, slope dw/ds.
    stiffness, inertia = np.zeros((6, 6)), np.zeros((6, 6))
    bar, bend = [0, 3], [1, 2, 4, 5]
    stiffness[np.ix_(bar, bar)] = axial / length * np.array([[1, -1], [-1, 1]])
    inertia[np.ix_(bar, bar)] = mass * length / 6 * np.array([[2, 1], [1, 2]])
    stiffness[np.ix_(bend, bend)] = bending / length**3 * np.array([
        [12, 6 * length, -12, 6 * length], [6 * length, 4 * l2, -6 * length, 2 * l2],
        [-12, -6 * length, 12, -6 * length], [6 * length, 2 * l2, -6 * length, 4 * l2],
    ])  # fmt: skip
    inertia[np.ix_(bend, bend)] = mass * length / 420 * np.array([
        [156, 22 * length, 54, -13 * length], [22 * length, 4 * l2, 13 * length, -3 * l2],
        [54, 13 * length, 156, -22 * length], [-13 * length, -3 * l2, -22 * length, 4 * l2],
    ])  # fmt: skip
    # A positive rotation about y turns x towards -z: dw/ds = -ry.
    node = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, -1]])
    turn = np.kron(np.eye(2), node)
    return turn.T @ inertia @ turn, turn.T @ stiffness @ turn


def plate_element(a: float, b: float, bending: float, poisson: float, mass: float) -> tuple[Matrix, Matrix]:
    """Mass and stiffness over z, rx, ry of the corners (0, 0), (a, 0), (a, b), (0, b), shape (12, 12).

    Parameters
    ----------
    a, b
        Lengths along x and y [m].
    bending, poisson, mass
        D [N m], nu [-], rho h [kg/m^2].

    References
    ----------
    Adini and Clough (1960), Melosh (1963): the incomplete quartic, which passes the patch test on rectangles.
    """
    corners = [(0.0, 0.0), (a, 0.0), (a, b), (0.0, b)]
    values = np.vstack([[_terms(x, y, 0, 0), _terms(x, y, 0, 1), -_terms(x, y, 1, 0)] for x, y in corners])
    shape = np.linalg.inv(values)
    elastic = bending * np.array([[1, poisson, 0], [poisson, 1, 0], [0, 0, (1 - poisson) / 2]])
    points, weights = np.polynomial.legendre.leggauss(4)
    stiffness, inertia = np.zeros((12, 12)), np.zeros((12, 12))
    for x, wx in zip((points + 1) * a / 2, weights * a / 2, strict=True):
        for y, wy in zip((points + 1) * b / 2, weights * b / 2, strict=True):
            curvature = np.array([_terms(x, y, 2, 0), _terms(x, y, 0, 2), 2 * _terms(x, y, 1, 1)]) @ shape
            deflection = _terms(x, y, 0, 0) @ shape
            stiffness += wx * wy * curvature.T @ elastic @ curvature
            inertia += wx * wy * mass * np.outer(deflection, deflection)
    return inertia, stiffness


def _terms(x: float, y: float, dx: int, dy: int) -> Matrix:
    """Derivatives of all terms of the polynomial, dx times by x and dy times by y, shape (12,)."""
    return np.array([_power(x, p, dx) * _power(y, q, dy) for p, q in TERMS])


def _power(x: float, exponent: int, derivative: int) -> float:
    factor = 1.0
    for _ in range(derivative):
        factor, exponent = factor * exponent, exponent - 1
    return factor * x**exponent if factor else 0.0
