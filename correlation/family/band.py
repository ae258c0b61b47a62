"""A predicted band over frequency: limits at some frequencies, what they are between them, and how sure they are."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator

from geometry.read_only_array import freeze_fields

Values = Float[NDArray[np.float64], " n"]
Both = Float[NDArray[np.float64], "2 f"]

#: Share of the difference between a smooth curve and straight lines through the limits that counts as one standard
#: deviation of what is between them.
BETWEEN = 0.25
#: Standard deviations of the frequency at which a band is looked at to see what such an error does.
LOOK = 2.0
#: Frequencies of one point as files round them.
SAME_FREQUENCY = 1e-5


class BandAt(NamedTuple):
    """Limits at n frequencies and their standard deviations, each lower then upper, shape (2, n)."""

    value: Float[NDArray[np.float64], "2 n"]
    deviation: Float[NDArray[np.float64], "2 n"]


class LimitChange(NamedTuple):
    """Limits where a force or a preload is another one."""

    log_ratio: Values
    """Natural logarithms of the ratios to it, on either side of 0 and rising, shape (k,) [-]."""
    value: Float[NDArray[np.float64], "k 2 f"]
    """Limits at these, shape (k, 2, f); NaN where no state was found."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PredictedBand:
    """Limits of one sensor and harmonic at one level; arrays of both limits have the lower one first.

    Parameters
    ----------
    frequency
        Rising, shape (f,) [Hz].
    value
        Limits, shape (2, f) [SI unit of the sensor]; NaN where none was found.
    deviation
        Standard deviation of the limits by the numerical error of the model, shape (2, f) [unit].
    jump
        Whether a limit lies on another branch of optima than a neighbour, shape (2, f).
    shift
        Standard deviation of their frequency by it, one for all of them and relative, which is no part of that [-].
    by_force
        Limits at other forces, amplitudes over the factor of the force; None where they are not known.
    by_preload
        Limits at other preloads, for each of the model's groups of preloads, or none.
    """

    frequency: Float[NDArray[np.float64], " f"]
    value: Both
    deviation: Both
    jump: Bool[NDArray[np.bool_], "2 f"]
    shift: float = 0.0
    by_force: LimitChange | None = None
    by_preload: tuple[LimitChange, ...] = ()

    def __post_init__(self) -> None:
        freeze_fields(self, "frequency", "value", "deviation")
        freeze_fields(self, "jump", kind=np.bool_)

    def at(self, frequency: Values, shift: float = 0.0, offset: Values | float = 0.0) -> BandAt:
        """Limits at other frequencies, on a smooth curve through those of the band; next to a jump the outer of both.

        The standard deviation has the numerical error, what an error of the frequency does, and what the curve between
        two frequencies may miss.

        Parameters
        ----------
        frequency
            Shape (n,) [Hz]; beyond the ends of the band limits are NaN.
        shift
            Standard deviation of the frequency, relative [-].
        offset
            Known error of the frequencies, one for all or shape (n,), relative [-]: limits are those at f (1 + offset).
        """
        inside = is_covered(self.frequency, frequency)
        frequency = frequency * (1 + offset)
        limits, between = self._limits(frequency)
        looks = (frequency * (1 + sign * LOOK * shift) for sign in ((1, -1) if shift else ()))
        moved = [np.nan_to_num(np.abs(self._limits(item)[0] - limits)) for item in looks]
        by_shift = np.max(moved, axis=0) / LOOK if moved else 0.0
        value = np.where(inside, limits, np.nan)
        return BandAt(value, np.sqrt(by_shift**2 + self.interpolate_error(frequency) ** 2 + between**2))

    def interpolate_error(self, frequency: Values) -> Float[NDArray[np.float64], "2 n"]:
        """Standard deviations of the limits by the numerical error of the model at other frequencies, shape (2, n)."""
        return np.array([np.interp(frequency, self.frequency, np.nan_to_num(own)) for own in self.deviation])

    @cached_property
    def _curves(self) -> tuple["_Curve", "_Curve"]:
        """Both limits through their known points: bands are asked hundreds of times for the offsets of set-ups."""
        return _Curve.from_points(self.frequency, self.value[0], self.jump[0]), _Curve.from_points(
            self.frequency, self.value[1], self.jump[1]
        )

    def _limits(self, frequency: Values) -> tuple[Both, Both]:
        """Both limits and the interpolation error.

        A smooth curve overshoots beside a kink, as where a contact begins to stick throughout and the band opens. Where
        smooth limits cross by more than they may miss one of them does, and both are straight.
        """
        smooth, straight, between = np.moveaxis(np.array([self._limit(side, frequency) for side in (0, 1)]), 1, 0)
        return np.where(smooth[0] - smooth[1] > between.sum(axis=0), straight, smooth), between

    def _limit(self, side: int, frequency: Values) -> tuple[Values, Values, Values]:
        """One limit, smooth and straight, on its tangent beyond the ends, and what the interpolation may miss."""
        known, f, y, jump, curve, ends = self._curves[side]
        if len(f) < 2:
            alone = np.full(len(frequency), y[0] if len(y) else np.nan)
            return alone, alone, np.zeros(len(frequency))
        inner = np.clip(frequency, f[0], f[-1])
        number = np.clip(np.searchsorted(f, inner, side="right") - 1, 0, len(f) - 2)
        straight = np.interp(inner, f, y)
        smooth = straight if curve is None else curve(inner)
        at_node = np.isclose(inner, f[number], rtol=SAME_FREQUENCY, atol=0.0) | np.isclose(
            inner, f[number + 1], rtol=SAME_FREQUENCY
        )
        jumps = (jump[number] | jump[number + 1]) & ~at_node
        outer = np.maximum(y[number], y[number + 1]) if side else np.minimum(y[number], y[number + 1])
        beyond = np.where(frequency > inner, ends[1], ends[0]) * (frequency - inner)
        # Where a limit is missing beside the interval nothing is known within.
        left, right = (np.searchsorted(self.frequency, f[number + step]) for step in (0, 1))
        gap = (right - left > 1) & ~at_node
        # The same half-way from the outermost limit to the ends of the band, where limits are missing there.
        nearest = np.abs(self.frequency[:, None] - frequency).argmin(axis=0)
        gap |= ((frequency < f[0]) | (frequency > f[-1])) & ~known[nearest]
        curved, line = (np.where(gap, np.nan, np.where(jumps, outer, item) + beyond) for item in (smooth, straight))
        return curved, line, np.where(jumps | gap, 0.0, BETWEEN * np.abs(smooth - straight))


