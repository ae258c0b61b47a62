r"""Proportional damping plus a part of low rank, as of a damped structure with an added spring, mass or dashpot.

.. math:: C = a M + b K + U \, \mathrm{diag}(s) \, U^T

with few columns in U. Only these couple the modes of M and K, and the Sherman-Morrison-Woodbury formula solves for
them: one decomposition serves all frequencies, as with proportional damping.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from reduction.array_type import Matrix, Real, Vector

#: Size of entries of C - a M - b K that is round-off, relative to sqrt(c_ii c_jj) with c = |a| m + |b| k.
ROUND_OFF = 1e-9
#: Largest number of degrees of freedom whose damping is not proportional: with more, a dense solve costs little more.
MAX_COUPLED = 16
#: Least fraction of the degrees of freedom with proportional damping for which a and b are accepted.
MAJORITY = 0.6


@dataclass(frozen=True, kw_only=True, eq=False)
class ProportionalPlusLowRank:
    """Damping a M + b K + U diag(s) U^T."""

    mass_factor: float
    stiffness_factor: float
    """a [1/s] and b [s]."""
    directions: Float[Real, "r k"]
    """U, shape (r, k) [-]."""
    strength: Float[Real, " k"]
    """s, shape (k,) [N s/m]."""


def split_proportional_plus_low_rank(
    mass: Matrix, damping: Matrix, stiffness: Matrix
) -> ProportionalPlusLowRank | None:
    """The factors and directions of such damping, from matrices of shape (r, r) [kg, N s/m, N/m]; else None."""
    factors = _find_factors(np.diag(mass), np.diag(damping), np.diag(stiffness))
    if factors is None:
        return None
    a, b = factors
    rest = damping - a * mass - b * stiffness
    own = np.sqrt(np.abs(a) * np.abs(np.diag(mass)) + np.abs(b) * np.abs(np.diag(stiffness)))
    beyond = np.abs(rest) > ROUND_OFF * np.outer(own, own)
    few = np.flatnonzero(beyond.any(axis=0) | beyond.any(axis=1))
    if len(few) > MAX_COUPLED:
        return None
    part = rest[np.ix_(few, few)]
    if not np.allclose(part, part.T, rtol=0, atol=ROUND_OFF * np.abs(part).max(initial=0.0)):
        return None
    strength, vectors = np.linalg.eigh((part + part.T) / 2)
    retained = np.abs(strength) > ROUND_OFF * np.abs(strength).max(initial=0.0)
    directions = np.zeros((len(mass), int(retained.sum())))
    directions[few] = vectors[:, retained]
    return ProportionalPlusLowRank(
        mass_factor=a, stiffness_factor=b, directions=directions, strength=np.asarray(strength[retained])
    )


def _find_factors(mass: Vector, damping: Vector, stiffness: Vector) -> tuple[float, float] | None:
    """Factors a and b with which most of the diagonal agrees.

    Each pair of widely separated entries gives an a and a b; the medians are those of the majority of entries, to which
    a and b are then fitted.
    """
    damped = np.flatnonzero(damping > 0)
    n = len(damped)
    if n < max(3, MAJORITY * len(damping)):
        return None
    # c = a m + b k, relative to c, in the order of k / m.
    order = damped[np.argsort(np.arctan2(stiffness[damped], mass[damped]), kind="stable")]
    rows = np.column_stack([mass, stiffness])[order] / damping[order, None]
    scale = np.abs(rows).max(axis=0)
    if not scale.all():
        return None
    rows /= scale
    half = n // 2
    first, second = rows[:half], rows[n - half :]
    determinant = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    apart = np.abs(determinant) > 1e-12 * np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
    if not apart.any():
        return None
    factor = np.median(
        np.column_stack([second[:, 1] - first[:, 1], first[:, 0] - second[:, 0]])[apart] / determinant[apart, None],
        axis=0,
    )
    agree = np.abs(rows @ factor - 1) < 1e-6
    # Two entries give an a and a b whatever the damping is.
    if agree.sum() < max(3, MAJORITY * len(damping)):
        return None
    factor = np.linalg.lstsq(rows[agree], np.ones(int(agree.sum())), rcond=None)[0] / scale
    return float(factor[0]), float(factor[1])
