"""A drive that does not reach its set point at the higher levels: an amplifier that clips, or a shaker at its limit."""

from collections.abc import Iterator

import numpy as np

from correlation.campaign.measurement import Campaign, Suspicion
from correlation.row_group import group_rows

#: A level is not reached if its largest force over its set point is below this share of that of the lowest level [-].
REACHED = 0.95
#: Forces that differ by less stand at one limit [-].
FLAT = 0.005
#: Readings of a level that tell its largest force.
FEWEST = 3


def find_drive_suspicions(campaign: Campaign) -> Iterator[Suspicion]:
    """Levels that the measured force never reaches, though it reaches lower ones.

    A test at a constant response has no set point of the force.

    Parameters
    ----------
    campaign
        Campaign; only forces that were measured tell.
    """
    table = campaign.measurement
    for number, test in enumerate(campaign.tests):
        if test.control == "response":
            continue
        here = table.test == number
        levels = np.unique(table.level[here])
        if not (table.force[here] != table.level[here]).any():
            continue  # not measured
        forces = {}
        for level in levels.tolist():
            rows = np.flatnonzero(here & (table.level == level))
            # Each state has a row for every sensor and harmonic.
            states = group_rows([each[rows] for each in (table.frequency, table.sweep, table.repeat, table.order)])
            force = table.force[rows[states.first]]
            if len(force) >= FEWEST:
                forces[level] = force
        if len(forces) < 2:
            continue
        lowest, *higher = forces
        usual = float(np.median(forces[lowest])) / lowest
        for level in higher:
            largest = float(forces[level].max())
            if largest < REACHED * usual * level:
                flat = int((forces[level] > (1 - FLAT) * largest).sum())
                unit = campaign.drive.unit
                yield Suspicion(
                    where=f'test "{test.name}", level {level:.4g} {unit}',
                    sentence=f"the measured force is at most {largest:.4g} {unit}, {largest / level:.0%} of its set "
                    f"point, where the level {lowest:.4g} {unit} has {usual:.0%}; {flat} of {len(forces[level])} "
                    "readings stand at this limit: does the drive clip? A force that clips is no sine, and the "
                    "model's is",
                )
