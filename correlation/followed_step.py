"""Wide steps of sweeps that small steps have followed.

Fits and screenings predict models that differ little. Where the states at both ends of a step have hardly moved since
the step was followed without a jump, the branch between them is still there, and it needs no small steps again.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Complex
from numpy.typing import NDArray

#: Coefficients of the joint directions, harmonics 0 to H [m].
Motion = Complex[NDArray[np.complex128], "harmonic d"]
#: Change of the motion at either end, relative to the larger motion, up to which a step counts as followed. By less
#: than the change that makes a step wide (`sweep_path.WIDE_CHANGE`), so that a state of a branch far away is followed
#: [-].
FOLLOWED_CHANGE = 0.2


class SweepStep(NamedTuple):
    """Step of a sweep at one level."""

    level: float
    """Level of the drive [its unit]."""
    start: float
    """Frequency that the step begins at [Hz], and ..."""
    end: float
    """... that it ends at [Hz]."""


class FollowedStep(NamedTuple):
    """Result of small steps between two motions."""

    start: Motion
    end: Motion
    jump: float | None
    """Share of the step at which the sweep jumps [-]; None if it stays on its branch."""

    def is_near(self, start: Motion, end: Motion) -> bool:
        """Whether the motions of another model at both ends are near."""
        return _are_near(self.start, start) and _are_near(self.end, end)


def _are_near(one: Motion, other: Motion) -> bool:
    """Whether two motions hardly differ, but for their means."""
    if one.shape != other.shape:
        return False
    size = max(np.abs(motion[1:]).max(initial=0.0) for motion in (one, other))
    return bool(np.abs(one[1:] - other[1:]).max(initial=0.0) <= FOLLOWED_CHANGE * size)
