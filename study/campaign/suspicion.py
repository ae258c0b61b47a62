"""Suspected mistakes in measured tables, with their evidence."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from correlation.campaign.passes import SWEEP_WORDS, find_difference
from study.campaign.column_role import Role
from study.campaign.draft_frequency import (
    find_force_column,
    is_response_controlled,
    make_complex_force,
    pair_responses_with_phases,
)
from study.campaign.dwell import find_contradicted_frequency
from study.campaign.named_level import find_wrong_names
from study.campaign.table_kind import JudgedTable, Kind
from study.campaign.time_history import FLAT, compute_share_near_limit

Series = Float[NDArray[np.float64], " n"]

#: Smallest ratio of the largest to the smallest force of a table that is reported as a varying force [-].
FORCE_FACTOR = 1.3
#: Fraction of samples at the largest or smallest value above which a channel is suspected to clip [-].
CLIPPED = 0.01


def list_suspicions(tables: Sequence[JudgedTable]) -> list[str]:
    """Suspicions of all tables, one sentence each.

    Parameters
    ----------
    tables
        Judged tables.
    """
    sentences: list[str] = []
    for judged in tables:
        if judged.kind is Kind.NOT_USED:
            continue
        sentences += _suspect_dead_channels(judged)
        if judged.kind is Kind.STEPPED_SINE:
            sentences += _suspect_branches(judged) + _suspect_varying_force(judged)
        elif judged.kind is Kind.STEADY_STATE:
            sentences += _suspect_clipping(judged) + _suspect_frequency_of_name(judged)
        elif judged.kind in {Kind.RECORD, Kind.RING_DOWN, Kind.LOOP}:
            sentences += _suspect_clipping(judged)
    return list(dict.fromkeys([*sentences, *find_wrong_names(tables)]))


def _suspect_branches(judged: JudgedTable) -> list[str]:
    """Report rising and falling sweeps on two branches."""
    frequency, sweeps = judged.of_role(Role.FREQUENCY)[0], judged.of_role(Role.SWEEP)
    sentences = []
    for rows in judged.rows():
        mask = judged.mask(rows)
        if sweeps and sweeps[0].words:
            names = np.array([SWEEP_WORDS[word.lower()] > 0 for word in sweeps[0].words])
            rising = names[sweeps[0].values[mask].astype(int)]
        else:
            rising = _find_rises(frequency.values[mask])
        for column, _ in pair_responses_with_phases(judged):
            at_rows, size = frequency.values[mask].real, np.abs(column.values[mask])
            order = np.argsort(at_rows, kind="stable")
            up, down = order[rising[order]], order[~rising[order]]
            apart = find_difference(at_rows[up], size[up], at_rows[down], size[down])
            if apart is not None:
                at = f" at {', '.join(f'{key} = {value}' for key, value in rows.items())}" if rows else ""
                sentences.append(
                    f'{judged.table.file.path.name}: "{column.name}"{at}: rising and falling sweeps differ by up to a '
                    f"factor of {apart.factor:.2g} from {apart.first:g} to {apart.last:g} Hz: these are two branches, "
                    "not repeats"
                )
    return sentences


def _find_rises(frequency: Series) -> Bool[NDArray[np.bool_], " n"]:
    """Whether the frequency rises at each row; rows of equal frequency have the direction before them."""
    steps = np.sign(np.diff(frequency))
    moving = np.flatnonzero(steps)
    if not len(moving):
        return np.ones(len(frequency), dtype=bool)
    last = np.searchsorted(moving, np.arange(len(steps)), side="right") - 1
    steps = steps[moving[np.maximum(last, 0)]]
    return np.asarray(np.concatenate([steps[:1], steps]) > 0)


def _suspect_varying_force(judged: JudgedTable) -> list[str]:
    """Report a force that varies, such as that of a shaker at a resonance."""
    force, values = find_force_column(judged), make_complex_force(judged)
    if force is None or values is None:
        return []
    size = np.abs(values)
    size = size[np.isfinite(size) & (size > 0)]
    if not len(size) or size.max() < FORCE_FACTOR * size.min() or judged.settings:
        return []
    if is_response_controlled(judged, values, pair_responses_with_phases(judged)[0][0], {}):
        return []
    return [
        f'{judged.table.file.path.name}: "{force.name}" varies from {size.min():.4g} to {size.max():.4g}: the force '
        "of each point is used; the level is the median"
    ]


def _suspect_frequency_of_name(judged: JudgedTable) -> list[str]:
    """Report a drive frequency that differs from that in the name of the file."""
    differ = find_contradicted_frequency(judged)
    if differ is None:
        return []
    return [
        f"{judged.table.file.path.name}: {differ[0]:g} Hz in its name, but its drive has {differ[1]:.4g} Hz, which is "
        "used: is the sampling rate correct?"
    ]


def _suspect_dead_channels(judged: JudgedTable) -> list[str]:
    return [
        f'{judged.table.file.path.name}: "{column.name}" has the same value in all rows: a dead channel?'
        # A force at its set point may be constant.
        for column in judged.of_role(Role.RESPONSE)
        if len(column.values) > 3 and (column.values == column.values[0]).all()
    ]


def _suspect_clipping(judged: JudgedTable) -> list[str]:
    sentences = []
    # The force of a loop is constant while its contact slips.
    for column in judged.of_role(*([Role.RESPONSE] if judged.kind is Kind.LOOP else [Role.RESPONSE, Role.FORCE])):
        values = column.values.real
        is_force = judged.columns[column.name].role is Role.FORCE
        asked = "does the drive clip, or this channel?" if is_force else "does it clip?"
        name = f'{judged.table.file.path.name}: "{column.name}"'
        flat = [
            f"{name} is {limit:.4g} in {100 * share:.1f} % of its samples: {asked}"
            for limit in (values.max(), values.min())
            if (share := _share_at(values, limit)) > CLIPPED
        ]
        near = compute_share_near_limit(values)
        if not flat and is_force and judged.kind is Kind.STEADY_STATE and near > FLAT:
            flat = [
                f"{name} is within 10 % of its largest value in {100 * near:.0f} % of its samples; for a sine this is "
                f"29 %: {asked}"
            ]
        sentences += flat
    return sentences


def _share_at(values: Series, limit: float) -> float:
    """Fraction of samples with a value [-]; 0 unless three of them are successive, and for the value 0."""
    there = values == limit
    # A sine sampled synchronously with its period often has its largest value, but not in successive samples.
    in_a_row = bool((there[2:] & there[1:-1] & there[:-2]).any())
    return float(np.mean(there)) if in_a_row and limit != 0 else 0.0
