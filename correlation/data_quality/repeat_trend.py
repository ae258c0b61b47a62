r"""Trend of the repeats with time: a structure that wears, warms up or loosens during the test.

Reading k of repeat r differs from its mean over the repeats by :math:`d_{kr}`. With the times :math:`t_{kr}` of the
repeats, of zero mean and unit length, the trend statistic is :math:`T = \sum_k w_k |\sum_r d_{kr} t_{kr}|^2`.

If repeats differ at random, by a new preload, friction histories and noise, all directions in the space of the repeats
are equivalent, for any number of readings with a common cause. The p-value of T then follows from random rotations of
all times together, under the only assumption that the differences of repeats are normal and independent. Levels are not
independent evidence, since all levels of a repeat may have a common preload. For a single cause, T is equivalent to
Student's test of its trend.

References
----------
Langsrud, Statistics and Computing 15 (2005), 53-60.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.campaign.measurement import Measurement
from correlation.data_quality.repeat_array import RepeatArray, arrange_repeats

#: Least number of repeats for a trend, and of points common to all of them.
FEWEST_REPEATS, FEWEST = 3, 8
#: Least fraction of the points of a test in a repeat [-].
MOST_READ = 0.5
#: Numbers of random rotations, their seed, and the probability below which the larger number is used. A probability of
#: 0.27 % then has a relative standard deviation of 9 %.
N_ROTATION, SEED, SMALL = (2_000, 50_000), 1, 0.02
#: Relative tolerance for equal times of the repeats [-].
SAME_TIME = 1e-6

#: Time of each repeat at each point, or of each of some kinds of points.
Times = Float[NDArray[np.float64], "n r"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Trend:
    """Trend over the repeats of a test.

    Parameters
    ----------
    read
        Values of all sensors at the points that all repeats have, the repeats in the order of measurement.
    sensors
        Numbers of these sensors.
    time
        Time of each repeat at each point, of zero mean and unit length, shape (n, r) [-].
    chance
        Probability of a trend at least as large if repeats differ at random [-].
    """

    read: RepeatArray
    sensors: list[int]
    time: Times
    chance: float

    @property
    def change(self) -> Complex[NDArray[np.complex128], "s n"]:
        """Change from the first repeat to the last one, by the straight line through all [unit of the readings]."""
        along = np.einsum("snr,nr->sn", self.read.value, self.time)
        return np.asarray(along * (self.time[:, -1] - self.time[:, 0]))

    @property
    def scale(self) -> Float[NDArray[np.float64], "s n"]:
        """Root mean square of the readings of each sensor at each level, at its points [unit of the readings]."""
        _, number = np.unique(self.read.level, return_inverse=True)
        square, count = (np.abs(self.read.value) ** 2).mean(axis=2), np.bincount(number)
        average = np.array([(np.bincount(number, item) / count)[number] for item in square])
        return np.asarray(np.sqrt(np.maximum(average, np.finfo(float).tiny)))

    @property
    def size(self) -> float:
        """Change from the first repeat to the last one relative to the readings, root mean square [-]."""
        return float(np.sqrt(np.mean(np.abs(self.change / self.scale) ** 2)))


def find_trend(table: Measurement, sensors: list[int]) -> Trend | None:
    """The trend of the repeats of a test; None with too few repeats or points.

    Parameters
    ----------
    table
        Rows of the test.
    sensors
        Numbers of its sensors.
    """
    table = table.where((table.harmonic == 1) & np.isin(table.sensor, sensors))
    if not len(table):
        return None
    there = np.unique(table.sensor).tolist()
    read = arrange_repeats(table, there)
    known = np.asarray(np.isfinite(read.value).all(axis=0))
    full = known.mean(axis=0) >= MOST_READ
    points = known[:, full].all(axis=1)
    if full.sum() < FEWEST_REPEATS or points.sum() < FEWEST:
        return None
    time = _find_times(table, read)[points][:, full]
    first = np.argsort(time.mean(axis=0), kind="stable")
    time = time[:, first] - time.mean(axis=1, keepdims=True)
    time /= np.linalg.norm(time, axis=1, keepdims=True)
    read = RepeatArray(
        repeat=np.array(read.repeat)[full][first].tolist(), value=read.value[:, points][:, :, full][:, :, first],
        level=read.level[points], frequency=read.frequency[points], sweep=read.sweep[points],
    )  # fmt: skip
    return Trend(read=read, sensors=there, time=time, chance=_compute_chance(read, time))


def _find_times(table: Measurement, read: RepeatArray) -> Times:
    """Mean position of each sweep of a level of a repeat in the order of measurement, for each of its points.

    If the order starts again in each repeat, the number of the repeat is used as its time.
    """
    times = np.full((len(read.level), len(read.repeat)), np.nan)
    for level, sweep in {*zip(read.level.tolist(), read.sweep.tolist(), strict=True)}:
        own = (table.level == level) & (table.sweep == sweep)
        of_repeat = [table.order[own & (table.repeat == item)] for item in read.repeat]
        there = (read.level == level) & (read.sweep == sweep)
        times[there] = [item.mean() if len(item) else np.nan for item in of_repeat]
    begins = [table.order[table.repeat == item].min() for item in read.repeat]
    return times if len({*begins}) == len(begins) else np.tile(np.array(read.repeat, dtype=float), (len(times), 1))


def _compute_chance(read: RepeatArray, time: Times) -> float:
    """Fraction of random rotations of all times along which the repeats differ at least as much."""
    basis = _find_contrasts(len(read.repeat))
    kinds, number = np.unique(np.round(time @ basis / SAME_TIME), axis=0, return_inverse=True)
    kinds, number = kinds * SAME_TIME, number.ravel()
    apart = _scale_differences(read) @ basis
    grams = [np.einsum("snr,snq->rq", *[apart[:, number == kind]] * 2) for kind in range(len(kinds))]
    measured = sum(float(item @ gram @ item) for item, gram in zip(kinds, grams, strict=True))
    chance = 0.0
    for n in N_ROTATION:
        random = np.zeros(n)
        for item, gram in zip(_rotate_at_random(kinds, n), grams, strict=True):
            random += ((item @ gram) * item).sum(axis=1)
        chance = float((1 + np.sum(random >= measured)) / (1 + n))
        if chance > SMALL:
            break
    return chance


def _find_contrasts(n: int) -> Float[NDArray[np.float64], "n n-1"]:
    """Orthonormal directions orthogonal to the mean."""
    return np.asarray(np.linalg.qr(np.column_stack([np.ones(n), np.eye(n, n - 1)]))[0][:, 1:])


def _rotate_at_random(kinds: Float[NDArray[np.float64], "k q"], n: int) -> list[Float[NDArray[np.float64], "n q"]]:
    """Each of k directions in the same n random rotations, uniform over all, k times of shape (n, q)."""
    within = np.linalg.svd(kinds, full_matrices=False)
    frame = within.Vh[within.S > SAME_TIME**0.5]
    draws = np.random.default_rng(SEED).standard_normal((n, kinds.shape[1], len(frame)))
    rotated, triangle = np.linalg.qr(draws)
    rotated *= np.sign(np.diagonal(triangle, axis1=1, axis2=2))[:, None, :]
    return [rotated @ item for item in kinds @ frame.T]


def _scale_differences(read: RepeatArray) -> Float[NDArray[np.float64], "s n r"]:
    """Differences from the mean of the repeats relative to the reading, real parts and imaginary parts as sensors.

    Readings near zero are scaled by the median of their sensor. Rows with larger differences than most have equal
    weight: points at which the response jumps would dominate otherwise.
    """
    mean = read.value.mean(axis=2)
    size = np.maximum(np.abs(mean), np.median(np.abs(mean), axis=1, keepdims=True))
    apart = (read.value - mean[:, :, None]) / np.where(size > 0, size, 1.0)[:, :, None]
    square = (np.abs(apart) ** 2).sum(axis=2)
    weighted = apart / np.sqrt(np.maximum(square + np.median(square), np.finfo(float).tiny))[:, :, None]
    return np.concatenate([weighted.real, weighted.imag])
