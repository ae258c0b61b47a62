"""Spread of response curves or limits over uncertain parameters: bands of 90 % of the draws, and their median."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import INK, PALE, Axes, Figure, TitledFigure, add_heading, add_legend, make_figure, open_box

Values = Float[NDArray[np.float64], " p"]

#: Panels in a row.
COLUMNS = 2
#: First order is drawn up to this multiple of the highest other value: at corners of a curve it is meaningless.
HIGHEST = 1.15


@dataclass(frozen=True, kw_only=True, eq=False)
class SpreadBand:
    """Band of quantiles; all values have shape (p,), NaN where there are none.

    Parameters
    ----------
    label
        Curve of the band, such as "upper limit"; empty for the only one.
    colour
        Its colour.
    along
        Frequency or level.
    quantiles
        5, 50 and 95 %, shape (3, p) [unit of the figure].
    nominal_along, nominal
        Curve at the means of all parameters.
    first_order
        Ends of its 90 % interval to first order, at the points of `nominal`, shape (2, p); None if unknown.
    """

    label: str
    colour: str
    along: Values
    quantiles: Float[NDArray[np.float64], "3 p"]
    nominal_along: Values
    nominal: Values
    first_order: Float[NDArray[np.float64], "2 p"] | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class ResponseSpread(TitledFigure):
    """Bands of several panels.

    Parameters
    ----------
    panels
        Label and bands of each panel.
    along_label, amplitude_label
        Labels of the axes, with units.
    """

    panels: Sequence[tuple[str, Sequence[SpreadBand]]]
    along_label: str
    amplitude_label: str


@draws(ResponseSpread, "response_spread")
def draw_response_spread(result: ResponseSpread) -> Figure:
    """Draw the bands."""
    columns = min(COLUMNS, len(result.panels))
    rows = -(-len(result.panels) // columns)
    figure = make_figure(max(8.0, 5.4 * columns), 1.9 + 3.1 * rows)
    grid = figure.subplots(rows, columns, squeeze=False)
    entries: dict[str, Any] = {}
    for axes, (label, bands) in zip(grid.flat, result.panels, strict=False):
        for band in bands:
            entries |= _draw(axes, band)
        axes.set_title(label, fontsize=10, loc="left", color=INK)
        axes.set_xlabel(result.along_label)
        axes.set_ylabel(result.amplitude_label)
        axes.set_ylim(bottom=0)
        open_box(axes)
    for axes in grid.flat[len(result.panels) :]:
        axes.set_visible(False)
    add_legend(figure, list(entries.values()), list(entries), most=4)
    add_heading(figure, result)
    return figure


def _draw(axes: Axes, band: SpreadBand) -> dict[str, Any]:
    """Draw a band; returns the entries of the legend."""
    name = f"{band.label}: " if band.label else ""
    entries: dict[str, Any] = {}
    if np.isfinite(band.quantiles).any():
        low, middle, high = band.quantiles
        entries[f"{name}5 to 95 % of the draws"] = axes.fill_between(
            band.along, low, high, color=band.colour, alpha=0.22, linewidth=0
        )
        (entries[f"{name}median of the draws"],) = axes.plot(band.along, middle, color=band.colour, linewidth=1.6)
    if band.first_order is not None:
        known = np.concatenate([band.quantiles.ravel(), band.nominal])
        top = HIGHEST * float(np.nanmax(known)) if np.isfinite(band.quantiles).any() else np.inf
        for end in band.first_order:
            shown = np.where((end >= 0) & (end <= min(top, 3 * band.nominal.max())), end, np.nan)
            (line,) = axes.plot(band.nominal_along, shown, color=PALE, linestyle=":", linewidth=1.4, zorder=3)
        entries["5 and 95 % to first order"] = line
    (entries["at the means of the parameters"],) = axes.plot(
        band.nominal_along, band.nominal, color=INK, linestyle="--", linewidth=1.1, zorder=3
    )
    return entries
