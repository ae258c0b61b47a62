"""Strengths of an effect that are far from its neutral one."""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from diagnosis.candidate.effect import EffectParameter


def list_far_strengths(parameter: EffectParameter) -> Float[NDArray[np.float64], "2 2"]:
    """Strength halfway to each bound (geometric for a ratio) and the bound itself, shape (2, 2) [its unit]."""
    bounds, vanishes = np.array([parameter.lower, parameter.upper]), parameter.vanishes
    halfway = np.sqrt(bounds * vanishes) if parameter.is_ratio else (bounds + vanishes) / 2
    return np.column_stack([halfway, bounds])
