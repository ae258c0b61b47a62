"""Strengths of an effect that are far from its neutral one."""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from diagnosis.candidate.effect import EffectParameter

#: Shares of the way to a bound, geometric for a ratio [-].
SHARES = np.array([0.25, 0.5, 1.0])


def list_far_strengths(parameter: EffectParameter) -> Float[NDArray[np.float64], "2 3"]:
    """Strengths at `SHARES` of the way to the lower and the upper bound, shape (2, 3) [its unit]."""
    bounds, vanishes = np.array([[parameter.lower], [parameter.upper]]), parameter.vanishes
    if parameter.is_ratio:
        return np.asarray(vanishes * (bounds / vanishes) ** SHARES)
    return np.asarray(vanishes + SHARES * (bounds - vanishes))
