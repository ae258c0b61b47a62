r"""Changes by jitter beyond the first order: smooth curvature, and kinks at which contacts begin to slip.

Repeats differ by a jitter x of preload and frequency, of standard deviation s. The mean is that of

.. math:: f(x) = f + f' x + d(x), \qquad d_\pm = f(\pm \sqrt 3 s) - f \mp \sqrt 3 f' s .

By Gauss and Hermite's rule of three points, where each end counts for a sixth, d has the mean (d_+ + d_-) / 6, which
stays in a mean over R repeats, and there the variance (d_+^2 + d_-^2) / 6 R. So each end is a mode.

Next to a resonance d is smooth, and the same jitter bends all states: one mode for all of them. At a kink d is as large
as the change by slip, and zero at the states beside it: a mode of that state alone. The parts are told apart by d at
half the jitter: if it is quadratic and cubic, these two tell it at the ends; what they do not tell is the kink.
"""

from collections.abc import Sequence
from math import sqrt
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.typing import NDArray

from correlation.model import Model
from correlation.noise.nuisance import ModelFeatures, Modes

Vector = Float[NDArray[np.float64], " m"]

#: Standard deviations at which a jitter is tried, and the weight of either end, by Gauss and Hermite's rule.
NODE, NODE_WEIGHT = sqrt(3.0), 1 / 6
#: Standard deviations, of all numbers of a state together, below which a remainder does not matter.
NEGLIGIBLE_REMAINDER = 1.0
#: A change is smooth if its quadratic and cubic parts tell it but for this share. Near a resonance the share is 0.5
#: where the jitter at an end is 0.9 of half the resonance's width, d = -x^2 / (1 + i x); at a kink it is less in one of
#: six places of the kink between the ends [-].
SMOOTH = 0.5


class JitterShift(NamedTuple):
    """Jitter of `NODE` standard deviations of a single repeat, up and down, half of it, and its first-order change."""

    models: tuple[Model, Model]
    halves: tuple[Model, Model]
    change: Vector


class Remainder(NamedTuple):
    """Changes of features beyond the first order at either end of a shift, shape (m, 2): smooth part and kinks."""

    smooth: Modes
    kink: Modes


def compute_remainder(nominal: ModelFeatures, shift: JitterShift) -> Remainder:
    """Compute the changes beyond the first order at either end of a shift: d_+ and d_- in two parts."""
    up, down = _beyond_first_order(nominal, shift.models, shift.change)
    half_up, half_down = _beyond_first_order(nominal, shift.halves, shift.change / 2)
    quadratic, cubic = 2 * (half_up + half_down), 4 * (half_up - half_down)
    whole = np.column_stack([up, down])
    rest = whole - np.column_stack([quadratic + cubic, quadratic - cubic])
    smooth = np.where(np.abs(rest) < SMOOTH * np.abs(whole), whole, 0.0)
    return Remainder(smooth=smooth, kink=whole - smooth)


def _beyond_first_order(nominal: ModelFeatures, models: tuple[Model, Model], change: Vector) -> list[Vector]:
    return [np.nan_to_num(nominal.changes(model) - sign * change) for model, sign in zip(models, (1, -1), strict=True)]


def make_curvature_modes(
    smooth: Sequence[Modes], free: Bool[NDArray[np.bool_], " m"], n_repeat: float
) -> Float[NDArray[np.float64], "m q"]:
    """Modes of smooth parts at one standard deviation, of the jointed and of the free structure, which are two tests.

    They matter next to sharp resonances, and at antiresonances.

    Parameters
    ----------
    smooth
        Smooth part of each independent cause, see `compute_remainder`.
    free
        Whether the contacts are absent, shape (m,).
    n_repeat
        Repeats in a mean [-].
    """
    ends = _deviation(n_repeat) * np.column_stack(smooth)
    modes = np.column_stack([np.where(free[:, None], 0.0, ends), np.where(free[:, None], ends, 0.0)])
    return np.asarray(modes[:, modes.any(axis=0)])


def make_kink_modes(
    state: Int[NDArray[np.int64], " m"], kinks: Sequence[Modes], deviation: Vector, n_repeat: float
) -> Float[NDArray[np.float64], "m q"]:
    """Modes of kinks at one standard deviation, each of one state.

    Parameters
    ----------
    state
        Steady state of each number, shape (m,).
    kinks
        Kinks of each independent cause, see `compute_remainder`.
    deviation
        Standard deviation of each number by noise, shape (m,).
    n_repeat
        Repeats in a mean [-].
    """
    modes = []
    for kink in (column for cause in kinks for column in cause.T):
        mode = _deviation(n_repeat) * kink
        size = np.bincount(state, (mode / deviation) ** 2)
        modes += [np.where(state == item, mode, 0.0) for item in np.flatnonzero(size > NEGLIGIBLE_REMAINDER**2)]
    return np.array(modes).reshape(-1, len(state)).T


def _deviation(n_repeat: float) -> float:
    """Standard deviation of a mean over repeats, and its bias, by an end of unit size [-]."""
    return sqrt(NODE_WEIGHT / n_repeat + NODE_WEIGHT**2)
