r"""Correction of readings to the force of their level and to the preloads of the model.

A controller misses the set point by one or two per cent, so that each point has its own force, and the preloads vary
between set-ups. With friction, amplitudes follow the force with different powers: 1 while contacts stick, a tenth in
slip, and several on the flank of a softening resonance. The power follows from the limits L. A reading x inside the
limits for the true force and preload keeps its relative position between the limits of the level; a reading outside
keeps its distance:

.. math:: x' = L_l + t\,(L_u - L_l) + d, \qquad
          t = \frac{c - L'_l}{L'_u - L'_l}, \quad c = \min(\max(x, L'_l), L'_u), \quad d = x - c .

The limits L' are L plus the changes by the force and by each preload.

References
----------
F. N. Fritsch and J. Butland, A method for constructing local monotone piecewise cubic interpolants, SIAM Journal on
Scientific and Statistical Computing 5 (1984), for the interpolation of limits over force or preload.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from correlation.family.band import BETWEEN, LimitChange, PredictedBand
from correlation.family.family import Family

Values = Float[NDArray[np.float64], " p"]
Both = Float[NDArray[np.float64], "2 p"]
#: A test and its repeat.
SetUp = tuple[str, int]


class _LimitInterpolant:
    """Changes of both limits at p readings with a force or a preload.

    Between the ratios with known limits they follow a monotone interpolant (Fritsch and Butland, PCHIP in SciPy); its
    difference from a straight line gives the interpolation error, as between two frequencies. Beyond these ratios, and
    where a state is missing, limits keep their last known value, with an uncertainty equal to the further change of the
    ratio.
    """

    def __init__(self, log_ratio: Values, change: Float[NDArray[np.float64], "k 2 p"], level: Both) -> None:
        self._level = level
        middle = int(np.searchsorted(log_ratio, 0.0))
        self._ratio = np.insert(log_ratio, middle, 0.0)
        table = np.insert(change, middle, 0.0, axis=0)
        known = np.isfinite(table)
        first = middle + 1 - np.logical_and.accumulate(known[middle::-1]).sum(axis=0)
        last = middle - 1 + np.logical_and.accumulate(known[middle:]).sum(axis=0)
        self._first, self._last = self._ratio[first], self._ratio[last]
        nearest = np.clip(np.arange(len(table))[:, None, None], first, last)
        self._change = np.take_along_axis(table, nearest, axis=0)
        self._slope, self._rate = np.zeros(table.shape), np.zeros(table.shape)
        # Missing limits must not affect the slopes of known ones.
        for low, high in np.unique(np.stack([first.ravel(), last.ravel()]), axis=1).T.tolist():
            own, here = slice(low, high + 1), (first == low) & (last == high)
            if high > low:
                x, y = self._ratio[own], self._change[own][:, here]
                self._slope[own, here] = PchipInterpolator(x, y).derivative()(x)
                # PCHIP has zero slope at a kink such as the onset of slip, where limits follow an error to one side.
                self._rate[own, here] = np.gradient(y, x, axis=0)

    def at(self, log_ratio: Values) -> tuple[Both, Both, Both]:
        """Change of the limits at each reading, its standard deviation, and its derivative by the log ratio."""
        inside = np.clip(log_ratio, self._first, self._last)
        left = np.clip(np.searchsorted(self._ratio, inside, side="right") - 1, 0, len(self._ratio) - 2)
        (y0, y1), (s0, s1), (r0, r1) = (
            [np.take_along_axis(item, (left + step)[None], axis=0)[0] for step in (0, 1)]
            for item in (self._change, self._slope, self._rate)
        )
        width = self._ratio[left + 1] - self._ratio[left]
        t = (inside - self._ratio[left]) / width
        # Hermite cubic, less the straight line.
        secant = (y1 - y0) / width
        bend = width * t * (1 - t) * ((s0 - secant) * (1 - t) - (s1 - secant) * t)
        deviation = np.hypot(BETWEEN * bend, np.abs(log_ratio - inside) * np.abs(self._level))
        return y0 + (y1 - y0) * t + bend, deviation, r0 + (r1 - r0) * t


class FamilyCorrection:
    """Corrects a family for the force of each reading and for preloads; the limits at its readings are computed once.

    Parameters
    ----------
    family, band
        Family and band of the same sensor, harmonic and level.
    """

    def __init__(self, family: Family, band: PredictedBand) -> None:
        self._family, self._band = family, band

    @cached_property
    def _level(self) -> Both:
        return self._band.at(self._family.frequency).value

    @cached_property
    def _by_force(self) -> _LimitInterpolant | None:
        return None if self._band.by_force is None else self._follow(self._band.by_force)

    @cached_property
    def _by_preload(self) -> list[_LimitInterpolant]:
        return [self._follow(by) for by in self._band.by_preload]

    def _follow(self, by: LimitChange) -> _LimitInterpolant:
        others = [replace(self._band, value=value).at(self._family.frequency).value for value in by.value]
        return _LimitInterpolant(by.log_ratio, np.array(others) - self._level, self._level)

    def corrected(self, preloads: Mapping[SetUp, Values] | None = None, force_noise: float = 0.0) -> Family:
        """The family corrected to the force of its level and the preloads of the model, where the limits allow it.

        Parameters
        ----------
        preloads
            Natural logarithm of each preload over that of the model, by set-up, shape (g,) [-]; 0 by default.
        force_noise
            Relative standard deviation of a measured force [-]. Its effect on amplitudes over the force is part of
            their scatter; here it is weighted by the rate of the limits with the force.
        """
        family, unknown = self._family, np.zeros(len(self._band.by_preload))
        pressed = np.array([(preloads or {}).get(key, unknown) for key in family.set_ups])[family.curve_number]
        if self._band.by_force is None and not pressed.any():
            return family
        level = self._level
        limit, variance, scaled = level, np.zeros(level.shape), family.scaled
        if self._by_force is not None:
            change, deviation, rate = self._by_force.at(np.log(family.ratio))
            limit, variance = limit + change, variance + deviation**2 + (force_noise * rate) ** 2
            scaled = np.zeros(family.n_point)
        for by, own in zip(self._by_preload, pressed.T, strict=True):
            change, deviation, _ = by.at(own)
            limit, variance = limit + change, variance + deviation**2
        # Limits of zero width may cross.
        lower, upper = np.sort(limit, axis=0)
        inside = np.clip(family.value, lower, upper)
        share = (inside - lower) / np.maximum(upper - lower, np.finfo(float).tiny)
        value = level[0] + share * (level[1] - level[0]) + family.value - inside
        has_limits = np.isfinite(value)
        value, scaled = np.where(has_limits, value, family.value), np.where(has_limits, scaled, family.scaled)
        uncertain = np.sqrt(np.nan_to_num(variance))
        rows = [np.flatnonzero(family.curve_number == number) for number in range(len(family.curves))]
        return replace(
            family,
            curves=tuple(
                replace(curve, value=value[own], ratio=1.0, scaled=scaled[own], uncertain=uncertain[:, own])
                for curve, own in zip(family.curves, rows, strict=True)
            ),
        )


def correct_family(
    family: Family, band: PredictedBand, preloads: Mapping[SetUp, Values] | None = None, force_noise: float = 0.0
) -> Family:
    """A family corrected once; see `FamilyCorrection`."""
    return FamilyCorrection(family, band).corrected(preloads, force_noise)
