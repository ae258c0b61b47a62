"""A frequency response function: amplitude and phase."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from figure.registry import REGISTRY, FigureKind
from figure.style import add_title, open_box

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LINE = "#0072b2"


@dataclass(frozen=True, kw_only=True, eq=False)
class FrequencyResponse:
    """A receptance over frequency.

    Parameters
    ----------
    frequency
        Ascending, shape (f,) [Hz].
    receptance
        Displacement over force, shape (f,) [m/N].
    title
        Above the figure.
    """

    frequency: Float[NDArray[np.float64], " f"]
    receptance: Complex[NDArray[np.complex128], " f"]
    title: str


def frequency_response_figure(of: FrequencyResponse) -> "Figure":
    """Draw a receptance."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import MultipleLocator

    figure = Figure(figsize=(9, 5.2), layout="constrained")
    amplitude, phase = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1))
    amplitude.semilogy(of.frequency, np.abs(of.receptance) * 1e6, color=LINE, linewidth=1.4)
    amplitude.set_ylabel("amplitude [um/N]")
    # Each resonance takes 180 degrees off the phase; unwrapped, it says how many were passed.
    phase.plot(of.frequency, np.degrees(np.unwrap(np.angle(of.receptance))), color=LINE, linewidth=1.4)
    phase.set_ylabel("phase [deg]")
    phase.yaxis.set_major_locator(MultipleLocator(90))
    phase.set_xlabel("frequency [Hz]")
    phase.set_xlim(of.frequency[0], of.frequency[-1])
    for axes in (amplitude, phase):
        open_box(axes)
    add_title(figure, of.title)
    return figure


REGISTRY.register(FigureKind(name="frequency_response", draws=FrequencyResponse, draw=frequency_response_figure))
