"""Map of the misfit over level and frequency in standard deviations, one panel per sensor and harmonic."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import (
    HEADING,
    INK,
    Axes,
    Figure,
    TitledFigure,
    add_axes,
    add_heading,
    choose_evenly,
    make_bare_figure,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import BoundaryNorm, Colormap

NOTHING = "#bcc3cc"
#: Ends of the steps of the scale [standard deviations]; a misfit below the second is within noise.
COLOUR_STEPS = (0, 2, 3, 5, 10, 20, 50)
#: The first step is as pale as paper, so that a misfit within noise is inconspicuous.
COLOURS = ("#f4f6f8", "#fee5b8", "#fdbb6c", "#f68a3c", "#d94a1e", "#a11a14", "#5a0a1e")
#: Largest number of labelled frequencies along an axis.
MOST_TICKS = 7
#: Least width of a panel, and height of a level in it; room for its title, for frequencies below it, and between
#: panels; width of a character of a level [inches].
PANEL_WIDTH, CELL, TITLE_ROOM, FOOT, BETWEEN, CHARACTER = 3.5, 0.28, 0.26, 0.36, 0.28, 0.065
#: Sizes of titles and axis labels, and of levels and frequencies; distances from a panel to its title, to levels and
#: frequencies, and to the axis label below these [points].
TITLE_SIZE, NUMBER_SIZE, TITLE_GAP, NUMBER_GAP, LABEL_GAP = 9, 8, 3.0, 3.5, 15.5
POINTS_PER_INCH = 72
#: Width that the scale and its label need [inches]; fewer panels are as wide together.
LEAST_WIDTH = 7.5
#: Room left and right of all panels; height of the scale, of its numbers and label, and of all of it [inches].
SIDE, END, BAR, BAR_FOOT, BAR_ROOM = 0.2, 0.1, 0.18, 0.5, 0.85
#: Room for the colour of cells without data and its name, right of the scale [inches].
WITHOUT = 0.9


@dataclass(frozen=True, kw_only=True, eq=False)
class MapPanel:
    """Panel of one sensor and harmonic.

    Parameters
    ----------
    sensor, harmonic
        Row and column of the panel.
    size
        Misfit, shape (l, f) [standard deviations]; NaN where nothing was measured.
    """

    sensor: str
    harmonic: int
    size: Float[NDArray[np.float64], "l f"]


@dataclass(frozen=True, kw_only=True, eq=False)
class MisfitMap(TitledFigure):
    """Misfits by level and frequency: sensors are rows, harmonics columns.

    Parameters
    ----------
    panels
        Sensors are rows, harmonics columns.
    levels
        Levels in words, ascending, l of them.
    frequency
        Ascending frequencies of all panels, shape (f,) [Hz]; drawn evenly, as points are dense at a resonance.
    """

    panels: Sequence[MapPanel]
    levels: Sequence[str]
    frequency: Float[NDArray[np.float64], " f"]
    subtitle: str


@draws(MisfitMap, "misfit_map")
def draw_misfit_map(result: MisfitMap) -> Figure:
    """Draw the map."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import BoundaryNorm, ListedColormap

    sensors = list(dict.fromkeys(panel.sensor for panel in result.panels))
    # Static parts come last: few sensors have one.
    harmonics = sorted({panel.harmonic for panel in result.panels}, key=lambda harmonic: (harmonic == 0, harmonic))
    by_place = {(panel.sensor, panel.harmonic): panel for panel in result.panels}
    colours = ListedColormap(COLOURS[:-1]).with_extremes(over=COLOURS[-1], bad=NOTHING)
    norm = BoundaryNorm(COLOUR_STEPS, len(COLOURS) - 1)
    bottom = {
        harmonic: max(row for row, sensor in enumerate(sensors) if (sensor, harmonic) in by_place)
        for harmonic in harmonics
    }
    side = SIDE + CHARACTER * max(len(level) for level in result.levels)
    cells = CELL * len(result.levels)
    tall = [TITLE_ROOM + cells + (FOOT if row in bottom.values() else 0.0) for row in range(len(sensors))]
    width = max(side + (PANEL_WIDTH + BETWEEN) * len(harmonics) + END, LEAST_WIDTH)
    across = (width - side - END) / len(harmonics) - BETWEEN
    height = HEADING + sum(tall) + BAR_ROOM
    figure = make_bare_figure(width, height)
    axes = _add_page_axes(figure, width, height)
    for row, sensor in enumerate(sensors):
        first = next(harmonic for harmonic in harmonics if (sensor, harmonic) in by_place)
        for column, harmonic in enumerate(harmonics):
            if (panel := by_place.get((sensor, harmonic))) is None:
                continue
            left, top = side + column * (across + BETWEEN), HEADING + sum(tall[:row]) + TITLE_ROOM
            _draw_panel(axes, panel, left, top, across, colours, norm)
            if harmonic == first:
                _name_levels(axes, result.levels, left, top)
            if row == bottom[harmonic]:
                _name_frequencies(axes, result.frequency, left, top + cells, across)
    margin, top = 0.1 * width, height - BAR_FOOT - BAR
    room = WITHOUT if any(np.isnan(panel.size).any() for panel in result.panels) else 0.0
    bar = figure.colorbar(
        ScalarMappable(norm=norm, cmap=colours), orientation="horizontal", extend="max",
        cax=add_axes(figure, margin, top, scale := width - 2 * margin - room, BAR),
    )  # fmt: skip
    if room:
        _name_nothing(axes, width - margin - room + BETWEEN, top)
    bar.set_label(
        "difference over its standard deviation (rms of real and imaginary part); values below 2 are explained by noise"
    )
    bar.ax.xaxis.label.set_x((width / 2 - margin) / scale)  # it is hardly narrower than the figure
    bar.outline.set_visible(False)
    add_heading(figure, result)
    return figure


