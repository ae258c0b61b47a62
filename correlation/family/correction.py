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

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.family.band import BETWEEN, LimitChange, PredictedBand
from correlation.family.family import Family

Values = Float[NDArray[np.float64], " p"]
Both = Float[NDArray[np.float64], "2 p"]
#: A test and its repeat.
SetUp = tuple[str, int]


def correct_family(
    family: Family, band: PredictedBand, preloads: Mapping[SetUp, Values] | None = None, force_noise: float = 0.0
) -> Family:
    """The family at the force of its level and the preloads of the model, as far as limits tell how they follow both.

    Where the limits at another force are not known, readings stay as they are, as uncertain as they were scaled.

    Parameters
    ----------
    family, band
        Of the same sensor, harmonic and level.
    preloads
        Natural logarithm of each preload over that of the model, by set-up, shape (g,) [-]; none differs by default.
    force_noise
        Standard deviation of a measured force, relative [-]. What it does to an amplitude over its force is part of the
        scatter of these; here it counts as far as limits follow the force.
    """
    pressed = np.array([preloads[key] if preloads else [] for key in family.set_ups])[family.curve_number]
    if band.by_force is None and not pressed.any():
        return family
    level = band.at(family.frequency).value
    limit, off, scaled = level, np.zeros(level.shape), family.scaled
    if band.by_force is not None:
        log_ratio, span = np.log(family.ratio), band.by_force.span
        change, uncertain, rate = _follow(band, band.by_force, family, level, log_ratio)
        limit, off = limit + change, np.hypot(uncertain, force_noise * rate)
        scaled = np.maximum(np.abs(log_ratio) - span, 0.0)
    for by, own in zip(band.by_preload, pressed.T, strict=False):
        change, uncertain, _ = _follow(band, by, family, level, own)
        limit, off = limit + np.nan_to_num(change), np.hypot(off, np.nan_to_num(uncertain))
    # Limits of no width may cross.
    lower, upper = np.sort(limit, axis=0)
    inside = np.clip(family.value, lower, upper)
    share = (inside - lower) / np.maximum(upper - lower, np.finfo(float).tiny)
    corrected = level[0] + share * (level[1] - level[0]) + family.value - inside
    size = np.maximum(np.abs(level), np.finfo(float).tiny)
    told = np.isfinite(corrected)
    columns = np.where(told, corrected, family.value), np.where(told, (off / size).max(axis=0) + scaled, family.scaled)
    ends = np.cumsum([len(curve.frequency) for curve in family.curves])[:-1]
    parts = zip(family.curves, *(np.split(column, ends) for column in columns), strict=True)
    return replace(family, curves=tuple(replace(curve, value=new, scaled=own) for curve, new, own in parts))


def _follow(
    band: PredictedBand, by: LimitChange, family: Family, level: Both, log_ratio: Values
) -> tuple[Both, Both, Both]:
    """Change of the limits at each reading, what it is uncertain by, and its rate with the logarithm of the ratio.

    Limits follow the parabola through those at three ratios, as far as these go; what it differs by from straight lines
    counts as it does between two frequencies.
    """
    less, more = (replace(band, value=value).at(family.frequency).value - level for value in by.value)
    step = np.clip(log_ratio / by.span, -1.0, 1.0)
    straight = np.where(step > 0, more * step, -less * step)
    parabola = (more - less) / 2 * step + (more + less) / 2 * step**2
    rate = ((more - less) / 2 + (more + less) * step) / by.span
    return parabola, BETWEEN * np.abs(parabola - straight), rate
