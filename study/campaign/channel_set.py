"""Sets of channels in one table, such as one column per level: the table is split into one table per set.

If a table has a channel several times, the sets follow from names, texts of datasets, the axis of an array with the
length of a vector of levels, or the order of the channels. A channel of an unknown set is left out by name: with the
force or the frequencies of another set it would be wrong by a factor.
"""

import re
from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from correlation.file.column import Column
from correlation.file.quantity import OF_UNIT
from correlation.file.unit_label import split_label
from study.campaign.column_role import RATIOS, WORDS, Role, name_words, recognise_column
from study.campaign.run_name import (
    HARMONIC_IN_NAME,
    LEVEL_BESIDE_UNIT,
    LEVEL_IN_NAME,
    OF_COLUMN,
    QUANTITY_OF_COLUMN,
    split_name,
)
from study.campaign.table import MeasuredTable

#: Roles of columns that apply to all sets of a table.
SHARED = {Role.FREQUENCY, Role.TIME, Role.LEVEL, Role.SWEEP, Role.ORDER, Role.REPEAT, Role.HARMONIC, Role.SENSOR}
#: Suffix of a repeated column name, from `make_unique_names`.
AGAIN = re.compile(r" \((\d+)\)$")
REMEDY = "write its run by hand as [[run]], or add the set to its name"


@dataclass(kw_only=True)
class ChannelSets:
    """Sets of channels of one table.

    Parameters
    ----------
    marks
        Words that identify the set of each column, by the name of the column; a column without mark is in all sets.
    names
        Short names of channels without these words, by the names of their columns.
    lost
        Reasons why the set of some columns is not known, by their names.
    scalars
        Numbers of each set, by its mark.
    """

    marks: dict[str, str]
    names: dict[str, str] = field(default_factory=dict)
    lost: dict[str, str] = field(default_factory=dict)
    scalars: dict[str, dict[str, float]] = field(default_factory=dict)


Finder = Callable[[MeasuredTable], ChannelSets | None]


def split_sets(table: MeasuredTable, finders: Iterable[Finder]) -> tuple[list[MeasuredTable], list[str]]:
    """Split a table into one table per set of channels.

    Parameters
    ----------
    table
        Table.
    finders
        Functions that find sets; the first that returns a result is used.

    Returns
    -------
    Table of each set, and one sentence on each column that is not used.
    """
    sets = next((result for find in finders if (result := find(table)) is not None), None)
    if sets is None:
        return [table], []
    roles = {column.name: find_role(table, column, sets.names) for column in table.columns}
    order = list(dict.fromkeys(mark for column in table.columns if (mark := sets.marks.get(column.name, ""))))
    lost = dict(sets.lost)
    of_level = any(LEVEL_IN_NAME.search(mark) or sets.scalars.get(mark) for mark in order)
    harmonics = {mark: number for mark in order if (number := read_harmonic(mark)) is not None}
    marks, names = dict(sets.marks), {**table.names, **sets.names}
    for column in table.columns if len(order) > 1 else ():
        role = roles[column.name]
        if marks.get(column.name) or column.name in lost or role in SHARED:
            continue
        if harmonics and role is not Role.FORCE:
            marks[column.name] = next((mark for mark in order if harmonics.get(mark) == 1), order[0])
        elif role in {Role.RESPONSE, Role.PHASE, Role.COHERENCE} or (role is Role.FORCE and of_level):
            lost[column.name] = f"it may belong to any of {_name_some(order)}"
    tables = []
    for mark in order or [""]:
        own = [one for one in table.columns if one.name not in lost and marks.get(one.name, "") in {"", mark}]
        if order and not any(marks.get(one.name) == mark and is_response(roles[one.name]) for one in own):
            alone = [one.name for one in own if marks.get(one.name) == mark]
            lost |= dict.fromkeys(alone, f'no response belongs to "{mark}"')
            continue
        tables.append(
            replace(
                table, columns=tuple(own), of_set=" ".join(word for word in (table.of_set, mark) if word), names=names,
                scalars={**table.scalars, **sets.scalars.get(mark, {})}, harmonic=harmonics.get(mark, table.harmonic),
            )
        )  # fmt: skip
    file = table.file.path.name
    return tables, [f'{file}: "{name}" is not used: {why}; {REMEDY}' for name, why in lost.items()]


