"""Where a continuation stands between two steps."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from hbsolve.balance import Real
from hbsolve.continuation.stop import StopReason


@dataclass(frozen=True, kw_only=True, eq=False)
class ContinuationState:
    """All that the next step depends on; a continuation goes on from it with the same result.

    Parameters
    ----------
    value
        Lambda.
    motion
        Real coefficients of the joint directions, shape (d, nh) [m].
    slider, by_multiplier
        Initial state of the sliders, shape (s,).
    tangent_motion, tangent_value
        Tangent, in the direction of travel; before the first step, lambda's way alone.
    orientation
        Sign of the determinant along it (`hbsolve.continuation.arclength.tangent`); 0 before the first step.
    step
        The next ds.
    n_point
        Points so far.
    mark_motion, mark_value, mark_tangent_motion, mark_tangent_value, mark_point
        An earlier point, its tangent, and its number: a branch that comes back to it is closed.
    stop_reason
        None while there is a next step.
    """

    value: float
    motion: Real
    slider: Float[NDArray[np.float64], " s"]
    by_multiplier: NDArray[np.int64]
    tangent_motion: Real
    tangent_value: float
    orientation: int
    step: float
    n_point: int
    mark_motion: Real
    mark_value: float
    mark_tangent_motion: Real
    mark_tangent_value: float
    mark_point: int
    stop_reason: StopReason | None = None
