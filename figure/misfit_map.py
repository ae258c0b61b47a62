"""Where a model fails: level by frequency, one panel per sensor and harmonic, in standard deviations."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import HEADING, INK, Axes, Figure, Headed, add_axes, add_heading, bare_figure, evenly

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import BoundaryNorm, Colormap

NOTHING = "#e5e7eb"
#: Ends of the steps of the scale [standard deviations]; below the second, noise explains it.
STEPS = (0, 2, 3, 5, 10, 20, 50)
#: The first step is as pale as paper, so that what noise explains does not catch the eye.
COLOURS = ("#f4f6f8", "#fee5b8", "#fdbb6c", "#f68a3c", "#d94a1e", "#a11a14", "#5a0a1e")
#: Frequencies named along an axis, at most.
MOST_TICKS = 7
#: Width of a panel and height of a level in it; room for its title, for frequencies below it, and between panels; width
#: of a character of a level [inches].
PANEL_WIDTH, CELL, TITLE_ROOM, FOOT, BETWEEN, CHARACTER = 3.5, 0.28, 0.26, 0.36, 0.28, 0.065
#: Room left and right of all panels; height of the scale, of its numbers and label, and of all of it [inches].
SIDE, END, BAR, BAR_FOOT, BAR_ROOM = 0.2, 0.1, 0.18, 0.5, 0.85


@dataclass(frozen=True, kw_only=True, eq=False)
class MapPanel:
    """One sensor and harmonic.

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
class MisfitMap(Headed):
    """Misfits by level and frequency: sensors are rows, harmonics columns.

    Parameters
    ----------
    panels
        Sensors are rows, harmonics columns.
    levels
        Levels in words, ascending, l of them.
    frequency
        Ascending, of all panels, shape (f,) [Hz]; drawn evenly, as points crowd at a resonance.
    """

    panels: Sequence[MapPanel]
    levels: Sequence[str]
    frequency: Float[NDArray[np.float64], " f"]
    subtitle: str


@draws(MisfitMap, "misfit_map")
def misfit_map_figure(result: MisfitMap) -> Figure:
    """Draw the map."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import BoundaryNorm, ListedColormap

    sensors = list(dict.fromkeys(panel.sensor for panel in result.panels))
    # Static parts come last: few sensors have one.
    harmonics = sorted({panel.harmonic for panel in result.panels}, key=lambda harmonic: (harmonic == 0, harmonic))
    by_place = {(panel.sensor, panel.harmonic): panel for panel in result.panels}
    colours = ListedColormap(COLOURS[:-1]).with_extremes(over=COLOURS[-1], bad=NOTHING)
    norm = BoundaryNorm(STEPS, len(COLOURS) - 1)
    bottom = {
        harmonic: max(row for row, sensor in enumerate(sensors) if (sensor, harmonic) in by_place)
        for harmonic in harmonics
    }
    side = SIDE + CHARACTER * max(len(level) for level in result.levels)
    across, cells = PANEL_WIDTH, CELL * len(result.levels)
    tall = [TITLE_ROOM + cells + (FOOT if row in bottom.values() else 0.0) for row in range(len(sensors))]
    width = max(side + (across + BETWEEN) * len(harmonics) + END, 7.5)
    figure = bare_figure(width, HEADING + sum(tall) + BAR_ROOM)
    ticks = evenly(len(result.frequency), MOST_TICKS)
    for row, sensor in enumerate(sensors):
        first = next(harmonic for harmonic in harmonics if (sensor, harmonic) in by_place)
        for column, harmonic in enumerate(harmonics):
            if (panel := by_place.get((sensor, harmonic))) is None:
                continue
            left, top = side + column * (across + BETWEEN), HEADING + sum(tall[:row]) + TITLE_ROOM
            axis = add_axes(figure, left, top, across, cells)
            _cells(axis, panel, colours, norm)
            # Ticks take most of the time: only those with a label are made.
            axis.set_xticks([])
            axis.set_yticks([])
            if harmonic == first:
                axis.set_yticks(range(len(result.levels)), result.levels)
            if row == bottom[harmonic]:
                axis.set_xticks(ticks, [f"{result.frequency[tick]:.4g}" for tick in ticks])
                axis.set_xlabel("frequency [Hz]", fontsize=9)
    bar = figure.colorbar(
        ScalarMappable(norm=norm, cmap=colours), orientation="horizontal", extend="max",
        cax=add_axes(figure, 0.1 * width, HEADING + sum(tall) + BAR_ROOM - BAR_FOOT - BAR, 0.8 * width, BAR),
    )  # fmt: skip
    bar.set_label("difference over its standard deviation (rms of real and imaginary part); below 2, noise explains it")
    bar.outline.set_visible(False)
    add_heading(figure, result)
    return figure


def _cells(axes: Axes, panel: MapPanel, colours: "Colormap", norm: "BoundaryNorm") -> None:
    """Draw one panel, with lines between its cells: a level and a frequency can be followed by eye."""
    n_level, n_frequency = panel.size.shape
    x, y = np.arange(n_frequency + 1) - 0.5, np.arange(n_level + 1) - 0.5
    axes.pcolormesh(x, y, panel.size, cmap=colours, norm=norm, edgecolors="white", linewidth=0.8)
    axes.tick_params(which="both", length=0, labelsize=8, colors=INK)
    axes.spines[:].set_visible(False)
    words = f"harmonic {panel.harmonic}" if panel.harmonic else "static"
    axes.set_title(f"{panel.sensor}, {words}", fontsize=9, loc="left", color=INK, pad=3, y=1.0)
