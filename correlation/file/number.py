"""Numbers as programs write them: Fortran's D exponents, decimal commas, groups of thousands, complex numbers."""

import re
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

#: Fields that stand for a value that was not measured.
MISSING = {"", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "---"}
NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?|[+-]?(?:inf|infinity)", re.IGNORECASE)
COMPLEX = re.compile(r"\(?\s*([+-]?[\d.]+(?:[eE][+-]?\d+)?)\s*([+-]\s*[\d.]+(?:[eE][+-]?\d+)?)\s*\*?\s*[ij]\s*\)?")
DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eEdD][+-]?\d+)?")
#: Groups of three digits, by whether the decimal sign is a comma: 1.234,5 or 1 234,5; 1,234.5 or 1'234.5.
BLANK = " \u00a0\u202f'\u2019"
GROUPED = {
    comma: re.compile(rf"[+-]?[1-9]\d{{0,2}}(?:(?:\{group}\d{{3}})+|(?:[{BLANK}]\d{{3}})+)(?:\{sign}\d*)?")
    for comma, sign, group in ((False, ".", ","), (True, ",", "."))
}


def read_number(text: str, *, decimal_comma: bool = False) -> float | complex | None:
    """Value of a field; NaN if it stands for none that was measured, None if it is no number."""
    text = text.strip()
    if text.lower() in MISSING:
        return float("nan")
    if GROUPED[decimal_comma].fullmatch(text):
        text = re.sub(rf"[{BLANK}{'.' if decimal_comma else ','}]", "", text)
    elif decimal_comma and "." in text and NUMBER.fullmatch(text):
        return None  # a point that is neither a decimal sign nor between groups
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
    """Whether a field is a number with one decimal sign or the other."""
    return any(read_number(text, decimal_comma=comma) is not None for comma in (False, True))


def has_decimal_comma(rows: Sequence[Sequence[str]]) -> bool:
    """Whether decimals are commas in rows of one length.

    A sign with other than three digits behind it is a decimal sign. Where all have three, one is a group of thousands
    if whole numbers below 1000 stand in its column, too.
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
    """Whether decimal signs may as well part groups of thousands: three digits behind each, beside whole numbers.

    Programs that write groups write whole numbers, those below 1000 without a sign. Numbers in equal steps are whole
    anyway, and so are those of few values, such as levels.

    Parameters
    ----------
    rows
        Fields of rows of one length.
    decimal_comma
        Whether decimals are taken to be commas.
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
    """Numbers between blanks and line ends, shape (n,); None if something else stands there."""
    if b"D" in text or b"d" in text:
        text = re.sub(rb"(?<=[\d.])[dD](?=[+-]?\d)", b"E", text)
    if b"_" in text:
        return None
    try:
        return np.array(list(map(float, text.split())), dtype=np.float64)
    except ValueError:
        return None
