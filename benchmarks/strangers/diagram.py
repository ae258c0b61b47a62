"""Figures of a score: confusion matrix of hidden and named effects, and reliability of the probabilities."""

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.hidden_effects_score import Share
from benchmarks.strangers.score import CLEAR, NO_ALARM, Record, is_first, kind_of, named
from figure.confusion import ConfusionMatrix, draw_confusion_matrix
from figure.style import INK, LIMITS, PALE, add_title, make_figure, open_box, png

#: Bounds of the bins of probabilities.
BOUNDS = (0.0, 0.3, 0.6, 0.9, 0.99, 1.0)
NOTHING = "nothing"


class Bin(NamedTuple):
    """Mean probability of the named effects in a bin, and the fraction of correct ones."""

    probability: float
    right: Share


def list_bins(records: Sequence[Record]) -> list[Bin]:
    """Bins of the effects named in first rounds, by probability.

    Only the hidden effect itself is correct: an effect that the data cannot separate from it has its own probability.
    """
    named_effects = [
        (probability, item["name"] in {effect["name"] for effect in record["effects"]})
        for record in records
        for item, probability in zip(named(record), record["rounds"][0].get("probabilities", ()), strict=False)
    ]
    bins = []
    for low, high in pairwise(BOUNDS):
        own = [(p, right) for p, right in named_effects if low < p <= high]
        if own:
            share = Share(count=sum(right for _, right in own), of=len(own))
            bins.append(Bin(float(np.mean([p for p, _ in own])), share))
    return bins


def draw_reliability(records: Sequence[Record], file: Path) -> None:
    """Draw the fraction of correct effects over their stated probability."""
    figure = make_figure(5.5, 5.0)
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], color=PALE, lw=1, ls="--")
    for item in list_bins(records):
        low, high = item.right.interval
        axes.plot([item.probability] * 2, [low, high], color=LIMITS[0], lw=2)
        axes.plot([item.probability], [item.right.value], "o", color=LIMITS[0])
        words = f"{item.right.count} of {item.right.of}"
        axes.annotate(words, (item.probability, item.right.value), (8, 0), textcoords="offset points", color=INK)
    axes.set(xlim=(0, 1.15), ylim=(0, 1.02), xlabel="probability that is told [-]", ylabel="share that is right [-]")
    open_box(axes)
    add_title(figure, "Are the probabilities right? (95 % intervals)")
    file.write_bytes(png(figure))


def draw_confusion(records: Sequence[Record], file: Path) -> None:
    """Draw the confusion matrix: hidden kinds against the first named kind or the finding."""
    counts: dict[str, Counter[tuple[str, bool]]] = {}
    for record in records:
        hidden = " + ".join(sorted(kind_of(item["name"]) for item in record["effects"])) or NOTHING
        finding = record["rounds"][0]["finding"]
        first = kind_of(named(record)[0]["name"]) if finding in CLEAR else finding
        counts.setdefault(hidden, Counter())[first, _is_right(record)] += 1
    rows = sorted(counts, key=lambda row: (row != NOTHING, row))
    columns = sorted({first for row in counts.values() for first, _ in row}, key=lambda item: (item == NOTHING, item))
    count = np.array([[sum(counts[row][first, right] for right in (True, False)) for first in columns] for row in rows])
    right = np.array([[counts[row][first, True] >= counts[row][first, False] for first in columns] for row in rows])
    result = ConfusionMatrix(
        title="What was hidden, and what was told first",
        subtitle=f"{len(records)} random structures; blue where most are right", count=count, right=right, rows=rows,
        columns=columns,
    )  # fmt: skip
    file.write_bytes(png(draw_confusion_matrix(result)))


def _is_right(record: Record) -> bool:
    """Whether the verdict of the first round is correct."""
    finding, effects = record["rounds"][0]["finding"], record["effects"]
    if not effects:
        return finding in NO_ALARM
    return bool(finding == "unknown") if not effects[0]["known"] else is_first(record)
