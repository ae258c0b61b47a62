"""Response curves of one output for several levels or frequencies: amplitude and phase, folds and all."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import LONGEST_LEGEND, Axes, Figure, Headed, add_title, choose_family_colours, new_figure, open_box

#: Lines of the curves of one group.
LINES = ("-", "--", ":", "-.")


@dataclass(frozen=True, kw_only=True, eq=False)
class DrawnCurve:
    """One curve of the figure.

    Parameters
    ----------
    label
        Text in the legend.
    parameter
        Frequency [Hz] or level [-] along the curve, shape (p,); it may turn back.
    response
        Complex amplitude, shape (p,) [unit of the figure].
    group
        Curves of one group have one colour and differ by their lines; by default each is a group.
    """

    label: str
    parameter: Float[NDArray[np.float64], " p"]
    response: Complex[NDArray[np.complex128], " p"]
    group: float | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class ResponseCurves(Headed):
    """Response curves of one output.

    Parameters
    ----------
    curves
        Curves in their order, at least one.
    parameter_label, amplitude_label
        Labels of the axes, with units.
    """

    curves: Sequence[DrawnCurve]
    parameter_label: str
    amplitude_label: str


@draws(ResponseCurves, "response_curves")
def response_curves_figure(result: ResponseCurves) -> Figure:
    """Draw the curves."""
    figure = new_figure(9, 6)
    amplitude, phase = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1))
    for curve, (colour, line) in zip(result.curves, _looks(result.curves), strict=True):
        look = {"color": colour, "linestyle": line, "linewidth": 1.5}
        amplitude.plot(curve.parameter, np.abs(curve.response), label=curve.label, **look)
        # A dot shows where the solver stood: the curve between two is drawn straight.
        amplitude.plot(curve.parameter, np.abs(curve.response), ".", color=colour, markersize=3)
        phase.plot(curve.parameter, _phase(curve.response), **look)
        top = int(np.argmax(np.abs(curve.response)))
        amplitude.plot(curve.parameter[top], np.abs(curve.response[top]), "o", color=colour, markersize=5)
    amplitude.set_ylabel(result.amplitude_label)
    amplitude.set_ylim(bottom=0)
    phase.set_ylabel("phase [deg]")
    phase.set_xlabel(result.parameter_label)
    _degrees(phase)
    lowest = min(float(curve.parameter.min()) for curve in result.curves)
    phase.set_xlim(lowest, max(float(curve.parameter.max()) for curve in result.curves))
    for axes in (amplitude, phase):
        open_box(axes)
    if len(result.curves) > LONGEST_LEGEND:
        figure.legend(*amplitude.get_legend_handles_labels(), frameon=False, loc="outside right upper")
    else:
        amplitude.legend(frameon=False)
    add_title(figure, result.title)
    return figure


def _looks(curves: Sequence[DrawnCurve]) -> list[tuple[str, str]]:
    """Colour and line of each curve."""
    groups = [number if curve.group is None else (curve.group,) for number, curve in enumerate(curves)]
    distinct = list(dict.fromkeys(groups))
    colour = dict(zip(distinct, choose_family_colours(len(distinct)), strict=True))
    return [(colour[group], LINES[groups[:number].count(group) % len(LINES)]) for number, group in enumerate(groups)]


def _phase(response: Complex[NDArray[np.complex128], " p"]) -> Float[NDArray[np.float64], " p"]:
    """Phase without jumps, such that curves of one family start on the same turn [deg]."""
    phase = np.degrees(np.unwrap(np.angle(response)))
    return np.asarray(phase - 360 * np.ceil((phase[0] - 179) / 360))


def _degrees(axes: Axes) -> None:
    from matplotlib.ticker import MultipleLocator

    low, high = axes.get_ylim()
    if high - low > 80:
        axes.yaxis.set_major_locator(MultipleLocator(45 if high - low < 270 else 90))
