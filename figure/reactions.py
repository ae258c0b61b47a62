"""Reactions of load cells over one period: one panel per de-coupler with the upper and the lower cell of each curve."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from figure.period_axis import Samples, closed, name_period, refuse_unequal, set_one_period
from figure.registry import draws
from figure.style import (
    INK,
    LONGEST_LEGEND,
    PALE,
    Figure,
    TitledFigure,
    add_heading,
    choose_family_colours,
    make_figure,
    open_box,
)
from geometry.errors import InputError

#: Lines of the two cells, distinguishable without colour.
STYLES: dict[str, Literal["-", "--"]] = {"upper": "-", "lower": "--"}
LINE = 1.5


@dataclass(frozen=True, kw_only=True, eq=False)
class Reaction:
    """Forces of the two load cells of one de-coupler over one period.

    Parameters
    ----------
    name
        Name of the de-coupler.
    label
        Label of the curve that the motion belongs to, such as a level.
    time
        Share of the period, ascending from 0, without its end, shape (n,) [-].
    upper, lower
        Forces of the two cells, shape (n,) [N].

    Raises
    ------
    InputError
        Arrays of different shapes.
    """

    name: str
    label: str
    time: Samples
    upper: Samples
    lower: Samples

    def __post_init__(self) -> None:
        refuse_unequal(f'"{self.name}"', self.time, upper=self.upper, lower=self.lower)


@dataclass(frozen=True, kw_only=True, eq=False)
class Reactions(TitledFigure):
    """Reactions of load cells over one period, one panel per de-coupler, all on one scale.

    Parameters
    ----------
    reactions
        Reactions of any number of de-couplers and curves; panels and colours are in the order in which names and labels
        first come.
    force_label
        Label of the vertical axis, with its unit; it may say which sign is tension.
    """

    reactions: Sequence[Reaction]
    force_label: str = "force of a load cell [N]"


@draws(Reactions, "load_cells")
def draw_reactions(result: Reactions) -> Figure:
    """Draw one panel per de-coupler, all on one scale.

    Raises
    ------
    InputError
        No reaction.
    """
    from matplotlib.lines import Line2D

    names = list(dict.fromkeys(reaction.name for reaction in result.reactions))
    labels = list(dict.fromkeys(reaction.label for reaction in result.reactions))
    if not names:
        raise InputError("reactions are those of 0 de-couplers: give at least one")
    colours = dict(zip(labels, choose_family_colours(len(labels)), strict=True))
    # The end of one axis shall not run into the start of the next.
    figure = make_figure(max(7.5, 1.0 + 4.2 * len(names)), 4.6, wspace=0.04)
    (row,) = figure.subplots(1, len(names), squeeze=False, sharey=True)
    panels = dict(zip(names, row, strict=True))
    for reaction in result.reactions:
        for cell, style in STYLES.items():
            time, force = closed(reaction.time, getattr(reaction, cell))
            panels[reaction.name].plot(
                time, force, color=colours[reaction.label], linestyle=style, linewidth=LINE, label=cell
            )
    for name, axes in panels.items():
        axes.set_title(name, fontsize=10, loc="left", color=INK)
        open_box(axes)
        set_one_period(axes)
        name_period(axes)
    row[0].set_ylabel(result.force_label, color=INK)
    cells = [Line2D([], [], color=PALE, linestyle=s, linewidth=LINE, label=f"{c} cell") for c, s in STYLES.items()]
    curves = [Line2D([], [], color=colour, linewidth=LINE + 1.5, label=label) for label, colour in colours.items()]
    handles = [*cells, *curves]
    # In two rows, the two cells stand below each other.
    n_column = len(handles) if len(handles) <= LONGEST_LEGEND else -(-len(handles) // 2)
    figure.legend(handles=handles, loc="outside lower center", ncols=n_column, frameon=False)
    add_heading(figure, result)
    return figure
