"""Comparison of a measured force with its set point: wrong unit, force of another level, or a clipping drive."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, Suspicion
from correlation.campaign.measurement_unit import find_root_units, find_si_factor
from correlation.row_group import group_rows

#: Forces of one level.
Forces = Float[NDArray[np.float64], " f"]

#: A level is not reached if the ratio of its largest force to its set point is below this fraction of the median ratio
#: of the lowest level [-].
REACHED = 0.95
#: Forces within this relative difference are at the same limit [-].
LIMIT_TOLERANCE = 0.005
#: Least number of readings of a level to determine its largest force.
FEWEST = 3
#: Least ratio between a force and its set point for a suspicion [-]: open loops and shakers at a resonance cause less.
ANOTHER = 1.8
#: Largest distance of a median force from a known factor, that of the other levels, or the set point of another level
#: (natural logarithm) [-]: controlled forces fall by some per cent at a resonance.
FACTOR_TOLERANCE = 0.1
#: Possible wrong units of a force or an acceleration.
UNITS: Mapping[str, Sequence[str]] = {
    "N": ("kN", "mN", "uN", "kgf", "gf", "lbf"),
    "m/s^2": ("g_n", "cm/s^2", "mm/s^2", "um/s^2"),
}


def find_drive_suspicions(campaign: Campaign) -> Iterator[Suspicion]:
    """Levels with a measured force in another unit, of another level, or below its set point.

    A test at a constant response has no set point of the force.

    Parameters
    ----------
    campaign
        Campaign; only measured forces are used.
    """
    for number, test in enumerate(campaign.tests):
        forces = {} if test.control == "response" else _list_forces(campaign, number)
        where, unit = f'test "{test.name}"', campaign.drive.unit
        ratios = {level: float(np.median(force)) / level for level, force in forces.items() if np.median(force) > 0}
        factor = find_common_factor(list(ratios.values())) if campaign.drive.calibrated else None
        if factor is not None and min(abs(np.log(ratio)) for ratio in ratios.values()) > np.log(ANOTHER):
            likely = list_likely_units(factor, unit)
            asked = f"is {' or '.join(likely)}?" if likely else "is the sensitivity of the force, or the level, right?"
            sentence = f"the measured force is {factor:.3g} times its set point at all levels: {asked}"
            yield Suspicion(where=where, sentence=sentence, of_test=bool(likely))
            continue
        others = dict(_suspect_levels(ratios, unit))
        for level, sentence in others.items():
            yield Suspicion(where=f"{where}, level {level:.4g} {unit}", sentence=sentence)
        for level, sentence in _suspect_clipping(
            {level: forces[level] for level in forces if level not in others}, unit
        ):
            yield Suspicion(where=f"{where}, level {level:.4g} {unit}", sentence=sentence)


def _list_forces(campaign: Campaign, test: int) -> dict[float, Forces]:
    """Measured forces of each state by level, lowest first, of levels with enough of them; empty if not measured."""
    table = campaign.measurement
    here = table.test == test
    if not (table.force[here] != table.level[here]).any():
        return {}
    forces = {}
    for level in np.unique(table.level[here]).tolist():
        rows = np.flatnonzero(here & (table.level == level))
        # Each state has a row for every sensor and harmonic.
        states = group_rows([item[rows] for item in (table.frequency, table.sweep, table.repeat, table.order)])
        force = table.force[rows[states.first]]
        if len(force) >= FEWEST:
            forces[level] = force
    return forces


def find_common_factor(ratios: Sequence[float]) -> float | None:
    """The common factor of forces over their set points; None if it is not the same for all.

    Parameters
    ----------
    ratios
        Measured forces over their set points, shape (n,) [-].
    """
    logarithms = np.log(list(ratios))
    return (
        float(np.exp(np.median(logarithms))) if len(logarithms) and np.ptp(logarithms) < 2 * FACTOR_TOLERANCE else None
    )


def list_likely_units(factor: float, unit: str) -> list[str]:
    """Likely units of forces that are a given factor times their set points, in words.

    Parameters
    ----------
    factor
        Measured forces over their set points [-].
    unit
        Stated unit of forces and set points.
    """
    si = next((si for si in UNITS if find_root_units(si)[1] == find_root_units(unit)[1]), "")
    return [
        f"{what} in {name} instead of {unit}"
        for what, own in (("the force", factor), ("the level", 1 / factor))
        for name in ((*UNITS[si], si) if si else ())
        if name != unit and abs(np.log(own * find_si_factor(name, unit))) < FACTOR_TOLERANCE
    ]


def find_mistaken_levels(ratios: Mapping[float, float]) -> dict[float, float]:
    """Levels whose force is the set point of another level, with that level.

    Parameters
    ----------
    ratios
        Measured force over set point [-] by level.
    """
    levels = np.array(list(ratios))
    meant = {}
    for level, ratio in ratios.items():
        apart = np.abs(np.log(levels / (level * ratio)))
        if apart.min() < FACTOR_TOLERANCE and levels[np.argmin(apart)] != level:
            meant[level] = float(levels[np.argmin(apart)])
    return meant


def _suspect_levels(ratios: Mapping[float, float], unit: str) -> Iterator[tuple[float, str]]:
    """Levels whose force is far above their set point, or with interchanged forces, with messages."""
    force = {level: level * ratio for level, ratio in ratios.items()}
    meant = find_mistaken_levels(ratios)
    for level, ratio in ratios.items():
        if is_in_cycle(meant, level):
            other = meant[level]
            word = "exchanged" if meant[other] == level else "mixed up"
            yield (
                level,
                f"the measured force is {force[level]:.4g} {unit}, {ratio:.0%} of its set point, and that of the level "
                f"{other:.4g} {unit}: are levels {word}?",
            )
        elif ratio > ANOTHER:
            like = f", the set point of the level {meant[level]:.4g} {unit}" if level in meant else ""
            yield (
                level,
                f"the measured force is {force[level]:.4g} {unit}, {ratio:.0%} of its set point{like}: is this level "
                "right?",
            )


def is_in_cycle(meant: Mapping[float, float], level: float) -> bool:
    """Whether the map from a level to the level whose force it has is a cycle; for clipping levels it is not.

    Parameters
    ----------
    meant
        Levels with the level whose force they have.
    level
        A level.
    """
    at = meant.get(level)
    for _ in meant:
        if at is None or at == level:
            break
        at = meant.get(at)
    return at == level


def _suspect_clipping(forces: Mapping[float, Forces], unit: str) -> Iterator[tuple[float, str]]:
    """Levels that the force does not reach, relative to the lowest level, with messages."""
    if len(forces) < 2:
        return
    lowest, *higher = forces
    usual = float(np.median(forces[lowest])) / lowest
    for level in higher:
        largest = float(forces[level].max())
        if largest < REACHED * usual * level:
            flat = int((forces[level] > (1 - LIMIT_TOLERANCE) * largest).sum())
            yield (
                level,
                f"the measured force is at most {largest:.4g} {unit}, {largest / level:.0%} of its set point, where "
                f"the level {lowest:.4g} {unit} has {usual:.0%}; {flat} of {len(forces[level])} readings are at this "
                "limit: does the drive clip? The model assumes a sinusoidal force",
            )
