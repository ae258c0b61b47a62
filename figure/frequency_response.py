"""A frequency response function: amplitude and phase."""

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from figure.style import add_title, open_box, png

LINE = "#0072b2"


def frequency_response_figure(
    frequency: Float[NDArray[np.float64], " f"], receptance: Complex[NDArray[np.complex128], " f"], *, title: str
) -> bytes:
    """Draw a receptance as PNG.

    Parameters
    ----------
    frequency
        Ascending, shape (f,) [Hz].
    receptance
        Displacement over force, shape (f,) [m/N].
    title
        Above the figure.
    """
    from matplotlib.figure import Figure
    from matplotlib.ticker import MultipleLocator

    figure = Figure(figsize=(9, 5.2), layout="constrained", dpi=160)
    amplitude, phase = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1))
    amplitude.semilogy(frequency, np.abs(receptance) * 1e6, color=LINE, linewidth=1.4)
    amplitude.set_ylabel("amplitude [um/N]")
    # Each resonance takes 180 degrees off the phase; unwrapped, it says how many were passed.
    phase.plot(frequency, np.degrees(np.unwrap(np.angle(receptance))), color=LINE, linewidth=1.4)
    phase.set_ylabel("phase [deg]")
    phase.yaxis.set_major_locator(MultipleLocator(90))
    phase.set_xlabel("frequency [Hz]")
    phase.set_xlim(frequency[0], frequency[-1])
    for axes in (amplitude, phase):
        open_box(axes)
    add_title(figure, title)
    return png(figure)
