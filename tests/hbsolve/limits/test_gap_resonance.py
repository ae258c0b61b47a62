"""Where the upper limit has its resonance, beside gaps that vibration closes and a contact that it makes slip.

A mass on a spring and on a preloaded friction contact lies between two contacts with gaps, closed by turns. With one
harmonic their stiffness is a describing function of the amplitude A; g is the gap, r = g / A <= 1,

    k(A) = k_n (1 - (2 / pi) (asin r + r sqrt(1 - r^2)))

and at the top of the resonance damping alone balances the force: A = F / (c omega).
"""

import numpy as np
import pytest

from hbsolve.balance import HarmonicBalance
from hbsolve.limits.objective import OutputHarmonic
from hbsolve.limits.response_limits import limit_problem, response_limits
from hbsolve.limits.search import LimitSettings
from reduction.jointed_system import FrictionContact, JointedSystem, along
from tests.slow import slow

SPRING, TANGENTIAL, NORMAL, DAMPING, GAP = 0.7, 0.3, 0.21, 0.02, 1.0
OPEN, CLOSED = np.sqrt(SPRING + TANGENTIAL), np.sqrt(SPRING + TANGENTIAL + NORMAL)
STEP = 0.004
OMEGA = np.arange(0.948, 1.112, STEP)
LEVELS = [0.01, 0.04, 0.3]
X, ACROSS = along(2, {0: 1.0}), along(2, {1: 1.0})


def between_gaps(friction_limit: float) -> HarmonicBalance:
    """The mass, whose friction contact slips at that force."""
    common = {"normal_stiffness": NORMAL, "tangential_stiffness": TANGENTIAL}
    pressed = FrictionContact(
        name="pressed", normal=ACROSS, tangents=X[None], friction_coefficient=0.5, preload=2 * friction_limit, **common
    )
    stops = [
        FrictionContact(
            name=name, normal=sign * X, tangents=ACROSS[None], friction_coefficient=0.5, gap=GAP, **common
        )
        for name, sign in (("ahead", 1.0), ("behind", -1.0))
    ]  # fmt: skip
    system = JointedSystem(
        mass=np.eye(2),
        damping=DAMPING * np.eye(2),
        stiffness=np.diag([SPRING, 10.0]),
        joints=[pressed, *stops],
        static_load=2 * friction_limit * ACROSS,
        harmonic_force=np.array([0 * X, X], dtype=np.complex128),
    )
    return HarmonicBalance(system=system, n_harmonic=2, n_sample=128)


def tops(friction_limit: float) -> tuple[np.ndarray, np.ndarray]:
    """Angular frequency and height of the upper limit's highest point at each level."""
    problem = limit_problem(between_gaps(friction_limit), OutputHarmonic(row=0))
    result = response_limits(problem, OMEGA, LEVELS, settings=LimitSettings(population=2, sample=0))
    return result.angular_frequency[result.upper.argmax(axis=1)], result.upper.max(axis=1)


def backbone(level: float) -> tuple[float, float]:
    """Angular frequency and amplitude at the top, all friction stuck."""
    omega = OPEN
    for _ in range(200):
        amplitude = level / (DAMPING * omega)
        r = min(GAP / amplitude, 1.0)
        stop = NORMAL * (1 - 2 / np.pi * (np.arcsin(r) + r * np.sqrt(1 - r * r)))
        omega = np.sqrt(SPRING + TANGENTIAL + stop)
    return float(omega), float(amplitude)


@slow
def test_resonance_drops_with_open_gaps_and_comes_back_with_level() -> None:
    # Slips beyond 60 gaps: never.
    frequency, height = tops(60 * GAP * TANGENTIAL)
    omega, amplitude = np.array([backbone(level) for level in LEVELS]).T
    # The top lies on a grid, and half a step beside it the amplitude is 2 % less.
    np.testing.assert_allclose(frequency, omega, atol=STEP)
    np.testing.assert_allclose(height, amplitude, rtol=0.03)
    # Gaps stay open at the first level; at the last they are a fifteenth of the amplitude.
    assert frequency[0] == pytest.approx(OPEN, abs=STEP)
    assert frequency[2] == pytest.approx(CLOSED, abs=0.01)
    assert OPEN + 4 * STEP < frequency[1] < CLOSED - 4 * STEP


def test_resonance_does_not_come_back_where_slip_is_first() -> None:
    # Slips at half the gap.
    frequency, _ = tops(0.5 * GAP * TANGENTIAL)
    assert frequency[0] == pytest.approx(OPEN, abs=STEP)
    assert frequency[1] < OPEN - 2 * STEP
    # All stops closed, and no friction spring: the lowest frequency on the grid is a little below.
    assert frequency[2] < OPEN
