"""Modal assurance criterion of all pairs of measured modes and modes of the model, and their pairing."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import INK, Figure, TitledFigure, add_heading, make_figure

#: Largest number of modes of either kind for which numbers are written into the cells.
MOST_NUMBERS = 14


@dataclass(frozen=True, kw_only=True, eq=False)
class MacMatrix(TitledFigure):
    """Modal assurance criterion.

    Parameters
    ----------
    assurance
        MAC in [0, 1], shape (n_measured, n_model) [-].
    measured, model
        Frequencies, shape (n_measured,) and (n_model,) [Hz].
    pairs
        Numbers of paired measured and predicted modes.
    """

    assurance: Float[NDArray[np.float64], "n m"]
    measured: Float[NDArray[np.float64], " n"]
    model: Float[NDArray[np.float64], " m"]
    pairs: Sequence[tuple[int, int]]


@draws(MacMatrix, "mac_matrix")
def draw_mac(result: MacMatrix) -> Figure:
    """Draw the matrix; pairs are framed."""
    from matplotlib.patches import Rectangle

    rows, columns = result.assurance.shape
    figure = make_figure(max(2.6 + 0.55 * columns, 5.5), max(2.0 + 0.5 * rows, 4.0))
    axes = figure.subplots()
    image = axes.imshow(result.assurance, cmap="Blues", vmin=0, vmax=1, aspect="auto")
    axes.set_xticks(range(columns), [f"{frequency:.4g}" for frequency in result.model], rotation=45, ha="right")
    axes.set_yticks(range(rows), [f"{frequency:.4g}" for frequency in result.measured])
    axes.set_xlabel("modes of the model [Hz]")
    axes.set_ylabel("measured modes [Hz]")
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    if max(rows, columns) <= MOST_NUMBERS:
        for row in range(rows):
            for column in range(columns):
                value = result.assurance[row, column]
                colour = "white" if value > 0.6 else INK
                axes.text(column, row, f"{value:.2f}", ha="center", va="center", fontsize=8, color=colour)
    for row, column in result.pairs:
        axes.add_patch(
            Rectangle((column - 0.5, row - 0.5), 1, 1, fill=False, edgecolor="#d55e00", linewidth=2.2, clip_on=False)
        )
    figure.colorbar(image, ax=axes, label="MAC [-]")
    add_heading(figure, result)
    return figure
