"""Stabilisation diagram: poles over the order of the fit, above them the sum of the responses."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import INK, Figure, TitledFigure, add_heading, add_legend, make_figure, open_box


@dataclass(frozen=True, kw_only=True, eq=False)
class StabilisationDrawing(TitledFigure):
    """Poles over the order.

    Parameters
    ----------
    order, frequency, stable
        Of each pole, shape (p,) [-, Hz, -].
    line, response
        Root mean square of all responses, shape (f,) [Hz, any unit].
    fitted
        The same for the fitted modes, shape (f,).
    chosen
        Frequencies of the selected modes, shape (m,) [Hz].
    response_label
        Label of the response, with its unit.
    """

    order: Int[NDArray[np.int64], " p"]
    frequency: Float[NDArray[np.float64], " p"]
    stable: Bool[NDArray[np.bool_], " p"]
    line: Float[NDArray[np.float64], " f"]
    response: Float[NDArray[np.float64], " f"]
    fitted: Float[NDArray[np.float64], " f"]
    chosen: Float[NDArray[np.float64], " m"]
    response_label: str


@draws(StabilisationDrawing, "stabilisation")
def draw_stabilisation(result: StabilisationDrawing) -> Figure:
    """Draw responses above, poles below; lines mark the selected modes."""
    figure = make_figure(9.0, 6.4)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1, 1.2))
    above.semilogy(result.line, result.response, color=INK, linewidth=0.7, zorder=3, label="measured")
    above.semilogy(result.line, result.fitted, color="#d55e00", linewidth=2.8, label="fitted modes")
    inside = (result.frequency >= result.line[0]) & (result.frequency <= result.line[-1])
    for stable, colour, label in ((False, "#c3c9d0", "pole"), (True, "#0072b2", "stable pole")):
        chosen = inside & (result.stable == stable)
        below.plot(
            result.frequency[chosen], result.order[chosen], color=colour, marker="o" if stable else ".", markersize=4,
            linestyle="none", label=label,
        )  # fmt: skip
    for axes in (above, below):
        for number, frequency in enumerate(result.chosen):
            named = {"label": "mode"} if number == 0 and axes is below else {}
            axes.axvline(frequency, color=INK, linewidth=0.8, linestyle=":", **named)
        open_box(axes)
    below.set_xlim(result.line[0], result.line[-1])
    below.set_xlabel("frequency [Hz]")
    below.set_ylabel("order [-]")
    above.set_ylabel(result.response_label)
    handles = [*above.get_legend_handles_labels()[0], *below.get_legend_handles_labels()[0]]
    labels = [*above.get_legend_handles_labels()[1], *below.get_legend_handles_labels()[1]]
    add_legend(figure, handles, labels)
    add_heading(figure, result)
    return figure
