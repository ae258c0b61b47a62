"""Laws in place of that of a cubic spring begin where they change the fundamental as it does."""

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.candidate.force_law import make_clearance_laws, make_even_laws, make_power_law
from hbsolve.balance import HarmonicBalance
from hbsolve.steady_state import steady_state
from reduction.jointed_system import CubicSpring, Joint, JointedSystem, PolynomialSpring

Array = NDArray[np.float64]
ROW, LARGEST = np.ones(1), 2e-3
STIFFNESS, FORCE = 1e4, 1.0


def test_a_spring_beyond_a_clearance_begins_with_the_secant_stiffness_that_is_asked_for() -> None:
    angle = 2 * np.pi * np.arange(4096) / 4096
    u = LARGEST * np.cos(angle)
    laws = make_clearance_laws("cubic at tip", ROW, 300.0, LARGEST, rotational=False)
    assert [law.sides for law in laws] == [(1.0, -1.0), (1.0,), (-1.0,)]
    for law in laws:
        stiffness, gap = law.start
        force = sum(side * stiffness * np.maximum(side * u - gap, 0.0) for side in law.sides)
        # Kinks between the instants.
        assert 2 * np.mean(force * np.cos(angle)) == pytest.approx(300.0 * LARGEST, rel=1e-6)


def response(joint: Joint, omega: float) -> complex:
    """Fundamental of one mass on a spring with a joint beside it, near its resonance at 100 rad/s."""
    force = np.zeros((2, 1), dtype=complex)
    force[1] = FORCE
    system = JointedSystem(
        mass=np.eye(1), damping=np.array([[4.0]]), stiffness=np.array([[STIFFNESS]]), joints=[joint],
        harmonic_force=force,
    )  # fmt: skip
    return complex(steady_state(HarmonicBalance(system=system, n_harmonic=6), omega).coefficients[1, 0])


@pytest.mark.parametrize("omega", [97.0, 100.0, 102.0])
def test_an_even_law_begins_as_soft_as_the_cubic_spring(omega: float) -> None:
    """To the second order in the amplitude, as in Nayfeh and Mook, Nonlinear Oscillations (1979), section 2.3."""
    cubic = -2e7
    none = response(CubicSpring(name="none", direction=ROW, stiffness=0.0), omega)
    softer = response(CubicSpring(name="cubic", direction=ROW, stiffness=cubic), omega)
    for law in make_even_laws("cubic at tip", ROW, cubic, 1 / STIFFNESS, rotational=False):
        even = response(PolynomialSpring(name="even", direction=ROW, quadratic=law.start[0]), omega)
        assert abs(even - softer) < 0.1 * abs(softer - none)


def test_a_power_law_is_distinct_from_its_own_power_and_from_a_linear_spring() -> None:
    law = make_power_law("cubic at tip", ROW, 300.0, LARGEST, 3.0, rotational=False)
    powers = (1.2, 2.0, 2.8, 3.4, 5.0)
    assert [law.is_distinct([300.0, power], [10.0, 0.1]) for power in powers] == [False, True, False, False, True]
    assert not law.is_distinct([300.0, 11.0], [10.0, 8.0])
    assert law.describe([300.0, 5.02], [10.0, 0.1]).endswith("grows with the displacement to the power 5.0 +- 0.2")
