r"""Frequencies in rad/s or kHz labelled as Hz, or the reverse: a common factor of all measured resonances."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

#: Largest difference of the logarithms of a predicted and a measured resonance that match, as stated and with the unit
#: corrected [-].
SAME_FREQUENCY, SAME_AFTER_CORRECTION = 0.25, 0.1


@dataclass(frozen=True, kw_only=True)
class WrongUnit:
    r"""Mistake of a frequency unit.

    Parameters
    ----------
    factor
        Factor of the measured frequencies relative to those of the model [-].
    words
        The factor in words.
    stated, likely
        Stated unit, from which the reader converts to Hz, and likely unit of the values.
    """

    factor: float
    words: str
    stated: str
    likely: str


MISTAKES = (
    WrongUnit(factor=2 * np.pi, words="2 pi times", stated="Hz", likely="rad/s"),
    WrongUnit(factor=1 / (2 * np.pi), words="a 2 pi-th of", stated="rad/s", likely="Hz"),
    WrongUnit(factor=1e-3, words="a thousandth of", stated="Hz", likely="kHz"),
    WrongUnit(factor=1e3, words="1000 times", stated="kHz", likely="Hz"),
)


def find_wrong_frequency_unit(distance: Callable[[float], Float[NDArray[np.float64], " m"]]) -> WrongUnit | None:
    """The unit for which all measured resonances agree with a model; None if one of them agrees without a change.

    Parameters
    ----------
    distance
        Function of a factor on the model's frequencies: distance of each measured resonance from the nearest resonance
        that may correspond to it, in the natural logarithm, shape (m,); infinite without any.
    """
    apart = distance(1.0)
    if not len(apart) or apart.min() < SAME_FREQUENCY:
        return None
    return next((item for item in MISTAKES if distance(item.factor).max() < SAME_AFTER_CORRECTION), None)
