"""Limits of the forces of one contact line over frequency: a row for each force, a column for each level."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from figure.limit_band import Band, add_band_legend, draw_band
from figure.registry import draws
from figure.style import Figure, TitledFigure, add_title, make_figure


@dataclass(frozen=True, kw_only=True, eq=False)
class LineForceBands(TitledFigure):
    """Bands of static and dynamic forces of one line.

    Parameters
    ----------
    bands
        One for each level, all of the same levels, by the name of the force, such as "T0".
    sampled_label
        Label of `Band.sampled`.
    """

    bands: Mapping[str, Sequence[Band]]
    sampled_label: str = "random histories"


@draws(LineForceBands, "line_force_bands")
def draw_line_force_bands(result: LineForceBands) -> Figure:
    """Draw the bands; panels of one force share their axis, so that its levels can be compared."""
    n_row, n_column = len(result.bands), len(next(iter(result.bands.values())))
    figure = make_figure(max(7.0, 1.4 + 3.0 * n_column), 1.3 + 2.2 * n_row)
    grid = figure.subplots(n_row, n_column, squeeze=False, sharex=True, sharey="row")
    for axes, (force, bands) in zip(grid, result.bands.items(), strict=True):
        for panel, band in zip(axes, bands, strict=True):
            draw_band(panel, band)
        axes[0].set_ylabel(f"{force} [N]")
        # Each panel has scaled the shared axis by its own values.
        axes[0].set_ylim(auto=True)
        axes[0].autoscale_view(scalex=False)
        if not min(np.nanmin(band.value) for band in bands) < 0:
            axes[0].set_ylim(bottom=0)
    for panel in grid[-1]:
        panel.set_xlabel("frequency [Hz]")
    everything = [band for bands in result.bands.values() for band in bands]
    add_band_legend(figure, everything, result.sampled_label)
    add_title(figure, result.title)
    return figure
