"""The interval in which a slider sticks, and what has none."""

import numpy as np
import pytest

from hbsolve.aft import InitialSliders
from hbsolve.balance import HarmonicBalance
from hbsolve.errors import BalanceError
from hbsolve.joint_law.registry import FORCE
from hbsolve.limits.sliders import compute_stick_intervals, make_slider_table, multipliers
from hbsolve.solution import forces_at
from reduction.jointed_system import CubicSpring, Friction, FrictionContact, JenkinsElement, JointedSystem

OMEGA = 50.0


def system_of(*joints: FrictionContact | JenkinsElement | CubicSpring) -> HarmonicBalance:
    three = np.eye(3)
    system = JointedSystem(mass=three, damping=three, stiffness=1e4 * three, joints=joints, static_load=[0, 0, 5.0])
    return HarmonicBalance(system=system, n_harmonic=3, n_sample=64)


def contact(friction: Friction) -> FrictionContact:
    rows = np.eye(3)
    return FrictionContact(
        name="pad 1",
        tangents=rows[:2],
        normal=rows[2],
        normal_stiffness=3e4,
        tangential_stiffness=2e4,
        friction_coefficient=0.4,
        preload=3.0,
        friction=friction,
    )


@pytest.mark.parametrize("seed", range(6))
def test_a_slider_inside_its_interval_stays_and_one_outside_is_dragged_to_its_end(seed: int) -> None:
    rub = JenkinsElement(name="rub", direction=np.array([1.0, 0, 1.0]), tangential_stiffness=1e4, limit_force=2.0)
    balance = system_of(contact(Friction.UNCOUPLED), rub)
    table, evaluate = make_slider_table(balance), balance.sampling.evaluate
    random = np.random.default_rng(seed)
    x = random.normal(size=(4, 5)) * [1e-5, 2e-5, 2e-5, 1e-5, 1e-5]
    intervals = compute_stick_intervals(x, table, evaluate)
    sticks = intervals.low <= intervals.high
    for start in (0.5 * (intervals.low + intervals.high), intervals.low - 1e-5, intervals.high + 1e-5):
        sliders = InitialSliders(start, np.zeros(3, dtype=np.int64))
        followed = forces_at(balance, OMEGA, x, sliders, FORCE).slider
        expected = np.clip(start, intervals.low, intervals.high)
        # The same numbers in another order of operations.
        np.testing.assert_allclose(followed[sticks], np.tile(expected[sticks][:, None], (1, 64)), atol=1e-18)
        m = multipliers(table, x, followed[:, -1], evaluate)
        assert (np.abs(m) <= 1).all()


def test_coupled_tangents_are_refused() -> None:
    with pytest.raises(BalanceError, match='"pad 1" has one Coulomb limit'):
        make_slider_table(system_of(contact(Friction.COULOMB)))


def test_a_system_without_sliders_is_refused() -> None:
    spring = CubicSpring(name="cubic", direction=np.array([1.0, 0, 0]), stiffness=1.0)
    with pytest.raises(BalanceError, match="no sliders"):
        make_slider_table(system_of(spring))