def is_covered(known: Values, frequency: Values) -> Bool[NDArray[np.bool_], " n"]:
    """Whether frequencies lie between the ends of those of a band, which rise, shape (n,)."""
    return np.asarray((frequency >= (1 - SAME_FREQUENCY) * known[0]) & (frequency <= (1 + SAME_FREQUENCY) * known[-1]))


class _Curve(NamedTuple):
    """Interpolant of one limit."""

    known: Bool[NDArray[np.bool_], " f"]
    frequency: Values
    value: Values
    jump: Bool[NDArray[np.bool_], " n"]
    """Of the known points."""
    smooth: Akima1DInterpolator | None
    """None where two points or fewer are known."""
    ends: Values
    """Slopes at both ends, shape (2,); NaN with one point or none."""

    @classmethod
    def from_points(cls, frequency: Values, value: Values, jump: Bool[NDArray[np.bool_], " f"]) -> "_Curve":
        """The curve through the points that are known."""
        known = np.isfinite(value)
        f, y = frequency[known], value[known]
        smooth = Akima1DInterpolator(f, y) if len(f) > 2 else None
        ends = np.full(2, np.nan)
        if smooth is not None:
            ends = smooth.derivative()(f[[0, -1]])
        elif len(f) == 2:
            ends = np.diff(y)[[0, -1]] / np.diff(f)[[0, -1]]
        return cls(known, f, y, jump[known], smooth, ends)
