"""Possible next tests: their probabilities to decide, and the predictions of the candidates in the best of them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import (
    GRID,
    INK,
    LIMITS,
    PALE,
    Figure,
    TitledFigure,
    add_heading,
    add_legend,
    choose_family_colours,
    make_figure,
    open_box,
)

#: Lines of candidates, distinguishable without colours too.
LINES = ("-", "--", "-.", ":")
#: Standard deviations of the band of a reading, and its opacity [-].
WIDE, BAND = 2.0, 0.2


@dataclass(frozen=True, kw_only=True)
class TestBar:
    """A test with the probability that it decides, and its duration [min]."""

    __test__ = False  # no test of pytest's

    name: str
    probability: float
    minutes: float


@dataclass(frozen=True, kw_only=True, eq=False)
class PredictedCurve:
    """Predicted size of a reading by one candidate, with its standard deviation due to noise, shape (f,)."""

    label: str
    size: Float[NDArray[np.float64], " f"]
    deviation: Float[NDArray[np.float64], " f"]


@dataclass(frozen=True, kw_only=True, eq=False)
class NextTests(TitledFigure):
    """Tests, the advised one first.

    Parameters
    ----------
    tests
        Tests.
    frequency
        Frequencies of the curves, shape (f,) [Hz].
    curves
        Predictions of each candidate in the advised test.
    reading
        Sensor with the unit of its size, as the label of an axis.
    """

    tests: Sequence[TestBar]
    frequency: Float[NDArray[np.float64], " f"]
    curves: Sequence[PredictedCurve]
    reading: str


@draws(NextTests, "next_test")
def draw_next_tests(result: NextTests) -> Figure:
    """Draw bars of probability, and the curves."""
    n = len(result.tests)
    figure = make_figure(11.5, max(4.6, 1.9 + 0.34 * n))
    bars, curves = figure.subplots(1, 2, width_ratios=[1.0, 1.1])
    place = np.arange(n)[::-1]
    for at, test in zip(place, result.tests, strict=True):
        bars.barh(at, 100 * test.probability, 0.65, color=LIMITS[1] if at == n - 1 else LIMITS[0], zorder=2)
        bars.text(
            101.5, at, f"{test.minutes:.0f} min", va="center", fontsize=8, color=PALE, clip_on=False
        )  # fmt: skip
    bars.set_yticks(place, [test.name for test in result.tests], fontsize=9)
    bars.set_xlim(0, 100)
    bars.set_xlabel("probability that the test decides [%]; right: time required")
    bars.axvline(50, color=GRID, linewidth=0.8, zorder=0)
    colours = choose_family_colours(len(result.curves))
    for number, (curve, colour) in enumerate(zip(result.curves, colours, strict=True)):
        low, high = curve.size - WIDE * curve.deviation, curve.size + WIDE * curve.deviation
        curves.fill_between(result.frequency, np.maximum(low, 0.0), high, color=colour, alpha=BAND, linewidth=0)
        curves.plot(
            result.frequency, curve.size, color=colour, linestyle=LINES[number % len(LINES)], linewidth=1.6,
            marker="o", markersize=3, label=curve.label,
        )  # fmt: skip
    curves.set_xlabel("frequency [Hz]")
    curves.set_ylabel(result.reading)
    curves.set_ylim(bottom=0.0)
    curves.tick_params(colors=INK)
    open_box(bars, grid="x")
    open_box(curves)
    handles, labels = curves.get_legend_handles_labels()
    add_legend(figure, handles, labels, most=2, loc="outside lower right")
    add_heading(figure, result)
    return figure
