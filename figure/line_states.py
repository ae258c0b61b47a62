"""Contact states of lines over one period: time across, stations upwards, each cell stuck, slipping or separated."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int
from numpy.typing import NDArray

from figure.period_axis import name_period, set_one_period
from figure.registry import draws
from figure.style import CONTACT_STATES, INK, Axes, Figure, TitledFigure, add_heading, add_legend, make_figure
from geometry.errors import InputError

#: Colours of the states 0, 1 and 2 by their names in the legend, in this order.
STATES = {name: CONTACT_STATES[name] for name in ("stuck", "slipping", "separated")}
#: Number of stations up to which each has a number at the axis and lines between the cells.
MOST_NUMBERS, MOST_GAPS = 12, 24
#: Height of a station, and the least and largest height of a panel [inches].
STATION, LOWEST, HIGHEST = 0.24, 1.2, 3.2


@dataclass(frozen=True, kw_only=True, eq=False)
class LineStates:
    """Contact states of one line over one period.

    Parameters
    ----------
    name
        Above its panel.
    states
        0 stuck, 1 slipping, 2 separated, of each station at instants evenly spaced from the start of the period,
        without its end, shape (station, sample) [-].

    Raises
    ------
    InputError
        Another shape, or other numbers.
    """

    name: str
    states: Int[NDArray[np.int64], "station sample"]

    def __post_init__(self) -> None:
        states = refuse_unknown_states(f'states of "{self.name}"', self.states)
        if states.ndim != 2 or states.size == 0:
            raise InputError(f'states of "{self.name}" have the shape {states.shape}: give (station, sample)')
        object.__setattr__(self, "states", states)


def refuse_unknown_states(what: str, states: Int[NDArray[np.int64], "..."]) -> Int[NDArray[np.int64], "..."]:
    """A read-only copy of states, all of which are 0, 1 or 2.

    Raises
    ------
    InputError
        Another number.
    """
    copy = np.array(states)
    if (strange := ~np.isin(copy, (0, 1, 2))).any():
        raise InputError(f"{what} have the value {copy[strange][0]}: give 0 stuck, 1 slipping or 2 separated")
    copy = copy.astype(np.int64)
    copy.setflags(write=False)
    return copy


@dataclass(frozen=True, kw_only=True, eq=False)
class StateHistories(TitledFigure):
    """States of contact lines over one period, as a grid of panels.

    Parameters
    ----------
    panels
        Rows (such as blade and de-coupler) of columns (such as sides or levels); a row may be shorter than the others,
        and lines may have different numbers of stations and instants.
    station_label
        Label of the vertical axes; it may say where station 1 is.
    """

    panels: Sequence[Sequence[LineStates]]
    station_label: str = "station [-]"


@draws(StateHistories, "line_states")
def draw_line_states(result: StateHistories) -> Figure:
    """Draw a grid of panels.

    Raises
    ------
    InputError
        No panel.
    """
    from matplotlib.patches import Patch

    if not any(result.panels):
        raise InputError(f"panels = {result.panels} contain no line: give at least one")
    rows = [row for row in result.panels if row]
    n_column = max(len(row) for row in rows)
    heights = [float(np.clip(STATION * max(len(line.states) for line in row), LOWEST, HIGHEST)) for row in rows]
    # A title shall stand nearer to its own panel than to the one above.
    figure = make_figure(max(7.5, 0.6 + 3.2 * n_column), 1.6 + sum(heights) + 0.5 * len(rows), hspace=0.05, wspace=0.03)
    grid = figure.subplots(len(rows), n_column, squeeze=False, height_ratios=heights)
    for number, row in enumerate(rows):
        for column in range(n_column):
            axes = grid[number, column]
            if column >= len(row):
                axes.set_axis_off()
                continue
            _draw(axes, row[column])
            # Below it there may be a shorter row.
            if number == len(rows) - 1 or column >= len(rows[number + 1]):
                name_period(axes)
            else:
                axes.tick_params(labelbottom=False)
            if column == 0:
                axes.set_ylabel(result.station_label, color=INK)
    # List all three states, even if fewer occur: a state absent from the figure did not occur.
    patches = [
        Patch(facecolor=colour, edgecolor="#9aa3ad", linewidth=0.5, label=name) for name, colour in STATES.items()
    ]
    add_legend(figure, patches)
    add_heading(figure, result)
    return figure


def _draw(axes: Axes, line: LineStates) -> None:
    from matplotlib.colors import ListedColormap
    from matplotlib.ticker import MaxNLocator

    n_station, n_sample = line.states.shape
    # A cell is centred at its instant; the first one is drawn at both ends, as the motion is periodic.
    closed = np.hstack([line.states, line.states[:, :1]])
    edge = 0.5 / n_sample
    axes.imshow(
        closed,
        cmap=ListedColormap(list(STATES.values())),
        vmin=-0.5,
        vmax=2.5,
        aspect="auto",
        origin="lower",
        interpolation="nearest",
        extent=(-edge, 1 + edge, 0.5, n_station + 0.5),
    )
    if n_station <= MOST_GAPS:
        for station in range(1, n_station):
            axes.axhline(station + 0.5, color="white", linewidth=1.2)
    if n_station <= MOST_NUMBERS:
        axes.set_yticks(range(1, n_station + 1))
    else:
        axes.yaxis.set_major_locator(MaxNLocator(6, integer=True))
    set_one_period(axes)
    axes.tick_params(axis="y", length=0)
    axes.tick_params(labelsize=9, colors=INK)
    axes.spines[:].set_visible(False)
    axes.set_title(line.name, fontsize=10, loc="left", color=INK)
