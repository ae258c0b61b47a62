"""Values of parameters with their intervals by several methods, and the truth: a panel for each parameter."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from figure.registry import draws
from figure.style import INK, Figure, TitledFigure, add_legend, add_title, choose_family_colours, make_figure, open_box

#: Panels in a row.
COLUMNS = 5


@dataclass(frozen=True, kw_only=True, eq=False)
class IntervalPanel:
    """Panel of one parameter.

    Parameters
    ----------
    label
        Name with its unit.
    truth
        True value; None if unknown.
    ways
        Value, lower and upper end by the name of the method; both ends equal the value without an interval.
    """

    label: str
    truth: float | None
    ways: Mapping[str, tuple[float, float, float]]


@dataclass(frozen=True, kw_only=True, eq=False)
class ParameterIntervals(TitledFigure):
    """Panels of all parameters, all with the same methods."""

    panels: Sequence[IntervalPanel]


@draws(ParameterIntervals, "parameter_intervals")
def draw_parameter_intervals(result: ParameterIntervals) -> Figure:
    """Draw a bar from end to end and a point for each method, and a line at the truth."""
    from matplotlib.lines import Line2D

    count = len(result.panels)
    columns = min(COLUMNS, count)
    rows = -(-count // columns)
    figure = make_figure(0.8 + 2.5 * columns, 1.2 + 1.5 * rows)
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    names = list(result.panels[0].ways)
    colours = dict(zip(names, choose_family_colours(len(names)), strict=True))
    for axes, panel in zip(grid, result.panels, strict=False):
        for place, (name, (value, lower, upper)) in enumerate(reversed(list(panel.ways.items()))):
            axes.plot(
                [lower, upper], [place, place], color=colours[name], linewidth=3, alpha=0.5, solid_capstyle="butt"
            )
            axes.plot(value, place, "o", color=colours[name], markersize=5)
        if panel.truth is not None:
            axes.axvline(panel.truth, color=INK, linewidth=1.2, linestyle="--")
        axes.set_ylim(-0.6, len(names) - 0.4)
        axes.set_yticks([])
        axes.margins(x=0.15)
        axes.set_xlabel(panel.label)
        open_box(axes, grid="x")
    for axes in grid[count:]:
        axes.set_visible(False)
    handles = [
        *(Line2D([], [], color=colours[name], marker="o", linewidth=3, alpha=0.7, label=name) for name in names),
        Line2D([], [], color=INK, linestyle="--", label="truth"),
    ]
    add_legend(figure, handles)
    add_title(figure, result.title)
    return figure
