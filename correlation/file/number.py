"""Parsing of numbers in text files: Fortran's D exponents, decimal commas, groups of thousands, complex numbers."""

import re
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

#: Fields that mark a missing value.
MISSING = {"", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "---"}
NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?|[+-]?(?:inf|infinity)", re.IGNORECASE)
COMPLEX = re.compile(r"\(?\s*([+-]?[\d.]+(?:[eE][+-]?\d+)?)\s*([+-]\s*[\d.]+(?:[eE][+-]?\d+)?)\s*\*?\s*[ij]\s*\)?")
DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eEdD][+-]?\d+)?")
#: Separators of groups of three digits beside point and comma.
BLANK = " \u00a0\u202f'\u2019"
#: Numbers with groups of thousands, by whether the decimal sign is a comma: 1.234,5 or 1 234,5; 1,234.5 or 1'234.5.
GROUPED = {
    comma: re.compile(rf"[+-]?[1-9]\d{{0,2}}(?:(?:\{group}\d{{3}})+|(?:[{BLANK}]\d{{3}})+)(?:\{sign}\d*)?")
    for comma, sign, group in ((False, ".", ","), (True, ",", "."))
}


def read_number(text: str, *, decimal_comma: bool = False) -> float | complex | None:
    """Value of a field; NaN if the field marks a missing value, None if it is not a number."""
    text = text.strip()
    if text.lower() in MISSING:
        return float("nan")
    if GROUPED[decimal_comma].fullmatch(text):
        text = re.sub(rf"[{BLANK}{'.' if decimal_comma else ','}]", "", text)
    elif decimal_comma and "." in text and NUMBER.fullmatch(text):
        return None  # the point is neither a decimal sign nor between groups
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


def is_written_number(text: str) -> bool:
    """Whether a field is a number with a decimal point or a decimal comma."""
    return any(read_number(text, decimal_comma=comma) is not None for comma in (False, True))


def has_decimal_comma(rows: Sequence[Sequence[str]]) -> bool:
    """Whether the decimal sign is a comma in rows of one length.

    A point or comma that is not followed by groups of three digits is a decimal sign. If all are, a column that also
    has whole numbers below 1000 has groups of thousands.
    """
    fields = [field.strip() for row in rows for field in row]
    commas = [field for field in fields if DECIMAL_COMMA.fullmatch(field) or GROUPED[True].fullmatch(field)]
    points = [field for field in fields if "." in field and read_number(field) is not None]
    proofs = [
        sum(sign in field and not GROUPED[not comma].fullmatch(field) for field in of_sign)
        for comma, sign, of_sign in ((True, ",", commas), (False, ".", points))
    ]
    if proofs[0] != proofs[1]:
        return proofs[0] > proofs[1]
    for column in zip(*rows, strict=True):
        written = [field.strip() for field in column if field.strip()]
        for comma in (False, True):
            grouped = sum(GROUPED[comma].fullmatch(field) is not None for field in written)
            whole = sum(re.fullmatch(r"[+-]?\d{1,3}", field) is not None for field in written)
            if grouped and whole and grouped + whole == len(written):
                return comma
    return len(commas) > len(points)


def may_part_thousands(rows: Sequence[Sequence[str]], *, decimal_comma: bool) -> bool:
    """Whether the decimal signs may instead separate groups of thousands.

    They may if three digits follow each sign and a column has whole numbers below 1000, which have no sign in a program
    that writes groups. Columns in equal steps or of few different values, such as levels, are not counted, since their
    values are often whole.

    Parameters
    ----------
    rows
        Fields of rows of one length.
    decimal_comma
        Whether the decimal sign was judged to be a comma.
    """
    sign = "," if decimal_comma else "."
    columns = [[field.strip() for field in column] for column in zip(*rows, strict=True)]
    signed = [field for column in columns for field in column if sign in field and field[:1] in "+-.,0123456789"]
    if not signed or not all(GROUPED[not decimal_comma].fullmatch(field) for field in signed):
        return False
    small = [column for column in columns if all(re.fullmatch(r"[+-]?\d{1,3}", field) for field in column)]
    steps = [{int(b) - int(a) for a, b in pairwise(column)} for column in small]
    return any(len(own) > 1 and 4 * len({*column}) > len(column) for column, own in zip(small, steps, strict=True))


def read_numbers(text: bytes) -> Float[NDArray[np.float64], " n"] | None:
    """Numbers separated by blanks and line ends, shape (n,); None if the text has anything else."""
    if b"D" in text or b"d" in text:
        text = re.sub(rb"(?<=[\d.])[dD](?=[+-]?\d)", b"E", text)
    if b"_" in text:
        return None
    try:
        return np.array(list(map(float, text.split())), dtype=np.float64)
    except ValueError:
        return None
