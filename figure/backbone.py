"""Frequency and damping ratio against amplitude: ring-downs as bands, levels as points, the model as lines."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import INK, Figure, Headed, add_heading, add_legend, choose_family_colours, new_figure, open_box

Values = Float[NDArray[np.float64], " k"]


@dataclass(frozen=True, kw_only=True, eq=False)
class BackboneCurve:
    """One mode.

    Parameters
    ----------
    label
        Name in the legend.
    amplitude
        Shape (k,) [unit of the figure].
    frequency, frequency_deviation
        Shape (k,) [Hz]; deviations are zeros of a prediction.
    damping, damping_deviation
        Damping ratios, shape (k,) [-].
    reference
        Frequency whose change is drawn [Hz]: that of a measured mode, also for its model.
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
class Backbones(Headed):
    """Backbones of one mode or several.

    Parameters
    ----------
    curves
        Curves, in their order.
    amplitude_label
        Of the amplitude, with its unit.
    """

    curves: Sequence[BackboneCurve]
    amplitude_label: str


@draws(Backbones, "backbone")
def backbone_figure(result: Backbones) -> Figure:
    """Draw the change of frequency and the damping side by side; bands and bars are 95 % intervals."""
    figure = new_figure(10.4, 4.6)
    left, right = figure.subplots(1, 2)
    colours = iter(choose_family_colours(sum(curve.kind != "model" for curve in result.curves)))
    for curve in result.curves:
        colour = INK if curve.kind == "model" else next(colours)
        for axes, value, deviation in (
            (left, 100 * (curve.frequency / curve.reference - 1), 100 * curve.frequency_deviation / curve.reference),
            (right, 100 * curve.damping, 100 * curve.damping_deviation),
        ):
            if curve.kind == "levels":
                axes.errorbar(
                    curve.amplitude, value, 1.96 * deviation, color=colour, marker="o", markersize=5,
                    markerfacecolor="white", linestyle="none", capsize=3, label=curve.label,
                )  # fmt: skip
                continue
            if curve.kind == "decay":
                axes.fill_between(
                    curve.amplitude, value - 1.96 * deviation, value + 1.96 * deviation, color=colour, alpha=0.22,
                    linewidth=0,
                )  # fmt: skip
            style = "--" if curve.kind == "model" else "-"
            axes.plot(curve.amplitude, value, color=colour, linestyle=style, linewidth=1.6, label=curve.label)
    left.set_ylabel("change of frequency [%]")
    right.set_ylabel("damping ratio [%]")
    for axes in (left, right):
        axes.set_xscale("log")
        axes.set_xlabel(result.amplitude_label)
        open_box(axes)
    handles, labels = left.get_legend_handles_labels()
    # One entry stands for the model of all modes.
    entries = dict(zip(labels, handles, strict=True))
    add_legend(figure, list(entries.values()), list(entries), most=4)
    add_heading(figure, result)
    return figure
