"""Limits of static or dynamic forces of contact lines, level by level, with histories or tests inside them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import INK, LIMITS, PALE, Figure, TitledFigure, add_legend, add_title, make_figure, open_box

Real = NDArray[np.float64]

#: Width of a bar, in distances of two levels, and scatter of points within it.
BAR, SCATTER = 0.5, 0.15


@dataclass(frozen=True, kw_only=True, eq=False)
class ForceLimits:
    """Panel of the limits of one force.

    Parameters
    ----------
    line, force
        Names of the contact line (a column) and of the force (a row), such as "T0".
    level
        Shape (l,) [-].
    value
        Lower and upper limit, shape (2, l) [N].
    sampled
        Forces after histories or tests, shape (n, l) [N]; NaN where one has none.
    """

    line: str
    force: str
    level: Float[Real, " l"]
    value: Float[Real, "2 l"]
    sampled: Float[Real, "n l"]


@dataclass(frozen=True, kw_only=True, eq=False)
class LineForceLimits(TitledFigure):
    """Limits of the forces of contact lines: one row per force, one column per line.

    Parameters
    ----------
    panels
        One for each force of each line, all of the same levels.
    sampled_label
        Label of the points, if there are any.
    level_label
        Label of the horizontal axes, with its unit.
    """

    panels: Sequence[ForceLimits]
    sampled_label: str = ""
    level_label: str = "level of the harmonic force [-]"


@draws(LineForceLimits, "force_limits")
def force_limits_figure(result: LineForceLimits) -> Figure:
    """Draw the limits as bars, with the samples in them."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    forces, lines = (list(dict.fromkeys(getattr(item, name) for item in result.panels)) for name in ("force", "line"))
    figure = make_figure(1.5 + 3.6 * len(lines), 1.3 + 2.5 * len(forces))
    grid = figure.subplots(len(forces), len(lines), squeeze=False, sharex=True, sharey="row")
    for panel in result.panels:
        axes = grid[forces.index(panel.force), lines.index(panel.line)]
        # A bar would end at the edge of its panel.
        axes.use_sticky_edges = False
        place = np.arange(len(panel.level))
        axes.bar(place, np.ptp(panel.value, axis=0), BAR, panel.value[0], color=PALE, alpha=0.2)
        for colour, limit in zip(LIMITS, panel.value, strict=True):
            axes.hlines(limit, place - BAR / 2, place + BAR / 2, color=colour, linewidth=2)
        # Side by side in their order: points of one value would hide each other.
        beside = np.linspace(-SCATTER, SCATTER, len(panel.sampled))[:, None] + place
        axes.plot(beside.ravel(), panel.sampled.ravel(), ".", color=INK, markersize=2.5)
        axes.set_xticks(place, [f"{level:g}" for level in panel.level])
        axes.set_title(f"{panel.line}: {panel.force}", fontsize=10, loc="left")
        open_box(axes, "y")
    for axes in grid.flat:
        axes.set_visible(axes.has_data())  # a force that was not measured has no panel
    for row, force in zip(grid[:, 0], forces, strict=True):
        row.set_ylabel(f"{force} [N]")
    for axes in grid[-1]:
        axes.set_xlabel(result.level_label)
    handles = [
        Line2D([], [], color=LIMITS[1], linewidth=2, label="upper limit"),
        Line2D([], [], color=LIMITS[0], linewidth=2, label="lower limit"),
        Patch(color=PALE, alpha=0.2, label="between them"),
    ]
    if result.sampled_label:
        style: dict[str, Any] = {"marker": ".", "linestyle": "", "markersize": 4}
        handles.append(Line2D([], [], color=INK, label=result.sampled_label, **style))
    add_legend(figure, handles)
    add_title(figure, result.title)
    return figure
