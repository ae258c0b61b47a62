"""Numbers in texts: a few significant digits, without an exponent for ordinary sizes."""

from math import isfinite
from typing import Literal


def format_number(value: float, digits: int = 2, sign: Literal["", "+"] = "") -> str:
    """Number with `digits` significant digits: 137 is ``140``, not ``1.4e+02``; "+" gives positive numbers a sign."""
    return f"{float(f'{value:.{digits}g}'):{sign}.12g}"


def percent(share: float, digits: int = 2) -> str:
    """Fraction as a percentage with `digits` significant digits: 0.0412 is ``4.1 %``; ``unknown`` if not finite."""
    return f"{format_number(100 * share, digits)} %" if isfinite(share) else "unknown"


def count(number: int, noun: str) -> str:
    """Number with its noun: ``1 sensor``, ``3 sensors``."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"
