"""Response curves of one output for several levels or frequencies: amplitude and phase, including folds."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Complex, Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import (
    INK,
    LONGEST_LEGEND,
    PALE,
    Axes,
    Figure,
    TitledFigure,
    add_title,
    choose_family_colours,
    make_figure,
    open_box,
)

Values = Float[NDArray[np.float64], " p"]

#: Lines of the curves of one group.
LINES = ("-", "--", ":", "-.")
#: Line of unstable parts.
UNSTABLE = (0, (1, 1.5))
#: Markers of points by the order of their labels.
MARKERS = ("o", "s", "D", "^", "v", "P")


@dataclass(frozen=True, kw_only=True, eq=False)
class CurveMark:
    """A named point of a curve.

    Parameters
    ----------
    label
        Text in the legend.
    parameter
        Frequency [Hz] or level [-].
    response
        Complex amplitude [unit of the figure].
    """

    label: str
    parameter: float
    response: complex


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
    unstable
        Whether points are unstable, shape (p,); None if unknown.
    marks
        Named points, such as bifurcations.
    top
        Marked point; by default that of the largest amplitude.
    """

    label: str
    parameter: Float[NDArray[np.float64], " p"]
    response: Complex[NDArray[np.complex128], " p"]
    group: float | None = None
    unstable: Bool[NDArray[np.bool_], " p"] | None = None
    marks: Sequence[CurveMark] = ()
    top: int | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class ResponseCurves(TitledFigure):
    """Response curves of one output.

    Parameters
    ----------
    curves
        Curves in their order, at least one.
    parameter_label, amplitude_label
        Labels of the axes, with units.
    backbone
        Amplitudes of a nonlinear mode over its frequency; none by default.
    """

    curves: Sequence[DrawnCurve]
    parameter_label: str
    amplitude_label: str
    backbone: DrawnCurve | None = None


@draws(ResponseCurves, "response_curves")
def response_curves_figure(result: ResponseCurves) -> Figure:
    """Draw the curves."""
    figure = make_figure(9, 6)
    amplitude, phase = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1))
    if result.backbone is not None:
        along, size = result.backbone.parameter, np.abs(result.backbone.response)
        amplitude.plot(along, size, color=INK, linestyle="--", linewidth=1.2, label=result.backbone.label)
    for curve, (colour, line) in zip(result.curves, _choose_line_styles(result.curves), strict=True):
        for axes, values in ((amplitude, np.abs(curve.response)), (phase, _compute_phase(curve.response))):
            _draw_line(axes, curve, values, colour, line)
        # A dot shows a computed point: the curve between two is drawn straight.
        stable = slice(None) if curve.unstable is None else ~curve.unstable
        amplitude.plot(curve.parameter[stable], np.abs(curve.response[stable]), ".", color=colour, markersize=3)
        top = int(np.argmax(np.abs(curve.response))) if curve.top is None else curve.top
        amplitude.plot(curve.parameter[top], np.abs(curve.response[top]), "o", color=colour, markersize=5)
    _draw_marks(amplitude, result.curves)
    amplitude.set_ylabel(result.amplitude_label)
    amplitude.set_ylim(bottom=0)
    phase.set_ylabel("phase [deg]")
    phase.set_xlabel(result.parameter_label)
    _set_degrees(phase)
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


def _draw_line(axes: Axes, curve: DrawnCurve, values: Values, colour: str, line: str) -> None:
    """The stable part as a line, the unstable part thin and pale, to the points on either side."""
    stable = values if curve.unstable is None else np.where(curve.unstable, np.nan, values)
    axes.plot(curve.parameter, stable, color=colour, linestyle=line, linewidth=1.5, label=curve.label)
    if curve.unstable is not None and curve.unstable.any():
        near = curve.unstable.copy()
        near[1:] |= curve.unstable[:-1]
        near[:-1] |= curve.unstable[1:]
        pale = np.where(near, values, np.nan)
        axes.plot(curve.parameter, pale, color=colour, linestyle=UNSTABLE, linewidth=1.2, alpha=0.6)


def _draw_marks(axes: Axes, curves: Sequence[DrawnCurve]) -> None:
    """Named points, one marker for each name, and the meaning of a pale line."""
    marks = [mark for curve in curves for mark in curve.marks]
    for label, marker in zip(sorted({mark.label for mark in marks}), MARKERS, strict=False):
        own = [mark for mark in marks if mark.label == label]
        axes.plot(
            [mark.parameter for mark in own], [abs(mark.response) for mark in own], marker, color=INK, markersize=6,
            markerfacecolor="white", label=label, zorder=5,
        )  # fmt: skip
    if any(curve.unstable is not None and curve.unstable.any() for curve in curves):
        axes.plot([], [], color=PALE, linestyle=UNSTABLE, linewidth=1.2, label="unstable")


def _choose_line_styles(curves: Sequence[DrawnCurve]) -> list[tuple[str, str]]:
    """Colour and line of each curve."""
    groups = [number if curve.group is None else (curve.group,) for number, curve in enumerate(curves)]
    distinct = list(dict.fromkeys(groups))
    colour = dict(zip(distinct, choose_family_colours(len(distinct)), strict=True))
    return [(colour[group], LINES[groups[:number].count(group) % len(LINES)]) for number, group in enumerate(groups)]


def _compute_phase(response: Complex[NDArray[np.complex128], " p"]) -> Float[NDArray[np.float64], " p"]:
    """Phase without jumps, such that curves of one family start on the same turn [deg]."""
    phase = np.degrees(np.unwrap(np.angle(response)))
    return np.asarray(phase - 360 * np.ceil((phase[0] - 179) / 360))


def _set_degrees(axes: Axes) -> None:
    from matplotlib.ticker import MultipleLocator

    low, high = axes.get_ylim()
    if high - low > 80:
        axes.yaxis.set_major_locator(MultipleLocator(45 if high - low < 270 else 90))
