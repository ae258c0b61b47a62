"""Frequency and damping ratio against amplitude: ring-downs as bands, levels as points, the model as lines."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.uncertainty.interval import TWO_SIDED_95
from figure.registry import draws
from figure.style import (
    INK,
    Axes,
    Figure,
    TitledFigure,
    add_heading,
    add_legend,
    choose_family_colours,
    make_figure,
    open_box,
    use_log_scale,
)

Values = Float[NDArray[np.float64], " k"]


@dataclass(frozen=True, kw_only=True, eq=False)
class BackboneCurve:
    """Backbone curve of one mode.

    Parameters
    ----------
    label
        Name in the legend.
    amplitude
        Shape (k,) [unit of the figure].
    frequency, frequency_deviation
        Shape (k,) [Hz]; deviations are zero for a prediction.
    damping, damping_deviation
        Damping ratios, shape (k,) [-].
    reference
        Frequency relative to which the change is drawn [Hz]: that of the measured mode, also for its model.
    kind
        "decay" for a band, "levels" for points, "model" for a line.
    """

    label: str
    amplitude: Values
    frequency: Values
    frequency_deviation: Values
    damping: Values
    damping_deviation: Values
    reference: float
    kind: str = "decay"


@dataclass(frozen=True, kw_only=True, eq=False)
class Backbones(TitledFigure):
    """Backbones of one mode or several.

    Parameters
    ----------
    curves
        Curves, in their order.
    amplitude_label
        Label of the amplitude, with its unit.
    """

    curves: Sequence[BackboneCurve]
    amplitude_label: str


#: Width of a line [points], and height of a panel in widths: lines of the model within two widths count as one.
LINE, WIDTHS = 1.6, 140


@draws(Backbones, "backbone")
def draw_backbone(result: Backbones) -> Figure:
    """Draw the change of frequency and the damping side by side; bands and bars are 95 % intervals."""
    figure = make_figure(10.4, 4.6)
    left, right = figure.subplots(1, 2)
    measured = [curve for curve in result.curves if curve.kind != "model"]
    for curve, colour in zip(measured, choose_family_colours(len(measured)), strict=True):
        for axes, (value, half) in zip((left, right), _compute_changes(curve), strict=True):
            if curve.kind == "levels":
                axes.errorbar(
                    curve.amplitude, value, half, color=colour, marker="o", markersize=5,
                    markerfacecolor="white", linestyle="none", capsize=3, label=curve.label,
                )  # fmt: skip
                continue
            if curve.kind == "decay":
                axes.fill_between(curve.amplitude, value - half, value + half, color=colour, alpha=0.22, linewidth=0)
            axes.plot(curve.amplitude, value, color=colour, linewidth=LINE, label=curve.label)
    for number, axes in enumerate((left, right)):
        _draw_models(axes, result.curves, number)
    left.set_ylabel("frequency change [%]")
    right.set_ylabel("damping ratio [%]")
    for axes in (left, right):
        use_log_scale(axes, "x")
        axes.set_xlabel(result.amplitude_label)
        open_box(axes)
    # One entry stands for the model of all modes.
    entries = dict(zip(*reversed(left.get_legend_handles_labels()), strict=True))
    add_legend(figure, list(entries.values()), list(entries), most=4)
    add_heading(figure, result)
    return figure


def _compute_changes(curve: BackboneCurve) -> tuple[tuple[Values, Values], tuple[Values, Values]]:
    """Change of frequency and damping with half their 95 % intervals [%]."""
    of = curve.reference
    return (
        (100 * (curve.frequency / of - 1), TWO_SIDED_95 * (100 * curve.frequency_deviation / of)),
        (100 * curve.damping, TWO_SIDED_95 * (100 * curve.damping_deviation)),
    )


def _draw_models(axes: Axes, curves: Sequence[BackboneCurve], number: int) -> None:
    """Dashed lines of the model, each only where it covers no other: dashes on dashes look like a solid line."""
    values = [_compute_changes(curve)[number] for curve in curves]
    if not any(curve.kind == "model" for curve in curves):
        return
    ends = np.concatenate([value + side * half for value, half in values for side in (-1, 1)])
    ends = ends[np.isfinite(ends)]
    near = 2 * float(np.ptp(ends)) / WIDTHS if ends.size else 0.0
    drawn: list[tuple[Values, Values]] = []
    models = [(curve, value) for curve, (value, _) in zip(curves, values, strict=True) if curve.kind == "model"]
    for curve, value in sorted(models, key=lambda pair: -float(np.ptp(np.log(pair[0].amplitude)))):
        order = np.argsort(curve.amplitude)
        place, line = np.log(curve.amplitude[order]), value[order]
        covered = np.zeros(len(line), dtype=np.bool_)
        for other, seen in drawn:
            covered |= np.abs(np.interp(place, other, seen, left=np.nan, right=np.nan) - line) < near
        drawn.append((place, line))
        if not covered.all():
            axes.plot(
                np.exp(place), np.where(covered, np.nan, line), color=INK, linestyle="--", linewidth=LINE,
                label=curve.label,
            )  # fmt: skip