def find_role(table: MeasuredTable, column: Column, names: Mapping[str, str] | None = None) -> Role:
    """Role of a column, judged without its table."""
    return recognise_column(column, (names or {}).get(column.name) or table.short_name(column)).role


def is_response(role: Role) -> bool:
    """Whether a column is a response, or is not recognised and may be one."""
    return role in {Role.RESPONSE, Role.OTHER}


def read_harmonic(mark: str) -> int | None:
    """Number of the harmonic in the mark of a set; None without one."""
    match = HARMONIC_IN_NAME.fullmatch(mark)
    return int(match[1]) if match else None


def find_sets_by_name(table: MeasuredTable) -> ChannelSets | None:
    """Sets by words in the names of columns: "A_1N" and "A_3N", "tip run1" and "tip run2", "tip up" and "tip down"."""
    splits = {one.name: _split_run(table, one) for one in table.columns if one.response is None}
    return _make_sets(table, splits) or find_sets_by_quantity(table)


def find_sets_by_quantity(table: MeasuredTable) -> ChannelSets | None:
    """Sets by a number with another unit than a level, "Acc 1000rpm", if each has a force: else it may be a place."""
    splits = {
        one.name: split_name(table.short_name(one), QUANTITY_OF_COLUMN) for one in table.columns if one.response is None
    }
    sets = _make_sets(table, splits)
    if sets is None:
        return None
    driven = {sets.marks.get(one.name, "") for one in table.columns if find_role(table, one) is Role.FORCE}
    return sets if driven >= {*sets.marks.values()} else None


def _split_run(table: MeasuredTable, column: Column) -> tuple[str, str]:
    """Name of a column without the words of its run, and these words."""
    name = table.short_name(column)
    if split_label(LEVEL_BESIDE_UNIT.sub("", name))[1]:
        return split_name(name, *OF_COLUMN, LEVEL_BESIDE_UNIT)
    # With a separate row of units, "Acc 1 g" may be channel 1.
    if column.unit_label and (not split_label(name)[1] or find_role(table, column) is Role.FORCE):
        return split_name(name, *OF_COLUMN, LEVEL_BESIDE_UNIT, has_unit=False)
    return split_name(name, *OF_COLUMN)


def find_sets_by_harmonic(table: MeasuredTable) -> ChannelSets | None:
    """Sets by the harmonics of responses, one column each: "tip H1" and "tip H3"; H1 of a ratio is an estimator."""
    splits = {
        one.name: split_name(table.short_name(one), HARMONIC_IN_NAME) for one in table.columns if one.response is None
    }
    if _make_sets(table, splits) is None:
        return None
    roles = {one.name: find_role(table, one) for one in table.columns}
    words = {word for one in table.columns for word in name_words(table.short_name(one))}
    ratios = any("/N" in one.unit or "/(N)" in one.unit or "response" in one.function for one in table.columns)
    if Role.FREQUENCY not in roles.values() or Role.COHERENCE in roles.values() or ratios or words & RATIOS - {"h"}:
        return None
    sets = _make_sets(table, {name: one for name, one in splits.items() if roles[name] is not Role.FORCE})
    numbers = {read_harmonic(mark) for mark in sets.marks.values() if mark} if sets else set()
    # H1 and H2 alone may be estimators, unless the table has a force.
    are_harmonics = 1 in numbers and (max(n or 0 for n in numbers) > 2 or Role.FORCE in roles.values())
    return sets if are_harmonics else None


def find_sets_by_abscissa(table: MeasuredTable) -> ChannelSets | None:
    """Sets with a time or frequency column each, followed by equal numbers of columns: "f1, A1, f2, A2"."""
    places = [place for place, one in enumerate(table.columns) if _is_abscissa(table, one)]
    if len(places) < 2 or places[0] != 0 or any(one.abscissa or one.response for one in table.columns):
        return None
    size = places[1]
    first = table.columns[0].values
    in_blocks = size > 1 and places == list(range(0, len(table.columns), size)) and len(table.columns) % size == 0
    if not in_blocks or all(np.array_equal(first, table.columns[one].values, equal_nan=True) for one in places):
        return None
    roles = [find_role(table, one) for one in table.columns]
    if not all(any(is_response(role) for role in roles[one + 1 : one + size]) for one in places):
        return None
    return ChannelSets(marks={one.name: f"set {1 + number // size}" for number, one in enumerate(table.columns)})


