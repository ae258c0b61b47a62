"""Harmonic balance against time integration, which shares no code of the joints with it."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.response import frequency_response
from hbsolve.state import SteadyState
from hbsolve.steady_state import steady_state
from transient.state import TransientState
from transient.steady import SteadyMotion, steady_motion

# H = 31 leaves less than 0.1 % of the fundamental of all these systems, the steps of the integration 0.03 %.
N_HARMONIC = 32
TOLERANCE = 2e-3


def integrated(case: Any, omega: float, level: float = 1.0, start: TransientState | None = None) -> SteadyMotion:
    motion = steady_motion(
        case.system, omega, start, level, tolerance=2e-5, steps_per_period=1024, max_steps_per_period=1024
    )
    assert motion.periodic, motion.message
    return motion


def balanced(case: Any, omega: float, slider: NDArray[np.float64], level: float = 1.0) -> SteadyState:
    """From the stuck state: of the integration, harmonic balance knows the sliders alone."""
    balance = HarmonicBalance(system=case.system, n_harmonic=N_HARMONIC, level=level)
    return steady_state(balance, omega, slider=slider)


def assert_same(case: Any, state: SteadyState, motion: SteadyMotion) -> None:
    mine, witness = state.coefficients[1] @ case.row, motion.coefficients(2)[1] @ case.row
    assert abs(mine - witness) < TOLERANCE * abs(witness)


def test_the_motion_from_rest_is_the_steady_state_below_at_and_above_resonance(witnessed: Any) -> None:
    balance = HarmonicBalance(system=witnessed.system, n_harmonic=8)
    branch = frequency_response(balance, witnessed.first, witnessed.last)
    peak = branch.angular_frequency[branch.amplitude(witnessed.row).argmax()]
    # Where the curve leans over, just before its folds instead: several motions are stable between them.
    for omega in (0.9 * peak, peak if single(branch.angular_frequency) else 0.95 * peak, 1.1 * peak):
        motion = integrated(witnessed, omega)
        assert_same(witnessed, balanced(witnessed, omega, motion.start.slider), motion)


def single(omega: NDArray[np.float64]) -> bool:
    return bool((np.diff(omega) > 0).all() or (np.diff(omega) < 0).all())
