"""Contact states along response curves: shares of the period stuck, slipping and separated, as stacked areas."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import CONTACT_STATES, Axes, Figure, TitledFigure, add_legend, add_title, choose_evenly, make_figure

#: Labelled places along a curve that turns back.
N_TICK = 5


@dataclass(frozen=True, kw_only=True, eq=False)
class StatePanel:
    """Panel of one response curve.

    Parameters
    ----------
    label
        Text above the panel.
    parameter
        Frequency [Hz] or level [-], shape (p,).
    states
        Names of its s states, of those in `CONTACT_STATES`, from the lowest area to the highest.
    share
        Shares of the period in each, shape (p, s), rows sum to 1 [-].
    """

    label: str
    parameter: Float[NDArray[np.float64], " p"]
    states: tuple[str, ...]
    share: Float[NDArray[np.float64], "p s"]


@dataclass(frozen=True, kw_only=True, eq=False)
class ContactStates(TitledFigure):
    """Shares of the states of contacts along curves, as a grid of panels.

    Parameters
    ----------
    panels
        Rows (contacts) of columns (curves), all rows of one length.
    parameter_label
        Label of the horizontal axes, with its unit.
    """

    panels: Sequence[Sequence[StatePanel]]
    parameter_label: str


@draws(ContactStates, "contact_states")
def draw_contact_states(result: ContactStates) -> Figure:
    """Draw a grid of panels."""
    from matplotlib.patches import Patch

    n_row, n_column = len(result.panels), len(result.panels[0])
    figure = make_figure(max(6.5, 3.4 * n_column), 1.5 + 1.9 * n_row)
    grid = figure.subplots(n_row, n_column, squeeze=False, sharey=True)
    for row, line in enumerate(result.panels):
        for column, panel in enumerate(line):
            axes = grid[row, column]
            turns = _draw(axes, panel)
            if row == n_row - 1:
                axes.set_xlabel(f"{result.parameter_label}, along the curve" if turns else result.parameter_label)
            if column == 0:
                axes.set_ylabel("share of the period [-]")
    # Above all panels, where no area is.
    there = {state for line in result.panels for panel in line for state in panel.states}
    patches = [Patch(color=colour, label=name) for name, colour in CONTACT_STATES.items() if name in there]
    add_legend(figure, patches)
    add_title(figure, result.title)
    return figure


def _draw(axes: Axes, panel: StatePanel) -> bool:
    """Draw a panel; return whether its curve turns back, so that the axis counts points instead."""
    from matplotlib.ticker import MaxNLocator

    step = np.diff(panel.parameter)
    turns = bool((step > 0).any() and (step < 0).any())
    # Over a fold the areas would cover each other: there the arc is the axis.
    place = np.arange(len(panel.parameter), dtype=np.float64) if turns else panel.parameter
    edges = np.hstack([np.zeros((len(place), 1)), np.cumsum(panel.share, axis=1)])
    for number, state in enumerate(panel.states):
        axes.fill_between(place, edges[:, number], edges[:, number + 1], color=CONTACT_STATES[state], linewidth=0)
    if turns:
        ticks = choose_evenly(len(place), N_TICK)
        axes.set_xticks(ticks, [f"{panel.parameter[tick]:.4g}" for tick in ticks])
    else:
        # A label at the right end would run into the first one of the panel beside it.
        axes.xaxis.set_major_locator(MaxNLocator(5, prune="upper"))
    axes.set_xlim(place.min(), place.max())
    axes.set_ylim(0, 1)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_title(panel.label, fontsize=10, loc="left")
    return turns
