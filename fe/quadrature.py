"""Quadrature rules on the reference cells."""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

Rule = tuple[Float[NDArray[np.float64], "point 3"], Float[NDArray[np.float64], " point"]]


def gauss_hexahedron(n: int) -> Rule:
    """Gauss-Legendre product rule on [-1, 1]^3, exact to degree 2 n - 1 in each direction.

    Parameters
    ----------
    n
        Number of points per direction [-], at least 1.

    Returns
    -------
    Points, shape (n^3, 3) [-], x fastest, and weights, shape (n^3,) [-], which sum to 8.
    """
    x, w = np.polynomial.legendre.leggauss(n)
    points = np.array([(a, b, c) for c in x for b in x for a in x])
    weights = np.array([wa * wb * wc for wc in w for wb in w for wa in w])
    return points, weights


def gauss_tetrahedron() -> Rule:
    """Four points of equal weight, exact to degree 2 on the tetrahedron of corners 0, e_x, e_y, e_z.

    Returns
    -------
    Points, shape (4, 3) [-], the k-th nearest to corner k, and weights, shape (4,) [-], which sum to 1/6.

    References
    ----------
    Hammer and Stroud, Numerical integration over simplexes, Math. Tables Aids Comput. 10 (1956), 137-139.
    """
    near, far = (5 + 3 * np.sqrt(5)) / 20, (5 - np.sqrt(5)) / 20
    points = np.vstack([np.full(3, far), far + (near - far) * np.eye(3)])
    return points, np.full(4, 1 / 24)
