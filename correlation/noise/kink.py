r"""Kinks: states at which contacts begin to slip, where a response is not linear in the differences between repeats.

Repeats differ by a jitter x of preload and frequency, of standard deviation s. The mean is that of

.. math:: f(x) = f + f' x + d(x), \qquad d_\pm = f(\pm \sqrt 3 s) - f \mp \sqrt 3 f' s .

Away from a kink d is zero. At one it is as large as the change by slip, and zero at the states beside it.
By Gauss and Hermite's rule of three points, where each end counts for a sixth, d has the mean (d_+ + d_-) / 6, which
stays in a mean over R repeats, and there the variance (d_+^2 + d_-^2) / 6 R: each end is a mode of that state alone.
"""

from collections.abc import Sequence
from math import sqrt
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.typing import NDArray

from correlation.model import Model
from correlation.noise.nuisance import ModelFeatures

Vector = Float[NDArray[np.float64], " m"]

#: Standard deviations at which a jitter is tried, and the weight of either end, by Gauss and Hermite's rule.
REACH, WEIGHT = sqrt(3.0), 1 / 6
#: Standard deviations, of all numbers of a state together, below which a remainder does not matter.
SEEN = 1.0


class Shift(NamedTuple):
    """Jitter of `REACH` standard deviations of a single repeat, up and down, and its first-order change."""

    models: tuple[Model, Model]
    change: Vector


def compute_remainders(nominal: ModelFeatures, shift: Shift) -> Float[NDArray[np.float64], "m 2"]:
    """What the features change beyond the first order at either end of a shift, d_+ and d_-, shape (m, 2)."""
    ends = [nominal.changes(model) for model in shift.models]
    return np.nan_to_num(np.column_stack([end - sign * shift.change for end, sign in zip(ends, (1, -1), strict=True)]))


def make_curvature_modes(
    remainder: Float[NDArray[np.float64], "m 2"], free: Bool[NDArray[np.bool_], " m"]
) -> Float[NDArray[np.float64], "m 2"]:
    """Change of a mean over repeats beyond the first order, of the jointed and of the free structure, shape (m, 2).

    It matters at antiresonances, and is as uncertain as a variance from a few repeats.

    Parameters
    ----------
    remainder
        Of frequencies, see `compute_remainders`.
    free
        Whether the contacts are absent, shape (m,).
    """
    bent = WEIGHT * remainder.sum(axis=1)
    return np.column_stack([np.where(free, 0.0, bent), np.where(free, bent, 0.0)])


def make_kink_modes(
    state: Int[NDArray[np.int64], " m"],
    remainders: Sequence[Float[NDArray[np.float64], "m 2"]],
    deviation: Vector,
    n_repeat: float,
) -> Float[NDArray[np.float64], "m q"]:
    """Modes at one standard deviation, each of one state.

    Parameters
    ----------
    state
        Steady state of each number, shape (m,).
    remainders
        Of each independent cause, see `compute_remainders`.
    deviation
        Standard deviation of each number by noise, shape (m,).
    n_repeat
        Repeats in a mean [-].
    """
    modes = []
    for remainder in (column for cause in remainders for column in cause.T):
        mode = sqrt(WEIGHT / n_repeat + WEIGHT**2) * remainder
        size = np.bincount(state, (mode / deviation) ** 2)
        modes += [np.where(state == each, mode, 0.0) for each in np.flatnonzero(size > SEEN**2)]
    return np.array(modes).reshape(-1, len(state)).T
