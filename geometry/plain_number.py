"""Numbers in sentences: a few digits, and no exponent where whole numbers do."""

from math import isfinite
from typing import Literal


def format_number(value: float, digits: int = 2, sign: Literal["", "+"] = "") -> str:
    """A number with so many significant digits: 137 is ``140``, never ``1.4e+02``; "+" gives positive ones a sign."""
    return f"{float(f'{value:.{digits}g}'):{sign}.12g}"


def percent(share: float, digits: int = 2) -> str:
    """A share with so many significant digits: 0.0412 is ``4.1 %``; ``unknown`` if it is none."""
    return f"{format_number(100 * share, digits)} %" if isfinite(share) else "unknown"


def count(number: int, noun: str) -> str:
    """A number of things: ``1 sensor``, ``3 sensors``."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"
