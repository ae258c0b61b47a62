"""Confusion matrix of the hidden-effect test: planted effect against named effect."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.hidden_effects_groups import Groups
from benchmarks.hidden_effects_plan import KIND, PLANTED, ROWS
from benchmarks.hidden_effects_record import AMBIGUOUS, FAILED, MISSING, NONE, UNKNOWN, Record
from transient.virtual_bench.effect import NOTHING

AMONG, APART, ELSEWHERE = "several, it among them", "several, without it", "its kind elsewhere"
WORDS = {NONE: "nothing", UNKNOWN: "none of the known", FAILED: "failed"}


@dataclass(frozen=True, kw_only=True, eq=False)
class Confusion:
    """Confusion matrix: planted effects (rows) by findings (columns).

    Parameters
    ----------
    rows, columns
        Keys of `ROWS` that were run, and findings in words.
    count
        Number of campaigns, shape (r, c).
    right
        Cells of correct findings, shape (r, c).
    """

    rows: tuple[str, ...]
    columns: tuple[str, ...]
    count: NDArray[np.int64]
    right: NDArray[np.bool_]


def confusion(records: Sequence[Record], groups: Groups) -> Confusion:
    """Make the confusion matrix; a kind that was never planted has a column if it was named.

    A planted kind is not correct at a place that the layout can separate from the true one.
    """
    named = [_column(record, groups) for record in records]
    kinds = [*KIND.values(), *sorted({*named} - {*KIND.values(), ELSEWHERE, AMONG, APART, *WORDS.values()})]
    columns = [*kinds, ELSEWHERE, AMONG, APART, WORDS[NONE], WORDS[UNKNOWN]]
    if WORDS[FAILED] in named:
        columns.append(WORDS[FAILED])
    present = {record.row for record in records}
    rows = [row for row in ROWS if row in present]
    count = np.zeros((len(rows), len(columns)), dtype=np.int64)
    for record, column in zip(records, named, strict=True):
        count[rows.index(record.row), columns.index(column)] += 1
    right = np.array([[column in _as_it_should(row) for column in columns] for row in rows], dtype=bool)
    return Confusion(rows=tuple(rows), columns=tuple(columns), count=count, right=right.reshape(count.shape))


def _as_it_should(row: str) -> tuple[str, ...]:
    if row in PLANTED:
        return KIND[row], AMONG
    return (WORDS[NONE if row == NOTHING else UNKNOWN],)


def _column(record: Record, groups: Groups) -> str:
    if record.finding == AMBIGUOUS:
        return AMONG if record.planted.effect in record.names else APART
    if record.finding == MISSING:
        (first, *_), planted = record.named, record.planted.effect
        here = first.effect in {planted, *groups.of(planted)} or record.row not in PLANTED
        return ELSEWHERE if first.kind == KIND.get(record.planted.kind) and not here else first.kind
    return WORDS[record.finding]
