"""Pictures of a score: what was hidden by what was told, and how often what is told with a probability is right."""

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

#: Bounds of the probabilities that are counted together.
BOUNDS = (0.0, 0.3, 0.6, 0.9, 0.99, 1.0)
NOTHING = "nothing"


class Bin(NamedTuple):
    """Effects that were named with a probability near this one, and how many of them were right."""

    probability: float
    right: Share


def list_bins(records: Sequence[Record]) -> list[Bin]:
    """Effects that first rounds name, by their probability.

    Right is the hidden one itself: what is the same has a share of its own.
    """
    told = [
        (probability, item["name"] in {effect["name"] for effect in record["effects"]})
        for record in records
        for item, probability in zip(named(record), record["rounds"][0].get("probabilities", ()), strict=False)
    ]
    bins = []
    for low, high in pairwise(BOUNDS):
        own = [(p, right) for p, right in told if low < p <= high]
        if own:
            share = Share(count=sum(right for _, right in own), of=len(own))
            bins.append(Bin(float(np.mean([p for p, _ in own])), share))
    return bins


def draw_reliability(records: Sequence[Record], file: Path) -> None:
    """Share of right names over the probability that they were told with."""
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
    """Kinds that were hidden by what was told first."""
    counts: dict[str, Counter[tuple[str, bool]]] = {}
    for record in records:
        hidden = " + ".join(sorted(kind_of(item["name"]) for item in record["effects"])) or NOTHING
        finding = record["rounds"][0]["finding"]
        told = kind_of(named(record)[0]["name"]) if finding in CLEAR else finding
        counts.setdefault(hidden, Counter())[told, _is_right(record)] += 1
    rows = sorted(counts, key=lambda row: (row != NOTHING, row))
    columns = sorted({told for row in counts.values() for told, _ in row}, key=lambda item: (item == NOTHING, item))
    count = np.array([[sum(counts[row][told, right] for right in (True, False)) for told in columns] for row in rows])
    right = np.array([[counts[row][told, True] >= counts[row][told, False] for told in columns] for row in rows])
    result = ConfusionMatrix(
        title="What was hidden, and what was told first",
        subtitle=f"{len(records)} random structures; blue where most are right", count=count, right=right, rows=rows,
        columns=columns,
    )  # fmt: skip
    file.write_bytes(png(draw_confusion_matrix(result)))


def _is_right(record: Record) -> bool:
    """Whether the first round tells what it should."""
    finding, effects = record["rounds"][0]["finding"], record["effects"]
    if not effects:
        return finding in NO_ALARM
    return bool(finding == "unknown") if not effects[0]["known"] else is_first(record)
