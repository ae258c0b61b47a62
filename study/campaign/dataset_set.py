"""Sets of channels in a universal file: datasets are grouped by their text lines or by their order."""

import re
from collections import Counter
from collections.abc import Hashable, Iterator, Mapping, Sequence

from correlation.file.column import Column
from study.campaign.channel_set import ChannelSets, find_role, is_response, number_sets
from study.campaign.column_role import Role, recognise_column
from study.campaign.run_name import HARMONIC_IN_NAME, LEVEL_IN_NAME, REPEAT_IN_NAME, RUN_IN_NAME, WAY_OF_COLUMN
from study.campaign.table import MeasuredTable

#: Text lines of a dataset that may identify its set, and patterns of the identifying words.
LINES = ("line 1", "line 2", "line 4", "line 5", "line 3", "z")
TELLING = (LEVEL_IN_NAME, REPEAT_IN_NAME, RUN_IN_NAME, WAY_OF_COLUMN)
#: Estimators of a frequency response.
ESTIMATOR = re.compile(r"(?<![A-Za-z\d])H[12v](?![A-Za-z\d])")
#: Number of a dataset at the beginning of the name of its column.
DATASET = re.compile(r"^58 #\d+ ")
FREQUENCY_RESPONSE = "frequency response"


def find_sets_by_dataset(table: MeasuredTable) -> ChannelSets | None:
    """Sets of the datasets over one abscissa; frequency responses are repeats unless their texts state levels.

    Parameters
    ----------
    table
        Table of a universal file.
    """
    columns = [one for one in table.columns if one.response is not None and one.abscissa is not None]
    points = Counter(_point(one) for one in columns)
    if max(points.values(), default=1) < 2:
        return _make_sets(_find_common_level(table, columns), columns)
    roles = {one.name: recognise_column(one, table.short_name(one)).role for one in columns}
    measured = [one for one in columns if roles[one.name] is Role.FORCE or is_response(roles[one.name])]
    keys = {one.name: _identify_channel(one, roles[one.name]) for one in measured}
    counts = Counter(keys.values())
    if max(counts.values(), default=1) < 2:
        return _make_sets(_find_common_level(table, columns), columns)
    driven: set[Hashable] = {keys[one.name] for one in measured if roles[one.name] is Role.FORCE}
    are_ratios = any(one.function == FREQUENCY_RESPONSE for one in measured)
    if are_ratios:
        return _find_other_estimates(measured, keys) or _make_sets(_find_levels(columns, keys), columns)
    marks = next((marks for marks in _list_texts(measured) if _are_sets(marks, keys, driven)), None)
    marks = marks or _number_by_order(measured, keys)
    if marks is not None:
        return _make_sets(marks, measured)
    why = "its sensor has several datasets, and neither their texts nor their order show which belong together"
    return ChannelSets(marks={}, lost={name: why for name, key in keys.items() if counts[key] > 1})


def _identify_channel(column: Column, role: Role) -> tuple[Hashable, ...]:
    """Key of a channel: point, reference, quantity and harmonic; a dataset without a point is a separate channel."""
    reference = column.reference
    to = None if reference is None else (reference.node or reference.name, reference.direction.lstrip("+-"))
    kind = (column.function, role, column.unit, column.facts.get("quantity", ""))
    return _point(column), to, kind, _find_harmonic(column)


def _find_harmonic(column: Column) -> int | None:
    """Harmonic in the texts of a dataset; None if not stated, or for a frequency response: its H1 is an estimator."""
    if column.function == FREQUENCY_RESPONSE:
        return None
    result = (HARMONIC_IN_NAME.search(column.facts.get(line, "")) for line in LINES)
    return next((int(match[1]) for match in result if match), None)


def find_sets_by_dataset_harmonic(table: MeasuredTable) -> ChannelSets | None:
    """Sets of the harmonics in the datasets of one table, by their texts; of the force only harmonic 1 is used.

    Parameters
    ----------
    table
        Table of a universal file.
    """
    columns = [one for one in table.columns if one.response is not None]
    roles = {one.name: find_role(table, one) for one in columns}
    harmonics = {one.name: number for one in columns if (number := _find_harmonic(one)) is not None}
    of_channel: dict[Hashable, set[int]] = {}
    for one in columns:
        if one.name in harmonics and is_response(roles[one.name]):
            of_channel.setdefault(_identify_channel(one, roles[one.name])[:-1], set()).add(harmonics[one.name])
    if max(map(len, of_channel.values()), default=0) < 2:
        return None
    why = "of the force only the first harmonic is used"
    return ChannelSets(
        marks={name: f"harmonic {number}" for name, number in harmonics.items() if roles[name] is not Role.FORCE},
        names={one.name: DATASET.sub("", one.name) for one in columns},
        lost={name: why for name, number in harmonics.items() if roles[name] is Role.FORCE and number > 1},
    )


