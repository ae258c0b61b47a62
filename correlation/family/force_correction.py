r"""Readings at a force that is a little off, as they would be at the force of their level.

A controller misses the set point by a per cent or two, and each point has its own force r F. With friction an amplitude
grows with any power of it: the first one while contacts stick, a tenth of it where they slip, and many times that on
the flank of a resonance that falls with the amplitude. The limits L tell it. Readings x between those at the force r F
become as far between those at F, and readings outside keep their distance:

.. math:: x' = L_l(1) + t\,(L_u(1) - L_l(1)) + d, \qquad
          t = \frac{c - L_l(r)}{L_u(r) - L_l(r)}, \quad c = \min(\max(x, L_l(r)), L_u(r)), \quad d = x - c .
"""

from dataclasses import replace

import numpy as np

from correlation.family.band import BETWEEN, PredictedBand
from correlation.family.family import Family


def correct_force(family: Family, band: PredictedBand) -> Family:
    """The family at the force of its level, as far as limits tell how they follow the force.

    Limits follow the parabola through those at three forces; what it differs by from straight lines counts as it does
    between two frequencies. Beyond these forces a reading is uncertain by as much as it was scaled.

    Parameters
    ----------
    family, band
        Of the same sensor, harmonic and level.
    """
    if band.forced is None:
        return family
    span, log_ratio = band.force_span, np.log(family.ratio)
    less, level, more = (
        replace(band, value=value).at(family.frequency).value for value in (band.forced[0], band.value, band.forced[1])
    )
    step = np.clip(log_ratio, -span, span) / span
    straight = level + np.where(step > 0, more - level, level - less) * step
    parabola = level + (more - less) / 2 * step + (more + less - 2 * level) / 2 * step**2
    # Limits of no width may cross.
    lower, upper = np.sort(parabola, axis=0)
    value = family.value
    inside = np.clip(value, lower, upper)
    share = (inside - lower) / np.maximum(upper - lower, np.finfo(float).tiny)
    corrected = level[0] + share * (level[1] - level[0]) + value - inside
    size = np.maximum(np.abs(level), np.finfo(float).tiny)
    off = np.max(BETWEEN * np.abs(parabola - straight) / size, axis=0) + np.abs(log_ratio - span * step)
    told = np.isfinite(corrected)
    columns = np.where(told, corrected, value), np.where(told, off, family.scaled)
    ends = np.cumsum([len(curve.frequency) for curve in family.curves])[:-1]
    parts = zip(family.curves, *(np.split(column, ends) for column in columns), strict=True)
    return replace(family, curves=tuple(replace(curve, value=new, scaled=own) for curve, new, own in parts))
