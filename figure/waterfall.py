"""The decrease of the error: one group of bars per step, for training and held-out data, and reduced chi-squared."""

from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import fill

import numpy as np

from figure.registry import draws
from figure.style import (
    INK,
    PALE,
    Axes,
    Figure,
    TitledFigure,
    add_heading,
    add_legend,
    format_three_digits,
    make_figure,
    open_box,
)

#: Training and held-out data.
TRAINING, HELD_OUT = "#9fb3c8", "#1f4e79"
#: Number of characters after which the name of a step is wrapped.
FOLD = 16
WIDTH = 0.38
#: Height of a number over its bar, as a share of the axes.
LABEL = 0.075
#: Reduced chi-squared of noise [-].
NOISE_CHI2 = 1.0


@dataclass(frozen=True, kw_only=True)
class WaterfallStep:
    """A step of the model updating.

    Parameters
    ----------
    name
        Name in words.
    training, held_out
        Relative errors [-]; NaN if they are unknown.
    training_chi2, held_out_chi2
        Reduced chi-squared [-].
    proposed
        Whether it is only proposed, not yet applied.
    """

    name: str
    training: float
    held_out: float
    training_chi2: float
    held_out_chi2: float
    proposed: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class Waterfall(TitledFigure):
    """Errors of a model over the steps of its updating.

    Parameters
    ----------
    steps
        Steps in their order.
    """

    steps: Sequence[WaterfallStep]
    subtitle: str


@draws(Waterfall, "waterfall")
def draw_waterfall(result: Waterfall) -> Figure:
    """Draw the steps."""
    from matplotlib.patches import Patch

    figure = make_figure(max(9.0, 2.6 * len(result.steps) + 2.0), 4.9)
    left, right = figure.subplots(1, 2)
    relative = [(100 * step.training, 100 * step.held_out) for step in result.steps]
    _draw_bars(left, relative, result.steps)
    left.set_ylabel("relative error of fundamentals [%]")
    pairs = [(step.training_chi2, step.held_out_chi2) for step in result.steps]
    _draw_bars(right, pairs, result.steps)
    right.set_yscale("log")
    values = [value for pair in pairs for value in pair if value > 0]
    right.set_ylim(min(0.5, *values) / 1.2, 2.2 * max(2.0, *values))
    _draw_labels(left, relative)
    _draw_labels(right, pairs, [tuple(label_foot(value, *right.get_ylim()) for value in pair) for pair in pairs])
    right.axhline(NOISE_CHI2, color=INK, linewidth=0.9, linestyle=(0, (4, 3)))
    right.text(
        1.01, NOISE_CHI2, "noise", transform=right.get_yaxis_transform(), ha="left", va="center", fontsize=8, color=PALE
    )
    right.set_ylabel("reduced chi-squared [-]")
    handles = [Patch(color=TRAINING, label="training data"), Patch(color=HELD_OUT, label="held-out data")]
    if any(step.proposed for step in result.steps):
        handles.append(Patch(facecolor="white", edgecolor=PALE, hatch="////", label="proposed"))
    add_legend(figure, handles, loc="outside lower left")
    add_heading(figure, result)
    return figure


def label_foot(value: float, lowest: float, highest: float) -> float:
    """Position of the number of a bar on a logarithmic axis: on the bar, but not on the line of the noise.

    Parameters
    ----------
    value
        Height of the bar.
    lowest, highest
        Ends of the axis.
    """
    reach = NOISE_CHI2 * (lowest / highest) ** LABEL
    return NOISE_CHI2 if reach < value < NOISE_CHI2 else value


def _draw_bars(axes: Axes, pairs: Sequence[tuple[float, float]], steps: Sequence[WaterfallStep]) -> None:
    place = np.arange(len(steps))
    for side, colour in ((0, TRAINING), (1, HELD_OUT)):
        heights = [pair[side] for pair in pairs]
        bars = axes.bar(place + (side - 0.5) * WIDTH, heights, WIDTH * 0.94, color=colour, zorder=2)
        for bar, step in zip(bars, steps, strict=True):
            if step.proposed:
                bar.set(hatch="////", facecolor="white", edgecolor=colour, linewidth=1.2)
    axes.set_xticks(place, [fill(step.name, FOLD) for step in steps], fontsize=9)
    axes.set_xlim(-0.5, len(steps) - 0.5)
    if not np.isfinite(pairs).any():
        axes.set(yticks=[], ylim=(0, 1))
    open_box(axes, grid="y")
    axes.margins(y=0.12)


def _draw_labels(
    axes: Axes, pairs: Sequence[tuple[float, float]], feet: Sequence[tuple[float, ...]] | None = None
) -> None:
    """Numbers over the bars, or higher."""
    for place, (pair, foot) in enumerate(zip(pairs, feet or pairs, strict=True)):
        for side, (value, at) in enumerate(zip(pair, foot, strict=True)):
            known = np.isfinite(value)
            axes.annotate(
                format_three_digits(value) if known else "unknown",
                (place + (side - 0.5) * WIDTH, at if known else axes.get_ylim()[0]), xytext=(0, 3),
                textcoords="offset points", ha="center", va="bottom", fontsize=8, color=INK, zorder=3,
            )  # fmt: skip
