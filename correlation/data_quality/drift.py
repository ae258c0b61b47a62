"""Repeats that differ by one factor in all readings: a gain that drifts, or a force that was set anew."""

from collections.abc import Iterator

import numpy as np

from correlation.campaign.measurement import CONTACT_FORCE, Campaign, Suspicion
from correlation.data_quality.by_repeat import arrange_by_repeat

#: Least difference of two repeats that is told, and its least ratio to the scatter of readings about the factor [-].
LEAST, CLEAR = 0.02, 3.0
#: Repeats that show a course, and readings that tell a factor.
FEWEST_REPEATS, FEWEST = 3, 8


def find_drift_suspicions(campaign: Campaign) -> Iterator[Suspicion]:
    """Tests whose motions are larger by one factor in some repeats than in others.

    Parameters
    ----------
    campaign
        Campaign with its single readings.
    """
    sensors = [number for number, each in enumerate(campaign.sensors) if each.quantity != CONTACT_FORCE]
    for number, test in enumerate(campaign.tests):
        if test.settling:
            continue  # its readings differ since they settle
        repeats, values, *_ = arrange_by_repeat(
            campaign.measurement.where(campaign.measurement.test == number), sensors
        )
        size = np.abs(values).reshape(-1, len(repeats))
        size = size[(size > 0).all(axis=1)]
        if len(repeats) < FEWEST_REPEATS or len(size) < FEWEST:
            continue
        share = np.log(size) - np.log(size).mean(axis=1, keepdims=True)
        factor = np.median(share, axis=0)
        scatter = float(np.median(np.abs(share - factor)))
        apart = float(np.ptp(factor))
        if apart < max(np.log1p(LEAST), CLEAR * scatter):
            continue
        least, most = repeats[int(np.argmin(factor))], repeats[int(np.argmax(factor))]
        steady = (np.diff(factor) > 0).all() or (np.diff(factor) < 0).all()
        course = ", and change in one direction from repeat to repeat" if steady else ""
        yield Suspicion(
            where=f'test "{test.name}"',
            sentence=f"motions at all frequencies and levels are {np.expm1(apart):.0%} larger in repeat {most} than "
            f"in repeat {least}{course}: does a gain or the force drift? A strength is then known no better than that",
        )
