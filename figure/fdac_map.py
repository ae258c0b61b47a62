"""Correlation of measured and predicted deflection shapes: FDAC over both frequencies."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import Figure, TitledFigure, add_heading, make_figure


@dataclass(frozen=True, kw_only=True, eq=False)
class FdacMap(TitledFigure):
    """Frequency domain assurance criterion.

    Parameters
    ----------
    assurance
        FDAC in [0, 1], shape (n_measured, n_model) [-].
    measured, model
        Frequencies, ascending, shape (n_measured,) and (n_model,) [Hz].
    """

    assurance: Float[NDArray[np.float64], "n m"]
    measured: Float[NDArray[np.float64], " n"]
    model: Float[NDArray[np.float64], " m"]


@draws(FdacMap, "fdac_map")
def draw_fdac(result: FdacMap) -> Figure:
    """Draw the map; if both agree, its ridge is on the line of equal frequencies."""
    figure = make_figure(7.5, 6.2)
    axes = figure.subplots()
    image = axes.pcolormesh(
        result.model,
        result.measured,
        result.assurance,
        cmap="Blues",
        vmin=0,
        vmax=1,
        shading="nearest",
        rasterized=True,
    )
    first = max(result.model[0], result.measured[0])
    last = min(result.model[-1], result.measured[-1])
    axes.plot([first, last], [first, last], color="#d55e00", linewidth=1.2, linestyle="--", label="equal frequencies")
    axes.set_xlabel("frequency of the model [Hz]")
    axes.set_ylabel("measured frequency [Hz]")
    axes.legend(loc="lower right")
    figure.colorbar(image, ax=axes, label="FDAC [-]")
    add_heading(figure, result)
    return figure
