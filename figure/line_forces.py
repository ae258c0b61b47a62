"""Forces of whole contact lines over one period: T(t), N(t), and |T| / N compared with the friction coefficient."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from figure.period_axis import Samples, closed, name_period, refuse_unequal, set_one_period
from figure.registry import draws
from figure.style import (
    INK,
    LONGEST_LEGEND,
    Axes,
    Figure,
    TitledFigure,
    add_heading,
    add_legend,
    choose_family_colours,
    make_figure,
    open_box,
)
from geometry.errors import InputError

#: Largest number of legible rows on one page.
MOST_ROWS = 4
#: A line whose normal force is below this share of its largest one is separated: T / N is then meaningless.
SEPARATED = 1e-6
LINE = 1.4


@dataclass(frozen=True, kw_only=True, eq=False)
class LineForce:
    """Forces of one contact line over one period, summed over its stations.

    Parameters
    ----------
    name
        Name of the line.
    label
        Label of the curve that the motion belongs to, such as a level.
    time
        Share of the period, ascending from 0, without its end, shape (n,) [-].
    tangential, normal
        T(t) and N(t), shape (n,) [N].

    Raises
    ------
    InputError
        Arrays of different shapes.
    """

    name: str
    label: str
    time: Samples
    tangential: Samples
    normal: Samples

    def __post_init__(self) -> None:
        refuse_unequal(f'"{self.name}"', self.time, tangential=self.tangential, normal=self.normal)

    @property
    def utilisation(self) -> Samples:
        """|T| / N, shape (n,) [-]; NaN where the line is separated."""
        closed = self.normal > SEPARATED * max(float(self.normal.max()), 0.0)
        return np.where(closed, np.abs(self.tangential) / np.where(closed, self.normal, 1.0), np.nan)


@dataclass(frozen=True, kw_only=True, eq=False)
class LineForces(TitledFigure):
    """Forces of contact lines over one period, one row per line, all rows on one scale.

    Parameters
    ----------
    forces
        Forces of at most `MOST_ROWS` lines, each on any number of curves; rows and colours are in the order in which
        names and labels first come.
    friction_coefficient
        Friction coefficient of each line by its name [-].
    """

    forces: Sequence[LineForce]
    friction_coefficient: Mapping[str, float]
    subtitle: str = ""


@draws(LineForces, "line_forces")
def draw_line_forces(result: LineForces) -> Figure:
    """Draw one row per line, all rows on one scale.

    Raises
    ------
    InputError
        No line, too many, or one without a friction coefficient.
    """
    from matplotlib.lines import Line2D

    names = list(dict.fromkeys(force.name for force in result.forces))
    labels = list(dict.fromkeys(force.label for force in result.forces))
    if not 1 <= len(names) <= MOST_ROWS:
        raise InputError(f"forces of {len(names)} lines cannot be drawn in one figure: give 1 to {MOST_ROWS}")
    if missing := [name for name in names if name not in result.friction_coefficient]:
        raise InputError(f'friction_coefficient has no value for "{missing[0]}": give one for each line')
    colours = dict(zip(labels, choose_family_colours(len(labels)), strict=True))
    legend_rows = -(-len(labels) // LONGEST_LEGEND)
    figure = make_figure(11.7, 1.2 + 0.25 * legend_rows + 2.2 * len(names), hspace=0.04, wspace=0.03)
    grid = figure.subplots(len(names), 3, squeeze=False, sharex=True, sharey="col")
    for row, name in zip(grid, names, strict=True):
        for force in result.forces:
            if force.name == name:
                _draw(row, force, colours[force.label])
        _limit(row[2], result.friction_coefficient[name])
        for axes, what in zip(row, ("tangential force", "normal force", "|T| / N"), strict=True):
            axes.set_title(f"{name}: {what}", fontsize=10, loc="left", color=INK)
            open_box(axes)
        for axes, what in zip(row, ("T(t) [N]", "N(t) [N]", "|T| / N [-]"), strict=True):
            axes.set_ylabel(what, color=INK, labelpad=6)
    # The axis includes zero, where a line opens, with a margin below so that a line at zero is visible.
    _from_zero(grid[0, 1], max(float(force.normal.max()) for force in result.forces), 1.08)
    ratios = np.concatenate(
        [force.utilisation for force in result.forces] + [[result.friction_coefficient[n]] for n in names]
    )
    # Above the highest limit there is space for its value.
    _from_zero(grid[0, 2], float(np.nanmax(ratios)), 1.25)
    for axes in grid[-1]:
        set_one_period(axes)
        name_period(axes)
    lines = [Line2D([], [], color=colour, linewidth=LINE, label=label) for label, colour in colours.items()]
    add_legend(figure, lines, most=LONGEST_LEGEND)
    add_heading(figure, result)
    return figure


def _draw(row: Sequence[Axes], force: LineForce, colour: str) -> None:
    for axes, values in zip(row, (force.tangential, force.normal, force.utilisation), strict=True):
        axes.plot(*closed(force.time, values), color=colour, linewidth=LINE)


def _limit(axes: Axes, friction_coefficient: float) -> None:
    axes.axhline(friction_coefficient, color=INK, linewidth=1.0, linestyle=(0, (5, 3)))
    axes.annotate(
        f"mu = {friction_coefficient:.3g}",
        (1.0, friction_coefficient),
        xycoords=axes.get_yaxis_transform(),
        xytext=(-2, 3),
        textcoords="offset points",
        ha="right",
        va="bottom",
        fontsize=9,
        color=INK,
    )


def _from_zero(axes: Axes, largest: float, margin: float) -> None:
    top = margin * largest if largest > 0 else 1.0
    axes.set_ylim(-0.03 * top, top)
