"""Comparison of the levels in the names of runs with the measured forces."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from correlation.campaign.measurement_unit import find_si_factor
from correlation.campaign.signal_entry import PEAK_OF
from correlation.data_quality.constant_factor import AMPLITUDES
from correlation.data_quality.drive import (
    ANOTHER,
    FACTOR_TOLERANCE,
    find_common_factor,
    find_mistaken_levels,
    is_in_cycle,
    list_likely_units,
)
from study.campaign.amplitude import find_stated_amplitude
from study.campaign.draft_frequency import find_force_column
from study.campaign.level import find_force_in_name
from study.campaign.set_point import HELD
from study.campaign.table_kind import JudgedTable, Kind
from study.campaign.time_history import estimate_sine_amplitude

USED = "the measured force is used"


class _NamedLevel(NamedTuple):
    """Run with a level in its name: file, text and value of the level [N], channel, force [N] and unit in the file."""

    file: str
    words: str
    level: float
    channel: str
    force: float
    unit: str

    @property
    def differs(self) -> bool:
        return abs(self.force - self.level) >= HELD * self.level


def find_wrong_names(tables: Sequence[JudgedTable]) -> Iterator[str]:
    """Suspected causes of differences between levels in names and measured forces, one sentence per cause.

    Parameters
    ----------
    tables
        Judged tables of a campaign.
    """
    runs = [run for judged in tables if (run := _find_named_level(judged)) is not None]
    if runs and all(run.differs for run in runs) and len({run.level for run in runs}) > 1:
        factor = find_common_factor([run.force / run.level for run in runs])
        if factor is not None and (sentence := _describe_factor(runs, factor)):
            yield sentence
            return
    by_level = {level: [run for run in runs if run.level == level] for level in sorted({run.level for run in runs})}
    ratios = {level: float(np.median([run.force for run in same])) / level for level, same in by_level.items()}
    meant = find_mistaken_levels(ratios)
    for level, same in by_level.items():
        wrong = [run for run in same if run.differs]
        if wrong and is_in_cycle(meant, level):
            other = by_level[meant[level]][0].words
            yield (
                f"{_name(wrong)}, and the measured force is {_range(wrong)}, which is that of the runs named "
                f'"{other}": are the names of levels interchanged? {USED.capitalize()}'
            )
        elif wrong:
            yield (
                f'{_name(wrong)}, but "{wrong[0].channel}" is {_range(wrong)}: did the drive clip, or is one of them '
                f"an rms or peak-to-peak value? {USED.capitalize()}"
            )


def _find_named_level(judged: JudgedTable) -> _NamedLevel | None:
    if judged.kind not in {Kind.STEPPED_SINE, Kind.STEADY_STATE}:
        return None
    force = find_force_column(judged)
    level, words = (None, "") if force is None else find_force_in_name(judged, force.name)
    if force is None or level is None or not level > 0:
        return None
    is_history = judged.kind is Kind.STEADY_STATE
    size = abs(estimate_sine_amplitude(force.values.real) if is_history else float(np.nanmedian(np.abs(force.values))))
    if not size > 0:
        return None
    if not is_history:  # the level in a name may be a peak value, or have the convention of the force
        peak = size * PEAK_OF.get(find_stated_amplitude(judged, force), 1.0)
        size = min(size, peak, key=lambda force: abs(np.log(force / level)))
    unit = judged.columns[force.name].unit
    newtons = find_si_factor(unit, "N")
    return _NamedLevel(judged.table.file.path.name, words, newtons * level, force.name, newtons * size, unit)


def _describe_factor(runs: Sequence[_NamedLevel], factor: float) -> str:
    """Sentence on one factor of all runs and its possible causes; empty for a small factor without a known cause."""
    units = list_likely_units(factor, runs[0].unit)
    amplitudes = [
        f"the force {own} and the level in the name {read}"
        for known, (own, read) in AMPLITUDES.items()
        if abs(np.log(factor / known)) < FACTOR_TOLERANCE
    ]
    if not units and not amplitudes and abs(np.log(factor)) < np.log(ANOTHER):
        return ""
    asked = (
        f"is {' or '.join([*units, *amplitudes])}"
        if units or amplitudes
        else "is the sensitivity of the force sensor correct"
    )
    remedy = "; if it is wrong, correct the unit of its column" if units else ""
    called = ", ".join(f'"{words}"' for words in dict.fromkeys(run.words for run in runs))
    return (
        f"{', '.join(dict.fromkeys(run.file for run in runs))}: the measured force of each of {len(runs)} runs is "
        f"{factor:.4g} times the level in its name ({called}): {asked}? {USED.capitalize()}{remedy}"
    )


def _name(runs: Sequence[_NamedLevel]) -> str:
    """Files of some runs and the level in their names, in words."""
    several = f" of {len(runs)} runs" if len(runs) > 1 else ""
    return f'{", ".join(dict.fromkeys(run.file for run in runs))}: "{runs[0].words}" in the name{several}'


def _range(runs: Sequence[_NamedLevel]) -> str:
    """Range of the measured forces, in words."""
    low, high = (f"{pick(run.force for run in runs):.4g}" for pick in (min, max))
    return f"{low} N" if low == high else f"{low} to {high} N"
