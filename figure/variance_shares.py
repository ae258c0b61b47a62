"""Shares of the variance of quantities by each uncertain parameter: first-order, and with all interactions."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import (
    INK,
    PALE,
    Axes,
    Figure,
    TitledFigure,
    add_heading,
    add_legend,
    choose_family_colours,
    make_figure,
    open_box,
)

Real = NDArray[np.float64]

#: Width of all bars of a parameter, of the distance to the next parameter.
GROUP = 0.8


@dataclass(frozen=True, kw_only=True, eq=False)
class SharePanel:
    """Panel of one quantity, of g curves and d parameters; NaN where a share is unknown.

    Parameters
    ----------
    label
        Name of the quantity.
    first, total
        First-order shares and those with all interactions, shape (g, d) [-].
    interval
        95 % interval of the total share, shape (2, g, d) [-].
    linear
        Shares by the derivatives at the means, shape (g, d) [-].
    """

    label: str
    first: Float[Real, "g d"]
    total: Float[Real, "g d"]
    interval: Float[Real, "2 g d"]
    linear: Float[Real, "g d"]


@dataclass(frozen=True, kw_only=True, eq=False)
class VarianceShares(TitledFigure):
    """Shares of several quantities.

    Parameters
    ----------
    panels
        Quantities.
    groups
        Curves, one colour each.
    parameters
        Names of the parameters.
    """

    panels: Sequence[SharePanel]
    groups: Sequence[str]
    parameters: Sequence[str]


@draws(VarianceShares, "variance_shares")
def draw_variance_shares(result: VarianceShares) -> Figure:
    """Draw one panel per quantity."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    count = len(result.panels)
    names = 0.09 * max(map(len, result.parameters))
    height = max(0.7, 0.22 * len(result.groups)) * len(result.parameters)
    figure = make_figure(max(8.5, 1.0 + names + 3.1 * count), 2.5 + height)
    panels = figure.subplots(1, count, squeeze=False, sharex=True, sharey=True)[0]
    colours = choose_family_colours(len(result.groups))
    for axes, panel in zip(panels, result.panels, strict=True):
        _draw(axes, panel, colours, result.parameters)
    handles = [Patch(color=colour, label=label) for colour, label in zip(colours, result.groups, strict=True)]
    signs = [
        Patch(facecolor=PALE, label="first-order index"),
        Patch(facecolor=PALE, alpha=0.3, label="total index"),
        Line2D([], [], color=INK, linewidth=1.0, label="its 95 % interval"),
        Line2D([], [], color=INK, marker="D", markerfacecolor="white", linestyle="", label="linearised"),
    ]
    add_legend(figure, [*handles, *signs])
    add_heading(figure, result)
    return figure


def _draw(axes: Axes, panel: SharePanel, colours: Sequence[str], parameters: Sequence[str]) -> None:
    n_group, d = panel.total.shape
    bar = GROUP / n_group
    for group, colour in enumerate(colours):
        place = np.arange(d) - GROUP / 2 + (group + 0.5) * bar
        # The estimate of a zero share scatters around zero.
        first, total = (np.nan_to_num(np.maximum(values[group], 0.0)) for values in (panel.first, panel.total))
        axes.barh(place, total, 0.86 * bar, color=colour, alpha=0.3)
        axes.barh(place, first, 0.86 * bar, color=colour)
        for colour_of_line, width in (("white", 3.0), (INK, 1.0)):  # seen on dark bars too
            axes.hlines(place, *np.maximum(panel.interval[:, group], 0.0), color=colour_of_line, linewidth=width)
        axes.plot(panel.linear[group], place, "D", color=INK, markerfacecolor="white", markersize=4.5, zorder=4)
    axes.set_title(panel.label, fontsize=10, loc="left", color=INK)
    axes.set_yticks(np.arange(d), parameters)
    axes.set_ylim(d - 0.5, -0.5)
    axes.tick_params(axis="y", length=0)
    axes.set_xlabel("share of the variance [-]")
    # A marker at zero is not cut.
    axes.set_xlim(left=-0.03)
    open_box(axes, grid="x")
