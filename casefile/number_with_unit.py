"""A number and the text of its unit, where which units there may be is known only later."""

import math
from decimal import Decimal
from typing import NamedTuple

from casefile.quantity import NUMBER_AND_UNIT
from correlation.campaign.measurement_unit import find_root_units


class NumberWithUnit(NamedTuple):
    """A number, and the text of its unit: "" for a ratio."""

    number: float
    unit: str

    def number_in(self, unit: str) -> float:
        """The number in another unit of the same quantity.

        Raises
        ------
        ValueError
            A unit of another quantity.
        """
        if unit == self.unit:
            return self.number
        (factor, root), (wanted_factor, wanted) = find_root_units(self.unit), find_root_units(unit)
        if root != wanted:
            mine, other = (f'in "{item}"' if item else "a bare number" for item in (self.unit, unit))
            raise ValueError(f"{self.number:g} is {mine}, but the other values are {other}: give all in one unit")
        number = float(Decimal(str(self.number)) * factor / wanted_factor)
        if not math.isfinite(number):
            raise ValueError(f"{self.number:g} {self.unit} is not a finite number of {unit or 'one'}")
        return number


def split_quantity(value: object) -> NumberWithUnit:
    """Number and unit of a value such as "20 N" or 0.4.

    Raises
    ------
    ValueError
        It is neither, or not finite, or has a unit that there is not.
    """
    if isinstance(value, int | float) and not isinstance(value, bool):
        result = NumberWithUnit(float(value), "")
    elif isinstance(value, str) and (match := NUMBER_AND_UNIT.fullmatch(value)):
        result = NumberWithUnit(float(match[1]), match[2])
    else:
        raise ValueError('must be a number, or text with a number and a unit, e.g. "20 N"')
    if not math.isfinite(result.number):
        raise ValueError("is not a finite number")
    if result.unit:
        find_root_units(result.unit)
    return result
