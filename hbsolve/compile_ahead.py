"""Compile the solver and the most common laws in advance, so that the first result does not wait for them."""

import numpy as np

from hbsolve.balance import HarmonicBalance
from hbsolve.contact_motion import contact_motion
from hbsolve.continuation.response import frequency_response
from hbsolve.solution import MAX_ITERATION
from hbsolve.stability.stability import stability
from hbsolve.state_sequence import follow_one
from hbsolve.steady_state import steady_state
from reduction.jointed_system import CubicSpring, FrictionContact, JointedSystem


def compile_kernels() -> None:
    """Solve a small system with friction and a cubic spring; the machine code is stored on disk.

    Other laws are compiled in seconds when they are first used.
    """
    rub = FrictionContact(
        name="rub",
        normal=np.array([0.0, 1.0]),
        tangents=np.array([1.0, 0.0]),
        normal_stiffness=1.0,
        tangential_stiffness=1.0,
        friction_coefficient=0.3,
        preload=1.0,
    )
    system = JointedSystem(
        mass=np.eye(2),
        damping=0.1 * np.eye(2),
        stiffness=np.eye(2),
        joints=[rub, CubicSpring(name="cubic", direction=np.array([1.0, 0.0]), stiffness=0.1)],
        static_load=np.array([0.0, 1.0]),
        harmonic_force=np.array([[0.0, 0.0], [1.0, 0.0]]),
    )
    balance = HarmonicBalance(system=system, n_harmonic=4)
    state = steady_state(balance, 0.7)
    contact_motion(balance, state)
    stability(balance, state)
    frequency_response(balance, 0.7, 0.8)
    condensed = balance.at(0.7)
    follow_one(balance, condensed, state.initial_slider, balance.linear(condensed), MAX_ITERATION)


if __name__ == "__main__":
    compile_kernels()
