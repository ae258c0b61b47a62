"""Noise of single readings: what the test engineer states, or what is left of the curve of the only repeat."""

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, ComplexColumn, FloatColumn, IntColumn
from correlation.noise.smoothness import estimate_curve_noise
from correlation.noise.variance import compute_margin
from correlation.prediction import Points

Noise = Float[NDArray[np.float64], " k"]

#: Degrees of freedom with which a curve tells its noise.
FREEDOM = 20
#: Repeats of a smaller share of the points, such as a turning point read twice, do not tell the noise of all [-].
LEAST_REPEATED = 0.05


def find_reading_noise(
    campaign: Campaign,
    points: Points,
    value: ComplexColumn,
    n_reading: IntColumn,
    repeated: Bool[NDArray[np.bool_], " k"],
) -> Noise:
    """Noise of one repeat at each point, of its real and its imaginary part, shape (k,) [SI].

    NaN where it is left to the repeats.

    Parameters
    ----------
    campaign
        Campaign with its sensors.
    points, value
        Points, and a value of each, shape (k,).
    n_reading
        Readings that one repeat has of each point, such as one per sweep, shape (k,).
    repeated
        Points that more than one repeat has, shape (k,). Where a sensor and configuration have too few of them, what is
        not stated is estimated from the curves.
    """
    noise = np.full(len(points), np.nan)
    for sensor in campaign.sensors:
        own = points.sensor == sensor.name
        if any(sensor.noise):
            relative, absolute = sensor.noise
            reading = np.hypot(relative * np.abs(value[own]), absolute)
            noise[own] = reading / np.sqrt(n_reading[own])
            continue
        for free in np.unique(points.free[own]):
            rows = np.flatnonzero(own & (points.free == free))
            if np.mean(repeated[rows]) < LEAST_REPEATED:
                seen = smooth_noise(points.where(rows), value[rows], has_phase=sensor.has_phase)
                noise[rows] = np.sqrt(compute_margin(FREEDOM)) * seen
    return noise


def smooth_noise(points: Points, value: ComplexColumn, *, has_phase: bool) -> Noise:
    """Noise of the curves of one sensor, shape (k,); NaN where a curve has too few frequencies."""
    noise = np.full(len(points), np.nan)
    curves = {*zip(points.free.tolist(), points.level.tolist(), points.harmonic.tolist(), strict=True)}
    for free, level, harmonic in sorted(curves):
        of = (points.free == free) & (points.level == level) & (points.harmonic == harmonic)
        for way in np.unique(points.sweep[of]):
            # The branch of a sweep goes on where both sweeps are one.
            rows = np.flatnonzero(of & np.isin(points.sweep, (0, way)) & np.isfinite(value))
            rows = rows[np.argsort(points.frequency[rows])]
            if not len(rows) or not np.abs(value[rows]).any():
                continue
            parts = 2 if has_phase and harmonic else 1
            result, _ = estimate_curve_noise(points.frequency[rows], value[rows], parts=parts)
            own = points.sweep[rows] == way
            noise[rows[own]] = result[own]
    return _filled(points, np.abs(value), noise)


def _filled(points: Points, size: FloatColumn, noise: Noise) -> Noise:
    """Short curves have the relative noise of the others of their harmonic."""
    for harmonic in np.unique(points.harmonic):
        rows = points.harmonic == harmonic
        known = rows & np.isfinite(noise) & (size > 0)
        if known.any():
            noise = np.where(rows & ~np.isfinite(noise), size * np.median(noise[known] / size[known]), noise)
    return noise
