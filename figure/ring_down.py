"""A free decay: the signal over time with the amplitudes of its modes, on a logarithmic axis."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import (
    GRID,
    PALE,
    Figure,
    TitledFigure,
    add_heading,
    add_legend,
    choose_family_colours,
    make_figure,
    open_box,
)

Values = Float[NDArray[np.float64], " n"]
#: Largest number of drawn points of the signal; more would only fill the area.
MOST_POINTS = 20000


@dataclass(frozen=True, kw_only=True, eq=False)
class DecayDrawing(TitledFigure):
    """A signal and the amplitudes of its modes.

    Parameters
    ----------
    time, signal
        Shape (n,) [s, unit of the label].
    modes
        Label, time and amplitude of each mode, shape (k,) each.
    floor
        Amplitude above which modes exceed the noise and are read [unit of the label].
    signal_label
        Of the signal, with its unit.
    """

    time: Values
    signal: Values
    modes: Sequence[tuple[str, Values, Values]]
    floor: float
    signal_label: str


@draws(DecayDrawing, "ring_down")
def draw_ring_down(result: DecayDrawing) -> Figure:
    """Draw the signal above, its logarithm with the amplitudes below."""
    figure = make_figure(9.0, 6.0)
    above, below = figure.subplots(2, 1, sharex=True)
    stride = max(1, len(result.time) // MOST_POINTS)
    time, signal = result.time[::stride], result.signal[::stride]
    offset = float(np.median(signal[-max(len(signal) // 10, 1) :]))
    above.plot(time, signal, color=PALE, linewidth=0.6)
    size = np.maximum(np.abs(signal - offset), result.floor / 10)
    below.plot(time, size, color=GRID, linewidth=0.6)
    for (label, at, amplitude), colour in zip(result.modes, choose_family_colours(len(result.modes)), strict=True):
        above.plot(at, amplitude + offset, color=colour, linewidth=1.8)
        above.plot(at, offset - amplitude, color=colour, linewidth=1.8)
        below.plot(at, amplitude, color=colour, linewidth=2.0, label=label)
    below.axhline(result.floor, color=PALE, linestyle=":", linewidth=1.2, label="modes are read down to here")
    below.set_yscale("log")
    below.set_xlabel("time [s]")
    above.set_ylabel(result.signal_label)
    below.set_ylabel(result.signal_label)
    for axes in (above, below):
        open_box(axes)
    handles, labels = below.get_legend_handles_labels()
    add_legend(figure, handles, labels, most=4)
    add_heading(figure, result)
    return figure
