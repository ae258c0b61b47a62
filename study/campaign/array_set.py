"""Sets of channels in arrays, by the axis with the length of the vector of levels or of the force."""

import re
from collections.abc import Mapping

import numpy as np

from correlation.file.column import Column
from study.campaign.channel_set import ChannelSets, find_role, is_response
from study.campaign.column_role import RATIOS, WORDS, Role, name_words
from study.campaign.table import MeasuredTable

#: Index of a column in an array: (:,1,2), [0,1].
INDEX = re.compile(r"[(\[]([\d,:]*\d[\d,:]*)[)\]]$")
#: Names of vectors of levels.
LEVELS = WORDS[Role.LEVEL] | {"force", "forces", "amplitude", "amplitudes", "loads", "stufen"}

#: Formats whose columns may come from arrays.
OF_ARRAYS = {"hdf5", "matlab 5", "matlab 7.3"}

Places = dict[str, tuple[int, ...]]


def find_sets_by_array(table: MeasuredTable) -> ChannelSets | None:
    """Sets of channels by the index along the axis of levels; arrays with several axes of that length are not used.

    Parameters
    ----------
    table
        Table of a file of arrays.
    """
    arrays: dict[str, Places] = {}
    for column in table.columns if table.file.format in OF_ARRAYS else ():
        if match := INDEX.search(column.name):
            place = tuple(int(number) for number in match[1].split(",") if number.isdigit())
            arrays.setdefault(column.name[: match.start()], {})[column.name] = place
    columns = {column.name: column for column in table.columns}
    roles = {array: find_role(table, columns[next(iter(places))]) for array, places in arrays.items()}
    responses = [array for array, role in roles.items() if is_response(role)]
    if not responses or _turns(table):
        return None
    levels = _find_levels(table)
    forces = [array for array, role in roles.items() if role is Role.FORCE and _rank(arrays[array]) == 1]
    number = len(levels[1]) if levels else len(arrays[forces[0]]) if len(forces) == 1 else 0
    deep = [array for array in responses if _rank(arrays[array]) > 1 and not set(name_words(array)) & RATIOS]
    if number < 2 and not deep:
        return None
    result = ChannelSets(marks={})
    for array, places in arrays.items():
        axes = [axis for axis, size in enumerate(_count_sizes(places)) if number > 1 and size == number]
        if len(axes) != 1:
            if array in deep or (number > 1 and array in responses):
                why = _explain_refusal(array, _count_sizes(places), number)
                result.lost |= dict.fromkeys(places, why)
            continue
        for name, place in places.items():
            which = sorted({one[axes[0]] for one in places.values()}).index(place[axes[0]])
            _mark(result, name, array, place, axes[0], which, levels)
    return result if result.marks or result.lost else None


def _mark(
    sets: ChannelSets, name: str, array: str, place: tuple[int, ...], axis: int, which: int,
    levels: tuple[str, np.ndarray] | None,
) -> None:  # fmt: skip
    """Add a column to the set of its index along the axis of levels."""
    short = array.rpartition("/")[2].rpartition(".")[2]
    rest = [str(one) for number, one in enumerate(place) if number != axis]
    sets.names[name] = f"{short}[{','.join(rest)}]" if rest else short
    mark = f"set {which + 1}"
    if levels:
        mark = f"{levels[0]} {levels[1][which]:g}"
        sets.scalars[mark] = {levels[0]: float(levels[1][which])}
    sets.marks[name] = mark


def _find_levels(table: MeasuredTable) -> tuple[str, np.ndarray] | None:
    """Name and values of the vector of levels in the same group as a table; None for none or several."""
    vectors = [
        (_with_unit(column.name.rpartition("/")[2].rpartition(".")[2], column.unit), column.values)
        for column in table.file.columns
        if 1 < len(column.values) < len(table.columns[0].values)
        and not column.words
        and not np.iscomplexobj(column.values)
        and not INDEX.search(column.name)
        and _stands_beside(column, table)
        and set(name_words(column.name)) & LEVELS
        and (column.values > 0).all()
        and len(np.unique(column.values)) == len(column.values)
    ]
    return vectors[0] if len(vectors) == 1 else None


def _with_unit(name: str, unit: str) -> str:
    """Name of a number with its unit, such as "level_N"."""
    return name if not unit or name.endswith(f"_{unit}") else f"{name}_{unit}"


def _stands_beside(column: Column, table: MeasuredTable) -> bool:
    return table.path in {"", column.name.rpartition("/")[0], column.name.rpartition(".")[0]} or not re.search(
        r"[./]", column.name
    )


def _turns(table: MeasuredTable) -> bool:
    """Whether the frequency changes direction: a vector of levels may then belong to successive passes."""
    frequency = next((one.values for one in table.columns if find_role(table, one) is Role.FREQUENCY), None)
    return frequency is not None and len({*np.sign(np.diff(frequency.real)).tolist()} - {0.0}) > 1


def _rank(places: Mapping[str, tuple[int, ...]]) -> int:
    return len(next(iter(places.values())))


def _count_sizes(places: Mapping[str, tuple[int, ...]]) -> list[int]:
    return [len({place[axis] for place in places.values()}) for axis in range(_rank(places))]


def _explain_refusal(array: str, sizes: list[int], number: int) -> str:
    shape = " x ".join(map(str, sizes))
    if number < 2:
        return f'it is not clear which axis of "{array}" ({shape} series) is that of the sensors: add a vector "level"'
    return f'"{array}" has {shape} series, but not exactly one axis with {number} entries, one per level'
