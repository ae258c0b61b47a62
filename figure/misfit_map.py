"""Where a model fails: level by frequency, one panel a sensor and harmonic, in standard deviations."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from figure.evenly import evenly
from figure.heading import add_heading
from figure.style import INK, png

NOTHING = "#e5e7eb"
#: Ends of the steps of the scale [standard deviations]; below the second, noise explains it.
STEPS = (0, 2, 3, 5, 10, 20, 50)
#: The first step is as pale as paper, so that what noise explains does not catch the eye.
COLOURS = ("#f4f6f8", "#fee5b8", "#fdbb6c", "#f68a3c", "#d94a1e", "#a11a14", "#5a0a1e")
#: Frequencies named along an axis, at most.
MOST_TICKS = 7


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


def misfit_map_figure(
    panels: Sequence[MapPanel],
    *,
    levels: Sequence[str],
    frequency: Float[NDArray[np.float64], " f"],
    title: str,
    subtitle: str,
) -> bytes:
    """Draw the map as PNG.

    Parameters
    ----------
    panels
        Sensors are rows, harmonics columns.
    levels
        In words, rising, l of them.
    frequency
        Ascending, of all panels, shape (f,) [Hz]; drawn evenly, as points crowd at a resonance.
    title, subtitle
        Above the figure.
    """
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.figure import Figure

    sensors = list(dict.fromkeys(panel.sensor for panel in panels))
    # Static parts come last: few sensors have one.
    harmonics = sorted({panel.harmonic for panel in panels}, key=lambda harmonic: (harmonic == 0, harmonic))
    by_place = {(panel.sensor, panel.harmonic): panel for panel in panels}
    colours = ListedColormap(COLOURS[:-1]).with_extremes(over=COLOURS[-1], bad=NOTHING)
    norm = BoundaryNorm(STEPS, len(COLOURS) - 1)
    height = 0.62 + 0.21 * len(levels)
    figure = Figure(
        figsize=(max(1.4 + 3.7 * len(harmonics), 7.5), 1.9 + height * len(sensors)), layout="constrained", dpi=150
    )
    axes = figure.subplots(len(sensors), len(harmonics), squeeze=False, sharex=True, sharey=True)
    ticks = evenly(len(frequency), MOST_TICKS)
    bottom = {
        harmonic: max(row for row, sensor in enumerate(sensors) if (sensor, harmonic) in by_place)
        for harmonic in harmonics
    }
    for row, sensor in enumerate(sensors):
        first = next(harmonic for harmonic in harmonics if (sensor, harmonic) in by_place)
        for column, harmonic in enumerate(harmonics):
            axis, panel = axes[row, column], by_place.get((sensor, harmonic))
            if panel is None:
                axis.set_axis_off()
                continue
            axis.imshow(panel.size, cmap=colours, norm=norm, aspect="auto", origin="lower", interpolation="nearest")
            # Lines between the cells: a level and a frequency can be followed by eye.
            axis.set_xticks(np.arange(len(frequency) + 1) - 0.5, minor=True)
            axis.set_yticks(np.arange(len(levels) + 1) - 0.5, minor=True)
            axis.grid(which="minor", color="white", linewidth=0.8)
            axis.tick_params(which="both", length=0, labelsize=8, colors=INK)
            axis.spines[:].set_visible(False)
            axis.set_title(
                f"{sensor}, harmonic {harmonic}" if harmonic else f"{sensor}, static",
                fontsize=9,
                loc="left",
                color=INK,
                pad=3,
            )
            axis.set_xticks(ticks, [f"{frequency[tick]:.4g}" for tick in ticks])
            axis.set_yticks(range(len(levels)), levels)
            axis.tick_params(labelleft=harmonic == first, labelbottom=row == bottom[harmonic])
            if row == bottom[harmonic]:
                axis.set_xlabel("frequency [Hz]", fontsize=9)
    bar = figure.colorbar(
        ScalarMappable(norm=norm, cmap=colours),
        ax=axes,
        location="bottom",
        shrink=0.8,
        aspect=45,
        extend="max",
        fraction=0.4 / figure.get_figheight(),
        pad=0.1 / figure.get_figheight(),
    )
    bar.set_label("difference over its standard deviation (rms of real and imaginary part); below 2, noise explains it")
    bar.outline.set_visible(False)
    add_heading(figure, title, subtitle)
    return png(figure)
