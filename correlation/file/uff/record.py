"""Parsing of records: fields of fixed width as written by FORTRAN, or fields separated by blanks."""

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from correlation.file.number import read_numbers
from correlation.file.uff.dataset import Dataset

#: Width of a real number in a record of six numbers [characters].
REAL = 13


def read_fields(dataset: Dataset, row: int, widths: Sequence[int], kinds: str) -> list[int | float | str]:
    """Read the fields of one line; missing fields are 0 or empty.

    Parameters
    ----------
    dataset, row
        Dataset, and index of the line in it.
    widths
        Widths of the fields [characters].
    kinds
        One letter per field: "i" whole number, "e" number, "t" text.

    Raises
    ------
    CampaignError
        A field is not a number of its kind.
    """
    text = dataset.text(row)
    fixed = _parse(_slice_fields(text, widths), kinds)
    if fixed is not None:
        return fixed
    apart = text.split()
    parsed = _parse([*apart, *[""] * (len(kinds) - len(apart))], kinds) if len(apart) <= len(kinds) else None
    if parsed is None or "t" in kinds[: len(apart)]:
        raise dataset.error(
            row, f'"{text.strip()[:60]}" is not a record of {_describe_kinds(kinds)}; export the file again'
        )
    return parsed


def read_integers(dataset: Dataset, row: int, widths: Sequence[int]) -> list[int]:
    """Read the whole numbers of one line; raises `CampaignError` as `read_fields` does."""
    return [int(value) for value in read_fields(dataset, row, widths, "i" * len(widths))]


def read_reals(dataset: Dataset, row: int) -> NDArray[np.float64] | None:
    """Read the real numbers of one line, separated by blanks or in fields of 13 characters (6E13.5); None if it fails.

    Parameters
    ----------
    dataset, row
        Dataset, and index of the line in it.
    """
    text = dataset.text(row)
    numbers = read_numbers(text.encode())
    if numbers is not None:
        return numbers
    fields = _slice_fields(text, (REAL,) * -(-len(text.rstrip()) // REAL))
    return read_numbers(" ".join(fields).encode())


def _slice_fields(text: str, widths: Sequence[int]) -> list[str]:
    fields, start = [], 0
    for width in widths:
        fields.append(text[start : start + width].strip())
        start += width
    return fields


def _parse(fields: Sequence[str], kinds: str) -> list[int | float | str] | None:
    values: list[int | float | str] = []
    for field, kind in zip(fields, kinds, strict=True):
        if kind == "t":
            values.append(field)
        elif not field:
            values.append(0)
        elif kind == "i" and re.fullmatch(r"[+-]?\d{1,18}", field):
            values.append(int(field))
        elif kind == "e" and re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD]?[+-]?\d+)?", field):
            text = re.sub(r"(?<=[\d.])[dD]|(?<=[\d.])(?=[+-])", "E", field)
            values.append(float(text))
        else:
            return None
    return values


def _describe_kinds(kinds: str) -> str:
    return f"{len(kinds)} numbers" if "t" not in kinds else f"{len(kinds)} fields"
