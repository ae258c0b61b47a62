"""Noise of single readings: stated by the test engineer, or estimated from the roughness of the only repeat."""

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, ComplexColumn, FloatColumn, IntColumn
from correlation.noise.smoothness import estimate_curve_noise
from correlation.noise.variance import compute_margin
from correlation.prediction import Points

Noise = Float[NDArray[np.float64], " k"]

#: Degrees of freedom of the noise estimate of a curve.
FREEDOM = 20
#: Least share of repeated points for an estimate from repeats; a turning point read twice is not sufficient [-].
LEAST_REPEATED = 0.05


def find_reading_noise(
    campaign: Campaign,
    points: Points,
    value: ComplexColumn,
    n_reading: IntColumn,
    repeated: Bool[NDArray[np.bool_], " k"],
) -> Noise:
    """Noise of one repeat at each point, of its real and its imaginary part, shape (k,) [SI].

    NaN where it is to be estimated from the repeats.

    Parameters
    ----------
    campaign
        Campaign with its sensors.
    points, value
        Points, and a value of each, shape (k,).
    n_reading
        Number of readings of each point in one repeat, such as one per sweep, shape (k,).
    repeated
        Mask of points with more than one repeat, shape (k,). If a sensor and configuration have too few of them, noise
        that is not stated is estimated from the curves.
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
    """Noise of the curves of one sensor, shape (k,); NaN if a curve has too few frequencies."""
    noise = np.full(len(points), np.nan)
    curves = {*zip(points.free.tolist(), points.level.tolist(), points.harmonic.tolist(), strict=True)}
    for free, level, harmonic in sorted(curves):
        of = (points.free == free) & (points.level == level) & (points.harmonic == harmonic)
        for way in np.unique(points.sweep[of]):
            # Sweep 0, where both sweeps coincide, continues the curve of a sweep.
            rows = np.flatnonzero(of & np.isin(points.sweep, (0, way)) & np.isfinite(value))
            rows = rows[np.argsort(points.frequency[rows])]
            if not len(rows) or not np.abs(value[rows]).any():
                continue
            parts = 2 if has_phase and harmonic else 1
            result, _ = estimate_curve_noise(points.frequency[rows], value[rows], parts=parts)
            own = points.sweep[rows] == way
            noise[rows[own]] = result[own]
    return _fill_short_curves(points, np.abs(value), noise)


def _fill_short_curves(points: Points, size: FloatColumn, noise: Noise) -> Noise:
    """Noise with that of short curves taken relative from other curves of the same harmonic."""
    for harmonic in np.unique(points.harmonic):
        rows = points.harmonic == harmonic
        known = rows & np.isfinite(noise) & (size > 0)
        if known.any():
            noise = np.where(rows & ~np.isfinite(noise), size * np.median(noise[known] / size[known]), noise)
    return noise
