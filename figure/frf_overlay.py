"""Measured and predicted responses over frequency, one colour per level: points with error bars, lines, and residuals.

At the scale of the response two good models coincide: the strip below each amplitude shows the error of the prediction
at each point.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from figure.band_axis import use_band_axis
from figure.registry import draws
from figure.style import (
    HEADING,
    INK,
    LEFT,
    Axes,
    Figure,
    TitledFigure,
    add_axes,
    add_heading,
    choose_family_colours,
    count_legend_columns,
    draw_ticks,
    make_bare_figure,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class OverlayCurve:
    """Measured and predicted curve of one level.

    Parameters
    ----------
    level
        Number of the level among those of the figure.
    frequency, measured, deviation
        Measured frequencies [Hz], complex values, and standard deviations of the mean, shape (f,).
    predicted
        Predicted at the measured frequencies, shape (f,); NaN where there is no steady state.
    line_frequency, line
        Predicted, shape (p,).
    """

    level: int
    frequency: Float[NDArray[np.float64], " f"]
    measured: Complex[NDArray[np.complex128], " f"]
    deviation: Float[NDArray[np.float64], " f"]
    predicted: Complex[NDArray[np.complex128], " f"]
    line_frequency: Float[NDArray[np.float64], " p"]
    line: Complex[NDArray[np.complex128], " p"]


@dataclass(frozen=True, kw_only=True, eq=False)
class OverlayPanel:
    """Panel of one sensor and harmonic.

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
    has_phase
        Whether phases were measured, and not amplitudes alone.
    """

    label: str
    unit: str
    curves: Sequence[OverlayCurve]
    is_static: bool = False
    has_phase: bool = True


@dataclass(frozen=True, kw_only=True, eq=False)
class FrfOverlay(TitledFigure):
    """Measured and predicted responses over frequency.

    Parameters
    ----------
    panels
        Panels in their order, row by row.
    levels
        Levels in words, ascending.
    columns
        Number of panels side by side [-].
    with_phase
        Whether the phase is drawn below each amplitude.
    """

    panels: Sequence[OverlayPanel]
    levels: Sequence[str]
    columns: int
    with_phase: bool


#: Height of a row of the legend [inches].
LEGEND_ROW = 0.22
#: Room for the title above a panel, between its axes, left of them for numbers and label, right of them, and below the
#: last panel for numbers and label [inches].
TITLE_ROOM, BETWEEN, SIDE, END, FOOT = 0.3, 0.17, 0.92, 0.22, 0.55
#: Where the labels end, left of the axes [inches]: numbers of seven characters fit between.
LABEL_PLACE = 0.72
#: Room above and below the points of a flat panel, as a share of its height, to keep them off the frame.
CLEARANCE = 0.15
#: Room for numbers between the axes and the label below them [points].
LABEL_PAD = 21


@draws(FrfOverlay, "frf_overlay")
def draw_frf_overlay(result: FrfOverlay) -> Figure:
    """Draw the panels."""
    from matplotlib.lines import Line2D

    columns = min(result.columns, len(result.panels))
    rows = -(-len(result.panels) // columns)
    ratios = [2.1, 0.8, 1.0] if result.with_phase else [1.6, 0.8]
    width, height = max(5.6 * columns, 8.0), 1.3 + (4.7 if result.with_phase else 3.2) * rows
    figure, colours = make_bare_figure(width, height), choose_family_colours(len(result.levels))
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
    ncols = count_legend_columns(figure, [str(handle.get_label()) for handle in handles], len(handles))
    figure.legend(
        handles=handles, frameon=False, loc="lower left", ncols=ncols, bbox_to_anchor=(LEFT / 2 / width, 0),
        borderaxespad=0.2,
    )  # fmt: skip
    foot = FOOT + LEGEND_ROW * -(-len(handles) // ncols)
    across, down = width / columns, (height - HEADING - foot) / rows
    heights = (down - TITLE_ROOM - BETWEEN * (len(ratios) - 1)) * np.array(ratios) / sum(ratios)
    tops = TITLE_ROOM + np.concatenate([[0.0], np.cumsum(heights + BETWEEN)[:-1]])
    first, named = None, list[Axes]()
    for number, panel in enumerate(result.panels):
        row, column = divmod(number, columns)
        block = []
        for top, tall in zip(tops, heights, strict=True):
            axes = add_axes(
                figure, column * across + SIDE, HEADING + row * down + top, across - SIDE - END, tall, sharex=first
            )
            first = first or axes
            axes.yaxis.set_label_coords(-LABEL_PLACE / (across - SIDE - END), 0.5)
            axes.spines[["top", "right"]].set_visible(False)
            block.append(axes)
        _draw_amplitude(block[0], panel, colours)
        _draw_residual(block[1], panel, colours)
        if result.with_phase:
            _draw_phase(block[2], panel, colours)
        if number + columns >= len(result.panels):
            block[-1].set_xlabel("frequency [Hz]", labelpad=LABEL_PAD)
            named.append(block[-1])
    curves = [curve.frequency for panel in result.panels for curve in panel.curves]
    if first is not None:
        use_band_axis(first, curves)
    draw_ticks(figure.axes, named)
    add_heading(figure, result)
    return figure


def _draw_amplitude(axes: Axes, panel: OverlayPanel, colours: Sequence[str]) -> None:
    def drawn(value: Complex[NDArray[np.complex128], " f"]) -> Float[NDArray[np.float64], " f"]:
        return np.asarray(value.real if panel.is_static else np.abs(value))

    for curve in panel.curves:
        colour = colours[curve.level]
        axes.plot(curve.line_frequency, drawn(curve.line), color=colour, linewidth=1.3, zorder=2)
        _draw_points(axes, curve.frequency, drawn(curve.measured), curve.deviation, colour)
    axes.set_title(panel.label, fontsize=10, loc="left", color=INK, y=1.0)
    axes.set_ylabel(f"static part [{panel.unit}]" if panel.is_static else f"amplitude [{panel.unit}]")
    if not panel.is_static:
        axes.set_ylim(bottom=0)


def _draw_residual(axes: Axes, panel: OverlayPanel, colours: Sequence[str]) -> None:
    """Draw the error of the prediction at each point: of an amplitude in %, of a static part in its unit."""
    axes.axhline(0.0, color=INK, linewidth=0.8, zorder=1)
    for curve in panel.curves:
        with np.errstate(divide="ignore", invalid="ignore"):
            if panel.is_static:
                value, deviation = (curve.predicted - curve.measured).real, curve.deviation
            else:
                size = np.abs(curve.measured)
                value, deviation = 100 * (np.abs(curve.predicted) / size - 1), 100 * curve.deviation / size
        there = np.isfinite(value)
        _draw_points(axes, curve.frequency[there], value[there], deviation[there], colours[curve.level])
    axes.margins(y=CLEARANCE)
    axes.set_ylabel(f"residual [{panel.unit}]" if panel.is_static else "residual [%]")


def _draw_phase(axes: Axes, panel: OverlayPanel, colours: Sequence[str]) -> None:
    from matplotlib.ticker import MultipleLocator

    lowest, highest = np.inf, -np.inf
    for curve in panel.curves:
        colour = colours[curve.level]
        line, there = np.angle(curve.line), np.isfinite(curve.line)
        line[there] = np.unwrap(line[there])
        if panel.has_phase:
            measured = np.unwrap(np.angle(curve.measured))
            # The phases of all levels begin between -90 and 270 deg.
            measured -= 2 * np.pi * np.ceil((measured[0] - 1.5 * np.pi) / (2 * np.pi))
            line += 2 * np.pi * np.round((measured[0] - line[there][0]) / (2 * np.pi)) if there.any() else 0.0
            with np.errstate(divide="ignore", invalid="ignore"):
                deviation = np.degrees(curve.deviation / np.abs(curve.measured))
            _draw_points(axes, curve.frequency, np.degrees(measured), deviation, colour)
        else:
            measured = line
        axes.plot(curve.line_frequency, np.degrees(line), color=colour, linewidth=1.3, zorder=2)
        lowest, highest = (
            min(lowest, float(np.degrees(np.nanmin(measured)))),
            max(highest, float(np.degrees(np.nanmax(measured)))),
        )
    axes.margins(y=CLEARANCE)
    axes.set_ylabel("phase [deg]")
    if highest - lowest > 80:
        axes.yaxis.set_major_locator(MultipleLocator(45 if highest - lowest < 200 else 90))


def _draw_points(
    axes: Axes,
    frequency: Float[NDArray[np.float64], " f"],
    value: Float[NDArray[np.float64], " f"],
    deviation: Float[NDArray[np.float64], " f"],
    colour: str,
) -> None:
    # Draw all bars as one line with gaps: an artist per bar takes ten times as long.
    bars = np.nan_to_num(deviation) * np.array([[-1.0], [1.0], [np.nan]]) + value
    axes.plot(
        np.repeat(frequency, 3), bars.T.ravel(), color=colour, linewidth=0.7, solid_capstyle="butt", zorder=3
    )  # fmt: skip
    # Hollow points, so that a line through them remains visible.
    axes.plot(
        frequency, value, "o", markersize=3.2, markerfacecolor="white", markeredgewidth=0.9, color=colour, zorder=3
    )  # fmt: skip
