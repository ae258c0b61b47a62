"""Measured families over predicted limits: a panel per level, every repeat and sweep, what lies outside marked."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import (
    INK,
    LIMITS,
    PALE,
    Axes,
    Figure,
    Headed,
    add_heading,
    add_legend,
    choose_family_colours,
    new_figure,
    open_box,
)

Real = NDArray[np.float64]

#: Width and height of a panel [inches].
PANEL = (3.9, 2.75)
#: The same where there are more than two columns.
SMALL_PANEL = (2.9, 2.3)
#: Space below for the legend [inches].
LEGEND = 0.75
#: Line and marker of a sweep up, down, and of none.
SWEEP: dict[int, dict[str, Any]] = {
    1: {"linestyle": "-", "marker": "^"},
    -1: {"linestyle": "--", "marker": "v"},
    0: {"linestyle": "-", "marker": "o"},
}
WAYS = {1: "up", -1: "down", 0: "no sweep"}
#: Points of a curve that have a marker; more would hide each other.
MOST_MARKED = 25
#: Limits are drawn over curves, and their markers over limits, so that all are seen where histories make no width.
OVER, MARKED = 3.0, 4.0
#: Repeats that a legend names one by one; more are named by the first and the last.
MOST_NAMED = 6


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredCurve:
    """One measured curve.

    Parameters
    ----------
    repeat
        Number of the repeat.
    sweep
        +1 up, -1 down, 0 none.
    frequency, value
        Shape (n,) [Hz, unit of the row].
    outside
        Whether a point lies outside of the limits by more than its uncertainty, shape (n,).
    """

    repeat: int
    sweep: int
    frequency: Float[Real, " n"]
    value: Float[Real, " n"]
    outside: Bool[NDArray[np.bool_], " n"]


@dataclass(frozen=True, kw_only=True, eq=False)
class FamilyPanel:
    """A family at one level over its band.

    Parameters
    ----------
    label
        Above the panel.
    frequency
        Of the limits, rising, shape (f,) [Hz].
    limit
        Lower and upper limit, shape (2, f) [unit of the row]; NaN where none was found.
    jump
        Limits on another branch of optima than a neighbour, shape (2, f).
    curves
        Measured curves.
    """

    label: str
    frequency: Float[Real, " f"]
    limit: Float[Real, "2 f"]
    jump: Bool[NDArray[np.bool_], "2 f"]
    curves: Sequence[MeasuredCurve]


@dataclass(frozen=True, kw_only=True, eq=False)
class FamilyRow:
    """Panels of one quantity.

    Parameters
    ----------
    label
        Of the vertical axis, with its unit.
    panels
        One per level.
    share
        Whether they have one vertical axis, as static forces want it: amplitudes grow with the level.
    """

    label: str
    panels: Sequence[FamilyPanel]
    share: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class FamiliesOverLimits(Headed):
    """Rows of panels, at least one; the last one may have fewer."""

    rows: Sequence[FamilyRow]


@draws(FamiliesOverLimits, "family_over_limits")
def family_over_limits_figure(result: FamiliesOverLimits) -> Figure:
    """Draw the panels; next to a jump a limit is dotted, since nothing says where it lies between."""
    columns = max(len(row.panels) for row in result.rows)
    width, height = PANEL if columns <= 2 else SMALL_PANEL
    figure = new_figure(max(6.5, 0.6 + width * columns), 0.8 + LEGEND + height * len(result.rows))
    grid = figure.subplots(len(result.rows), columns, squeeze=False, sharex=True)
    repeats = sorted({c.repeat for row in result.rows for panel in row.panels for c in panel.curves})
    colours = dict(zip(repeats, choose_family_colours(len(repeats)), strict=True))
    for line, row in zip(grid, result.rows, strict=True):
        for axes, panel in zip(line, row.panels, strict=False):
            _draw(axes, panel, colours)
            if not row.share and _lowest(panel) >= 0:
                axes.set_ylim(bottom=0)
        line[0].set_ylabel(row.label)
        if row.share:
            ends = np.array([axes.get_ylim() for axes in line[: len(row.panels)]])
            for axes in line[: len(row.panels)]:
                axes.set_ylim(ends[:, 0].min(), ends[:, 1].max())
        for axes in line[len(row.panels) :]:
            axes.set_visible(False)
    for column in range(columns):
        last = max(number for number, row in enumerate(result.rows) if len(row.panels) > column)
        grid[last, column].set_xlabel("frequency [Hz]")
        grid[last, column].tick_params(labelbottom=True)
    _legend(figure, result, colours)
    add_heading(figure, result)
    return figure


def _draw(axes: Axes, panel: FamilyPanel, colours: dict[int, str]) -> None:
    f = panel.frequency
    if len(f) == 1:
        # One frequency has no width: limits are short bars.
        for limit, colour in zip(panel.limit[:, 0], LIMITS, strict=True):
            axes.plot(f, [limit], marker="_", markersize=26, color=colour, markeredgewidth=1.8, zorder=OVER)
    else:
        axes.fill_between(f, *panel.limit, color=PALE, alpha=0.18, linewidth=0)
        for y, jump, colour in zip(panel.limit, panel.jump, LIMITS, strict=True):
            for first in range(len(f) - 1):
                dotted = bool(jump[first] or jump[first + 1])
                style: dict[str, Any] = {"linestyle": ":", "linewidth": 1.2} if dotted else {"linewidth": 1.6}
                axes.plot(f[first : first + 2], y[first : first + 2], color=colour, zorder=OVER, **style)
    for number, curve in enumerate(panel.curves):
        way = SWEEP[curve.sweep]
        style = {"color": colours[curve.repeat], "alpha": 0.85}
        axes.plot(curve.frequency, curve.value, linestyle=way["linestyle"], linewidth=0.8, **style)
        # Curves are marked at different points, since repeats lie on each other.
        every = -(-len(curve.frequency) // MOST_MARKED)
        marked = slice(number % every, None, every)
        style |= {"marker": way["marker"], "markersize": 2.6, "linestyle": "", "zorder": MARKED}
        axes.plot(curve.frequency[marked], curve.value[marked], **style)
    for curve in panel.curves:
        if curve.outside.any():
            axes.plot(curve.frequency[curve.outside], curve.value[curve.outside], **_ring())
    axes.set_title(panel.label, fontsize=10, loc="left")
    open_box(axes)


def _lowest(panel: FamilyPanel) -> float:
    """Lowest value that is drawn: an axis of amplitudes begins at zero."""
    return min([float(np.nanmin(panel.limit, initial=np.inf)), *(float(c.value.min()) for c in panel.curves)])


def _ring() -> dict[str, Any]:
    return {
        "marker": "o", "linestyle": "", "markerfacecolor": "none", "markeredgecolor": "#c1121f", "markersize": 4.5,
        "markeredgewidth": 0.9, "zorder": MARKED,
    }  # fmt: skip


def _legend(figure: Figure, result: FamiliesOverLimits, colours: dict[int, str]) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    curves = [c for row in result.rows for panel in row.panels for c in panel.curves]
    entries: dict[str, Any] = {
        "upper limit": Line2D([], [], color=LIMITS[1], linewidth=1.6),
        "lower limit": Line2D([], [], color=LIMITS[0], linewidth=1.6),
        "all friction histories": Patch(color=PALE, alpha=0.18),
    }
    if any(panel.jump.any() for row in result.rows for panel in row.panels):
        entries["jump of a limit"] = Line2D([], [], color=INK, linestyle=":", linewidth=1.2)
    for sweep in sorted({curve.sweep for curve in curves}, reverse=True):
        style = SWEEP[sweep] | {"markersize": 4, "linewidth": 1}
        entries[f"measured, {WAYS[sweep]}"] = Line2D([], [], color=INK, **style)
    repeats = [*colours]
    named = repeats if len(repeats) <= MOST_NAMED else [repeats[0], repeats[-1]]
    for repeat in named:
        entries[f"repeat {repeat}"] = Line2D([], [], color=colours[repeat], linewidth=3)
    if any(curve.outside.any() for curve in curves):
        entries["outside by more than its uncertainty"] = Line2D([], [], **_ring())
    add_legend(figure, list(entries.values()), list(entries), fontsize=9)
