"""A frequency response function: amplitude and phase."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import Figure, TitledFigure, add_title, make_figure, open_box

LINE = "#0072b2"


@dataclass(frozen=True, kw_only=True, eq=False)
class ReceptanceCurve(TitledFigure):
    """A receptance over frequency.

    Parameters
    ----------
    frequency
        Ascending, shape (f,) [Hz].
    receptance
        Displacement over force, shape (f,) [m/N].
    """

    frequency: Float[NDArray[np.float64], " f"]
    receptance: Complex[NDArray[np.complex128], " f"]
    title: str


@draws(ReceptanceCurve, "frequency_response")
def draw_frequency_response(result: ReceptanceCurve) -> Figure:
    """Draw a receptance."""
    from matplotlib.ticker import MultipleLocator

    figure = make_figure(9, 5.2)
    amplitude, phase = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1))
    amplitude.semilogy(result.frequency, np.abs(result.receptance) * 1e6, color=LINE, linewidth=1.4)
    amplitude.set_ylabel("amplitude [µm/N]")
    # Each resonance lowers the phase by 180 degrees; unwrapped, it shows the number of resonances passed.
    phase.plot(result.frequency, np.degrees(np.unwrap(np.angle(result.receptance))), color=LINE, linewidth=1.4)
    phase.set_ylabel("phase [deg]")
    phase.yaxis.set_major_locator(MultipleLocator(90))
    phase.set_xlabel("frequency [Hz]")
    phase.set_xlim(result.frequency[0], result.frequency[-1])
    for axes in (amplitude, phase):
        open_box(axes)
    add_title(figure, result.title)
    return figure
