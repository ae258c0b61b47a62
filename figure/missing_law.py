"""A recovered force law: loops of each level, work and stiffness against the amplitude, and known laws."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import (
    LIMITS,
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

Samples = Float[NDArray[np.float64], " n"]

#: Lines of known laws.
LINES = (":", "--", "-.")
#: Opacity of a band.
BAND = 0.22
#: Factors to drawn units: micrometres, newtons per micrometre and microjoules; millimetres per second; likewise for
#: angles.
MICRO, MILLI = 1e6, 1e3
#: Largest stiffness above which stiffness is shown in N/µm [N/m].
MIN_STIFF = 1e4


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
    """A known law close to the spring force, shape (n,) [N]."""

    label: str
    force: Samples


@dataclass(frozen=True, kw_only=True, eq=False)
class LawDrawing(TitledFigure):
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
    motion_unit, force_unit
        Units of displacements and of forces, or of angles and moments.
    is_hatched
        Whether the band of the spring force is that of the prior alone, as the data cannot distinguish both sides.
    """

    title: str
    loops: Sequence[LevelLoop]
    spring: BandedCurve
    damper: BandedCurve
    stiffness: BandedCurve
    work: BandedCurve
    known: Sequence[KnownLaw] = ()
    is_hatched: bool = False
    motion_unit: str = "m"
    force_unit: str = "N"


@draws(LawDrawing, "missing_law")
def draw_missing_law(result: LawDrawing) -> Figure:
    """Draw the law in four panels."""
    figure = make_figure(9.6, 7.6)
    by_u, by_v, of_stiffness, of_work = figure.subplots(2, 2).flat
    motion, force_unit = result.motion_unit, result.force_unit
    spring, damper = _scale(result.spring, MICRO), _scale(result.damper, MILLI)
    for known, line in zip(result.known, cycle(LINES)):
        by_u.plot(spring.x, known.force, color=PALE, linewidth=1.0, linestyle=line, label=known.label)
    _draw_band(by_u, spring, is_hatched=result.is_hatched)
    _draw_band(by_v, damper, is_hatched=False)
    for loop, colour in zip(result.loops, choose_family_colours(len(result.loops)), strict=True):
        force = np.append(loop.force, loop.force[0])
        for axes, along, unit in ((by_u, loop.displacement, MICRO), (by_v, loop.velocity, MILLI)):
            axes.plot(unit * np.append(along, along[0]), force, color=colour, linewidth=1.4, label=loop.label)
    is_stiff = float(np.abs(result.stiffness.mean).max()) >= MIN_STIFF
    for axes, curve in (
        (of_stiffness, _scale(result.stiffness, MICRO, 1 / MICRO if is_stiff else 1.0)),
        (of_work, _scale(result.work, MICRO, MICRO)),
    ):
        _draw_band(axes, curve, is_hatched=False)
        axes.plot(curve.x, curve.mean, color=LIMITS[0], linewidth=1.4)
        axes.set_xlabel(f"amplitude [µ{motion}]")
    by_u.set(xlabel=f"displacement [µ{motion}]", ylabel=f"force [{force_unit}]")
    by_v.set(xlabel=f"velocity [m{motion}/s]", ylabel=f"force [{force_unit}]")
    of_stiffness.set_ylabel(f"secant stiffness [{force_unit}/{'µ' if is_stiff else ''}{motion}]")
    of_work.set_ylabel("work per cycle [µJ]")
    for axes in (by_u, by_v, of_stiffness, of_work):
        open_box(axes)
        axes.locator_params(nbins=6)
    handles, labels = by_u.get_legend_handles_labels()
    add_legend(figure, handles, labels)
    add_heading(figure, result)
    return figure


def _draw_band(axes: Axes, curve: BandedCurve, *, is_hatched: bool) -> None:
    shade = {"facecolor": "none", "edgecolor": PALE, "hatch": "///", "alpha": 0.6} if is_hatched else {"color": PALE}
    label = "95 %; hatched: determined by the prior alone" if is_hatched else "95 %"
    axes.fill_between(curve.x, curve.low, curve.high, linewidth=0.0, **({"alpha": BAND} | shade), label=label)


def _scale(curve: BandedCurve, x: float, y: float = 1.0) -> BandedCurve:
    """The curve in other units."""
    return BandedCurve(x=x * curve.x, mean=y * curve.mean, low=y * curve.low, high=y * curve.high)
