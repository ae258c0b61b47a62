"""Average of the settled loops of a record over one period, with a smoothed displacement."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from correlation.signal.record import Samples
from geometry.read_only_array import freeze_fields

Bounds = Int[NDArray[np.int64], " p"]
Points = Float[NDArray[np.float64], " m"]

#: Largest number of parts of the period in which samples are averaged [-].
MOST_POINTS = 1500
#: Part of the half stroke, to either side of its middle, in which a crossing is located by a straight line [-].
CROSSING = 0.2
#: Largest number of harmonics of the displacement, and their significance in standard deviations of noise [-].
MOST_HARMONICS, SIGNIFICANT = 40, 4.0
#: Least number of samples per point for their scatter, and ratio of variances above which harmonics do not follow the
#: means: with hundreds of points, noise reaches 1.3 [-].
REPEATED, LACK_OF_FIT = 2.0, 1.5


@dataclass(frozen=True, kw_only=True, eq=False)
class MeanLoop:
    """Mean of the periods, each from one downward crossing of the middle of the stroke to the next.

    Parameters
    ----------
    displacement
        Significant harmonics of the displacement, shape (m,) [m].
    force
        Means of the samples of each point, shape (m,) [N].
    normal
        Significant harmonics of the normal force, or means of the samples of each point if the harmonics do not fit
        them, as with separation, shape (m,) [N].
    weight
        Number of samples of each point, shape (m,) [-].
    displacement_deviation
        Standard deviation of the noise in the residual of the harmonics [m].
    samples, point
        Forces in the order of the record, and the point of each, shape (n,) [N, -].
    n_period
        Number of periods [-].
    """

    displacement: Points
    force: Points
    normal: Points
    weight: Points
    displacement_deviation: float
    samples: Samples
    point: Int[NDArray[np.int64], " n"]
    n_period: int

    def __post_init__(self) -> None:
        freeze_fields(self, "displacement", "force", "normal", "weight", "samples")
        freeze_fields(self, "point", kind=np.int64)


def average_loops(displacement: Samples, force: Samples, normal: Samples, bounds: Bounds) -> MeanLoop:
    """The mean loop between some bounds of periods.

    The phase of a sample is its position between crossings of the middle of the stroke, where the velocity is largest
    and the effect of noise smallest. Periods may differ in length.

    Parameters
    ----------
    displacement, force, normal
        Shape (n,) [m, N, N].
    bounds
        Samples at which periods begin and the last ends: highest displacements, shape (p + 1,).
    """
    starts = _find_crossings(displacement, bounds)
    if len(starts) < 2:
        starts = np.array([float(bounds[0]), float(bounds[-1])])
    used = np.arange(int(np.ceil(starts[0])), int(np.ceil(starts[-1])))
    phase = np.interp(used, starts, np.arange(len(starts))) % 1.0
    x, f, n = displacement[used], force[used], normal[used]
    part = np.minimum((phase * MOST_POINTS).astype(np.int64), MOST_POINTS - 1)
    _, point = np.unique(part, return_inverse=True)
    weight = np.bincount(point).astype(np.float64)
    mean_phase, mean_f = (np.bincount(point, values) / weight for values in (phase, f))
    per_period = len(used) / (len(starts) - 1)
    smooth, deviation = _keep_significant_harmonics(phase, x, mean_phase, per_period)
    smooth_normal, _ = _keep_significant_harmonics(phase, n, mean_phase, per_period)
    return MeanLoop(
        displacement=smooth,
        force=mean_f,
        normal=_without_noise(n, point, smooth_normal),
        weight=weight,
        displacement_deviation=deviation,
        samples=f,
        point=point,
        n_period=len(starts) - 1,
    )


def _without_noise(normal: Samples, point: Int[NDArray[np.int64], " n"], smooth: Points) -> Points:
    """The harmonics of a normal force, or its means if these differ from the harmonics by more than their scatter.

    Means bias the stiffness: a slider moves at each dip of a noisy limit, and does not move back at a peak.
    """
    weight = np.bincount(point)
    mean = np.bincount(point, normal) / weight
    scatter = float(((normal - mean[point]) ** 2).sum()) / max(len(normal) - len(weight), 1)
    lack_of_fit = float((weight * (mean - smooth) ** 2).mean())
    repeated = len(normal) >= REPEATED * len(weight)
    return np.asarray(mean if repeated and lack_of_fit > LACK_OF_FIT * scatter else smooth)


def _find_crossings(displacement: Samples, bounds: Bounds) -> Float[NDArray[np.float64], " p"]:
    """Downward crossings of the middle of the stroke by each period [samples]."""
    places = []
    for a, b in pairwise(bounds):
        part = displacement[a : b + 1]
        falling = part[: int(np.argmin(part)) + 1]
        middle, reach = (part.max() + part.min()) / 2, CROSSING * np.ptp(part) / 2
        near = np.flatnonzero(np.abs(falling - middle) <= reach)
        if len(near) >= 3:
            slope, offset = np.polyfit(near - near.mean(), falling[near] - middle, 1)
            places.append(a + near.mean() - (offset / slope if slope < 0 else 0.0))
        else:
            first = max(int(np.argmax(falling <= middle)), 1)
            before, after = falling[first - 1], falling[first]
            places.append(a + first - (middle - after) / (before - after))
    return np.asarray(places, dtype=np.float64)


def _keep_significant_harmonics(
    phase: Samples, values: Samples, points: Points, samples_per_period: float
) -> tuple[Points, float]:
    """A periodic signal at some phases without insignificant harmonics, and its noise."""
    most = max(min(MOST_HARMONICS, int(samples_per_period / 6)), 1)
    columns = _make_waves(phase, np.arange(1, most + 1))
    result = np.linalg.lstsq(columns, values, rcond=None)[0]
    variance = float(((values - columns @ result) ** 2).sum() / max(len(values) - columns.shape[1], 1))
    size = np.hypot(result[1 : most + 1], result[most + 1 :])
    order = 1 + np.flatnonzero(size > SIGNIFICANT * np.sqrt(2 * variance / len(values)))
    columns = _make_waves(phase, order)
    result = np.linalg.lstsq(columns, values, rcond=None)[0]
    return np.asarray(_make_waves(points, order) @ result), float(np.sqrt(variance * columns.shape[1] / len(values)))


def _make_waves(phase: Points, order: NDArray[np.int64]) -> Float[NDArray[np.float64], "n p"]:
    angle = 2 * np.pi * np.outer(phase, order)
    return np.hstack([np.ones((len(phase), 1)), np.cos(angle), np.sin(angle)])
