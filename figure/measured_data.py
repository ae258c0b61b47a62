"""Measured and predicted data of any type: loops, ring-downs, frequency responses, a panel each."""

from collections.abc import Sequence
from dataclasses import dataclass

from correlation.data_type.registry import Panel
from figure.registry import draws
from figure.style import (
    INK,
    LIMITS,
    Axes,
    Figure,
    TitledFigure,
    add_heading,
    add_legend,
    make_figure,
    open_box,
    use_log_scale,
)

COLUMNS = 2
#: Height of a title [inches].
LEAST_WIDTH = 7.5
#: Predictions at fewer points are drawn with a marker at each.
MARKED_POINTS = 20


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredData(TitledFigure):
    """Panels of measured data, at least one."""

    panels: Sequence[Panel]


@draws(MeasuredData, "measured_data")
def draw_measured_data(result: MeasuredData) -> Figure:
    """Draw the panels, two in a row."""
    columns = min(COLUMNS, len(result.panels))
    rows = -(-len(result.panels) // columns)
    figure = make_figure(max(5.6 * columns, LEAST_WIDTH), 1.2 + 3.2 * rows, hspace=0.06)
    grid = figure.subplots(rows, columns, squeeze=False)
    for axes in grid.flat[len(result.panels) :]:
        axes.set_visible(False)
    for axes, panel in zip(grid.flat, result.panels, strict=False):
        _draw(axes, panel)
    handles, labels = grid[0, 0].get_legend_handles_labels()
    if labels:
        add_legend(figure, handles, labels)
    add_heading(figure, result)
    return figure


def _draw(axes: Axes, panel: Panel) -> None:
    for number, (x, y) in enumerate(panel.measured):
        # Above the model, and thin, so that both are visible where they agree.
        curve, points = {"linewidth": 0.7, "zorder": 3}, {"marker": "o", "markersize": 4, "linestyle": "none"}
        style = curve if panel.is_curve else points
        axes.plot(x, y, color=INK, label=None if number else "measured", **style)
    for number, (x, y) in enumerate(panel.predicted):
        few = len(x) < MARKED_POINTS
        axes.plot(
            x, y, color=LIMITS[1], linewidth=2.8 if panel.is_curve else 1.4, marker="s" if few else "", markersize=4.5,
            label=None if number else "model",
        )  # fmt: skip
    axes.set_title(panel.title, fontsize=10, loc="left")
    axes.set_xlabel(panel.x_label)
    axes.set_ylabel(panel.y_label)
    if panel.log_x:
        use_log_scale(axes, "x")
    if panel.log_y:
        use_log_scale(axes, "y")
    open_box(axes)