def _is_abscissa(table: MeasuredTable, column: Column) -> bool:
    """Whether a column is a time or a frequency by its role, and its unit or a word of its name is that of one."""
    words = {*name_words(table.short_name(column))}
    may_be = OF_UNIT.get(column.unit) in {"time", "frequency"} or words & (WORDS[Role.TIME] | WORDS[Role.FREQUENCY])
    return bool(may_be) and find_role(table, column) in {Role.TIME, Role.FREQUENCY}


def find_sets_by_header(table: MeasuredTable) -> ChannelSets | None:
    """Sets of columns with repeated headers, with a force in each set: "Force, Amp, Force, Amp"."""
    names = {column.name for column in table.columns}
    channels = {one.name: AGAIN.sub("", one.name) for one in table.columns}
    channels = {name: channel if channel in names else name for name, channel in channels.items()}
    counts = Counter(channels.values())
    if len(counts) == len(channels):
        return None
    roles = {one.name: find_role(table, one, channels) for one in table.columns}
    forces = {channels[name] for name, role in roles.items() if role is Role.FORCE and counts[channels[name]] > 1}
    if not forces:
        return None
    number = max(counts[channel] for channel in forces)
    repeated = {channel for channel, count in counts.items() if count > 1}
    if any(counts[channel] != number for channel in repeated):
        why = "its header occurs several times, but not as often as that of the force"
        return ChannelSets(
            marks={}, lost={name: why for name, channel in channels.items() if channel in repeated - forces}
        )
    marks = number_sets({name: channel for name, channel in channels.items() if channel in repeated})
    return ChannelSets(marks=marks, names={name: channels[name] for name in marks})


def number_sets(channels: Mapping[str, Hashable]) -> dict[str, str]:
    """Mark of each column by its number among the columns of its channel: "set 1" for the first."""
    counts: Counter[Hashable] = Counter()
    marks = {}
    for name, channel in channels.items():
        counts[channel] += 1
        marks[name] = f"set {counts[channel]}"
    return marks


def _make_sets(table: MeasuredTable, marked: Mapping[str, tuple[str, str]]) -> ChannelSets | None:
    """Sets from the channel and mark of each column; None unless a response has several marks."""
    result: dict[str, set[str]] = {}
    for channel, mark in marked.values():
        result.setdefault(channel, set()).update([mark] if mark else [])
    if not any(len(words) > 1 for words in result.values()):
        return None
    named = {name: (channel or "response", mark) for name, (channel, mark) in marked.items() if mark}
    named |= _find_columns_below(table, named)
    marks: dict[str, set[str]] = {}
    for column in table.columns:
        channel, mark = named.get(column.name, ("", ""))
        if mark and is_response(recognise_column(column, channel).role):
            marks.setdefault(channel, set()).add(mark)
    if not any(len(words) > 1 for words in marks.values()):
        return None
    return ChannelSets(
        marks={name: mark for name, (_, mark) in named.items()},
        names={name: channel for name, (channel, _) in named.items()},
    )


def _find_columns_below(table: MeasuredTable, named: Mapping[str, tuple[str, str]]) -> dict[str, tuple[str, str]]:
    """Channel and mark of columns with equal headers, one in each set, as below a merged cell of a spreadsheet."""
    names = {column.name for column in table.columns}
    alike: dict[str, list[str]] = {}
    for column in table.columns:
        channel = AGAIN.sub("", column.name)
        if column.name not in named and find_role(table, column) not in SHARED and channel in names:
            alike.setdefault(channel, []).append(column.name)
    place = {column.name: number for number, column in enumerate(table.columns)}
    order = list(dict.fromkeys(named[column.name][1] for column in table.columns if column.name in named))
    begins = [min(place[name] for name, (_, mark) in named.items() if mark == one) for one in order]
    ends = [*begins[1:], len(place)]

    def is_below(same: Sequence[str]) -> bool:
        pairs = zip(begins, same, ends, strict=True)
        return all(begin <= place[name] < end for begin, name, end in pairs)

    return {
        name: (channel, mark)
        for channel, same in alike.items()
        if len(same) == len(order) > 1 and is_below(same)
        for name, mark in zip(same, order, strict=True)
    }


def _name_some(marks: Sequence[str]) -> str:
    return f"{', '.join(marks[:3])}{' ...' if len(marks) > 3 else ''}"
