"""A frequency axis that replaces the gap between separately measured bands by a grey strip."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.feature.gap import find_gaps
from figure.style import GRID, Axes

Frequency = Float[NDArray[np.float64], " f"]

#: Margin beside the points of a band, relative to its width, and at most relative to the gap beside it; width of a
#: strip and least width of a band, relative to the axis [-].
MARGIN, MOST_OF_GAP, STRIP, LEAST = 0.05, 0.3, 0.03, 0.2
#: Number of steps between ticks of an axis; a band has its share of them, at least two.
TICK_STEPS, LEAST_TICK_STEPS = 7, 2


def use_band_axis(axes: Axes, curves: Sequence[Frequency]) -> None:
    """Put bands of frequencies side by side, with widths by their numbers of points; a single band changes nothing.

    Parameters
    ----------
    axes
        Axes, including those that share the frequency axis.
    curves
        Measured frequencies of each curve [Hz].
    """
    from matplotlib.ticker import FixedLocator, MaxNLocator, ScalarFormatter

    bands = join_bands(curves)
    if len(bands) < 2:
        return
    ends, places = _place(bands)
    axes.set_xscale(
        "function", functions=(lambda f: np.interp(f, ends, places), lambda place: np.interp(place, places, ends))
    )
    axes.set_xlim(ends[0], ends[-1])
    ticks = []
    for band, width in zip(bands, np.diff(places)[::2], strict=True):
        positions = MaxNLocator(max(round(TICK_STEPS * width), LEAST_TICK_STEPS)).tick_values(band[0], band[-1])
        ticks.append(positions[(positions >= band[0]) & (positions <= band[-1])])
    axes.xaxis.set_major_locator(FixedLocator(np.concatenate(ticks).tolist()))
    axes.xaxis.set_major_formatter(ScalarFormatter(useOffset=False))
    for item in axes.get_shared_x_axes().get_siblings(axes):
        for low, high in zip(ends[1:-1:2], ends[2:-1:2], strict=True):
            item.axvspan(low, high, facecolor=GRID, linewidth=0, zorder=0.6)


def join_bands(curves: Sequence[Frequency]) -> list[Frequency]:
    """Frequencies of all curves by bands, ascending: no curve continues between two bands.

    Curves of several levels may have been read at slightly different frequencies: gaps are those of single curves.
    """
    pieces = [
        piece for curve in map(np.unique, curves) for piece in np.split(curve, find_gaps(curve) + 1) if len(piece)
    ]
    bands = list[Frequency]()
    for piece in sorted(pieces, key=lambda item: float(item[0])):
        if bands and piece[0] <= bands[-1][-1]:
            bands[-1] = np.union1d(bands[-1], piece)
        else:
            bands.append(piece)
    return bands


def _place(bands: Sequence[Frequency]) -> tuple[Frequency, Frequency]:
    """Ends of all bands [Hz], and their places on the axis [-], shape (2 b,)."""
    low, high = (np.array([band[end] for band in bands]) for end in (0, -1))
    gap = np.concatenate([[np.inf], low[1:] - high[:-1], [np.inf]])
    margin = MARGIN * np.maximum(high - low, 1e-3 * low)
    before, after = (np.minimum(margin, MOST_OF_GAP * beside) for beside in (gap[:-1], gap[1:]))
    share = np.maximum([len(band) / sum(map(len, bands)) for band in bands], LEAST)
    steps = np.full(2 * len(bands) - 1, STRIP)
    steps[::2] = share / share.sum()
    return np.column_stack([low - before, high + after]).ravel(), np.concatenate([[0.0], np.cumsum(steps)])
