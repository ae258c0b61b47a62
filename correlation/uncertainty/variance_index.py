r"""Variance-based indices: how much of the variance of a quantity each uncertain parameter causes.

Of two independent sets of n draws A and B, and sets A_i that are A with parameter i from B,

.. math:: S_i = \frac{1}{V n} \sum_j f(B)_j \left( f(A_i)_j - f(A)_j \right), \qquad
          S_{T i} = \frac{1}{2 V n} \sum_j \left( f(A)_j - f(A_i)_j \right)^2 ,

with the variance V of all f(A) and f(B), from which their mean is taken first. S is the share that parameter i causes
by itself; S_T adds its interactions with the others. Both cost n (d + 2) evaluations.

References
----------
Saltelli et al., Comput. Phys. Commun. 181 (2010), Table 2 (b) and (f).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

Real = NDArray[np.float64]
Value = TypeVar("Value")

#: Number of bootstrap samples of the draws, their seed, and the coverage of an interval.
RESAMPLES, SEED, CONFIDENCE = 500, 0, 0.95
#: Values that differ by less than this share count as constant [-].
ROUND_OFF = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class SaltelliDesign:
    """Points of a unit cube at which a function is evaluated, shapes (n, d), (n, d) and (d, n, d)."""

    a: Float[Real, "n d"]
    b: Float[Real, "n d"]
    ab: Float[Real, "d n d"]

    @property
    def points(self) -> Float[Real, "m d"]:
        """All of them: A, B, then A_1 to A_d, shape (n (d + 2), d)."""
        d = self.a.shape[1]
        return np.concatenate([self.a, self.b, self.ab.reshape(-1, d)])


@dataclass(frozen=True, kw_only=True, eq=False)
class VarianceIndices:
    """Indices of one quantity; intervals have a coverage of 95 %, shape (2, d).

    Parameters
    ----------
    first, total
        S and S_T of each parameter, shape (d,) [-]; not a number where the quantity does not vary.
    first_interval, total_interval
        Bootstrap intervals, shape (2, d) [-].
    n_draw
        Rows of the design whose values are all known [-].
    """

    first: Float[Real, " d"]
    total: Float[Real, " d"]
    first_interval: Float[Real, "2 d"]
    total_interval: Float[Real, "2 d"]
    n_draw: int


def make_saltelli_design(n: int, d: int, seed: int) -> SaltelliDesign:
    """Scrambled Sobol points of 2 d coordinates: A from the first d of them, B from the others.

    Parameters
    ----------
    n
        Number of draws, a power of two [-].
    d
        Number of parameters [-].
    seed
        Seed of the scrambling.
    """
    from scipy.stats import qmc

    points = qmc.Sobol(2 * d, scramble=True, rng=seed).random(n)
    # A quantile of 0 is -inf for a normal distribution: the smallest step of the points keeps clear of it.
    points = np.clip(points, 2.0**-33, 1 - 2.0**-33)
    a, b = points[:, :d], points[:, d:]
    ab = np.tile(a, (d, 1, 1))
    for i in range(d):
        ab[i, :, i] = b[:, i]
    return SaltelliDesign(a=a, b=b, ab=ab)


def take_independent_draws(values: Sequence[Value], d: int) -> Sequence[Value]:
    """Values at the points A and B of a `SaltelliDesign` of d parameters: 2 n independent draws."""
    return values[: 2 * (len(values) // (d + 2))]


def compute_variance_indices(values: Float[Real, " m"], d: int) -> VarianceIndices:
    """Indices of a quantity from its values at the points of a `SaltelliDesign`.

    Parameters
    ----------
    values
        In the order of `SaltelliDesign.points`, shape (n (d + 2),); a row of the design with a value that is not finite
        is left out.
    d
        Number of parameters [-].
    """
    table = np.asarray(values, dtype=np.float64).reshape(d + 2, -1)
    table = table[:, np.isfinite(table).all(axis=0)]
    n = table.shape[1]
    first, total = _compute_indices(table)
    random = np.random.default_rng(SEED)
    resampled = np.full((2, RESAMPLES, d), np.nan)
    for number in range(RESAMPLES if n > 1 else 0):
        resampled[:, number] = _compute_indices(table[:, random.integers(n, size=n)])
    ends = [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2]
    known = np.where(np.isfinite(resampled), resampled, 0.0)
    # A quantity that does not vary has no index in any sample.
    intervals = np.quantile(known, ends, axis=1) if np.isfinite(first).all() else np.full((2, 2, d), np.nan)
    return VarianceIndices(
        first=first, total=total, first_interval=intervals[:, 0], total_interval=intervals[:, 1], n_draw=n
    )


def _compute_indices(table: Float[Real, "k n"]) -> tuple[Real, Real]:
    """S and S_T, shape (d,) each, of f(A), f(B), f(A_1), ..., shape (d + 2, n)."""
    d = len(table) - 2
    # Values that differ by round-off only are constant.
    if table.shape[1] < 2 or np.ptp(table[:2]) <= ROUND_OFF * np.abs(table[:2]).max():
        return np.full(d, np.nan), np.full(d, np.nan)
    # The mean does not change the indices, and large ones would cost digits and scatter.
    a, b, *ab = table - table[:2].mean()
    variance = np.var(np.concatenate([a, b]))
    first = [float(np.mean(b * (mixed - a)) / variance) for mixed in ab]
    total = [float(np.mean((a - mixed) ** 2) / (2 * variance)) for mixed in ab]
    return np.array(first), np.array(total)
