"""A predicted band over frequency: limits at some frequencies, their interpolation, and their uncertainty."""

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

#: Standard deviation of the interpolation between limits, as a share of the difference between a smooth curve and
#: straight lines [-].
BETWEEN = 0.25
#: Frequency shift for the effect of a frequency error on a band [standard deviations].
LOOK = 2.0
#: Relative difference of equal frequencies due to rounding in files [-].
SAME_FREQUENCY = 1e-5


class BandAt(NamedTuple):
    """Limits at n frequencies and their standard deviations, each lower then upper, shape (2, n)."""

    value: Float[NDArray[np.float64], "2 n"]
    deviation: Float[NDArray[np.float64], "2 n"]


class LimitChange(NamedTuple):
    """Limits at other values of a force or a preload."""

    log_ratio: Values
    """Natural logarithms of the ratios to the nominal value, on either side of 0, ascending, shape (k,) [-]."""
    value: Float[NDArray[np.float64], "k 2 f"]
    """Limits at these ratios, shape (k, 2, f); NaN where no state was found."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PredictedBand:
    """Limits of one sensor and harmonic at one level; arrays of both limits have the lower one first.

    Parameters
    ----------
    frequency
        Frequencies, ascending, shape (f,) [Hz].
    value
        Limits, shape (2, f) [SI unit of the sensor]; NaN where none was found.
    deviation
        Standard deviation of the limits by the numerical error of the model, shape (2, f) [unit].
    jump
        Whether a limit lies on another branch of optima than a neighbour, shape (2, f).
    shift
        Standard deviation of a common relative frequency error by the numerical error, not included in `deviation` [-].
    by_force
        Limits at other forces, amplitudes over the factor of the force; None if unknown.
    by_preload
        Limits at other preloads, for each of the model's groups of preloads; empty if unknown.
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
        """Limits at other frequencies, interpolated by a smooth curve; next to a jump the outer of both neighbours.

        The standard deviation contains the numerical error, the effect of a frequency error, and the interpolation
        error.

        Parameters
        ----------
        frequency
            Frequencies, shape (n,) [Hz]; beyond the ends of the band limits are NaN.
        shift
            Relative standard deviation of the frequency [-].
        offset
            Known relative error of the frequencies, one for all or shape (n,) [-]; limits are taken at f (1 + offset).
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
        """Interpolants of both limits, cached: the estimate of the offsets of set-ups evaluates them often."""
        return _Curve.from_points(self.frequency, self.value[0], self.jump[0]), _Curve.from_points(
            self.frequency, self.value[1], self.jump[1]
        )

    def _limits(self, frequency: Values) -> tuple[Both, Both]:
        """Both limits and the interpolation error.

        A smooth curve overshoots near a kink, for example where a contact begins to stick throughout and the band
        opens. Where smooth limits cross by more than their interpolation error, linear interpolation is used for both.
        """
        smooth, straight, between = np.moveaxis(np.array([self._limit(side, frequency) for side in (0, 1)]), 1, 0)
        return np.where(smooth[0] - smooth[1] > between.sum(axis=0), straight, smooth), between

    def _limit(self, side: int, frequency: Values) -> tuple[Values, Values, Values]:
        """One limit by smooth and by linear interpolation, on its tangent beyond the ends, and interpolation error."""
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
        # An interval that contains a missing limit has no value.
        left, right = (np.searchsorted(self.frequency, f[number + step]) for step in (0, 1))
        gap = (right - left > 1) & ~at_node
        # Neither have frequencies beyond the outermost known limit that are nearer to a missing one.
        nearest = np.abs(self.frequency[:, None] - frequency).argmin(axis=0)
        gap |= ((frequency < f[0]) | (frequency > f[-1])) & ~known[nearest]
        curved, line = (np.where(gap, np.nan, np.where(jumps, outer, item) + beyond) for item in (smooth, straight))
        return curved, line, np.where(jumps | gap, 0.0, BETWEEN * np.abs(smooth - straight))


def is_covered(known: Values, frequency: Values) -> Bool[NDArray[np.bool_], " n"]:
    """Whether frequencies lie within the range of those of a band, which are ascending, shape (n,)."""
    return np.asarray((frequency >= (1 - SAME_FREQUENCY) * known[0]) & (frequency <= (1 + SAME_FREQUENCY) * known[-1]))


class _Curve(NamedTuple):
    """Interpolant of one limit."""

    known: Bool[NDArray[np.bool_], " f"]
    frequency: Values
    value: Values
    jump: Bool[NDArray[np.bool_], " n"]
    """Jump flags of the known points."""
    smooth: Akima1DInterpolator | None
    """None with two or fewer known points."""
    ends: Values
    """Slopes at both ends, shape (2,); NaN with one or no known point."""

    @classmethod
    def from_points(cls, frequency: Values, value: Values, jump: Bool[NDArray[np.bool_], " f"]) -> "_Curve":
        """The curve through the known points."""
        known = np.isfinite(value)
        f, y = frequency[known], value[known]
        smooth = Akima1DInterpolator(f, y) if len(f) > 2 else None
        ends = np.full(2, np.nan)
        if smooth is not None:
            ends = smooth.derivative()(f[[0, -1]])
        elif len(f) == 2:
            ends = np.diff(y)[[0, -1]] / np.diff(f)[[0, -1]]
        return cls(known, f, y, jump[known], smooth, ends)
