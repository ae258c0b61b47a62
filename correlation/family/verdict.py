r"""Comparison of a measured family with its predicted band: coverage, and departures with size and significance.

A reading x at a distance d outside the limits [l, u] counts as outside only if d exceeds `OUTSIDE` standard deviations
of the errors that the limits do not include: noise of the reading and numerical error. Common frequency errors of
set-ups and model are not part of these: `frequency_offset` shifts all readings of a set-up by the same amount. If the
noise was estimated with :math:`\nu` degrees of freedom, d over its standard deviation has Student's t distribution; it
is reported as the number of standard deviations z of a normal distribution with the same tail probability,

.. math:: z = \frac{8 \nu + 1}{8 \nu + 3}\,\sqrt{\nu \ln (1 + t^2 / \nu)} .

A family leaves its band if a reading is so far outside that noise reaches this distance in only one of a hundred
campaigns. It also leaves its band if more than one reading in twenty is outside and these lie at more frequencies than
noise explains in all but one of a hundred campaigns: readings at one frequency have a common error of the limit.

References
----------
D. L. Wallace, Bounds on normal approximations to Student's and the chi-square distributions, Annals of Mathematical
Statistics 30 (1959), for z. F. E. Satterthwaite, Biometrics Bulletin 2 (1946), for the degrees of freedom of a sum.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray
from scipy.special import bdtrc, chdtri, ndtr, ndtri

from correlation.family.band import PredictedBand
from correlation.family.correction import SetUp
from correlation.family.family import Family, number_points
from correlation.family.noise import ReadingNoise
from correlation.metric.band import coverage, interval_score, tightness

Values = Float[NDArray[np.float64], " p"]
Both = Float[NDArray[np.float64], "2 p"]

#: Distance from a limit above which a reading is outside [standard deviations].
OUTSIDE = 3.0
#: Probability that noise alone causes a significant departure in a campaign [-].
CHANCE = 0.01
#: Share of readings outside above which noise does not explain them [-].
SHARE = 0.05
#: Number of quantiles of an estimated variance over which probabilities are averaged [-].
N_QUANTILE = 200
#: Degrees of freedom that are practically infinite [-].
CERTAIN = 1e9


@dataclass(frozen=True, kw_only=True)
class Departure:
    """A reading outside of the band.

    Parameters
    ----------
    test, repeat, sweep
        Curve of the reading; sweep +1 up, -1 down, 0 none.
    frequency
        Frequency [Hz].
    side
        Limit that is exceeded: "lower" or "upper".
    value, limit
        Reading and limit [SI unit of the sensor].
    deviations
        Distance from the limit in standard deviations of an equivalent normal distribution [-].
    """

    test: str
    repeat: int
    sweep: int
    frequency: float
    side: str
    value: float
    limit: float
    deviations: float

    @property
    def distance(self) -> float:
        """Distance from the limit, positive [SI unit of the sensor]."""
        return abs(self.value - self.limit)


@dataclass(frozen=True, kw_only=True, eq=False)
class FamilyVerdict:
    """Comparison of a family with its band; p readings.

    Parameters
    ----------
    family, band
        Family and band.
    limit, deviation
        Limits at each reading, and standard deviation of the distance from them, lower then upper, shape (2, p); NaN
        for a reading without limits.
    coverage
        Share of compared readings that are not outside [-]; NaN if none is compared.
    tightness
        Width of the band over spread of the curves, median over the points [-]; NaN with a single curve.
    score
        Mean interval score of the band widened by noise, over the mean size of the readings [-]; alpha is 1 / (n + 1)
        for n readings.
    departures
        Readings outside, most significant first.
    critical_deviation
        Distance above which a single reading shows that a family leaves its band [standard deviations].
    outside
        Mask of readings outside, curve after curve, shape (p,).
    critical_count
        Least number of frequencies with readings outside that noise does not explain [-].
    """

    family: Family
    band: PredictedBand
    limit: Float[NDArray[np.float64], "2 p"]
    deviation: Float[NDArray[np.float64], "2 p"]
    coverage: float
    tightness: float
    score: float
    departures: tuple[Departure, ...]
    critical_deviation: float
    outside: Bool[NDArray[np.bool_], " p"]
    critical_count: int

    @property
    def n_compared(self) -> int:
        """Number of readings with limits [-]."""
        return int(np.isfinite(self.limit).all(axis=0).sum())

    @property
    def leaves_band(self) -> bool:
        """Whether the family leaves its band significantly."""
        far = any(item.deviations > self.critical_deviation for item in self.departures)
        places = len(np.unique(number_points(self.family.curves)[self.outside]))
        return far or (len(self.departures) > SHARE * self.n_compared and places >= self.critical_count)


def judge_family(
    family: Family,
    band: PredictedBand,
    noise: ReadingNoise,
    *,
    shift: float,
    n_reading: int,
    offsets: Mapping[SetUp, float] | None = None,
) -> FamilyVerdict:
    """Compare a family with its band.

    Parameters
    ----------
    family, band
        Family and band of the same sensor, harmonic and level.
    noise
        Noise of the readings.
    shift
        Relative standard deviation of independent frequency errors of the readings [-].
    n_reading
        Number of readings of all families in the comparison [-].
    offsets
        Known relative frequency errors by set-up, see `estimate_frequency_offsets` [-].
    """
    known = [(offsets or {}).get(key, 0.0) for key in family.set_ups]
    offset = np.array(known)[family.curve_number]
    value, at = family.value, band.at(family.frequency, shift, offset)
    limit = np.where(np.isfinite(at.value).all(axis=0), at.value, np.nan)
    # Noise of a reading at the limit: a smaller reading below it must not have a smaller noise.
    beside_noise = family.widen(at.deviation, limit)
    deviation = np.hypot(beside_noise, noise.deviation(limit))
    freedom = np.fmin(noise.freedom(limit, beside_noise), CERTAIN)
    clear = -float(ndtri(CHANCE / (2 * max(n_reading, 1))))
    compared = np.isfinite(limit).all(axis=0)
    deviations, side = _compute_distance(value, limit, deviation, freedom)
    curve = family.curve_number
    departures = [
        Departure(
            test=family.curves[curve[row]].test, repeat=family.curves[curve[row]].repeat,
            sweep=family.curves[curve[row]].sweep, frequency=float(family.frequency[row]),
            side=("lower", "upper")[side[row]], value=float(value[row]), limit=float(limit[side[row], row]),
            deviations=float(deviations[row]),
        )
        for row in np.argsort(-np.nan_to_num(deviations))
        if deviations[row] > OUTSIDE
    ]  # fmt: skip
    inside, tight, score = np.nan, np.nan, np.nan
    if compared.any():
        x, ends = value[compared], limit[:, compared]
        inside = coverage(x[None], *_widen(ends, (_find_student_bound(freedom) * deviation)[:, compared]))
        alpha = 1 / (len(x) + 1)
        low, high = _widen(ends, compute_noise_width(alpha) * deviation[:, compared])
        size = interval_score(x[None], low, high, alpha)
        score = float(np.mean(size) / max(float(np.mean(np.abs(x))), 1e-300))
        tight = _compute_tightness(family, limit)
    return FamilyVerdict(
        family=family, band=band, limit=limit, deviation=deviation, coverage=inside, tightness=tight, score=score,
        departures=tuple(departures), critical_deviation=max(clear, OUTSIDE), outside=deviations > OUTSIDE,
        critical_count=_count_critical_points(
            number_points(family.curves)[compared], noise.freedom(limit[:, compared]), CHANCE * len(value) / n_reading
        ),
    )  # fmt: skip


def compute_noise_width(alpha: Values | float) -> Values:
    """Distance that normal noise exceeds, on both sides together, in a share alpha of readings [standard deviations].

    With a quantile of Student's distribution with few degrees of freedom, noise alone would dominate the score.
    """
    return np.asarray(-ndtri(np.asarray(alpha) / 2), dtype=np.float64)


def _widen(ends: Both, by: Both) -> Both:
    """Both ends of a band moved outwards; the upper end is at least the lower one."""
    low = ends[0] - by[0]
    return np.array([low, np.maximum(ends[1] + by[1], low)])


def _compute_distance(value: Values, limit: Both, deviation: Both, freedom: Both) -> tuple[Values, NDArray[np.int64]]:
    """Distance of readings outside their limits in standard deviations, 0 inside, and index of the limit."""
    beyond = np.nan_to_num(np.array([limit[0] - value, value - limit[1]]), nan=-np.inf)
    side = np.argmax(beyond, axis=0)
    rows = np.arange(len(value))
    distance = np.maximum(beyond[side, rows], 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        deviations = np.where(distance > 0, distance / deviation[side, rows], 0.0)
    return _convert_to_normal(deviations, freedom[side, rows]), side


def _convert_to_normal(deviations: Values, freedom: Values) -> Values:
    """Standard deviations of a normal distribution with the same tail probability as Student's t, shape (p,)."""
    return (8 * freedom + 1) / (8 * freedom + 3) * np.sqrt(freedom * np.log1p(deviations**2 / freedom))


