"""Response curves over a grid of parameters: one panel per level, colours by one parameter, lines by the others."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import (
    FIRST_COLOUR,
    INK,
    LAST_COLOUR,
    Axes,
    Figure,
    TitledFigure,
    add_heading,
    add_legend,
    make_figure,
    open_box,
)

Values = Float[NDArray[np.float64], " p"]

#: Lines of the other parameters.
LINES: tuple[Literal["-", "--", ":", "-."], ...] = ("-", "--", ":", "-.")
#: Panels in a row, and values that a colour bar names.
COLUMNS, NAMED_VALUES = 2, 9


@dataclass(frozen=True, kw_only=True, eq=False)
class ParameterCurve:
    """Response curve at one value of a parameter.

    Parameters
    ----------
    value
        Value of the parameter that colours represent.
    line
        Number of the line in `ParameterCurves.lines`.
    along, amplitude
        Shape (p,).
    """

    value: float
    line: int
    along: Values
    amplitude: Values


@dataclass(frozen=True, kw_only=True, eq=False)
class ParameterCurves(TitledFigure):
    """Curves for values of a parameter.

    Parameters
    ----------
    panels
        Label and curves of each panel.
    colour_label
        Parameter that colours represent, with its unit.
    lines
        Meaning of the kinds of lines: values of the other parameters; one without a name if there are none.
    along_label, amplitude_label
        Labels of the axes, with units.
    """

    panels: Sequence[tuple[str, Sequence[ParameterCurve]]]
    colour_label: str
    lines: Sequence[str]
    along_label: str
    amplitude_label: str


@draws(ParameterCurves, "parameter_curves")
def draw_parameter_curves(result: ParameterCurves) -> Figure:
    """Draw the curves."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize

    columns = min(COLUMNS, len(result.panels))
    rows = -(-len(result.panels) // columns)
    figure = make_figure(max(8.0, 5.4 * columns), 1.8 + 3.2 * rows)
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True)
    values = sorted({curve.value for _, curves in result.panels for curve in curves})
    shades = ListedColormap(colormaps["viridis"](np.linspace(FIRST_COLOUR, LAST_COLOUR, 256)))
    norm = Normalize(values[0], values[-1])
    colours = ScalarMappable(norm, shades)
    for axes, (label, curves) in zip(grid.flat, result.panels, strict=False):
        _draw(axes, label, curves, lambda value: shades(norm(value)))
    for axes in grid.flat[len(result.panels) :]:
        axes.set_visible(False)
    for column in range(columns):
        bottom = max(row for row in range(rows) if row * columns + column < len(result.panels))
        grid[bottom, column].set_xlabel(result.along_label)
        grid[bottom, column].tick_params(labelbottom=True)
    for row in range(rows):
        grid[row, 0].set_ylabel(result.amplitude_label)
    if len(values) > 1:
        bar = figure.colorbar(colours, ax=grid, label=result.colour_label, aspect=28, pad=0.015)
        bar.outline.set_visible(False)
        if len(values) <= NAMED_VALUES:
            bar.set_ticks(values, labels=[f"{value:.4g}" for value in values])
    if len(result.lines) > 1:
        _add_line_legend(figure, result.lines)
    add_heading(figure, result)
    return figure


def _draw(axes: Axes, label: str, curves: Sequence[ParameterCurve], colour: Callable[[float], Any]) -> None:
    for curve in curves:
        axes.plot(
            curve.along, curve.amplitude, color=colour(curve.value), linestyle=LINES[curve.line % len(LINES)],
            linewidth=1.4,
        )  # fmt: skip
    axes.set_title(label, fontsize=10, loc="left", color=INK)
    axes.set_ylim(bottom=0)
    open_box(axes)


def _add_line_legend(figure: Figure, lines: Sequence[str]) -> None:
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color=INK, linestyle=LINES[number % len(LINES)]) for number in range(len(lines))]
    add_legend(figure, handles, list(lines), most=4)
