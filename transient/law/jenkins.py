"""A spring and a slider in series."""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.compiled import compiled
from transient.law.path import slide
from transient.law.witness import WITNESSES, Witness

Vector = Float[NDArray[np.float64], " n"]


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.law.witness`."""
    stiffness, limit = value[0], value[1]
    end[0], mean[0] = slide(stiffness * (before[0] - slider[0]), stiffness * (after[0] - before[0]), limit, limit)
    moved[0] = after[0] - end[0] / stiffness


WITNESSES.register(Witness(name="jenkins", force=force))
