"""Quantities of response curves against a parameter: peak frequency, peak amplitude, equivalent damping."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from figure.parameter_curves import LINES
from figure.registry import draws
from figure.style import (
    INK,
    PALE,
    Axes,
    Figure,
    TitledFigure,
    add_heading,
    add_legend,
    choose_family_colours,
    make_figure,
    open_box,
)

Real = NDArray[np.float64]

#: Ratio of extreme values above which the axis is logarithmic [-].
LOGARITHMIC_RATIO = 10.0


@dataclass(frozen=True, kw_only=True, eq=False)
class TrendLine:
    """Quantities along one parameter.

    Parameters
    ----------
    group, line
        Numbers of its colour in `ParameterTrends.groups` and of its kind of line in `ParameterTrends.lines`.
    value
        Values of the parameter, ascending, shape (n,).
    quantity
        Shape (k, n); NaN where there is none.
    doubtful
        Values at an end of the sweep, beyond which they may be larger, shape (n,).
    """

    group: int
    line: int
    value: Float[Real, " n"]
    quantity: Float[Real, "k n"]
    doubtful: Bool[NDArray[np.bool_], " n"]


@dataclass(frozen=True, kw_only=True, eq=False)
class ParameterTrends(TitledFigure):
    """Trends of k quantities.

    Parameters
    ----------
    trends
        Lines in their order.
    groups, lines
        Meaning of colours and kinds of lines; one line without a name if there is one kind.
    quantity_labels
        Labels of the k axes, with units.
    parameter_label
        Parameter, with its unit.
    """

    trends: Sequence[TrendLine]
    groups: Sequence[str]
    lines: Sequence[str]
    quantity_labels: Sequence[str]
    parameter_label: str


@draws(ParameterTrends, "parameter_trends")
def draw_parameter_trends(result: ParameterTrends) -> Figure:
    """Draw one panel per quantity; a hollow point is at an end of its sweep."""
    count = len(result.quantity_labels)
    figure = make_figure(4.1 * count, 4.9)
    panels = figure.subplots(1, count, squeeze=False)[0]
    colours = choose_family_colours(len(result.groups))
    for number, (axes, label) in enumerate(zip(panels, result.quantity_labels, strict=True)):
        for trend in result.trends:
            _draw(axes, trend, trend.quantity[number], colours[trend.group])
        axes.set_ylabel(label)
        axes.set_xlabel(result.parameter_label)
        known = np.concatenate([trend.quantity[number] for trend in result.trends])
        known = known[np.isfinite(known)]
        if len(known) and 0 < LOGARITHMIC_RATIO * known.min() < known.max():
            _set_logarithmic(axes)
        else:
            axes.ticklabel_format(axis="y", useOffset=False)
        open_box(axes)
    _add_group_legend(figure, result, colours)
    add_heading(figure, result)
    return figure


def _draw(axes: Axes, trend: TrendLine, values: Float[Real, " n"], colour: str) -> None:
    axes.plot(trend.value, values, color=colour, linestyle=LINES[trend.line % len(LINES)], linewidth=1.4)
    for doubtful, face in ((False, colour), (True, "white")):
        there = trend.doubtful == doubtful
        axes.plot(trend.value[there], values[there], "o", color=colour, markerfacecolor=face, markersize=4.5)


def _set_logarithmic(axes: Axes) -> None:
    """Decades, with plain numbers at 1, 2 and 5 of each."""
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())


def _add_group_legend(figure: Figure, result: ParameterTrends, colours: Sequence[str]) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=colour, marker="o", markersize=4.5, label=label)
        for colour, label in zip(colours, result.groups, strict=True)
    ]
    if len(result.lines) > 1:
        handles += [
            Line2D([], [], color=INK, linestyle=LINES[number % len(LINES)], label=label)
            for number, label in enumerate(result.lines)
        ]
    if any(trend.doubtful.any() for trend in result.trends):
        doubt = Line2D([], [], color=PALE, marker="o", markerfacecolor="white", linestyle="", markersize=4.5)
        doubt.set_label("at an end of the sweep")
        handles.append(doubt)
    add_legend(figure, handles)