def _point(column: Column) -> Hashable:
    """Point and direction of a dataset; the name of its column if it has no point."""
    point = column.response
    if point is None or (point.node is None and not point.name):
        return column.name
    return point.node or point.name, point.direction.lstrip("+-")


def _list_texts(columns: Sequence[Column]) -> Iterator[dict[str, str]]:
    """Candidate marks of datasets: a level, repeat, run or direction in one line, all of these, or a whole line."""
    for telling in TELLING:
        for line in LINES:
            matches = {one.name: telling.search(one.facts.get(line, "")) for one in columns}
            yield {name: match[0].strip() for name, match in matches.items() if match}
    joined = {}
    for one in columns:
        whole = " / ".join(one.facts.get(line, "") for line in LINES)
        joined[one.name] = " ".join(match[0].strip() for telling in TELLING for match in telling.finditer(whole))
    yield {name: text for name, text in joined.items() if text}
    for line in LINES:
        yield {one.name: text for one in columns if (text := one.facts.get(line, "").strip())}


def _are_sets(marks: Mapping[str, str], keys: Mapping[str, Hashable], driven: set[Hashable]) -> bool:
    """Whether marks divide all datasets into as many sets as a channel has datasets, each with all forces."""
    groups: dict[str, list[Hashable]] = {}
    for name, mark in marks.items():
        groups.setdefault(mark, []).append(keys[name])
    return len(groups) == max(Counter(keys.values()).values()) > 1 and all(
        len(marks) == len(keys) and len({*group}) == len(group) and {*group} > driven for group in groups.values()
    )


def _number_by_order(columns: Sequence[Column], keys: Mapping[str, Hashable]) -> dict[str, str] | None:
    """Mark of each dataset by its order; None unless all channels have equally many, ordered by set or by channel."""
    counts = Counter(keys.values())
    number = max(counts.values())
    if any(count != number for count in counts.values()):
        return None
    order = [keys[one.name] for one in columns]
    channels = list(dict.fromkeys(order))
    if order not in (channels * number, [key for key in channels for _ in range(number)]):
        return None
    return number_sets({one.name: keys[one.name] for one in columns})


def _find_other_estimates(columns: Sequence[Column], keys: Mapping[str, Hashable]) -> ChannelSets | None:
    """Sets that keep the first of several estimates of one frequency response; None if there are no others."""
    result = {
        one.name: match[0]
        for one in columns
        if (match := ESTIMATOR.search(" ".join(one.facts.get(line, "") for line in LINES)))
    }
    kept: dict[Hashable, str] = {}
    lost: dict[str, str] = {}
    for name, estimator in result.items():
        first = kept.setdefault(keys[name], estimator)
        if estimator != first:
            lost[name] = f"it is the {estimator} estimate of a response whose {first} estimate is used, not a repeat"
    return ChannelSets(marks={}, lost=lost) if lost else None


def _find_levels(columns: Sequence[Column], keys: Mapping[str, Hashable]) -> dict[str, str] | None:
    """Mark of each frequency response by the level in its text; None if one has no level, or all have the same."""
    for line in LINES:
        matches = {one.name: LEVEL_IN_NAME.search(one.facts.get(line, "")) for one in columns}
        marks = {name: match[0] for name, match in matches.items() if match}
        pairs = [(keys[name], mark) for name, mark in marks.items() if name in keys]
        if len(pairs) == len(keys) == len({*pairs}) and len({*marks.values()}) > 1:
            return marks
    return None


def _find_common_level(table: MeasuredTable, columns: Sequence[Column]) -> dict[str, str] | None:
    """Mark of all datasets over one abscissa by their common level, in a file with several abscissas."""
    if len({one.abscissa for one in table.file.columns if one.abscissa}) < 2:
        return None
    for line in LINES:
        matches = [LEVEL_IN_NAME.search(one.facts.get(line, "")) for one in columns]
        levels = {match[0] for match in matches if match}
        if len(levels) == 1 and all(matches):
            return dict.fromkeys((one.name for one in columns), levels.pop())
    return None


def _make_sets(marks: dict[str, str] | None, columns: Sequence[Column]) -> ChannelSets | None:
    if marks is None:
        return None
    return ChannelSets(marks=marks, names={one.name: DATASET.sub("", one.name) for one in columns})
