"""Numbers in sentences: a few digits, and no exponent where whole numbers do."""

from typing import Literal


def plain(value: float, digits: int = 2, sign: Literal["", "+"] = "") -> str:
    """A number with so many significant digits: 137 is ``140``, never ``1.4e+02``; "+" gives positive ones a sign."""
    return f"{float(f'{value:.{digits}g}'):{sign}.12g}"
