"""Frequencies that a search adds to the requested ones.

A state at one frequency can often be reached only from another frequency: branches that begin at the resonance of a
slipping contact end far from it, and no search at their end finds them. So limits are also sought at some frequencies
between the requested ones and the next resonance. Resonances lie between those of the structure without its joints and
those with all joints stuck and closed.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Int

from fe.dense_modes import compute_dense_modes
from hbsolve.balance import HarmonicBalance
from reduction.array_type import Real, Whole

#: Lowest and highest frequency searched, relative to the lowest and the highest requested one [-].
BELOW, ABOVE = 0.75, 1.33
#: The search extends beyond a resonance by this fraction of it, so that a branch is reached from both sides [-].
PASSED_SHARE = 0.03


class SearchedFrequencies(NamedTuple):
    """Frequencies at which limits are sought."""

    angular_frequency: Real
    """Omega, ascending, shape (f,) [rad/s]."""
    requested: Int[Whole, " a"]
    """Indices of the requested frequencies, shape (a,)."""


def add_auxiliary_frequencies(balance: HarmonicBalance, angular_frequency: Real, fewest: int) -> SearchedFrequencies:
    """Requested frequencies, ascending [rad/s], with evenly spaced ones about them up to `fewest` in total."""
    missing = fewest - len(angular_frequency)
    low, high = _window(balance, angular_frequency)
    if missing <= 0 or high <= low:
        return SearchedFrequencies(angular_frequency, np.arange(len(angular_frequency)))
    grid = np.linspace(low, high, fewest)
    for requested in angular_frequency:
        grid = np.delete(grid, np.abs(grid - requested).argmin())
    merged = np.sort(np.concatenate([angular_frequency, grid]))
    return SearchedFrequencies(merged, np.searchsorted(merged, angular_frequency))


def _window(balance: HarmonicBalance, angular_frequency: Real) -> tuple[float, float]:
    """Interval that covers the requested frequencies and the resonances next to them [rad/s]."""
    first, last = float(angular_frequency[0]), float(angular_frequency[-1])
    free = np.sqrt(compute_dense_modes(balance.system.mass, balance.system.stiffness).lambda_.clip(min=0))
    stuck = np.sqrt(balance.structure.stuck.modes.lambda_.clip(min=0))
    driven = np.flatnonzero(balance.system.dynamic.any(axis=1))
    harmonic = max(int(driven[0]), 1) if len(driven) else 1
    intervals = np.sort(np.stack([free, stuck]), axis=0) / harmonic
    ends = [first, last]
    for requested in (first, last):
        away = np.maximum(np.maximum(intervals[0] - requested, requested - intervals[1]), 0.0)
        near = intervals[:, away.argmin()]
        ends += [(1 - PASSED_SHARE) * near[0], (1 + PASSED_SHARE) * near[1]]
    return max(min(ends), BELOW * first), min(max(ends), ABOVE * last)
