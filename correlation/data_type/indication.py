"""Indications: properties of a structure that data show directly, beside those of a model, in words."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model

#: Smallest clear difference between measurement and model: it exceeds errors that are common to all readings, which
#: their standard deviations do not include [standard deviations].
CLEAR_DEVIATION = 5.0


@dataclass(frozen=True, kw_only=True)
class Indication:
    """Measured and predicted value of one property.

    Parameters
    ----------
    quantity
        Name of the property, such as "frequency of the mode at 122 Hz".
    kind
        "frequency", "damping", "stiffness", "work", "growth" of work with the amplitude, "slow growth" for an exponent
        nearer to 1 than to 2, or "play".
    measured, predicted
        Values in words, such as "falls from 122 to 119 Hz".
    difference
        Measured less predicted value, with its sign [standard deviations].
    """

    quantity: str
    kind: str
    measured: str
    predicted: str
    difference: float

    @property
    def is_clear(self) -> bool:
        """Whether the difference cannot be explained by chance."""
        return abs(self.difference) > CLEAR_DEVIATION

    @property
    def sentence(self) -> str:
        """Measured and predicted value in one sentence."""
        return f"the {self.quantity} {self.measured}; the model's {self.predicted}"


#: Function that lists the indications of all data of one type, from a model, the data, and the predicted features.
ListIndications: TypeAlias = Callable[
    [Model, Sequence[Any], Sequence[Float[NDArray[np.float64], " m"]]], Sequence[Indication]
]


def name_causes(indications: Sequence[Indication]) -> str:
    """Usual causes of the clear indications, in words; empty if no cause is known."""
    clear = {(item.kind, item.difference > 0) for item in indications if item.is_clear}
    causes = []
    if ("frequency", False) in clear and ("damping", True) in clear:
        causes.append(
            "a frequency that falls and a damping that rises with the amplitude are signs of slip in joints, or of a "
            "softening spring with drag"
        )
    elif ("frequency", True) in clear:
        causes.append("a frequency that rises with the amplitude is a sign of a hardening spring or a stop")
    elif ("frequency", False) in clear:
        causes.append("a frequency that falls with the amplitude is a sign of a softening spring or an opening contact")
    elif ("damping", True) in clear:
        causes.append("a damping that rises with the amplitude is a sign of drag or friction")
    plays, slides = ("play", True) in clear, ("slow growth", False) in clear
    if plays and slides:
        causes.append(
            "a force that stays near zero after a reversal, and work that grows nearly in proportion to the amplitude, "
            "are signs of hysteresis with play: friction that slides behind a backlash"
        )
    elif plays:
        causes.append("a force that stays near zero after a reversal is a sign of play (backlash)")
    elif slides:
        causes.append("work that grows nearly in proportion to the amplitude is a sign of friction that slides")
    if not slides and ("work", True) in clear:
        causes.append("work that the model does not dissipate is a sign of friction or damping that it lacks")
    return "; ".join(causes)
