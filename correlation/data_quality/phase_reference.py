"""Runs whose phases all differ by one angle from another run: they do not refer to the force."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from correlation.campaign.measurement import CONTACT_FORCE, Campaign, Measurement, Suspicion
from correlation.data_quality.phase_offset import MIN_ANGLE, PhaseOffset, find_phase_offset
from correlation.row_group import group_rows

#: Least number of common frequencies of two runs: fewer may all lie between two branches. Of 2,000 clean random
#: campaigns (`benchmarks.data_quality`) that are cut to a band at random none raises an alarm; two did with six.
FEWEST = 8


def find_turned_runs(campaign: Campaign) -> Iterator[Suspicion]:
    """Tests in which all phases of a run differ by one angle from another repeat or sweep of its level.

    Differences of 180 deg are left to the search for opposite signs.

    Parameters
    ----------
    campaign
        Campaign with its single readings.
    """
    phased = np.array([item.has_phase and item.quantity != CONTACT_FORCE for item in campaign.sensors], dtype=np.bool_)
    table = campaign.measurement
    table = table.where((table.harmonic == 1) & phased[table.sensor])
    for number, test in enumerate(campaign.tests):
        own = table.where(table.test == number)
        pairs = [pair for level in np.unique(own.level) for pair in _compare_runs(own.where(own.level == level))]
        turned = [item for item in pairs if item is not None]
        if not any(abs(item.angle) < np.pi - MIN_ANGLE for item in turned):
            continue
        angles, left = ([getattr(item, name) for item in turned] for name in ("angle", "residual"))
        yield Suspicion(
            where=f'test "{test.name}"',
            sentence=f"{len(turned)} of {len(pairs)} times all phases of a run differ from those of another run at its "
            f"level by one angle, up to {np.degrees(np.abs(angles).max()):.0f} deg, and agree within "
            f"{np.degrees(np.median(left)):.2g} deg once they are turned by it: the phases are not relative to the "
            "force. Was its phase not measured, or measured with the opposite sign? Give it, or write phase = false "
            "for the sensors",
            of_test=True,
        )


def _compare_runs(table: Measurement) -> Iterator[PhaseOffset | None]:
    """Phase offset between each run and the next one, runs of one direction first; None without an offset."""
    run, point = group_rows([table.sweep, table.repeat]), group_rows([table.sensor, table.frequency])
    values = np.full((len(run.first), len(point.first)), np.nan, dtype=np.complex128)
    values[run.number, point.number] = table.value
    frequency, sensor = table.frequency[point.first], table.sensor[point.first]
    for one, other in pairwise(values):
        if len(np.unique(frequency[np.isfinite(one * other)])) >= FEWEST:
            yield find_phase_offset(other, one, frequency, sensor)
