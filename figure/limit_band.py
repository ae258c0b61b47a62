"""The band that unknown friction history can produce, over frequency, one panel per level."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import INK, LIMITS, PALE, Axes, Figure, TitledFigure, add_legend, add_title, make_figure, open_box

Real = NDArray[np.float64]
Flags = Bool[NDArray[np.bool_], "2 f"]

#: Panels in a row.
COLUMNS = 2
#: Styles of the range of the sampled states, and of each state.
REACH: dict[str, Any] = {"color": PALE, "linewidth": 2.5, "alpha": 0.45}
STATE: dict[str, Any] = {"color": INK, "linestyle": "", "marker": ".", "markersize": 1.5}


@dataclass(frozen=True, kw_only=True, eq=False)
class Band:
    """Band between both limits; arrays have the lower limit first.

    Parameters
    ----------
    label
        Text above the panel.
    frequency
        Ascending, shape (f,) [Hz].
    value
        Limits, shape (2, f) [unit of the figure]; NaN where none was found.
    sampled
        States of random histories, shape (n, f) [unit of the figure], or their lowest and highest, shape (2, f).
    jump
        Points on another branch of optima than a neighbour, shape (2, f).
    repaired
        Points that a sampled state led to, shape (2, f).
    """

    label: str
    frequency: Float[Real, " f"]
    value: Float[Real, "2 f"]
    sampled: Float[Real, "n f"]
    jump: Flags
    repaired: Flags


@dataclass(frozen=True, kw_only=True, eq=False)
class LimitBands(TitledFigure):
    """Bands of response limits over frequency; next to a jump a limit is dotted, since its course is unknown.

    Parameters
    ----------
    bands
        One per level, at least one.
    amplitude_label
        Label of the vertical axes, with its unit.
    sampled_label
        Label of `Band.sampled`.
    """

    bands: Sequence[Band]
    amplitude_label: str
    sampled_label: str = "random histories"


@draws(LimitBands, "limit_band")
def limit_band_figure(result: LimitBands) -> Figure:
    """Draw the bands; next to a jump a limit is dotted, since its course between the points is unknown."""
    columns = min(COLUMNS, len(result.bands))
    rows = -(-len(result.bands) // columns)
    figure = make_figure(max(7.0, 5.5 * columns), 1.3 + 3.1 * rows)
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True)
    for axes, band in zip(grid.flat, result.bands, strict=False):
        draw_band(axes, band)
    for axes in grid.flat[len(result.bands) :]:
        axes.set_visible(False)
    for column in range(columns):
        bottom = max(row for row in range(rows) if row * columns + column < len(result.bands))
        grid[bottom, column].set_xlabel("frequency [Hz]")
        grid[bottom, column].tick_params(labelbottom=True)
    figure.supylabel(result.amplitude_label, fontsize=10)
    add_band_legend(figure, result.bands, result.sampled_label)
    add_title(figure, result.title)
    return figure


def add_band_legend(figure: Figure, bands: Sequence[Band], sampled_label: str) -> None:
    """A legend of the items in some bands."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    jump, repaired = (any(getattr(band, name).any() for band in bands) for name in ("jump", "repaired"))
    entries: dict[str, Any] = {
        "upper limit": Line2D([], [], color=LIMITS[1], marker="."),
        "lower limit": Line2D([], [], color=LIMITS[0], marker="."),
        "between them": Patch(color=PALE, alpha=0.15),
    }
    if any(np.isfinite(band.sampled).any() for band in bands):
        entries[sampled_label] = (Line2D([], [], **REACH), Line2D([], [], **STATE))
    if jump:
        entries["jump to another optimum"] = Line2D([], [], **_make_ring("o"))
    if repaired:
        entries["found by a random history"] = Line2D([], [], **_make_ring("s"))
    add_legend(figure, list(entries.values()), list(entries))


def draw_band(axes: Axes, band: Band) -> None:
    """Draw a band into its axes."""
    f = band.frequency
    clean = ~(band.jump[:, :-1] | band.jump[:, 1:])
    # The area too is left open where either limit jumps.
    for first in np.flatnonzero(clean.all(axis=0)).tolist():
        two = slice(first, first + 2)
        axes.fill_between(f[two], band.value[0, two], band.value[1, two], color=PALE, alpha=0.15, linewidth=0)
    if np.isfinite(band.sampled).any():
        there = np.isfinite(band.sampled).any(axis=0)
        ends = [reach(band.sampled[:, there], axis=0) for reach in (np.nanmin, np.nanmax)]
        axes.vlines(f[there], *ends, **REACH)
        axes.plot(np.broadcast_to(f, band.sampled.shape).ravel(), band.sampled.ravel(), **STATE)
    for side, colour in enumerate(LIMITS):
        y = band.value[side]
        for first in range(len(f) - 1):
            two = slice(first, first + 2)
            style: dict[str, Any] = {"linewidth": 1.5} if clean[side, first] else {"linewidth": 0.9, "linestyle": ":"}
            axes.plot(f[two], y[two], color=colour, **style)
        axes.plot(f, y, ".", color=colour, markersize=3.5)
        for flags, marker in ((band.jump, "o"), (band.repaired, "s")):
            axes.plot(f[flags[side]], y[flags[side]], **_make_ring(marker))
    axes.set_title(band.label, fontsize=10, loc="left")
    axes.set_xlim(f[0], f[-1])
    if not (np.nanmin(band.value) < 0):
        axes.set_ylim(bottom=0)
    open_box(axes)


def _make_ring(marker: str) -> dict[str, Any]:
    size = {"o": 8, "s": 7}[marker]
    return {
        "marker": marker, "linestyle": "", "markerfacecolor": "none", "markeredgecolor": INK, "markersize": size,
        "markeredgewidth": 0.9,
    }  # fmt: skip
