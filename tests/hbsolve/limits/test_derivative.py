"""What a state answers its sliders, against differences."""

from dataclasses import replace

import numpy as np
import pytest

from hbsolve.balance import HarmonicBalance
from hbsolve.energy import energy_balance
from hbsolve.limits.local_search import compute_slider_derivative
from hbsolve.limits.loss_factor import LossFactor
from hbsolve.limits.objective import ContactForceHarmonic, Objective, OutputHarmonic
from hbsolve.limits.point import LimitPoint, TrialState
from hbsolve.limits.response_limits import limit_problem
from hbsolve.solution import forces_at
from hbsolve.steady_state import steady_state
from reduction.jointed_system import FrictionContact, JointedSystem

LEVEL, SHARE = 0.6, 0.97
OBJECTIVES = [
    OutputHarmonic(row=0),
    OutputHarmonic(row=np.array([0.3, 1.0, 0.0, -2.0]), harmonic=2),
    OutputHarmonic(row=1, harmonic=0),
    ContactForceHarmonic(joints=["blade 1", "ground 2"], direction=0, harmonic=0),
    ContactForceHarmonic(joints=["ground 1"], direction=-1, harmonic=1),
    LossFactor(),
]


def partly_sliding(system: JointedSystem, objective: Objective) -> tuple[LimitPoint, TrialState]:
    """A state in which some sliders stick, well inside their intervals, while others slip or lift off."""
    balance = HarmonicBalance(system=system, n_harmonic=4, n_sample=128)
    problem = limit_problem(balance, objective, reach=1e-5)
    point = problem.at(2 * np.pi * 284.0 * SHARE, LEVEL)
    random = np.random.default_rng(3)
    for _ in range(40):
        start = point.from_rest(random.uniform(-1e-5, 1e-5, 4))
        trial = start and point.settle(start.motion, start.initial_slider)
        if trial is None or not 0 < len(trial.undetermined) < 4:
            continue
        w, margin = trial.initial_slider.copy(), 0.2 * (trial.intervals.high - trial.intervals.low)
        w[trial.undetermined] = np.clip(w, trial.intervals.low + margin, trial.intervals.high - margin)[
            trial.undetermined
        ]
        inside = point.solve(trial.motion, w)
        if inside is not None and 0 < len(inside.undetermined) < 4 and not inside.outside_interval.any():
            return point, inside
    raise AssertionError("no state sticks in part")


@pytest.mark.parametrize("objective", OBJECTIVES, ids=lambda each: f"{type(each).__name__} {vars(each)}"[:60])
def test_gradient_and_intervals_are_those_of_differences(wedge: JointedSystem, objective: Objective) -> None:
    point, trial = partly_sliding(wedge, objective)
    derivative = compute_slider_derivative(point, trial)
    # 1e-4 of an interval, far from the next instant that could set it.
    step = 1e-10
    for number, slider in enumerate(derivative.undetermined):
        either = []
        for sign in (1, -1):
            w = trial.initial_slider.copy()
            w[slider] += sign * step
            moved = point.solve(trial.motion, w)
            assert moved is not None
            either.append(moved)
        ahead, back = either
        free = derivative.undetermined
        by_differences = (ahead.value - back.value) / (2 * step)
        # Newton's tolerance of 1e-9 over the step's effect, of some 1e-5 of the motion.
        scale = max(np.abs(derivative.gradient).max(), 1e-300)
        assert derivative.gradient[number] == pytest.approx(by_differences, abs=1e-3 * scale)
        low = (ahead.intervals.low - back.intervals.low)[free] / (2 * step)
        high = (ahead.intervals.high - back.intervals.high)[free] / (2 * step)
        np.testing.assert_allclose(derivative.low[:, number], low, atol=1e-3)
        np.testing.assert_allclose(derivative.high[:, number], high, atol=1e-3)


@pytest.mark.parametrize("gap", [-0.2, 0.1, 0.5], ids=["closed at rest", "open at rest", "mostly open"])
def test_the_loss_factor_of_a_bouncing_contact_is_that_of_the_energies_and_its_slopes_are_differences(
    gap: float,
) -> None:
    contact = FrictionContact(
        name="c", normal=np.array([0.0, 1.0]), tangents=np.array([1.0, 0.0]), normal_stiffness=2.0,
        tangential_stiffness=1.0, friction_coefficient=0.0, gap=gap,
    )  # fmt: skip
    system = JointedSystem(
        mass=np.eye(2), damping=0.1 * np.eye(2), stiffness=np.eye(2), joints=[contact],
        harmonic_force=[[0, 0], [0.3, 0.8]],
    )  # fmt: skip
    for joint in (contact, replace(contact, friction_coefficient=0.3)):
        balance = HarmonicBalance(system=replace(system, joints=[joint]), n_harmonic=8, n_sample=256)
        state = steady_state(balance, 1.3)
        condensed, x = balance.at(1.3), state.motion
        g = forces_at(balance, 1.3, x, state.sliders).coefficients
        measure = LossFactor().measure(balance, condensed)
        # Without friction only the coefficients of g that are kept work, and the normal spring is sampled.
        exact = energy_balance(balance, state).loss_factor
        assert measure.value(1.0, x, g) == pytest.approx(exact, rel=1e-9 if joint is contact else 0.02)
        by_x, by_g = measure.slopes(1.0, x, g)
        step = 1e-6
        for index in np.ndindex(x.shape):
            unit = np.zeros_like(x)
            unit[index] = step
            for slope, ahead, back in (
                (by_x, measure.value(1.0, x + unit, g), measure.value(1.0, x - unit, g)),
                (by_g, measure.value(1.0, x, g + unit), measure.value(1.0, x, g - unit)),
            ):
                # Round-off over the step.
                assert slope[index] == pytest.approx((ahead - back) / (2 * step), abs=1e-6 * np.abs(slope).max())
