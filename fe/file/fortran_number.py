"""Numbers as Fortran programs write them: in columns of fixed width, with D exponents or none at all."""

import re

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

#: "1.5-103" is 1.5e-103 where the exponent needed three digits.
_BARE_EXPONENT = re.compile(r"(?<=[\d.])([+-]\d+)$")


def fortran_real(text: str) -> float:
    """A real number such as 1.5, 1.5D+03 or 1.5-103.

    Raises
    ------
    ValueError
        No number.
    """
    plain = text.strip().upper().replace("D", "E")
    return float(plain if "E" in plain else _BARE_EXPONENT.sub(r"E\1", plain))


def columns(lines: list[str], width: int) -> list[str]:
    """Entries of lines, in columns of a fixed width; what is blank is none."""
    found = []
    for line in lines:
        text = line.rstrip()
        found += [text[start : start + width] for start in range(0, len(text), width)]
    return [each for each in found if each.strip()]


def reals(entries: list[str]) -> Float[NDArray[np.float64], " n"]:
    """Real numbers from their texts, by Python's own conversion where it can."""
    try:
        return np.fromiter(map(float, entries), dtype=np.float64, count=len(entries))
    except ValueError:
        return np.fromiter(map(fortran_real, entries), dtype=np.float64, count=len(entries))
