r"""Readings as they would be at the force of their level and at the preloads of the model.

A controller misses the set point by a per cent or two, so that each point has its own force; and each set-up is pressed
a little more or less. With friction an amplitude grows with any power of the force: the first one while contacts stick,
a tenth of it where they slip, and many times that on the flank of a resonance that falls with the amplitude. The
limits L tell it. Readings x between those under the true force and preload become as far between those of the level,
and readings outside keep their distance:

.. math:: x' = L_l + t\,(L_u - L_l) + d, \qquad
          t = \frac{c - L'_l}{L'_u - L'_l}, \quad c = \min(\max(x, L'_l), L'_u), \quad d = x - c .

Limits L' are L and the changes by the force and by each preload.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.family.band import BETWEEN, LimitChange, PredictedBand
from correlation.family.family import Family

Values = Float[NDArray[np.float64], " p"]
Both = Float[NDArray[np.float64], "2 p"]
#: A test and its repeat.
SetUp = tuple[str, int]


class _Ends(NamedTuple):
    """Changes of the limits at each reading with less and with more of a force or a preload."""

    span: float
    less: Both
    more: Both


class FamilyCorrection:
    """Corrects a family for one force of each reading and for any preloads; the limits at its readings are read once.

    Parameters
    ----------
    family, band
        Of the same sensor, harmonic and level.
    """

    def __init__(self, family: Family, band: PredictedBand) -> None:
        self._family, self._band = family, band

    @cached_property
    def _level(self) -> Both:
        return self._band.at(self._family.frequency).value

    @cached_property
    def _by_force(self) -> _Ends | None:
        return None if self._band.by_force is None else self._ends(self._band.by_force)

    @cached_property
    def _by_preload(self) -> list[_Ends]:
        return [self._ends(by) for by in self._band.by_preload]

    def _ends(self, by: LimitChange) -> _Ends:
        less, more = (replace(self._band, value=value).at(self._family.frequency).value for value in by.value)
        return _Ends(by.span, less - self._level, more - self._level)

    def corrected(self, preloads: Mapping[SetUp, Values] | None = None, force_noise: float = 0.0) -> Family:
        """The family at the force of its level and the preloads of the model, as far as limits follow both.

        Parameters
        ----------
        preloads
            Natural logarithm of each preload over that of the model, by set-up, shape (g,) [-]; none differs by
            default.
        force_noise
            Standard deviation of a measured force, relative [-]. What it does to an amplitude over its force is part of
            the scatter of these; here it counts as far as limits follow the force.
        """
        family, unknown = self._family, np.zeros(len(self._band.by_preload))
        pressed = np.array([(preloads or {}).get(key, unknown) for key in family.set_ups])[family.curve_number]
        if self._band.by_force is None and not pressed.any():
            return family
        level = self._level
        limit, variance, scaled = level, np.zeros(level.shape), family.scaled
        if self._by_force is not None:
            change, deviation, rate = self._follow(self._by_force, np.log(family.ratio))
            limit, variance = limit + change, variance + deviation**2 + (force_noise * rate) ** 2
            scaled = np.zeros(family.n_point)
        for ends, own in zip(self._by_preload, pressed.T, strict=True):
            change, deviation, _ = self._follow(ends, own)
            limit, variance = limit + change, variance + deviation**2
        # Limits of no width may cross.
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

    def _follow(self, ends: _Ends, log_ratio: Values) -> tuple[Both, Both, Both]:
        """Change of the limits at each reading, its standard deviation, and its rate with the logarithm of the ratio.

        Limits follow the parabola through those at three ratios, no further than the ends of each side; what it differs
        by from straight lines counts as it does between two frequencies. Beyond these ratios, and where a state is
        missing, nothing is known: limits are uncertain by as much as the ratio differs.
        """
        span, less, more = ends
        step = np.clip(log_ratio / span, -1.0, 1.0)
        end = np.where(step > 0, more, less)
        straight = np.abs(step) * end
        parabola = (more - less) / 2 * step + (more + less) / 2 * step**2
        change = np.clip(parabola, np.minimum(end, 0.0), np.maximum(end, 0.0))
        rate = ((more - less) / 2 + (more + less) * step) / span
        known = np.isfinite(parabola)
        beyond = np.where(known, np.abs(log_ratio - span * step), np.abs(log_ratio)) * np.abs(self._level)
        deviation = np.hypot(BETWEEN * np.where(known, change - straight, 0.0), beyond)
        return np.where(known, change, 0.0), deviation, np.where(known, rate, 0.0)


def correct_family(
    family: Family, band: PredictedBand, preloads: Mapping[SetUp, Values] | None = None, force_noise: float = 0.0
) -> Family:
    """A family corrected once; see `FamilyCorrection`."""
    return FamilyCorrection(family, band).corrected(preloads, force_noise)
