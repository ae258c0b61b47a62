"""Measured and predicted responses of small vibrations for several models: a panel for each configuration."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import INK, Figure, TitledFigure, add_legend, add_title, choose_family_colours, make_figure, open_box

Real = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class SmallResponsePanel:
    """Panel of one configuration.

    Parameters
    ----------
    label
        Above the panel.
    frequency, measured
        Readings, shape (p,) [Hz, unit of the amplitude].
    line_frequency
        Frequencies of the models, shape (f,) [Hz].
    lines
        Amplitude of each model by its name, shape (f,) [unit of the amplitude].
    """

    label: str
    frequency: Float[Real, " p"]
    measured: Float[Real, " p"]
    line_frequency: Float[Real, " f"]
    lines: Mapping[str, Float[Real, " f"]]


@dataclass(frozen=True, kw_only=True, eq=False)
class SmallResponses(TitledFigure):
    """Panels side by side, all with lines of the same names.

    Parameters
    ----------
    panels
        One for each configuration.
    amplitude
        Label of the vertical axes, with its unit.
    """

    panels: Sequence[SmallResponsePanel]
    amplitude: str = "amplitude of the tip [µm/N]"


@draws(SmallResponses, "small_responses")
def draw_small_responses(result: SmallResponses) -> Figure:
    """Draw points and lines."""
    figure = make_figure(5.2 * len(result.panels), 4.3)
    grid = figure.subplots(1, len(result.panels), squeeze=False)[0]
    names = list(result.panels[0].lines)
    for axes, panel in zip(grid, result.panels, strict=True):
        for name, colour in zip(names, choose_family_colours(len(names)), strict=True):
            axes.semilogy(panel.line_frequency, panel.lines[name], color=colour, linewidth=1.4, label=name)
        axes.semilogy(panel.frequency, panel.measured, ".", color=INK, markersize=4, label="measured")
        axes.set_title(panel.label, fontsize=10, loc="left")
        axes.set_xlabel("frequency [Hz]")
        open_box(axes)
    grid[0].set_ylabel(result.amplitude)
    handles, labels = grid[0].get_legend_handles_labels()
    add_legend(figure, handles, labels)
    add_title(figure, result.title)
    return figure
