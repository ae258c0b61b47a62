"""A recovered force law: loops of each level, work and stiffness against the amplitude, known laws beside it."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import (
    LIMITS,
    LONGEST_LEGEND,
    PALE,
    Axes,
    Figure,
    Headed,
    add_heading,
    choose_family_colours,
    new_figure,
    open_box,
)

Samples = Float[NDArray[np.float64], " n"]

#: Lines of known laws.
LINES = (":", "--", "-.")
#: Opacity of a band.
BAND = 0.22
#: Millimetres and millimetres per second.
MILLI = 1e3


@dataclass(frozen=True, kw_only=True, eq=False)
class BandedCurve:
    """A curve with its 95 % band, shape (n,) each."""

    x: Samples
    mean: Samples
    low: Samples
    high: Samples


@dataclass(frozen=True, kw_only=True, eq=False)
class LevelLoop:
    """Force along the strongest measured motion of a level.

    Parameters
    ----------
    label
        Of the level.
    displacement, velocity, force
        Over a period, shape (n,) each [m, m/s, N].
    """

    label: str
    displacement: Samples
    velocity: Samples
    force: Samples


@dataclass(frozen=True, kw_only=True, eq=False)
class KnownLaw:
    """A known law that comes near to the spring force, shape (n,) [N]."""

    label: str
    force: Samples


@dataclass(frozen=True, kw_only=True, eq=False)
class LawDrawing(Headed):
    """A recovered law.

    Parameters
    ----------
    title
        Of the figure.
    loops
        Of each level.
    spring, damper
        Force against displacement [N, m] and velocity [N, m/s], with bands.
    stiffness, work
        Secant stiffness [N/m] and work per cycle [J] against the amplitude [m], with bands.
    known
        Known laws at the displacements of the spring force.
    is_hatched
        Whether the band of the spring force is that of the prior alone, where the data cannot tell both sides apart.
    """

    title: str
    loops: Sequence[LevelLoop]
    spring: BandedCurve
    damper: BandedCurve
    stiffness: BandedCurve
    work: BandedCurve
    known: Sequence[KnownLaw] = ()
    is_hatched: bool = False


@draws(LawDrawing, "missing_law")
def draw_missing_law(result: LawDrawing) -> Figure:
    """Draw the law in four panels."""
    figure = new_figure(9.6, 7.6)
    by_u, by_v, of_stiffness, of_work = figure.subplots(2, 2).flat
    for known, line in zip(result.known, cycle(LINES)):
        by_u.plot(MILLI * result.spring.x, known.force, color=PALE, linewidth=1.0, linestyle=line, label=known.label)
    _draw_band(by_u, result.spring, is_hatched=result.is_hatched)
    _draw_band(by_v, result.damper, is_hatched=False)
    for loop, colour in zip(result.loops, choose_family_colours(len(result.loops)), strict=True):
        force = np.append(loop.force, loop.force[0])
        for axes, along in ((by_u, loop.displacement), (by_v, loop.velocity)):
            axes.plot(MILLI * np.append(along, along[0]), force, color=colour, linewidth=1.4, label=loop.label)
    for axes, curve in ((of_stiffness, result.stiffness), (of_work, result.work)):
        _draw_band(axes, curve, is_hatched=False)
        axes.plot(MILLI * curve.x, curve.mean, color=LIMITS[0], linewidth=1.4)
        axes.set_xlabel("amplitude [mm]")
    by_u.set(xlabel="displacement [mm]", ylabel="force [N]")
    by_v.set(xlabel="velocity [mm/s]", ylabel="force [N]")
    of_stiffness.set_ylabel("secant stiffness [N/m]")
    of_work.set_ylabel("work per cycle [J]")
    for axes in (by_u, by_v, of_stiffness, of_work):
        open_box(axes)
    handles, labels = by_u.get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside lower center", ncols=min(len(labels), LONGEST_LEGEND - 2), frameon=False
    )
    add_heading(figure, result)
    return figure


def _draw_band(axes: Axes, curve: BandedCurve, *, is_hatched: bool) -> None:
    shade = {"facecolor": "none", "edgecolor": PALE, "hatch": "///", "alpha": 0.6} if is_hatched else {"color": PALE}
    label = "95 %, where only the prior speaks hatched" if is_hatched else "95 %"
    axes.fill_between(MILLI * curve.x, curve.low, curve.high, linewidth=0.0, **({"alpha": BAND} | shade), label=label)