def _add_page_axes(figure: Figure, width: float, height: float) -> Axes:
    """Invisible axes of the whole figure in inches from the left and from the top.

    Axes and their ticks take most of the time of a figure of many: all panels of the map are drawn in these.
    """
    axes = add_axes(figure, 0.0, 0.0, width, height)
    axes.set(xlim=(0.0, width), ylim=(height, 0.0))
    axes.set_axis_off()
    return axes


def _draw_panel(
    axes: Axes, panel: MapPanel, left: float, top: float, across: float, colours: "Colormap", norm: "BoundaryNorm"
) -> None:
    """Draw one panel, with lines between its cells: a level and a frequency can be followed by eye."""
    n_level, n_frequency = panel.size.shape
    x = left + across * np.arange(n_frequency + 1) / n_frequency
    y = top + CELL * np.arange(n_level, -1, -1)
    axes.pcolormesh(x, y, panel.size, cmap=colours, norm=norm, edgecolors="white", linewidth=0.8)
    words = f"harmonic {panel.harmonic}" if panel.harmonic else "static"
    axes.text(
        left, top - TITLE_GAP / POINTS_PER_INCH, f"{panel.sensor}, {words}", fontsize=TITLE_SIZE, color=INK,
        va="baseline", ha="left",
    )  # fmt: skip


def _name_nothing(axes: Axes, left: float, top: float) -> None:
    """Draw a cell without data, and label it."""
    from matplotlib.patches import Rectangle

    axes.add_patch(Rectangle((left, top), BAR, BAR, facecolor=NOTHING, label="no data"))
    axes.text(
        left + BAR + NUMBER_GAP / POINTS_PER_INCH, top + BAR / 2, "no data", fontsize=NUMBER_SIZE, color=INK,
        va="center_baseline", ha="left",
    )  # fmt: skip


def _name_levels(axes: Axes, levels: Sequence[str], left: float, top: float) -> None:
    """Write the levels left of a panel; the lowest is at its bottom."""
    x = left - NUMBER_GAP / POINTS_PER_INCH
    for row, level in enumerate(reversed(levels)):
        axes.text(
            x, top + CELL * (row + 0.5), level, fontsize=NUMBER_SIZE, color=INK, va="center_baseline", ha="right"
        )  # fmt: skip


def _name_frequencies(
    axes: Axes, frequency: Float[NDArray[np.float64], " f"], left: float, bottom: float, across: float
) -> None:
    """Write some of the frequencies below a panel, and the label of the axis."""
    y = bottom + NUMBER_GAP / POINTS_PER_INCH
    for place in choose_evenly(len(frequency), MOST_TICKS):
        x = left + across * (place + 0.5) / len(frequency)
        axes.text(x, y, f"{frequency[place]:.4g}", fontsize=NUMBER_SIZE, color=INK, va="top", ha="center")
    axes.text(
        left + across / 2, bottom + LABEL_GAP / POINTS_PER_INCH, "frequency [Hz]", fontsize=TITLE_SIZE,
        va="top", ha="center",
    )  # fmt: skip
