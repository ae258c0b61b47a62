r"""Latin hypercubes: points that fill a unit cube evenly, with equal steps in each direction.

Swapping the coordinates of two points in one direction preserves a Latin hypercube. Random swaps are accepted if they
lower the centred discrepancy of the points :math:`x_i` in :math:`d` directions, with :math:`y = x - 1/2`,

.. math:: C^2 = \left(\frac{13}{12}\right)^d
                - \frac{2}{n} \sum_i \prod_k \left(1 + \frac{|y_{ik}| - y_{ik}^2}{2}\right)
                + \frac{1}{n^2} \sum_{ij} \prod_k \left(1 + \frac{|y_{ik}| + |y_{jk}| - |y_{ik} - y_{jk}|}{2}\right) .

`scipy.stats.qmc` contains the same algorithm, but importing `scipy.stats` takes longer than many comparisons.

References
----------
Fang, Li and Sudjianto, Design and Modeling for Computer Experiments (2006), chapter 3.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

Design = Float[NDArray[np.float64], "n d"]

#: Number of consecutive swaps without a lower discrepancy that ends the search.
PATIENCE = 100


def draw_latin_hypercube(n: int, d: int, seed: int) -> Design:
    """Random points in a unit cube, one in each step of every direction, shape (n, d).

    Parameters
    ----------
    n, d
        Number of points and of directions [-].
    seed
        The points are those of `scipy.stats.qmc.LatinHypercube(d, optimization="random-cd", rng=seed)`.
    """
    (random,) = np.random.default_rng(seed).spawn(1)
    within = random.uniform(size=(n, d))
    steps = np.tile(np.arange(1, n + 1), (d, 1))
    for row in steps:
        random.shuffle(row)
    points = (steps.T - within) / n
    if n < 2 or d < 2:
        return points
    least, failed = compute_centred_discrepancy(points), 0
    while failed < PATIENCE:
        column, one, other = (int(random.integers(size)) for size in (d, n, n))
        tried = points.copy()
        tried[[one, other], column] = points[[other, one], column]
        discrepancy = compute_centred_discrepancy(tried)
        if discrepancy < least:
            points, least, failed = tried, discrepancy, 0
        else:
            failed += 1
    return points


def compute_centred_discrepancy(points: Design) -> float:
    """C^2 of points in a unit cube [-]."""
    n, d = points.shape
    y = points - 0.5
    size = np.abs(y)
    single = np.prod(1 + (size - y**2) / 2, axis=1).sum()
    pairs = np.prod(1 + (size[:, None] + size - np.abs(y[:, None] - y)) / 2, axis=2).sum()
    return float((13 / 12) ** d - 2 / n * single + pairs / n**2)
