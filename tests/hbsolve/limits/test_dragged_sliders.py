"""How far tests drag sliders: not beyond rest where nothing slips, and at least as far as integration in time does."""

from dataclasses import replace

import numpy as np
import pytest

from hbsolve.balance import HarmonicBalance
from hbsolve.limits.dragged_sliders import dragged_reach
from hbsolve.limits.objective import OutputHarmonic
from hbsolve.limits.problem import LimitProblem
from hbsolve.limits.response_limits import limit_problem
from reduction.jointed_system import JointedSystem
from transient.virtual_bench.sweep import SweptBench

FREQUENCY = 284.0 * np.linspace(0.9, 1.02, 5)
LEVELS = [3.0, 5.0]


@pytest.fixture(scope="module")
def damped(wedge: JointedSystem) -> JointedSystem:
    """The wedge damper with 2 % of damping, so that integration takes seconds."""
    return replace(wedge, damping=10 * wedge.damping)


@pytest.fixture(scope="module")
def problem(damped: JointedSystem) -> LimitProblem:
    return limit_problem(HarmonicBalance(system=damped, n_harmonic=8, n_sample=128), OutputHarmonic(row=0))


def test_without_slip_the_box_at_rest_is_enough(problem: LimitProblem) -> None:
    seen: list[tuple[float, float]] = []
    reach = dragged_reach(problem, 2 * np.pi * FREQUENCY, [1e-6], report=lambda done, total: seen.append((done, total)))
    assert reach == problem.box.reach
    # Half of the tests go up and back, the others down and back.
    n = 4 * len(FREQUENCY)
    assert seen == [(done, n) for done in range(1, n + 1)]


def test_sliders_that_stick_in_a_test_integrated_in_time_lie_in_the_box(
    damped: JointedSystem, problem: LimitProblem
) -> None:
    reach = dragged_reach(problem, 2 * np.pi * FREQUENCY, LEVELS)
    bench = SweptBench(damped, {"blade": np.eye(4)[0]}, 256)
    furthest = 0.0
    for level in LEVELS:
        for share in (-0.8, 0.8):
            stepped = bench.sweep([*FREQUENCY, *FREQUENCY[::-1]], level, np.full(4, share))
            assert stepped.periodic.all()
            # A slider that sticks stands where it was at the frequency before; those that slip have moved.
            still = np.abs(np.diff(stepped.slider, axis=0)) < 1e-3 * problem.box.reach
            still[len(FREQUENCY) - 1] = False  # the same frequency twice
            drift = np.abs(stepped.slider[1:] - problem.box.nominal)
            furthest = max(furthest, float(drift[still].max(initial=0.0)))
    assert problem.box.reach < furthest < reach
