"""Estimates of what harmonics and samples left out cost, against what a finer balance changes."""

from dataclasses import replace

import numpy as np
import pytest

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.response import joint_response
from hbsolve.state import SteadyState
from hbsolve.steady_state import steady_state
from hbsolve.truncation import truncation
from reduction.jointed_system import (
    CubicSpring,
    ElasticStop,
    Friction,
    FrictionContact,
    JenkinsElement,
    Joint,
    JointedSystem,
)

ONE = np.ones(1)


def oscillator(*joints: Joint, force: float = 1.0) -> JointedSystem:
    return JointedSystem(
        mass=[[1.0]], damping=[[0.05]], stiffness=[[1.0]], joints=joints, harmonic_force=[[0.0], [force]]
    )


def rubbing() -> JointedSystem:
    """Two masses on a contact that slips and lifts off."""
    contact = FrictionContact(
        name="pad",
        normal=np.array([0.0, 0.0, 1.0]),
        tangents=np.eye(3)[:2],
        normal_stiffness=2.0,
        tangential_stiffness=1.0,
        friction_coefficient=0.4,
        preload=0.3,
        friction=Friction.COULOMB,
    )
    force = np.zeros((2, 3), dtype=complex)
    force[1] = [0.4, 0.3j, 0.35]
    return JointedSystem(
        mass=np.eye(3), damping=0.1 * np.eye(3), stiffness=np.diag([1.0, 1.3, 0.8]), joints=[contact],
        static_load=np.array([0.0, 0.0, 0.3]), harmonic_force=force,
    )  # fmt: skip


CUBIC = CubicSpring(name="cubic", direction=ONE, stiffness=0.2)
SLIDER = JenkinsElement(name="slider", direction=ONE, tangential_stiffness=0.5, limit_force=1.0)
STOP = ElasticStop(name="stop", direction=ONE, stiffness=2.0, gap=0.5)
SYSTEMS = {
    "cubic": (oscillator(CUBIC, force=5.0), 0.7),
    "slider": (oscillator(SLIDER, force=2.0), 0.9),
    "stop": (oscillator(STOP), 0.9),
    "pad": (rubbing(), 1.1),
}


def change(state: SteadyState, finer: SteadyState) -> float:
    """Relative change of the fundamental of the joint directions."""
    before, after = state.displacement[1], finer.displacement[1]
    return float(np.linalg.norm(after - before) / np.linalg.norm(before))


#: Of the estimate against the change: it is one Newton step, from which contacts change their states on the way, and
#: what it sees are harmonics to 2 H + 1, four more than H = 3 and fewer than all.
FACTOR = 2.0


@pytest.mark.parametrize("system", SYSTEMS)
@pytest.mark.parametrize("highest", [3, 5, 7])
def test_the_estimate_for_harmonics_is_what_four_more_change(system: str, highest: int) -> None:
    of, omega = SYSTEMS[system]
    balance = HarmonicBalance(system=of, n_harmonic=highest + 1, n_sample=4096)
    state = steady_state(balance, omega)
    four_more = balance.with_harmonics(highest + 5, 4096)
    observed = change(state, steady_state(four_more, omega))
    estimated = truncation(balance, state).harmonics
    assert observed > 1e-8  # more than two residuals
    assert observed / FACTOR < estimated < observed * FACTOR


@pytest.mark.parametrize("system", ["slider", "stop", "pad"])
@pytest.mark.parametrize("n_sample", [32, 64, 128])
def test_the_estimate_for_samples_is_what_twice_as_many_change(system: str, n_sample: int) -> None:
    of, omega = SYSTEMS[system]
    balance = HarmonicBalance(system=of, n_harmonic=5, n_sample=n_sample)
    state = steady_state(balance, omega)
    observed = change(state, steady_state(balance.with_samples(2 * n_sample), omega, start=state))
    # One Newton step is nearly all of it: the square of a change of some thousandths is left.
    np.testing.assert_allclose(truncation(balance, state).samples, observed, rtol=1e-2)


def test_a_polynomial_needs_no_more_samples() -> None:
    """A cube of harmonics to H has 3 H: 4 H + 1 samples hold what of it falls on 0 to H."""
    balance = HarmonicBalance(system=oscillator(CUBIC), n_harmonic=4, n_sample=13)
    assert truncation(balance, steady_state(balance, 0.7)).samples < 1e-8  # ten residuals


@pytest.mark.parametrize("joint", [replace(SLIDER, limit_force=100.0), replace(STOP, gap=100.0)])
def test_joints_that_stay_linear_need_no_more_of_either(joint: Joint) -> None:
    balance = HarmonicBalance(system=oscillator(joint), n_harmonic=2)
    errors = truncation(balance, steady_state(balance, 0.7))
    assert max(errors.harmonics, errors.samples) < 1e-8  # ten residuals


def test_a_structure_without_joints_or_without_motion_has_no_error() -> None:
    for system in (oscillator(), oscillator(SLIDER, force=0.0)):
        balance = HarmonicBalance(system=system, n_harmonic=2)
        errors = truncation(balance, steady_state(balance, 0.7))
        assert (errors.harmonics, errors.samples) == (0.0, 0.0)


def test_the_level_of_the_state_counts() -> None:
    balance = HarmonicBalance(system=oscillator(SLIDER), n_harmonic=4)
    state = steady_state(balance.at_level(2.0), 0.8)
    at_level = truncation(balance.at_level(2.0), state)
    np.testing.assert_array_equal(truncation(balance, state).change, at_level.change)


def test_the_mean_alone_of_a_static_load_is_exact() -> None:
    """k u + c u^3 = F, at any number of harmonics and samples."""
    spring = CubicSpring(name="cubic", direction=np.ones(1), stiffness=1e9)
    system = JointedSystem(mass=[[1.0]], damping=[[5.0]], stiffness=[[1e4]], joints=[spring], static_load=[50.0])
    balance = HarmonicBalance(system=system, n_harmonic=1)
    errors = truncation(balance, steady_state(balance, 50.0))
    assert max(errors.harmonics, errors.samples) < 1e-8  # ten residuals
    branch = joint_response(balance, 50.0, "cubic", "stiffness", 1e9, 1e8)
    u = branch.coefficients[:, 0, 0].real
    np.testing.assert_allclose(1e4 * u[[0, -1]] + [1e9, 1e8] * u[[0, -1]] ** 3, 50.0, rtol=1e-8)
    assert branch.truncation_error.max() < 1e-8
