"""Channels with a constant reading at all frequencies of a run: a disconnected cable, or an unfilled file."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Bool
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, Suspicion
from correlation.row_group import group_rows

#: Least number of frequencies of a run with the same number for a suspicion.
FEWEST = 3
#: Relative tolerance for equal amplitudes, rotated by different phases [-].
SAME_AMPLITUDE = 1e-9


def find_dead_rows(campaign: Campaign) -> Bool[NDArray[np.bool_], " k"]:
    """Rows of fundamentals whose amplitude is the same at all frequencies of their run, shape (k,).

    Parameters
    ----------
    campaign
        Campaign. A constant amplitude of a controlled response is not suspected.
    """
    table = campaign.measurement
    dead = np.zeros(len(table), dtype=np.bool_)
    rows = np.flatnonzero(table.harmonic == 1)
    run = group_rows([item[rows] for item in (table.test, table.sensor, table.level, table.repeat)]).number
    by_run = np.argsort(run, kind="stable")
    for own in np.split(rows[by_run], np.flatnonzero(np.diff(run[by_run])) + 1) if len(rows) else ():
        size = np.abs(table.value[own])
        held = campaign.tests[int(table.test[own[0]])].control == "response" and size[0] > 0
        if not held and len(np.unique(table.frequency[own])) >= FEWEST and np.ptp(size) <= SAME_AMPLITUDE * size[0]:
            dead[own] = True
    return dead


def find_dead_channels(campaign: Campaign, dead: Bool[NDArray[np.bool_], " k"]) -> Iterator[Suspicion]:
    """Suspicion for each sensor of a test that is dead in some or all of its runs.

    Parameters
    ----------
    campaign
        Campaign.
    dead
        Result of `find_dead_rows`, shape (k,).
    """
    table = campaign.measurement
    for test, sensor in {*zip(table.test[dead].tolist(), table.sensor[dead].tolist(), strict=True)}:
        own = (table.test == test) & (table.sensor == sensor) & (table.harmonic == 1)
        wrong = own & dead
        where, of = "", campaign.sensors[sensor]
        for name, column, unit in (("level", table.level, f" {campaign.drive.unit}"), ("repeat", table.repeat, "")):
            values = np.unique(column[wrong])
            if len(values) < len(np.unique(column[own])):
                listed = ", ".join(f"{value:.4g}" for value in values)
                where += f" of {name}{'s' if len(values) > 1 else ''} {listed}{unit}"
        size = np.abs(table.value[wrong])
        one = np.ptp(size) <= SAME_AMPLITUDE * size.max()
        reads = "zero" if not size.any() else f"{size[0]:.4g} {of.unit}" if one else "one number per run"
        yield Suspicion(
            where=f'test "{campaign.tests[test].name}", sensor "{of.name}"',
            sentence=f"it reads {reads} at all {int(wrong.sum())} points{where}: a dead channel, or a file that was "
            "not filled? Remove these rows",
        )
