"""What the harmonics left out and the number of samples cost: one Newton step of a finer balance."""

from dataclasses import dataclass

import numpy as np

from hbsolve.balance import HarmonicBalance
from hbsolve.newton import newton_step
from hbsolve.solution import forces_at, residual
from hbsolve.state import SteadyState, check_state


@dataclass(frozen=True, kw_only=True)
class Truncation:
    """Estimated relative errors of the fundamental of the joint directions."""

    harmonics: float
    """Change by harmonics H + 1 to 2 H + 1 on the same samples (more where those are too few for them) [-]."""
    samples: float
    """Change by twice the samples [-]. The error itself is some 4/3 of it, since the laws are of second order in the
    distance of the samples, and up to twice as large where a contact lands between two samples and sticks at once."""


def truncation(balance: HarmonicBalance, state: SteadyState) -> Truncation:
    """Estimate both errors of a state; zero where there are no joints.

    The state is put into a balance with more harmonics, or more samples, and the first Newton step there is what the
    finer balance would change. It is an estimate: contacts may change their state on the way.

    Raises
    ------
    BalanceError
        A state of another balance.
    """
    check_state(balance, state)
    if not balance.n_direction or not np.linalg.norm(state.motion):  # nothing moves, as far as squares show
        return Truncation(harmonics=0.0, samples=0.0)
    at_level = balance.at_level(state.level)
    n_harmonic = 2 * balance.n_harmonic
    more = at_level.with_harmonics(n_harmonic, max(balance.n_sample, 4 * n_harmonic))
    samples = _first_step(at_level.with_samples(2 * balance.n_sample), state)
    return Truncation(harmonics=_first_step(more, state), samples=samples)


def _first_step(balance: HarmonicBalance, state: SteadyState) -> float:
    """Relative change of the fundamental in the first Newton step from a state."""
    x = np.zeros((balance.n_direction, 2 * balance.n_harmonic - 1))
    motion = state.motion
    x[:, : motion.shape[1]] = motion
    condensed = balance.at(state.angular_frequency)
    forces = forces_at(balance, state.angular_frequency, x, state.start)
    first, count = balance.joint_of_direction
    R = residual(balance, condensed, x, forces)
    step = newton_step(forces, condensed.receptance, first, count, R, 0.0)
    size = float(np.linalg.norm(motion[:, 1:3])) or float(np.linalg.norm(motion))
    return float(np.linalg.norm(step[:, 1:3])) / size
