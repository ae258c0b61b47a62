"""The force of a vibration over frequency and amplitude, and the response curves of constant force on it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import GRID, Axes, Figure, TitledFigure, add_heading, add_legend, choose_family_colours, make_figure

if TYPE_CHECKING:
    from matplotlib.colors import LogNorm

Numbers = Float[NDArray[np.float64], " p"]
#: Shades of the surface, on which dark curves stand out; points without a steady state are paper with hatches.
PALEST, DARKEST = 0.06, 0.55
#: The scale begins this many decades below the largest force: the force falls to nearly zero in a narrow valley.
DECADES = 4.0
#: Columns of the legend at most.
MOST_COLUMNS = 5


@dataclass(frozen=True, kw_only=True, eq=False)
class ForceCurve:
    """The response at one force.

    Parameters
    ----------
    label
        The force, with its unit.
    pieces
        Frequency [Hz] and amplitude of each connected piece, shape (q,) both, within the surface.
    """

    label: str
    pieces: Sequence[tuple[Numbers, Numbers]]


@dataclass(frozen=True, kw_only=True, eq=False)
class ForceSurface(TitledFigure):
    """Force over frequency and amplitude.

    Parameters
    ----------
    frequency
        Ascending, shape (p,) [Hz].
    amplitude
        Ascending and positive, shape (a,).
    force
        Positive, shape (a, p); NaN where no steady state was found.
    amplitude_label, force_label
        With units.
    curves
        Curves of constant force, ascending.
    """

    frequency: Numbers
    amplitude: Float[NDArray[np.float64], " a"]
    force: Float[NDArray[np.float64], "a p"]
    amplitude_label: str
    force_label: str
    curves: Sequence[ForceCurve] = ()


@draws(ForceSurface, "force_surface")
def force_surface_figure(result: ForceSurface) -> Figure:
    """Draw the surface as a map, and the curves on it."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    figure = make_figure(9.0, 5.8)
    axes = figure.add_subplot()
    axes.set_yscale("log")
    axes.patch.set(hatch="////", edgecolor=GRID)
    shades = ListedColormap(colormaps["Greys"](np.linspace(PALEST, DARKEST, 256)))
    scale = _scale(result.force)
    surface = axes.pcolormesh(
        result.frequency, result.amplitude, result.force, norm=scale, cmap=shades, shading="gouraud", rasterized=True
    )
    lowest, shown = np.nanmin(result.force, initial=np.inf), scale.vmin or 0.0
    bar = figure.colorbar(surface, ax=axes, pad=0.02, extend="min" if lowest < shown else "neither")
    bar.set_label(result.force_label)
    bar.outline.set_visible(False)
    _draw_curves(axes, result.curves)
    axes.set(
        xlim=(result.frequency[0], result.frequency[-1]), ylim=(result.amplitude[0], result.amplitude[-1]),
        xlabel="frequency [Hz]", ylabel=result.amplitude_label,
    )  # fmt: skip
    axes.spines[["top", "right"]].set_visible(False)
    if result.curves:
        add_legend(figure, *axes.get_legend_handles_labels(), most=MOST_COLUMNS)
    add_heading(figure, result)
    return figure


def _scale(force: Float[NDArray[np.float64], "a p"]) -> "LogNorm":
    """Shades by the logarithm of the force."""
    from matplotlib.colors import LogNorm

    known = force[np.isfinite(force) & (force > 0)]
    highest = float(known.max()) if known.size else 1.0
    lowest = max(float(known.min()), highest / 10**DECADES) if known.size else 0.1
    return LogNorm(lowest, highest if highest > lowest else 10 * lowest)


def _draw_curves(axes: Axes, curves: Sequence[ForceCurve]) -> None:
    for curve, colour in zip(curves, choose_family_colours(len(curves)), strict=True):
        # Draw the pieces as one line with gaps and one entry of the legend.
        gap = np.array([np.nan])
        x = [part for frequency, _ in curve.pieces for part in (frequency, gap)]
        y = [part for _, amplitude in curve.pieces for part in (amplitude, gap)]
        axes.plot(np.concatenate([gap, *x]), np.concatenate([gap, *y]), color=colour, linewidth=1.8, label=curve.label)
