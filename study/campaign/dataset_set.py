"""Sets of channels in a universal file: its datasets by the lines of text in them, or by their order."""

import re
from collections import Counter
from collections.abc import Hashable, Mapping, Sequence

from correlation.file.column import Column
from study.campaign.channel_set import ChannelSets, is_response, number_sets
from study.campaign.column_role import Role, recognise_column
from study.campaign.run_name import HARMONIC_IN_NAME, LEVEL_IN_NAME, REPEAT_IN_NAME, RUN_IN_NAME
from study.campaign.table import Table

#: Lines of a dataset that may tell its set, and what in them tells it.
LINES = ("line 1", "line 2", "line 4", "line 5", "line 3", "z")
TELLING = (LEVEL_IN_NAME, HARMONIC_IN_NAME, REPEAT_IN_NAME, RUN_IN_NAME, re.compile(r".+"))
#: Estimators of a frequency response.
ESTIMATOR = re.compile(r"(?<![A-Za-z\d])H[12v](?![A-Za-z\d])")
#: Number of a dataset at the beginning of the name of its column.
DATASET = re.compile(r"^58 #\d+ ")
FREQUENCY_RESPONSE = "frequency response"


def sets_by_dataset(table: Table) -> ChannelSets | None:
    """Sets of the datasets of one abscissa; frequency responses are repeats unless their texts have levels.

    Parameters
    ----------
    table
        Table of a universal file.
    """
    columns = [one for one in table.columns if one.response is not None and one.abscissa is not None]
    points = Counter(_point(one) for one in columns)
    if max(points.values(), default=1) < 2:
        return _named(_common_level(table, columns), columns)
    roles = {one.name: recognise_column(one, table.short_name(one)).role for one in columns}
    measured = [one for one in columns if roles[one.name] is Role.FORCE or is_response(roles[one.name])]
    keys = {one.name: _channel(one, roles[one.name]) for one in measured}
    counts = Counter(keys.values())
    if max(counts.values(), default=1) < 2:
        return _named(_common_level(table, columns), columns)
    driven = {keys[one.name] for one in measured if roles[one.name] is Role.FORCE}
    are_ratios = any(one.function == FREQUENCY_RESPONSE for one in measured)
    if are_ratios:
        return _estimates(measured, keys) or _named(_levels(columns, keys), columns)
    marks = _by_text(measured, keys, driven) or _by_order(measured, keys)
    if marks is not None:
        return _named(marks, measured)
    why = "its sensor has several datasets, and neither their texts nor their order tell which belong together"
    return ChannelSets(marks={}, lost={name: why for name, key in keys.items() if counts[key] > 1})


def _channel(column: Column, role: Role) -> Hashable:
    """What a dataset measures and where; one that names no point is a channel of its own."""
    reference = column.reference
    to = None if reference is None else (reference.node or reference.name, reference.direction.lstrip("+-"))
    kind = (column.function, role, column.unit, column.facts.get("quantity", ""))
    return _point(column), to, kind


def _point(column: Column) -> Hashable:
    """Point and direction of a dataset; its own name if it says no point."""
    point = column.response
    if point is None or (point.node is None and not point.name):
        return column.name
    return point.node or point.name, point.direction.lstrip("+-")


def _by_text(columns: Sequence[Column], keys: Mapping[str, Hashable], driven: set[Hashable]) -> dict[str, str] | None:
    """Set of each dataset by what one of its lines tells: a level, harmonic or repeat, else the whole line."""
    most = max(Counter(keys.values()).values())
    for telling in TELLING:
        for line in LINES:
            found = {one.name: telling.search(one.facts.get(line, "")) for one in columns}
            marks = {name: _mark(telling, match) for name, match in found.items() if match}
            groups: dict[str, list[Hashable]] = {}
            for name, mark in marks.items():
                groups.setdefault(mark, []).append(keys[name])
            alone = {key for name, key in keys.items() if name not in marks}
            # A force without the text of a level or repeat is that of nobody knows which.
            shared = alone <= driven and telling is HARMONIC_IN_NAME
            if (
                len(groups) == most > 1
                and all(len({*group}) == len(group) and {*group} - driven for group in groups.values())
                and (all({*group} >= driven for group in groups.values()) if not alone else shared)
            ):
                return marks
    return None


def _mark(telling: re.Pattern[str], match: re.Match[str]) -> str:
    return f"harmonic {int(match[1])}" if telling is HARMONIC_IN_NAME else match[0].strip()


def _by_order(columns: Sequence[Column], keys: Mapping[str, Hashable]) -> dict[str, str] | None:
    """Set of each dataset by its place, if all sets have one order, or all channels the same number of datasets."""
    counts = Counter(keys.values())
    number = max(counts.values())
    if any(count != number for count in counts.values()):
        return None
    order = [keys[one.name] for one in columns]
    channels = list(dict.fromkeys(order))
    if order not in (channels * number, [key for key in channels for _ in range(number)]):
        return None
    return number_sets({one.name: keys[one.name] for one in columns})


def _estimates(columns: Sequence[Column], keys: Mapping[str, Hashable]) -> ChannelSets | None:
    """Of several estimates of one frequency response the first is kept."""
    found = {
        one.name: match[0]
        for one in columns
        if (match := ESTIMATOR.search(" ".join(one.facts.get(line, "") for line in LINES)))
    }
    kept: dict[Hashable, str] = {}
    lost: dict[str, str] = {}
    for name, estimator in found.items():
        first = kept.setdefault(keys[name], estimator)
        if estimator != first:
            lost[name] = f"it is the estimate {estimator} of a response whose estimate {first} is used, no repeat"
    return ChannelSets(marks={}, lost=lost) if lost else None


def _levels(columns: Sequence[Column], keys: Mapping[str, Hashable]) -> dict[str, str] | None:
    """Set of each frequency response by the level in its text."""
    for line in LINES:
        found = {one.name: LEVEL_IN_NAME.search(one.facts.get(line, "")) for one in columns}
        marks = {name: match[0] for name, match in found.items() if match}
        pairs = [(keys[name], mark) for name, mark in marks.items() if name in keys]
        if len(pairs) == len(keys) == len({*pairs}) and len({*marks.values()}) > 1:
            return marks
    return None


def _common_level(table: Table, columns: Sequence[Column]) -> dict[str, str] | None:
    """The level in the texts of all datasets of one abscissa, where those of other abscissas are other sets."""
    if len({one.abscissa for one in table.file.columns if one.abscissa}) < 2:
        return None
    for line in LINES:
        found = [LEVEL_IN_NAME.search(one.facts.get(line, "")) for one in columns]
        levels = {match[0] for match in found if match}
        if len(levels) == 1 and all(found):
            return dict.fromkeys((one.name for one in columns), levels.pop())
    return None


def _named(marks: dict[str, str] | None, columns: Sequence[Column]) -> ChannelSets | None:
    if marks is None:
        return None
    return ChannelSets(marks=marks, names={one.name: DATASET.sub("", one.name) for one in columns})
