"""Time and frequency columns from numbers in a file: a sampling rate, or a first value and a step."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from correlation.file.column import Column, MeasuredFile
from correlation.file.quantity import OF_UNIT, find_named_quantities
from correlation.file.unit_label import read_unit

#: Formats whose columns are arrays, with such numbers beside them.
OF_ARRAYS = {"hdf5", "matlab 5", "matlab 7.3"}
#: Formats of text tables, with such numbers above the rows.
OF_TEXT = {"csv"}
#: Quantities of a column that exclude a time history without a time column in a text table.
NO_HISTORY = {"time", "frequency", "angle"}
#: Names of a sampling rate and of a time step, without marks between their words.
RATES = {"fs", "samplingrate", "samplerate", "samplingfrequency", "samplefrequency", "abtastrate", "fsample", "fsamp"}
STEP_NAMES = {"dt", "deltat", "timestep", "samplinginterval", "sampletime", "samplingtime", "timeincrement", "ts"}
#: Factors to Hz or s of the units at the end of such names.
FACTORS = {"hz": 1.0, "khz": 1e3, "s": 1.0, "ms": 1e-3, "us": 1e-6}
#: Smallest rate [Hz] or step [s]; its inverse is the largest. Other numbers are damaged.
MIN_RATE = 1e-12
#: Smallest length of a history; shorter columns are parameters.
FEWEST = 20


def add_abscissas(file: MeasuredFile) -> MeasuredFile:
    """Add time or frequency columns for columns without an abscissa, if numbers in the file define them.

    Parameters
    ----------
    file
        Measured file.
    """
    if file.format not in OF_ARRAYS | OF_TEXT or (file.format in OF_TEXT and any(map(_tells_abscissa, file.columns))):
        return file
    groups: dict[tuple[str, int], list[Column]] = {}
    for column in file.columns:
        if len(column.values) >= FEWEST and not column.words:
            groups.setdefault((_find_path(file, column), len(column.values)), []).append(column)
    added: dict[str, Column] = {}
    units: dict[str, str] = {}
    above = cache(
        lambda: next((step for facts in (_list_numbers(file, ""), file.facts) if (step := _step(facts))), None)
    )
    for (path, length), columns in groups.items():
        beside = groups.get(("", length), []) if path else []
        if any(_may_be_abscissa(one) for one in [*columns, *beside]):
            continue
        if (abscissa := _of_pair(file, path, length) or _of_rate(file, path, columns, above)) is not None:
            added[columns[0].name] = abscissa
            label = file.facts.get(f"{path}{_mark(file)}quantity{_mark(file)}label", "")
            units |= {one.name: read_unit(label) for one in columns if not one.unit and label}
    result: list[Column] = []
    for column in file.columns:
        result += [added[column.name]] if column.name in added else []
        result.append(replace(column, unit=units.get(column.name, column.unit)))
    return replace(file, columns=tuple(result)) if added else file


def _of_rate(
    file: MeasuredFile, path: str, columns: Sequence[Column], above: Callable[[], float | None]
) -> Column | None:
    """Time of columns from a sampling rate or step among their attributes, beside them, or above them in the file."""
    if any(np.iscomplexobj(one.values) for one in columns):
        return None
    step = _step(columns[0].facts) or _step(_list_numbers(file, path)) or above()
    if step is None:
        return None
    values = step * np.arange(len(columns[0].values))
    name = f"{path}{_mark(file)}time" if path else "time"
    why = f"sampling rate {1 / step:.9g} Hz"
    return Column(name=name, values=values, unit="s", function="time", facts={"abscissa": why}, where=columns[0].where)


def _step(facts: Mapping[str, str]) -> float | None:
    """Time step from a rate or a step among facts [s]; None if there is none, or if they differ."""
    result = set()
    for key, text in facts.items():
        whole = re.sub(r"[^a-z]", "", key.lower())
        ending = re.search(r"[_ (](khz|hz|ms|us|s)\)?$", key.lower())
        unit = ending[1] if ending else ""
        name = whole.removesuffix(unit) if unit else whole
        kind = 1 if name in RATES else -1 if name in STEP_NAMES else 0
        match = re.fullmatch(r"(\S+?)(?:\s*([a-z]+))?", text.strip().lower())  # "4000 Hz"
        number = _number(match[1]) if match else None
        factor = FACTORS.get(unit or (match[2] if match else "") or "s")
        if kind and number is not None and number > 0 and factor is not None:
            value = number * factor
            result.add(float(f"{value if kind < 0 else 1 / value:.12g}"))
    return result.pop() if len(result) == 1 else None


def _of_pair(file: MeasuredFile, path: str, length: int) -> Column | None:
    """Abscissa of values in a structure "y_values" from the numbers in a structure "x_values", as in Testlab files."""
    if not re.search(r"(?:^|[./])y_values$", path):
        return None
    of_x = f"{path.removesuffix('y_values')}x_values"
    numbers = {key: number for key, text in _list_numbers(file, of_x).items() if (number := _number(text)) is not None}
    step, first = numbers.get("increment"), numbers.get("start_value", 0.0)
    unit = read_unit(file.facts.get(f"{of_x}{_mark(file)}quantity{_mark(file)}label", ""))
    if step is None or not step > 0 or unit not in {"s", "Hz"} or numbers.get("number_of_values", length) != length:
        return None
    kind = "time" if unit == "s" else "frequency"
    values = first + step * np.arange(length)
    return Column(name=f"{path}{_mark(file)}{kind}", values=values, unit=unit, function=kind, where=of_x)


def _tells_abscissa(column: Column) -> bool:
    """Whether the unit or the name of a column is that of a time, a frequency or a phase."""
    return bool({OF_UNIT.get(column.unit, ""), *find_named_quantities(column.name)} & NO_HISTORY)


def _may_be_abscissa(column: Column) -> bool:
    """Whether the values of a column rise or fall strictly from row to row."""
    if np.iscomplexobj(column.values):
        return False
    steps = np.diff(column.values)
    return bool((steps > 0).all() or (steps < 0).all())


def _list_numbers(file: MeasuredFile, path: str) -> dict[str, str]:
    """Single numbers directly within a path of a file, by their short names."""
    return {
        column.name.removeprefix(path).lstrip("./"): repr(float(column.values[0].real))
        for column in file.columns
        if len(column.values) == 1 and not column.words and _find_path(file, column) == path
    }


def _find_path(file: MeasuredFile, column: Column) -> str:
    if file.format in OF_TEXT:
        return ""
    return re.sub(r"[(\[][\d:,]+[)\]]$", "", column.name).rpartition(_mark(file))[0]


def _mark(file: MeasuredFile) -> str:
    """Mark between the parts of a path."""
    return "/" if file.format == "hdf5" else "."


def _number(text: str) -> float | None:
    """Number of a rate, a step or a first value; None if the text is not a number in their range."""
    try:
        number = float(text)
    except ValueError:
        return None
    return number if number == 0 or MIN_RATE < abs(number) < 1 / MIN_RATE else None
