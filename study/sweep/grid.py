"""The grid of a sweep: the user's values of each parameter, and all their combinations."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import prod

import numpy as np

from casefile.number_with_unit import NumberWithUnit, split_quantity
from casefile.validation import require_different
from study.kind.registry import OpenCase
from study.sweep.parameter import CaseParameter, find_parameter, refuse, vary

#: Largest number of points of a grid; more points are a mistake of a range.
MOST_POINTS = 2000
#: Digits of values between the ends of a range: 3.6 and not 3.5999999999999996.
DIGITS = 12
EXAMPLE = "kt=0.8:1.2:5 or mu=0.9,1,1.1"


@dataclass(frozen=True, kw_only=True)
class Grid:
    """Parameters and their values.

    Parameters
    ----------
    parameters
        Parameters, at least one.
    values
        Values of each parameter, in its unit.
    whole
        Whether each parameter has whole numbers, such as a number of harmonics.
    """

    parameters: tuple[CaseParameter, ...]
    values: tuple[tuple[float, ...], ...]
    whole: tuple[bool, ...]

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each parameter [-]."""
        return tuple(len(item) for item in self.values)

    def points(self) -> list[tuple[float, ...]]:
        """List all combinations; the last parameter changes fastest."""
        return list(itertools.product(*self.values))

    def at(self, point: Sequence[float]) -> dict[CaseParameter, object]:
        """Return the entries of the case file at a point."""
        return {
            item: item.written(value, whole=whole)
            for item, value, whole in zip(self.parameters, point, self.whole, strict=True)
        }


def read_grid(opened: OpenCase, values: Mapping[str, str | Sequence[float | str]] | Sequence[str]) -> Grid:
    """Read the user's grid, and check each value as in a case file.

    Parameters
    ----------
    opened
        Case of the sweep.
    values
        By the name of the parameter, a range ``"0.8:1.2:5"`` with first value, last value and number of values, or a
        list of values; or words ``NAME=VALUES``.

    Raises
    ------
    CaseError
        A parameter is not in the case, there are no values or too many, or a value is invalid for the case.
    """
    pairs = list(values.items()) if isinstance(values, Mapping) else [_split(opened, word) for word in values]
    if not pairs:
        raise refuse(opened, "", f"the grid is empty: give a parameter and its values, such as {EXAMPLE}")
    parameters: list[CaseParameter] = []
    numbers, whole = [], []
    for name, given in pairs:
        text = given if isinstance(given, str) else ", ".join(map(str, given))
        try:
            quantities = _read_range(given) if isinstance(given, str) else [split_quantity(item) for item in given]
            own, unit = _convert_to_one_unit(quantities)
            require_different(own)
            parameter = find_parameter(opened, name, unit)
        except ValueError as error:
            raise refuse(opened, name, f"{name} = {text}: {error}") from None
        if parameter.path in [item.path for item in parameters]:
            raise refuse(opened, name, f"{name} = {text}: its values are given twice: give them once")
        parameters.append(parameter)
        numbers.append(own)
        whole.append(not unit and all(value.is_integer() for value in own) and "." not in text)
    grid = Grid(parameters=tuple(parameters), values=tuple(numbers), whole=tuple(whole))
    count = prod(grid.shape)
    if count > MOST_POINTS:
        sizes = " x ".join(map(str, grid.shape))
        raise refuse(
            opened,
            "",
            f"the grid has {sizes} = {count} points, but at most {MOST_POINTS} are allowed: give fewer values",
        )
    for parameter, own, is_whole in zip(grid.parameters, grid.values, grid.whole, strict=True):
        for value in own:
            vary(opened, {parameter: parameter.written(value, whole=is_whole)})
    return grid


def _split(opened: OpenCase, word: str) -> tuple[str, str]:
    name, sign, text = word.partition("=")
    if not (sign and name.strip()):
        raise refuse(
            opened, "", f'"{word}" is not of the form NAME=VALUES: give a parameter and its values, such as {EXAMPLE}'
        )
    return name.strip(), text.strip()


def _read_range(text: str) -> list[NumberWithUnit]:
    """Read the values of a text such as ``3:6:7`` or ``0.4,0.6``.

    Raises
    ------
    ValueError
        The text is not a range or a list of values.
    """
    if ":" not in text:
        parts = [part.strip() for part in text.split(",")]
        if not all(parts):
            raise ValueError(f"a value is missing: give one or several, such as {EXAMPLE}")
        return [split_quantity(part) for part in parts]
    ends = [part.strip() for part in text.split(":")]
    if len(ends) != 3 or not all(ends):
        raise ValueError("a range is FIRST:LAST:NUMBER, such as 0.8:1.2:5")
    first, last = split_quantity(ends[0]), split_quantity(ends[1])
    if not ends[2].isdigit() or int(ends[2]) < 2:
        raise ValueError(f"a range of {ends[2]} values is not a range: give 2 or more, such as 0.8:1.2:5")
    if int(ends[2]) > MOST_POINTS:
        raise ValueError(f"a range of {ends[2]} values is too large: give at most {MOST_POINTS}")
    (low, high), unit = _convert_to_one_unit([first, last])
    if low == high:
        raise ValueError(f"both ends are {low:g}: give two different ones, or one value")
    inner = np.linspace(low, high, int(ends[2]))[1:-1].tolist()
    return [NumberWithUnit(value, unit) for value in (low, *(float(f"{v:.{DIGITS}g}") for v in inner), high)]


def _convert_to_one_unit(quantities: Sequence[NumberWithUnit]) -> tuple[tuple[float, ...], str]:
    """Convert numbers to the unit of the last value; numbers without a unit are in this unit, as in ``3:6 N/um:7``."""
    if not quantities:
        raise ValueError(f"there are no values: give one or several, such as {EXAMPLE}")
    unit = quantities[-1].unit
    return tuple(item.number if not item.unit else item.number_in(unit) for item in quantities), unit
