r"""Frequency and damping of a mode at its amplitude, from the resonance curve of one level.

A single mode is fitted to the points around the peak: near a resonance, a nonlinear structure at a constant force level
responds like a linear one with frequency and damping for the amplitude at the peak. If these vary within the peak, the
curve is bent, since points on its flanks have smaller amplitudes; the misfit of the single mode is added to the
standard deviations.

The fit is to :math:`1 / |X|^2`, a parabola in the squared frequency: only amplitudes are used, no phases.
"""

from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.metric.response import find_peak, fit_resonance, measure_bend
from correlation.model import DERIVATIVE

#: Step of numerical derivatives with respect to the logarithm of an amplitude [-].
STEP = 1e-5
#: Number of coefficients of a parabola.
PARABOLA = 3


def fit_peak(
    frequency: Float[NDArray[np.float64], " f"],
    response: NDArray[Any],
    deviation: Float[NDArray[np.float64], " f"] | None,
    quantity: str,
) -> tuple[float, ...]:
    """Amplitude, frequency [Hz] and damping ratio [-] of the largest peak, each followed by its standard deviation.

    The standard deviations are NaN if they cannot be estimated: with three points in all and no stated deviation.

    Parameters
    ----------
    frequency
        Frequencies, shape (f,) [Hz].
    response
        Complex responses, or amplitudes, shape (f,) [any unit].
    deviation
        Standard deviation of real and imaginary part, or of the amplitude, shape (f,); None to use the misfit.
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
        raise CampaignError(f"{len(order)} points do not determine a resonance: measure three or more around the peak")
    lines, values = frequency[order], np.abs(response[order]) / (2 * np.pi * frequency[order]) ** DERIVATIVE[quantity]
    chosen = find_peak(lines, values.astype(complex))
    best = np.array(fit_resonance(lines, values.astype(complex), chosen))
    relative = np.full(len(order), np.nan) if deviation is None else deviation[order] / np.abs(response[order])
    # The misfit of one mode is noise, or the bend of a nonlinear peak. Three points have no misfit, so that one more on
    # either side is used.
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
            ends.append([*result, _fit_height(lines, moved, chosen, result)])
        slopes[:, column] = (np.array(ends[0]) - ends[1]) / (2 * STEP)
    spread = np.sqrt((slopes**2) @ variance)
    height = _fit_height(lines, values, chosen, (float(best[0]), float(best[1])))
    scale = (2 * np.pi * best[0]) ** DERIVATIVE[quantity]
    numbers = (height * scale, spread[2] * scale, best[0], spread[0], best[1], spread[1])
    return tuple(float(number) for number in numbers)


def _fit_height(
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
