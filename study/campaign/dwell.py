"""Dwells, each with one steady state: recognition in groups, and check of the frequency in their names."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from correlation.errors import CampaignError
from correlation.signal.harmonics import find_frequency
from correlation.signal.steady_state import fit_steady_state
from study.campaign.column_role import Role
from study.campaign.draft_frequency import find_force_column
from study.campaign.run_name import find_frequency_in_name, make_naming_scheme
from study.campaign.table import make_file_stem
from study.campaign.table_kind import JudgedTable, Kind
from study.campaign.time_history import SECONDS, Samples


def extend_steady_states(tables: Sequence[JudgedTable]) -> list[JudgedTable]:
    """Judge records as steady states if most tables of the same naming scheme and channels are steady states.

    The motion of a joint that chatters near its resonance is not recognised as a steady state. Its force must be
    periodic, at the frequency in the name if there is one.

    Parameters
    ----------
    tables
        Judged tables of all files.
    """
    groups: dict[tuple[str, ...], list[JudgedTable]] = {}
    for judged in tables:
        groups.setdefault(_make_scheme(judged), []).append(judged)
    evidence = {}
    for members in groups.values():
        steady = [judged for judged in members if judged.kind is Kind.STEADY_STATE]
        for judged in members if 2 * len(steady) > len(members) else ():
            if judged.kind is Kind.RECORD and _is_driven_as_named(judged):
                evidence[id(judged)] = f"like {len(steady)} others with similar names and channels"
    return [
        replace(judged, kind=Kind.STEADY_STATE, evidence=evidence[id(judged)]) if id(judged) in evidence else judged
        for judged in tables
    ]


def find_dwell_frequencies(tables: Sequence[JudgedTable]) -> list[float]:
    """Frequency of each steady state [Hz]: from its name if all names agree with the data, else from the data."""
    named = [find_frequency_in_name(judged.table.label) for judged in tables]
    in_names = [one for one, judged in zip(named, tables, strict=True) if one is not None and _has_line(judged, one)]
    return in_names if len(in_names) == len(tables) else [_fit_frequency(judged) for judged in tables]


def find_contradicted_frequency(judged: JudgedTable) -> tuple[float, float] | None:
    """Frequencies in the name of a steady state and of its drive [Hz], if they differ; else None."""
    named = find_frequency_in_name(judged.table.label)
    if named is None or _has_line(judged, named):
        return None
    result = _find_drive_frequency(judged)
    return (named, result) if np.isfinite(result) else None


def _make_scheme(judged: JudgedTable) -> tuple[str, ...]:
    table = judged.table
    names = [table.short_name(column) for column in table.columns]
    return (
        make_naming_scheme(make_file_stem(table.file.path.name)),
        make_naming_scheme(table.path),
        table.file.format,
        *names,
    )


def _is_driven_as_named(judged: JudgedTable) -> bool:
    """Whether a record has a time and a periodic drive, whose frequency does not contradict the name."""
    has_time = bool(judged.of_role(Role.TIME)) and find_force_column(judged) is not None
    return has_time and np.isfinite(_find_drive_frequency(judged)) and find_contradicted_frequency(judged) is None


def _has_line(judged: JudgedTable, frequency: float) -> bool:
    """Whether the strongest frequency of the drive equals a frequency, within one line spacing of its spectrum."""
    time, _ = _drive(judged)
    return abs(_find_drive_frequency(judged) - frequency) < 1.0 / float(time[-1] - time[0])


def _find_drive_frequency(judged: JudgedTable) -> float:
    """Strongest frequency of the drive [Hz]; NaN if there is none."""
    time, drive = _drive(judged)
    try:
        return find_frequency(time, drive[np.newaxis])
    except CampaignError:
        return float("nan")


def _fit_frequency(judged: JudgedTable) -> float:
    """Frequency of the drive by a fit of a steady state [Hz]; 0 if the fit fails."""
    time, drive = _drive(judged)
    try:
        return float(fit_steady_state(time, drive, drive, 1).frequency)
    except CampaignError:
        return 0.0


def _drive(judged: JudgedTable) -> tuple[Samples, Samples]:
    """Instants [s] and values of the force, or of the first response without a force, shape (n,) each."""
    time = judged.of_role(Role.TIME)[0]
    column = find_force_column(judged) or judged.of_role(Role.RESPONSE)[0]
    mask = judged.mask(judged.rows()[0])
    seconds = SECONDS.get(judged.columns[time.name].unit, 1.0)
    return seconds * time.values.real[mask], column.values.real[mask]
