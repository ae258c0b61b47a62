r"""Frequency and damping of a mode against amplitude, from resonance curves of several levels.

Each level is fitted by one mode of its own, at the points around its peak: near a resonance, a nonlinear structure
under a constant force level responds like a linear one whose frequency and damping belong to the amplitude at the peak.
The curve bends where they change within the peak, so that points far down its sides belong to smaller amplitudes; the
misfit of the one mode is added to the deviations.

The fit is to :math:`1 / |X|^2`, a parabola of the squared frequency: amplitudes are enough, phases are not used.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.metric.response import find_peak, fit_resonance, measure_bend
from correlation.model import DERIVATIVE
from geometry.read_only_array import freeze_fields

Levels = Float[NDArray[np.float64], " l"]

#: Step of a numerical derivative by the logarithm of an amplitude [-].
STEP = 1e-5
#: Numbers of a parabola.
PARABOLA = 3


@dataclass(frozen=True, kw_only=True, eq=False)
class Backbone:
    """A mode at several levels.

    Parameters
    ----------
    level
        Rising, shape (l,) [N].
    amplitude, amplitude_deviation
        At the peak, shape (l,) [unit of the response].
    frequency, frequency_deviation
        Shape (l,) [Hz].
    damping_ratio, damping_deviation
        Shape (l,) [-].
    suspicions
        Levels without a resonance, and what else speaks against the result, in words.
    """

    level: Levels
    amplitude: Levels
    amplitude_deviation: Levels
    frequency: Levels
    frequency_deviation: Levels
    damping_ratio: Levels
    damping_deviation: Levels
    suspicions: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze_fields(
            self, "level", "amplitude", "amplitude_deviation", "frequency", "frequency_deviation", "damping_ratio",
            "damping_deviation",
        )  # fmt: skip


def fit_backbone(
    level: Sequence[float],
    frequency: Sequence[Any],
    response: Sequence[Any],
    *,
    deviation: Sequence[Any] | None = None,
    quantity: str = "displacement",
) -> Backbone:
    """Frequency and damping of the largest peak at every level.

    Parameters
    ----------
    level
        Shape (l,) [N].
    frequency
        Of each level, shape (f,) [Hz].
    response
        Of each level, complex, or amplitudes alone, shape (f,) [any unit].
    deviation
        Standard deviation of real and imaginary part, or of the amplitude, shape (f,); by default from what the fit
        leaves.
    quantity
        "displacement", "velocity" or "acceleration".

    Raises
    ------
    CampaignError
        No level with a resonance, an unknown quantity, or other numbers of levels than of responses.
    """
    if quantity not in DERIVATIVE:
        raise CampaignError(f'"{quantity}" is no quantity of a response: give {", ".join(DERIVATIVE)}')
    if not len(level) == len(frequency) == len(response):
        raise CampaignError(
            f"{len(level)} levels with {len(frequency)} sets of frequencies and {len(response)} responses: give "
            "one each"
        )
    rows, suspicions = [], []
    for place in np.argsort(level):
        spread = None if deviation is None else np.asarray(deviation[place], dtype=np.float64)
        try:
            found = fit_peak(
                np.asarray(frequency[place], dtype=np.float64), np.asarray(response[place]), spread, quantity
            )
        except CampaignError as error:
            suspicions.append(f"level {level[place]:.6g} N: {error}")
            continue
        rows.append([float(level[place]), *found])
    if not rows:
        raise CampaignError("no level has a resonance: " + "; ".join(suspicions))
    table = np.array(rows).T
    return Backbone(
        level=table[0], amplitude=table[1], amplitude_deviation=table[2], frequency=table[3],
        frequency_deviation=table[4], damping_ratio=table[5], damping_deviation=table[6], suspicions=tuple(suspicions),
    )  # fmt: skip


def fit_peak(
    frequency: Float[NDArray[np.float64], " f"],
    response: NDArray[Any],
    deviation: Float[NDArray[np.float64], " f"] | None,
    quantity: str,
) -> tuple[float, ...]:
    """Amplitude, frequency [Hz] and damping ratio [-] of the largest peak, each followed by its standard deviation.

    The deviations are not a number where nothing tells them: three points in all, and no deviation of their own.

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
            found = fit_resonance(lines, moved.astype(complex), chosen)
            ends.append([*found, _height(lines, moved, chosen, found)])
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
