r"""Second-order changes by jitter: smooth curvature, and kinks at which contacts begin to slip.

Repeats differ by a jitter x of preload and frequency with standard deviation s. A feature is

.. math:: f(x) = f + f' x + d(x), \qquad d_\pm = f(\pm \sqrt 3 s) - f \mp \sqrt 3 f' s .

By the three-point Gauss-Hermite rule, with a weight of 1/6 at each end, d has the mean (d_+ + d_-) / 6, which remains
in a mean over R repeats, and the mean over repeats has the variance (d_+^2 + d_-^2) / (6 R). Each end is a mode.

Near a resonance d is smooth, and the same jitter affects all states: one mode for all of them. At a kink d is as large
as the change by slip, and zero at neighbouring states: one mode for this state alone. d at half the jitter separates
the two: a quadratic and cubic d is extrapolated from there to the ends, and the remainder is the kink.
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

#: Nodes in standard deviations of the jitter, and weight of each end, of the Gauss-Hermite rule.
NODE, NODE_WEIGHT = sqrt(3.0), 1 / 6
#: Size of a remainder, over all features of a state together, below which it is negligible [standard deviations].
NEGLIGIBLE_REMAINDER = 1.0
#: A change is smooth if its quadratic and cubic parts explain it up to this share. Near a resonance, with
#: d = -x^2 / (1 + i x), the remainder is 0.5 if the jitter at an end is 0.9 of half the width of the resonance. At a
#: kink it is below 0.5 for one in six positions of the kink between the ends [-].
SMOOTH = 0.5


class JitterShift(NamedTuple):
    """Jitter of a single repeat by `NODE` standard deviations up and down, half of it, and its first-order change."""

    models: tuple[Model, Model]
    halves: tuple[Model, Model]
    change: Vector


class Remainder(NamedTuple):
    """Changes of features beyond first order at both ends of a shift, shape (m, 2): smooth part and kinks."""

    smooth: Modes
    kink: Modes


def compute_remainder(nominal: ModelFeatures, shift: JitterShift) -> Remainder:
    """Compute the changes beyond first order at both ends of a shift, d_+ and d_-, in two parts."""
    up, down = _compute_beyond_first_order(nominal, shift.models, shift.change)
    half_up, half_down = _compute_beyond_first_order(nominal, shift.halves, shift.change / 2)
    quadratic, cubic = 2 * (half_up + half_down), 4 * (half_up - half_down)
    whole = np.column_stack([up, down])
    rest = whole - np.column_stack([quadratic + cubic, quadratic - cubic])
    smooth = np.where(np.abs(rest) < SMOOTH * np.abs(whole), whole, 0.0)
    return Remainder(smooth=smooth, kink=whole - smooth)


def _compute_beyond_first_order(nominal: ModelFeatures, models: tuple[Model, Model], change: Vector) -> list[Vector]:
    return [np.nan_to_num(nominal.changes(model) - sign * change) for model, sign in zip(models, (1, -1), strict=True)]


def make_curvature_modes(
    smooth: Sequence[Modes], free: Bool[NDArray[np.bool_], " m"], n_repeat: float
) -> Float[NDArray[np.float64], "m q"]:
    """Modes of smooth parts at one standard deviation, separate for the jointed and the free test.

    They are significant near sharp resonances and at antiresonances.

    Parameters
    ----------
    smooth
        Smooth part of each independent cause, see `compute_remainder`.
    free
        Whether the contacts are absent, shape (m,).
    n_repeat
        Number of repeats in a mean [-].
    """
    ends = _compute_deviation(n_repeat) * np.column_stack(smooth)
    modes = np.column_stack([np.where(free[:, None], 0.0, ends), np.where(free[:, None], ends, 0.0)])
    return np.asarray(modes[:, modes.any(axis=0)])


def make_kink_modes(
    state: Int[NDArray[np.int64], " m"], kinks: Sequence[Modes], deviation: Vector, n_repeat: float
) -> Float[NDArray[np.float64], "m q"]:
    """Modes of kinks at one standard deviation, each of one state.

    Parameters
    ----------
    state
        Steady state of each feature, shape (m,).
    kinks
        Kinks of each independent cause, see `compute_remainder`.
    deviation
        Standard deviation of each feature by noise, shape (m,).
    n_repeat
        Number of repeats in a mean [-].
    """
    modes = []
    for kink in (column for cause in kinks for column in cause.T):
        mode = _compute_deviation(n_repeat) * kink
        size = np.bincount(state, (mode / deviation) ** 2)
        modes += [np.where(state == item, mode, 0.0) for item in np.flatnonzero(size > NEGLIGIBLE_REMAINDER**2)]
    return np.array(modes).reshape(-1, len(state)).T


def _compute_deviation(n_repeat: float) -> float:
    """Root of variance plus squared bias of a mean over repeats, for an end of unit size [-]."""
    return sqrt(NODE_WEIGHT / n_repeat + NODE_WEIGHT**2)