def _find_student_bound(freedom: Both) -> Both:
    """Student's t that `_convert_to_normal` converts to `OUTSIDE`, shape (2, p)."""
    scaled = (8 * freedom + 3) / (8 * freedom + 1) * OUTSIDE
    return np.sqrt(freedom * np.expm1(scaled**2 / freedom))


def _count_critical_points(point: NDArray[np.int64], freedom: Both, chance: float) -> int:
    """Number of frequencies with readings outside that noise reaches with less than a given probability.

    The probability is averaged over the distribution of the noise estimate. All readings may lie on a limit, and a band
    may have zero width: any reading may be outside on either side.
    """
    place, count = np.unique(point, return_counts=True)
    mean = 1 / max(float(np.mean(1 / freedom)) if freedom.size else 0.0, 1 / CERTAIN)
    quantile = (np.arange(N_QUANTILE) + 0.5) / N_QUANTILE
    estimate = np.sqrt(chdtri(mean, 1 - quantile) / mean)
    reading = 2 * ndtr(-_find_student_bound(np.array(mean)) * estimate)
    places = 1 - (1 - reading) ** count.max(initial=1)
    number = np.arange(1, len(place) + 2)
    reached = bdtrc(number[:, None] - 1, len(place), places).mean(axis=1)
    return int(number[np.argmax(reached < chance)])


def _compute_tightness(family: Family, limit: Float[NDArray[np.float64], "2 p"]) -> float:
    """Tightness of the band; readings are moved along the middle of the band to the mean frequency of their point."""
    point, curve = number_points(family.curves), family.curve_number
    names, column = np.unique(point, return_inverse=True)
    middle, width = limit.mean(axis=0), np.maximum(limit[1] - limit[0], 0.0)
    there = np.isfinite(middle)
    count = np.maximum(np.bincount(column, there), 1)
    mean = np.bincount(column, np.where(there, middle, 0.0)) / count
    half = np.bincount(column, np.where(there, width, 0.0)) / count / 2
    table = np.full((len(family.curves), len(names)), np.nan)
    table[curve[there], column[there]] = (family.value - middle + mean[column])[there]
    seen = np.isfinite(table).any(axis=0)
    ratio = tightness(table[:, seen], (mean - half)[seen], (mean + half)[seen])
    known = ratio[np.isfinite(ratio)]
    return float(np.median(known)) if len(known) else float("nan")


def count_readings(families: Sequence[Family]) -> int:
    """Number of readings of all families [-]."""
    return sum(family.n_point for family in families)
