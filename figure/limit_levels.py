"""Limits against the level of the load: their peaks and peak frequencies."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import LIMITS, PALE, Axes, Figure, TitledFigure, add_legend, add_title, make_figure, open_box

Real = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class LimitsByLevel(TitledFigure):
    """Limits by level; arrays of both limits have the lower one first.

    Parameters
    ----------
    level
        Ascending, shape (l,) [-].
    value
        Shape (2, l) [unit of the figure]; NaN where none was found.
    frequency
        Frequencies of these values, shape (2, l) [Hz].
    doubtful
        Points at a jump, or at an end of the frequencies, beyond which values may be larger, shape (2, l).
    amplitude_label, level_label
        Labels of the axes, with their units.
    """

    level: Float[Real, " l"]
    value: Float[Real, "2 l"]
    frequency: Float[Real, "2 l"]
    doubtful: Bool[NDArray[np.bool_], "2 l"]
    amplitude_label: str
    level_label: str = "level of the harmonic force [-]"


@draws(LimitsByLevel, "limit_levels")
def draw_limit_levels(result: LimitsByLevel) -> Figure:
    """Draw limits over the level; their frequencies below, if there is more than one."""
    from matplotlib.lines import Line2D

    n_row = 2 if np.ptp(result.frequency[np.isfinite(result.frequency)]) > 0 else 1
    figure = make_figure(7.5, 1.4 + 2.6 * n_row)
    rows = figure.subplots(n_row, 1, squeeze=False, sharex=True)[:, 0]
    rows[0].fill_between(result.level, *result.value, color=PALE, alpha=0.15, linewidth=0)
    _draw(rows[0], result, result.value)
    rows[0].set_ylabel(result.amplitude_label)
    if not np.nanmin(result.value) < 0:
        rows[0].set_ylim(bottom=0)
    if n_row > 1:
        _draw(rows[1], result, result.frequency)
        rows[1].set_ylabel("its frequency [Hz]")
        rows[1].ticklabel_format(axis="y", useOffset=False)
    rows[-1].set_xlabel(result.level_label)
    for axes in rows:
        open_box(axes)
    handles = [
        Line2D([], [], color=LIMITS[side], marker="o", markersize=5, label=f"{name} limit")
        for side, name in ((1, "upper"), (0, "lower"))
    ]
    if result.doubtful.any():
        style: dict[str, Any] = {
            "marker": "o",
            "markerfacecolor": "white",
            "markeredgecolor": PALE,
            "linestyle": "",
            "markersize": 5,
        }
        handles.append(Line2D([], [], **style, label="at a jump, or at an end of the frequencies"))
    add_legend(figure, handles)
    add_title(figure, result.title)
    return figure


def _draw(axes: Axes, limits: LimitsByLevel, values: Float[Real, "2 l"]) -> None:
    for side, colour in enumerate(LIMITS):
        axes.plot(limits.level, values[side], color=colour, linewidth=1.5)
        for doubtful, face in ((False, colour), (True, "white")):
            there = limits.doubtful[side] == doubtful
            axes.plot(limits.level[there], values[side][there], "o", color=colour, markerfacecolor=face, markersize=5)
