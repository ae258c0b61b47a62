"""Loading histories: what a system remembers of the levels, static loads and frequencies that it went through."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from reduction.jointed_system import JointedSystem
from transient.equilibrium import equilibrium
from transient.errors import TransientError
from transient.state import TransientState
from transient.state_transition import make_modal_structure
from transient.stepper import Stepper


@dataclass(frozen=True, kw_only=True)
class Segment:
    """Whole periods over which level and static load change linearly from where the last segment ended.

    Raises
    ------
    TransientError
        A number out of range.
    """

    n_period: int
    """Periods of the excitation [-]."""
    angular_frequency: float
    """Of the excitation; for a slow static ramp, of the clock that counts the periods [rad/s]."""
    level: float = 1.0
    load: float = 1.0
    """Scale of the harmonic force and of the static load at the end [-]."""

    def __post_init__(self) -> None:
        if not isinstance(self.n_period, int | np.integer) or self.n_period < 1:
            raise TransientError(f"n_period = {self.n_period} of a segment must be a whole number of at least 1")
        if not (np.isfinite(self.level) and np.isfinite(self.load)):
            raise TransientError(f"level = {self.level} and load = {self.load} of a segment must be finite")


def follow(
    system: JointedSystem,
    segments: Sequence[Segment],
    start: TransientState | None = None,
    *,
    steps_per_period: int = 256,
    first_level: float = 0.0,
    first_load: float = 1.0,
) -> TransientState:
    """State at the end of a loading history.

    Parameters
    ----------
    system
        Structure, joints and loads.
    segments
        Parts of the history, one after the other; the excitation passes its phase 0 between them.
    start
        State to start from; by default the equilibrium under `first_load`.
    steps_per_period
        Number of time steps per period of the excitation [-].
    first_level, first_load
        Scales of the harmonic force and of the static load at the start [-].

    Raises
    ------
    TransientError
        No segments, or what `transient.integrate.integrate` refuses.
    """
    if not segments:
        raise TransientError("a loading history without segments is empty: give at least one")
    structure = make_modal_structure(system)
    state = equilibrium(structure, first_load) if start is None else start
    level, load = first_level, first_load
    for segment in segments:
        stepper = Stepper(structure, segment.angular_frequency, steps_per_period, state)
        for n in range(segment.n_period):
            # Midpoints of the steps, where a linear change has its mean.
            share = (n + (np.arange(steps_per_period) + 0.5) / steps_per_period) / segment.n_period
            stepper.advance(level + (segment.level - level) * share, load + (segment.load - load) * share)
        state, level, load = stepper.state, segment.level, segment.load
    return state
