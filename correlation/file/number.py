"""Numbers as programs write them: Fortran's D exponents, decimal commas, complex numbers."""

import re

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

#: Fields that stand for a value that was not measured.
MISSING = {"", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "---"}
NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?|[+-]?(?:inf|infinity)", re.IGNORECASE)
COMPLEX = re.compile(r"\(?\s*([+-]?[\d.]+(?:[eE][+-]?\d+)?)\s*([+-]\s*[\d.]+(?:[eE][+-]?\d+)?)\s*\*?\s*[ij]\s*\)?")
DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eEdD][+-]?\d+)?")


def read_number(text: str, *, decimal_comma: bool = False) -> float | complex | None:
    """Value of a field; NaN if it stands for none that was measured, None if it is no number."""
    text = text.strip()
    if text.lower() in MISSING:
        return float("nan")
    if decimal_comma:
        text = text.replace(",", ".")
    if NUMBER.fullmatch(text):
        return float(text.replace("D", "e").replace("d", "e"))
    match = COMPLEX.fullmatch(text)
    if match:
        try:
            return complex(float(match[1]), float(match[2].replace(" ", "")))
        except ValueError:
            return None
    return None


def read_numbers(text: bytes) -> Float[NDArray[np.float64], " n"] | None:
    """Numbers between blanks and line ends, shape (n,); None if something else stands there."""
    if b"D" in text or b"d" in text:
        text = re.sub(rb"(?<=[\d.])[dD](?=[+-]?\d)", b"E", text)
    if b"_" in text:
        return None
    try:
        return np.array(list(map(float, text.split())), dtype=np.float64)
    except ValueError:
        return None
