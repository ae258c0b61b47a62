"""Repeats with a common factor of all readings, or of all readings of a sensor: drift of a gain, readjusted force."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.special import ndtri

from correlation.campaign.measurement import Campaign, Suspicion
from correlation.data_quality.repeat_array import arrange_repeats

#: Least reported difference of two repeats, and its least ratio to the scatter of readings about the factor [-].
MIN_DRIFT, MIN_DRIFT_OVER_SCATTER = 0.02, 3.0
#: Least number of repeats for a course, and of readings for a factor.
FEWEST_REPEATS, FEWEST = 3, 8
#: Probability of a significant factor of any sensor of a test by chance [-]. Of 600 clean random campaigns of two
#: sensors (`benchmarks.data_quality`) and of 451 of 20 sensors none raises an alarm.
BY_CHANCE = 0.01
#: Standard deviation of the median of n normal numbers, times sqrt(n) over the median of their moduli [-].
OF_MEDIAN = np.sqrt(np.pi / 2) / ndtri(0.75)

#: ln of the readings, less its mean over the repeats, at n points in r repeats [-].
Shares = Float[NDArray[np.float64], "n r"]


class _Factors(NamedTuple):
    """Factor of each repeat [ln], and the largest difference of two of them."""

    factor: Float[NDArray[np.float64], " r"]
    apart: float


def find_drift_suspicions(campaign: Campaign) -> Iterator[Suspicion]:
    """Tests with a common factor of all motions between repeats, and single sensors with such a factor.

    Parameters
    ----------
    campaign
        Campaign with its single readings.
    """
    sensors = campaign.structure_sensors
    for number, test in enumerate(campaign.tests):
        if test.settling:
            continue  # its readings differ since they settle
        repeats, values, *_ = arrange_repeats(campaign.measurement.where(campaign.measurement.test == number), sensors)
        with np.errstate(divide="ignore", invalid="ignore"):  # a reading of zero has no logarithm
            size = np.log(np.abs(values))
            share = np.where(
                np.isfinite(size).all(axis=2, keepdims=True), size - size.mean(axis=2, keepdims=True), np.nan
            )
        if len(repeats) < FEWEST_REPEATS:
            continue
        own = {place: factors for place in range(len(sensors)) if (factors := _find_own_factors(share, place))}
        for place, factors in own.items():
            yield Suspicion(
                where=f'test "{test.name}", sensor "{campaign.sensors[sensors[place]].name}"',
                sentence=f"its readings at all frequencies and levels are {_describe_change(factors, repeats)}, and "
                "those of the other sensors are not: was its gain changed? If so, correct its readings in these "
                "repeats",
            )
        if together := _find_factors(np.delete(share, [*own], axis=0).reshape(-1, len(repeats))):
            steady = (np.diff(together.factor) > 0).all() or (np.diff(together.factor) < 0).all()
            course = ", and change in one direction from repeat to repeat" if steady else ""
            yield Suspicion(
                where=f'test "{test.name}"',
                sentence=f"motions at all frequencies and levels are {_describe_change(together, repeats)}{course}: "
                "does a gain or the force drift? Strengths are then no more accurate than this",
            )


def _find_own_factors(share: Float[NDArray[np.float64], "s n r"], place: int) -> _Factors | None:
    """Factors of one sensor, absolute and relative to the median of the others, if both are clear."""
    there = np.isfinite(share).all(axis=(0, 2))
    if len(share) < 2 or not there.any():
        return None
    alone, others = share[place][there], np.delete(share, place, axis=0)[:, there]
    own, beside = (_find_factors(item, len(share)) for item in (alone, alone - np.median(others, axis=0)))
    return own if own and beside else None


def _find_factors(share: Shares, n_sensor: int = 1) -> _Factors | None:
    """Factors of the repeats, if their differences are significant for `n_sensor` sensors."""
    share = share[np.isfinite(share).all(axis=1)]
    if len(share) < FEWEST:
        return None
    factor = np.median(share, axis=0)
    scatter, apart = float(np.median(np.abs(share - factor))), float(np.ptp(factor))
    n_pair = n_sensor * len(factor) * (len(factor) - 1)
    by_chance = -ndtri(BY_CHANCE / n_pair) * np.sqrt(2 / len(share)) * OF_MEDIAN
    clear = apart >= max(np.log1p(MIN_DRIFT), max(MIN_DRIFT_OVER_SCATTER, by_chance) * scatter)
    return _Factors(factor, apart) if clear else None


def _describe_change(factors: _Factors, repeats: list[int]) -> str:
    """Words for the largest difference of two repeats."""
    least, most = (repeats[int(end(factors.factor))] for end in (np.argmin, np.argmax))
    return f"{np.expm1(factors.apart):.0%} larger in repeat {most} than in repeat {least}"
