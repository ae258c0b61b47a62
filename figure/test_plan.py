"""A plan of tests: the smallest detectable strength of each effect, and effects that are not distinguishable."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import INK, LIMITS, PALE, Figure, TitledFigure, add_heading, make_figure, open_box

#: Size of the signs of the matrix [points].
SIGN = 3.0


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanDrawing(TitledFigure):
    """Smallest detectable strengths of a plan, and effects that it cannot distinguish.

    Parameters
    ----------
    names
        Effects, the most detectable first, n of them.
    smallest
        Smallest detectable strength over the typical one, shape (n,) [-].
    cosines
        |cos| of the changes by each pair, shape (n, n) [-].
    confused
        |cos| above which tests cannot distinguish two effects [-].
    """

    names: Sequence[str]
    smallest: Float[NDArray[np.float64], " n"]
    cosines: Float[NDArray[np.float64], "n n"]
    confused: float


@draws(PlanDrawing, "test_plan")
def draw_plan(result: PlanDrawing) -> Figure:
    """Draw bars of the strengths, and the matrix of the cosines in the same order."""
    n = len(result.names)
    height = max(4.2, 1.9 + 0.24 * n)
    figure = make_figure(6.2 + 0.24 * n + 2.0, height)
    bars, matrix = figure.subplots(1, 2, sharey=True, width_ratios=[1.0, 1.25])
    place = np.arange(n)
    colours = [LIMITS[0] if value <= 1 else PALE for value in result.smallest]
    least = 10 ** np.floor(np.log10(min([0.1, *result.smallest.tolist()])))
    bars.barh(place, result.smallest - least, 0.7, left=least, color=colours, zorder=2)
    bars.set_xscale("log")
    bars.set_xlim(least, 10 ** np.ceil(np.log10(max([10.0, *result.smallest.tolist()]) * 1.01)))
    bars.axvline(1.0, color=INK, linewidth=0.9, linestyle=(0, (4, 3)))
    bars.set_yticks(place, list(result.names), fontsize=8)
    bars.set_ylim(n - 0.5, -0.5)
    bars.set_xlabel("smallest detectable over typical strength [-]")
    open_box(bars, grid="x")
    image = matrix.imshow(result.cosines, cmap="Blues", vmin=0, vmax=1, aspect="auto")
    alike = np.argwhere((result.cosines > result.confused) & ~np.eye(n, dtype=bool))
    if len(alike):
        matrix.plot(alike[:, 1], alike[:, 0], "s", color=LIMITS[1], markersize=SIGN, linestyle="none")
    matrix.set_xticks(place, list(result.names), fontsize=7, rotation=90)
    matrix.tick_params(length=0, labelleft=False)
    matrix.spines[:].set_visible(False)
    figure.colorbar(image, ax=matrix, label="|cos| of changes [-]; marked: confused")
    add_heading(figure, result)
    return figure
