"""Measured families over predicted limits: a panel per level, every repeat and sweep, with outside points marked."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from correlation.campaign.measurement import SWEEPS
from figure.registry import draws
from figure.style import (
    INK,
    LIMITS,
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

#: Width and height of a panel [inches].
PANEL = (3.9, 2.75)
#: The same for more than two columns.
SMALL_PANEL = (2.9, 2.3)
#: Space below for the legend [inches].
LEGEND = 0.75
#: Line and marker of a sweep up, a sweep down, and without a sweep.
SWEEP: dict[int, dict[str, Any]] = {
    1: {"linestyle": "-", "marker": "^"},
    -1: {"linestyle": "--", "marker": "v"},
    0: {"linestyle": "-", "marker": "o"},
}
WAYS = SWEEPS | {0: "no sweep"}
#: Number of points of a curve with a marker; more would hide each other.
MOST_MARKED = 25
#: Width of the line of a limit [points], and least height of a panel in widths.
LINE, WIDTHS = 1.6, 90
#: Dashes of an upper limit over the lower one where both coincide, so that both colours are visible.
DASHES: Any = (0, (2.5, 2.5))
#: Limits are drawn over curves, and markers over limits, so that all are visible where the band has no width.
OVER, MARKED = 3.0, 4.0
#: Number of repeats that a legend lists individually; of more, only the first and the last.
MOST_NAMED = 6


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredCurve:
    """Measured curve with its readings outside of the limits.

    Parameters
    ----------
    repeat
        Number of the repeat.
    sweep
        +1 up, -1 down, 0 none.
    frequency, value
        Shape (n,) [Hz, unit of the row].
    outside
        Whether a point is outside the limits by more than its uncertainty, shape (n,).
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
        Ascending frequencies of the limits, shape (f,) [Hz].
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
        Label of the vertical axis, with its unit.
    panels
        One per level.
    share
        Whether the panels share the vertical axis: suits static forces, while amplitudes grow with the level.
    """

    label: str
    panels: Sequence[FamilyPanel]
    share: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class FamiliesOverLimits(TitledFigure):
    """Rows of panels, at least one; the last one may have fewer."""

    rows: Sequence[FamilyRow]


@draws(FamiliesOverLimits, "family_over_limits")
def draw_family_over_limits(result: FamiliesOverLimits) -> Figure:
    """Draw the panels; next to a jump a limit is dotted, since its course between the points is unknown."""
    columns = max(len(row.panels) for row in result.rows)
    width, height = PANEL if columns <= 2 else SMALL_PANEL
    figure = make_figure(max(6.5, 0.6 + width * columns), 0.8 + LEGEND + height * len(result.rows))
    grid = figure.subplots(len(result.rows), columns, squeeze=False, sharex=True)
    repeats = sorted({c.repeat for row in result.rows for panel in row.panels for c in panel.curves})
    colours = dict(zip(repeats, choose_family_colours(len(repeats)), strict=True))
    for line, row in zip(grid, result.rows, strict=True):
        for axes, panel in zip(line, row.panels, strict=False):
            _draw(axes, panel, colours)
            if not row.share and _find_lowest(panel) >= 0:
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
    _add_limits_legend(figure, result, colours)
    add_heading(figure, result)
    return figure


def _draw(axes: Axes, panel: FamilyPanel, colours: dict[int, str]) -> None:
    f = panel.frequency
    if len(f) == 1:
        # A single frequency has no width: draw limits as short bars.
        for limit, colour in zip(panel.limit[:, 0], LIMITS, strict=True):
            axes.plot(f, [limit], marker="_", markersize=26, color=colour, markeredgewidth=1.8, zorder=OVER)
    else:
        axes.fill_between(f, *panel.limit, color=PALE, alpha=0.18, linewidth=0)
        together = _coincide(panel)
        for y, jump, colour, side in zip(panel.limit, panel.jump, LIMITS, ("lower", "upper"), strict=True):
            dotted = jump[1:] | jump[:-1]
            dashed = together if side == "upper" else np.zeros_like(together)
            for first, last in _split_runs(2 * dotted + (dashed & ~dotted)):
                style: Any = ":" if dotted[first] else DASHES if dashed[first] else "-"
                axes.plot(
                    f[first : last + 1], y[first : last + 1], color=colour, linestyle=style, zorder=OVER,
                    linewidth=1.2 if dotted[first] else LINE, dash_capstyle="butt",
                )  # fmt: skip
    for number, curve in enumerate(panel.curves):
        way = SWEEP[curve.sweep]
        ink: dict[str, Any] = {"color": colours[curve.repeat], "alpha": 0.85}
        axes.plot(curve.frequency, curve.value, linestyle=way["linestyle"], linewidth=0.8, **ink)
        # Mark curves at different points, since repeats coincide.
        every = -(-len(curve.frequency) // MOST_MARKED)
        marked = slice(number % every, None, every)
        ink |= {"marker": way["marker"], "markersize": 2.6, "linestyle": "", "zorder": MARKED}
        axes.plot(curve.frequency[marked], curve.value[marked], **ink)
    for curve in panel.curves:
        if curve.outside.any():
            axes.plot(curve.frequency[curve.outside], curve.value[curve.outside], **_make_ring())
    axes.set_title(panel.label, fontsize=10, loc="left")
    open_box(axes)


def _coincide(panel: FamilyPanel) -> NDArray[np.bool_]:
    """Whether the band between two frequencies is narrower than the lines of its limits, shape (f - 1,)."""
    drawn = np.concatenate([panel.limit.ravel(), *(curve.value for curve in panel.curves)])
    high, low = np.nanmax(drawn, initial=-np.inf), np.nanmin(drawn, initial=np.inf)
    narrow = np.abs(panel.limit[1] - panel.limit[0]) < (high - low) / WIDTHS
    return np.asarray(narrow[1:] & narrow[:-1])


def _split_runs(kind: NDArray[np.int64]) -> list[tuple[int, int]]:
    """First and last of each run of equal numbers, the last one excluded."""
    ends = [0, *(np.flatnonzero(np.diff(kind)) + 1).tolist(), len(kind)]
    return list(itertools.pairwise(ends))


def _find_lowest(panel: FamilyPanel) -> float:
    """Lowest value that is drawn: an axis of amplitudes begins at zero."""
    return min([float(np.nanmin(panel.limit, initial=np.inf)), *(float(c.value.min()) for c in panel.curves)])


def _make_ring() -> dict[str, Any]:
    return {
        "marker": "o", "linestyle": "", "markerfacecolor": "none", "markeredgecolor": "#c1121f", "markersize": 4.5,
        "markeredgewidth": 0.9, "zorder": MARKED,
    }  # fmt: skip


def _add_limits_legend(figure: Figure, result: FamiliesOverLimits, colours: dict[int, str]) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    curves = [c for row in result.rows for panel in row.panels for c in panel.curves]
    panels = [panel for row in result.rows for panel in row.panels]
    together = [_coincide(panel) if len(panel.frequency) > 1 else np.zeros(1, dtype=np.bool_) for panel in panels]
    lower, upper = (Line2D([], [], color=colour, linewidth=LINE) for colour in LIMITS)
    entries: dict[str, Any] = {}
    if not all(item.all() for item in together):
        entries |= {
            "upper limit": upper, "lower limit": lower, "all friction histories": Patch(color=PALE, alpha=0.18),
        }  # fmt: skip
    if any(item.any() for item in together):
        dashes = Line2D([], [], color=LIMITS[1], linewidth=LINE, linestyle=DASHES, dash_capstyle="butt")
        entries["both limits, closer than the line width"] = (lower, dashes)
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
        entries["outside by more than its uncertainty"] = Line2D([], [], **_make_ring())
    add_legend(figure, list(entries.values()), list(entries), fontsize=9)
