r"""Frequency and damping of a mode at its amplitude, from the resonance curve of one level.

One mode is fitted to the points around the peak: near a resonance, a nonlinear structure under a constant force level
responds like a linear one whose frequency and damping belong to the amplitude at the peak. The curve bends where they
change within the peak, so that points far down its sides belong to smaller amplitudes; the misfit of the one mode is
added to the deviations.

The fit is to :math:`1 / |X|^2`, a parabola of the squared frequency: amplitudes are enough, phases are not used.
"""

from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.metric.response import find_peak, fit_resonance, measure_bend
from correlation.model import DERIVATIVE

#: Step of a numerical derivative by the logarithm of an amplitude [-].
STEP = 1e-5
#: Numbers of a parabola.
PARABOLA = 3


def fit_peak(
    frequency: Float[NDArray[np.float64], " f"],
    response: NDArray[Any],
    deviation: Float[NDArray[np.float64], " f"] | None,
    quantity: str,
) -> tuple[float, ...]:
    """Amplitude, frequency [Hz] and damping ratio [-] of the largest peak, each followed by its standard deviation.

    The deviations are not a number where nothing tells them: three points in all, and no deviation of their own.

    Parameters
    ----------
    frequency
        Shape (f,) [Hz].
    response
        Complex, or amplitudes alone, shape (f,) [any unit].
    deviation
        Standard deviation of real and imaginary part, or of the amplitude, shape (f,); None for what the fit leaves.
    quantity
        "displacement", "velocity" or "acceleration".

    Raises
    ------
    CampaignError
        No resonance.
    """
    usable = np.isfinite(response) & np.isfinite(frequency) & (np.abs(response) > 0)
    order = np.flatnonzero(usable)[np.argsort(frequency[usable])]
    if len(order) < PARABOLA:
        raise CampaignError(f"{len(order)} points are no resonance: measure three or more around the peak")
    lines, values = frequency[order], np.abs(response[order]) / (2 * np.pi * frequency[order]) ** DERIVATIVE[quantity]
    chosen = find_peak(lines, values.astype(complex))
    best = np.array(fit_resonance(lines, values.astype(complex), chosen))
    relative = np.full(len(order), np.nan) if deviation is None else deviation[order] / np.abs(response[order])
    # What one mode leaves is noise, or the bend of a nonlinear peak: either way it is unexplained. Three points leave
    # nothing, so that it is seen with one more on either side.
    seen = chosen if chosen.sum() > PARABOLA else find_peak(lines, values.astype(complex), beside=1)
    bend = measure_bend(lines, values.astype(complex), seen)
    left = float((bend**2).sum() / (len(bend) - PARABOLA)) if len(bend) > PARABOLA else 0.0
    variance = np.fmax(relative[chosen] ** 2, left or np.nan)
    slopes = np.zeros((3, int(chosen.sum())))
    for column, point in enumerate(np.flatnonzero(chosen)):
        ends = []
        for step in (STEP, -STEP):
            moved = values.copy()
            moved[point] *= np.exp(step)
            result = fit_resonance(lines, moved.astype(complex), chosen)
            ends.append([*result, _height(lines, moved, chosen, result)])
        slopes[:, column] = (np.array(ends[0]) - ends[1]) / (2 * STEP)
    spread = np.sqrt((slopes**2) @ variance)
    height = _height(lines, values, chosen, (float(best[0]), float(best[1])))
    scale = (2 * np.pi * best[0]) ** DERIVATIVE[quantity]
    numbers = (height * scale, spread[2] * scale, best[0], spread[0], best[1], spread[1])
    return tuple(float(number) for number in numbers)


def _height(
    lines: Float[NDArray[np.float64], " f"],
    values: Float[NDArray[np.float64], " f"],
    chosen: NDArray[np.bool_],
    mode: tuple[float, float],
) -> float:
    """Displacement at the resonance of a mode that fits the chosen points."""
    own, damping = mode
    ratio = lines[chosen] / own
    shape = 1 / np.abs(1 - ratio**2 + 2j * damping * ratio)
    return float((values[chosen] * shape).sum() / (shape**2).sum() / (2 * damping))
