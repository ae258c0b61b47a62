"""Wide steps of sweeps that small steps have followed.

Fits and screenings predict models that differ little. Where the states at both ends of a step have hardly moved since
the step was followed without a jump, the branch between them is still there, and it needs no small steps again.
"""

from typing import NamedTuple

import numpy as np

from hbsolve.state import SteadyState

#: Change of the motion at either end, relative to the larger motion, up to which a step counts as followed [-].
NEAR = 0.2


class Step(NamedTuple):
    """Step of a sweep at one level."""

    level: float
    """Set point of the force [N]."""
    start: float
    """Frequency that the step begins at [Hz], and ..."""
    end: float
    """... that it ends at [Hz]."""


class FollowedStep(NamedTuple):
    """What small steps found between two states."""

    start: SteadyState
    end: SteadyState
    jump: float | None
    """Share of the step at which the sweep jumps [-]; None if it stays on its branch."""

    def is_near(self, start: SteadyState, end: SteadyState) -> bool:
        """Whether the states of another model at both ends are near."""
        return _are_near(self.start, start) and _are_near(self.end, end)


def _are_near(one: SteadyState, other: SteadyState) -> bool:
    """Whether the motions of the joint directions hardly differ."""
    if one.displacement.shape != other.displacement.shape:
        return False
    motions = one.displacement[1:], other.displacement[1:]
    size = max(np.abs(motion).max(initial=0.0) for motion in motions)
    return bool(np.abs(motions[0] - motions[1]).max(initial=0.0) <= NEAR * size)
