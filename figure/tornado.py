"""Tornado diagram: change by a step of each parameter, as bars to both sides, one panel for each quantity."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import INK, LIMITS, Figure, TitledFigure, add_legend, add_title, make_figure, open_box


@dataclass(frozen=True, kw_only=True, eq=False)
class Tornado(TitledFigure):
    """Changes of quantities by steps of parameters.

    Parameters
    ----------
    parameters
        Names with their steps.
    changes
        By quantity, its name with the unit: change by the step down and up of each parameter, shape (p, 2).
    """

    parameters: Sequence[str]
    changes: Mapping[str, Float[NDArray[np.float64], "p 2"]]


#: Panels in one row.
MOST_COLUMNS = 3


@draws(Tornado, "tornado")
def draw_tornado(result: Tornado) -> Figure:
    """Draw the bars."""
    from matplotlib.patches import Patch

    n_panel = len(result.changes)
    n_row = -(-n_panel // MOST_COLUMNS)
    n_column = -(-n_panel // n_row)
    figure = make_figure(2.4 + 3.4 * n_column, 1.2 + n_row * (0.4 + 0.34 * len(result.parameters)))
    grid = figure.subplots(n_row, n_column, squeeze=False, sharey=True)
    place = np.arange(len(result.parameters))[::-1]
    for axes in grid.flat[n_panel:]:
        axes.set_axis_off()
    for axes, (name, change) in zip(grid.flat, result.changes.items(), strict=False):
        for side, colour in enumerate(LIMITS):
            axes.barh(place + (0.18, -0.18)[side], change[:, side], 0.34, color=colour)
        axes.axvline(0.0, color=INK, linewidth=0.8)
        axes.set_xlabel(name)
        open_box(axes, grid="x")
    grid[0, 0].set_yticks(place, result.parameters)
    entries = {"a step down": Patch(color=LIMITS[0]), "a step up": Patch(color=LIMITS[1])}
    add_legend(figure, list(entries.values()), list(entries))
    add_title(figure, result.title)
    return figure
