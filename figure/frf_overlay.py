"""Measured and predicted responses over frequency, one colour per level: points with error bars, and lines."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import INK, Axes, Figure, Headed, add_heading, choose_family_colours, new_figure, open_box


@dataclass(frozen=True, kw_only=True, eq=False)
class OverlayCurve:
    """One level.

    Parameters
    ----------
    level
        Number of the level among those of the figure.
    frequency, measured, deviation
        Measured frequencies [Hz], complex values, and standard deviations of the mean, shape (f,).
    line_frequency, line
        Predicted, shape (p,).
    """

    level: int
    frequency: Float[NDArray[np.float64], " f"]
    measured: Complex[NDArray[np.complex128], " f"]
    deviation: Float[NDArray[np.float64], " f"]
    line_frequency: Float[NDArray[np.float64], " p"]
    line: Complex[NDArray[np.complex128], " p"]


@dataclass(frozen=True, kw_only=True, eq=False)
class OverlayPanel:
    """One sensor and harmonic.

    Parameters
    ----------
    label
        Above the panel.
    unit
        Unit of the amplitude.
    curves
        One per level.
    is_static
        Whether values are real, drawn with their sign.
    """

    label: str
    unit: str
    curves: Sequence[OverlayCurve]
    is_static: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class FrfOverlay(Headed):
    """Measured and predicted responses over frequency.

    Parameters
    ----------
    panels
        Panels in their order, row by row.
    levels
        Levels in words, ascending.
    columns
        Panels beside each other [-].
    with_phase
        Whether the phase is drawn below each amplitude.
    """

    panels: Sequence[OverlayPanel]
    levels: Sequence[str]
    columns: int
    with_phase: bool


@draws(FrfOverlay, "frf_overlay")
def frf_overlay_figure(result: FrfOverlay) -> Figure:
    """Draw the panels."""
    from matplotlib.lines import Line2D

    rows = -(-len(result.panels) // result.columns)
    height = 4.0 if result.with_phase else 2.6
    figure = new_figure(max(5.6 * result.columns, 8.0), 1.3 + height * rows)
    ratios = [2.1, 1.0] * rows if result.with_phase else [1.0] * rows
    axes = figure.subplots(len(ratios), result.columns, squeeze=False, sharex=True, height_ratios=ratios)
    colours, step = choose_family_colours(len(result.levels)), 2 if result.with_phase else 1
    for number in range(rows * result.columns):
        row, column = step * (number // result.columns), number % result.columns
        if number >= len(result.panels):
            for item in axes[row : row + step, column]:
                item.set_axis_off()
            continue
        panel, last = result.panels[number], number + result.columns >= len(result.panels)
        _amplitude(axes[row, column], panel, colours)
        if result.with_phase:
            _phase(axes[row + 1, column], panel, colours)
        lowest = axes[row + step - 1, column]
        lowest.tick_params(labelbottom=last)
        if last:
            lowest.set_xlabel("frequency [Hz]")
        for item in axes[row : row + step, column]:
            open_box(item)
    handles = [
        Line2D([], [], color=colour, linewidth=2, label=level)
        for colour, level in zip(colours, result.levels, strict=True)
    ]
    handles += [
        Line2D(
            [],
            [],
            color=INK,
            marker="o",
            markersize=4,
            markerfacecolor="white",
            linestyle="none",
            label="measured, with standard deviation",
        ),
        Line2D([], [], color=INK, linewidth=1.4, label="predicted"),
    ]
    figure.legend(handles=handles, frameon=False, loc="outside lower left", ncols=len(handles))
    add_heading(figure, result)
    return figure


def _amplitude(axes: Axes, panel: OverlayPanel, colours: Sequence[str]) -> None:
    def drawn(value: Complex[NDArray[np.complex128], " f"]) -> Float[NDArray[np.float64], " f"]:
        return np.asarray(value.real if panel.is_static else np.abs(value))

    for curve in panel.curves:
        colour = colours[curve.level]
        axes.plot(curve.line_frequency, drawn(curve.line), color=colour, linewidth=1.3, zorder=2)
        _points(axes, curve.frequency, drawn(curve.measured), curve.deviation, colour)
    axes.set_title(panel.label, fontsize=10, loc="left", color=INK)
    unit = panel.unit.replace("um", "µm")
    axes.set_ylabel(f"static part [{unit}]" if panel.is_static else f"amplitude [{unit}]")
    if not panel.is_static:
        axes.set_ylim(bottom=0)


def _phase(axes: Axes, panel: OverlayPanel, colours: Sequence[str]) -> None:
    from matplotlib.ticker import MultipleLocator

    lowest, highest = np.inf, -np.inf
    for curve in panel.curves:
        colour = colours[curve.level]
        measured = np.unwrap(np.angle(curve.measured))
        # All levels begin on the turn from -90 to 270 deg.
        measured -= 2 * np.pi * np.ceil((measured[0] - 1.5 * np.pi) / (2 * np.pi))
        line = np.unwrap(np.angle(curve.line))
        line += 2 * np.pi * np.round((measured[0] - line[0]) / (2 * np.pi))
        axes.plot(curve.line_frequency, np.degrees(line), color=colour, linewidth=1.3, zorder=2)
        with np.errstate(divide="ignore", invalid="ignore"):
            deviation = np.degrees(curve.deviation / np.abs(curve.measured))
        _points(axes, curve.frequency, np.degrees(measured), deviation, colour)
        lowest, highest = (
            min(lowest, float(np.degrees(measured.min()))),
            max(highest, float(np.degrees(measured.max()))),
        )
    axes.set_ylabel("phase [deg]")
    if highest - lowest > 80:
        axes.yaxis.set_major_locator(MultipleLocator(45 if highest - lowest < 200 else 90))


def _points(
    axes: Axes,
    frequency: Float[NDArray[np.float64], " f"],
    value: Float[NDArray[np.float64], " f"],
    deviation: Float[NDArray[np.float64], " f"],
    colour: str,
) -> None:
    # Hollow points: a line that runs through one is seen within it.
    axes.errorbar(
        frequency, value, yerr=np.nan_to_num(deviation), fmt="o", markersize=3.2, markerfacecolor="white",
        markeredgewidth=0.9, color=colour, elinewidth=0.7, zorder=3,
    )  # fmt: skip
