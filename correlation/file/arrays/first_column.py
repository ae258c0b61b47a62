"""Abscissas of arrays whose first column rises in equal steps, as in ``[t x]`` and ``[f H]``."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from correlation.file.column import Column, MeasuredFile

#: Formats whose columns may be those of arrays.
OF_ARRAYS = {"hdf5", "matlab 5", "matlab 7.3"}
#: Index of a column in an array of two axes: (:,1), (1,:), [0]; and index of a cell in its row: {3,1}.
IN_ARRAY = re.compile(r"(?:\((?::,)?(\d+)(?:,:)?\)|\[(\d+)\])$")
IN_ROW = re.compile(r"^(.*\{\d+,)(\d+)\}(?:\((?::,)?\d+(?:,:)?\))?$")
#: Smallest length of a series; shorter columns are parameters.
FEWEST = 20
#: Largest deviation of computed instants and spectral lines from equal steps, relative to a step [-].
ROUNDING = 1e-3


def pair_first_columns(file: MeasuredFile) -> MeasuredFile:
    """Set the first column of each such array as the abscissa of its other columns.

    Arrays with equal first columns share the first of these; the others are removed. The first column of a complex
    array becomes real.

    Parameters
    ----------
    file
        Measured file.
    """
    arrays: dict[tuple[str, int], list[Column]] = {}
    for column in file.columns if file.format in OF_ARRAYS else ():
        if (place := _name_array(column.name)) and not column.words and len(column.values) >= FEWEST:
            arrays.setdefault((place, len(column.values)), []).append(column)
    shared: dict[bytes, Column] = {}
    changed: dict[str, Column | None] = {}
    for first, *others in arrays.values():
        if first.abscissa or not others or not _is_first(first) or not rises_evenly(first):
            continue
        if all(rises_evenly(one) or one.abscissa for one in others):
            continue
        real = replace(first, values=first.values.real.astype(np.float64))
        abscissa = shared.setdefault(real.values.tobytes(), real)
        changed[first.name] = abscissa if abscissa.name == first.name else None
        changed |= {one.name: replace(one, abscissa=abscissa.name) for one in others}
    if not changed:
        return file
    columns: Sequence[Column | None] = [changed.get(one.name, one) for one in file.columns]
    return replace(file, columns=tuple(one for one in columns if one is not None))


def rises_evenly(column: Column) -> bool:
    """Whether the values of a column rise in equal steps, as a time or the lines of a spectrum do.

    Parameters
    ----------
    column
        Column of numbers.
    """
    values = column.values
    if len(values) < FEWEST or column.words or not np.isfinite(values).all() or np.any(values.imag):
        return False
    step = float(values[-1].real - values[0].real) / (len(values) - 1)
    even = values[0].real + step * np.arange(len(values))
    return step > 0 and bool(np.abs(values.real - even).max() <= ROUNDING * step)


def _name_array(name: str) -> str:
    """Name of the array or row of cells of a column; empty for other columns."""
    if match := IN_ROW.match(name):
        return match[1]
    return name[: match.start()] if (match := IN_ARRAY.search(name)) else ""


def _is_first(column: Column) -> bool:
    if match := IN_ROW.match(column.name):
        return int(match[2]) == 1 and column.name.endswith("}")
    match = IN_ARRAY.search(column.name)
    return match is not None and (match[1] == "1" or match[2] == "0")
