"""How far tests drag sliders: not beyond rest where nothing slips, and at least as far as integration in time does."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.family_coverage import frequencies, random_model
from hbsolve.balance import HarmonicBalance
from hbsolve.limits.objective import OutputHarmonic
from hbsolve.limits.problem import LimitProblem
from hbsolve.limits.response_limits import limit_problem
from hbsolve.limits.search import LimitSettings
from hbsolve.limits.several_limits import several_limits
from hbsolve.limits.vibration_bounds import MARGIN, compute_vibration_bounds
from reduction.jointed_system import JointedSystem
from tests.slow import slow
from transient.virtual_bench.sweep import VirtualSweepTest

FREQUENCY = 284.0 * np.linspace(0.9, 1.02, 5)
LEVELS = [3.0, 5.0]
QUICK = LimitSettings(population=8, sample=16, perturbations=1)


@pytest.fixture(scope="module")
def damped(wedge: JointedSystem) -> JointedSystem:
    """The wedge damper with 2 % of damping, so that integration takes seconds."""
    return replace(wedge, damping=10 * wedge.damping)


@pytest.fixture(scope="module")
def problem(damped: JointedSystem) -> LimitProblem:
    """With the box of the states at rest."""
    balance = HarmonicBalance(system=damped, n_harmonic=8, n_sample=128)
    rest = limit_problem(balance, OutputHarmonic(row=0)).box
    return limit_problem(balance, OutputHarmonic(row=0), nominal=rest.middle, reach=rest.static)


@pytest.fixture(scope="module")
def variant(damped: JointedSystem) -> JointedSystem:
    """Another wedge damper, whose first line is dragged slowly near resonance."""
    values = [(1.4254, 0.429), (1.4637, 0.2783), (1.0897, 0.3818), (1.2732, 0.3111)]
    joints = [
        joint.with_values(
            {"tangential_stiffness": item[0] * joint.tangential_stiffness, "friction_coefficient": item[1]}
        )
        for joint, item in zip(damped.joints, values, strict=True)
    ]
    return replace(damped, joints=joints, static_load=damped.static * np.array([1, 1, 1, 1.0845]))


def test_without_slip_the_box_at_rest_is_enough(problem: LimitProblem) -> None:
    seen: list[tuple[float, float]] = []
    reach = compute_vibration_bounds(
        problem, 2 * np.pi * FREQUENCY, [1e-6], report=lambda done, total: seen.append((done, total))
    )
    np.testing.assert_array_equal(reach, [problem.box.reach])
    # Tests at the level and at its overshoot go up and back, or down and back, in whole and in quarter steps.
    n = 2 * 4 * (len(FREQUENCY) + 4 * (len(FREQUENCY) - 1) + 1)
    assert seen == [(done, n) for done in range(1, n + 1)]


@slow
def test_sliders_that_stick_in_a_test_integrated_in_time_lie_in_the_box_of_its_level(
    damped: JointedSystem, problem: LimitProblem
) -> None:
    reach = compute_vibration_bounds(problem, 2 * np.pi * FREQUENCY, LEVELS)
    bench = VirtualSweepTest(damped, {"blade": np.eye(4)[0]}, 256)
    further = False
    for level, own in zip(LEVELS, reach, strict=True):
        for share in (-0.8, 0.8):
            stepped = bench.sweep([*FREQUENCY, *FREQUENCY[::-1]], level, np.full(4, share))
            assert stepped.periodic.all()
            # A slider that sticks stands where it was at the frequency before; those that slip have moved.
            still = np.abs(np.diff(stepped.slider, axis=0)) < 1e-3 * problem.box.reach
            still[len(FREQUENCY) - 1] = False  # the same frequency twice
            drift = np.where(still, np.abs(stepped.slider[1:] - problem.box.nominal), 0.0)
            assert (drift < own).all()
            further |= bool((drift > problem.box.reach).any())
    assert further


@slow
def test_a_load_that_begins_at_once_drags_no_slider_out_of_the_box(variant: JointedSystem) -> None:
    balance, levels = HarmonicBalance(system=variant, n_harmonic=8, n_sample=128), [0.7, 1.0]
    rest = limit_problem(balance, OutputHarmonic(row=0)).box
    problem = limit_problem(balance, OutputHarmonic(row=0), nominal=rest.middle, reach=rest.static)
    reach = compute_vibration_bounds(problem, 2 * np.pi * FREQUENCY, levels)
    bench = VirtualSweepTest(variant, {"blade": np.eye(4)[0]}, 256)
    further = 0
    for level, own in zip(levels, reach, strict=True):
        for share in (-0.9, -0.5, 0.0, 0.5, 0.9):
            for frequency in FREQUENCY:
                # Half a per cent further a slider that slips has moved; one that sticks stands where the begin left it.
                begun = bench.sweep([float(frequency), 1.005 * float(frequency)], level, np.full(4, share))
                still = np.abs(np.diff(begun.slider, axis=0)[0]) < 1e-3 * rest.static
                drift = np.where(still, np.abs(begun.slider[1] - rest.middle), 0.0)
                # Without the overshoot 5 of 50 lie outside.
                assert (drift < own).all()
                further += bool((drift > rest.static).any())
    assert further > 10


def test_what_one_level_drags_does_not_count_at_another(problem: LimitProblem) -> None:
    levels = [1.0, 1.5]
    both = compute_vibration_bounds(problem, 2 * np.pi * FREQUENCY, levels)
    alone = compute_vibration_bounds(problem, 2 * np.pi * FREQUENCY, levels[:1])
    np.testing.assert_array_equal(both[0], alone[0])
    assert (both[1] != both[0]).any()
    # Contacts of one line move together.
    line = problem.sliders.line
    excess = both - problem.box.reach
    for number in range(int(line.max()) + 1):
        np.testing.assert_allclose(np.ptp(excess[:, line == number], axis=1), 0.0, atol=1e-18)


@slow
def test_histories_integrated_in_time_stay_inside_limits_that_are_narrower_than_those_of_one_reach(
    variant: JointedSystem,
) -> None:
    # Long steps of frequency alone end on a branch that drags the first line less: in a box of what they reach the
    # lower limit is 10 % too high.
    balance, output = HarmonicBalance(system=variant, n_harmonic=8, n_sample=128), OutputHarmonic(row=0)
    frequency, levels = 284.0 * np.linspace(0.9, 1.02, 9), [1.0]
    rest = limit_problem(balance, output).box
    still = limit_problem(balance, output, nominal=rest.middle, reach=rest.static)
    reach = compute_vibration_bounds(still, 2 * np.pi * frequency, levels)
    excess = (reach - rest.static).max() / MARGIN
    widths = []
    for item in (reach[0], float(2 * rest.radius.max() + MARGIN * excess)):
        problem = limit_problem(balance, output, nominal=rest.middle, reach=item)
        limits = several_limits(problem, {"blade": output}, 2 * np.pi * frequency, levels, settings=QUICK)["blade"]
        widths.append(limits.upper[0] - limits.lower[0])
        if len(widths) == 1:
            own = limits
    bench = VirtualSweepTest(variant, {"blade": np.eye(4)[0]}, 256)
    random = np.random.default_rng(4)
    for _ in range(3):
        swept = bench.sweep([*frequency, *frequency[::-1]], levels[0], random.uniform(-1, 1, 4))
        assert swept.periodic.all()
        amplitude = np.abs(swept.motion[:, 0, 0]).reshape(2, -1)
        for curve in (amplitude[0], amplitude[1, ::-1]):
            # Seven harmonics and 256 steps a period agree to half a percent.
            assert (own.lower[0] * 0.995 < curve).all()
            assert (curve < own.upper[0] * 1.005).all()
    assert (widths[0] <= widths[1] + 1e-3 * own.upper[0]).all()  # what two searches leave
    assert widths[0].sum() < 0.98 * widths[1].sum()


def test_the_steps_of_the_laboratory_drag_sliders_as_integration_in_time_does() -> None:
    # Beyond its resonance the motion sticks, with sliders left as the last frequency at which they slip has them.
    model = random_model(10829)
    assert model is not None
    balance = HarmonicBalance(system=model.system, n_harmonic=model.n_harmonic, n_sample=model.n_sample)
    rest = limit_problem(balance, OutputHarmonic(row=0)).box
    problem = limit_problem(balance, OutputHarmonic(row=0), nominal=rest.middle, reach=rest.static)
    measured = frequencies(model)
    finer = np.interp(np.arange(11) / 2, np.arange(6), measured)
    (reach,) = compute_vibration_bounds(problem, 2 * np.pi * finer, [0.3], stops=[range(0, 11, 2)])
    (by_half_steps,) = compute_vibration_bounds(problem, 2 * np.pi * finer, [0.3])
    stepped = VirtualSweepTest(model.system, {"near": np.eye(6)[0]}, 256).sweep(list(measured), 0.3)
    # A slider that sticks stands where it was at the frequency before.
    still = np.abs(stepped.slider[-1] - stepped.slider[-2]) < 1e-3 * rest.static
    drift = np.abs(stepped.slider[-1] - rest.middle)
    assert (drift > by_half_steps)[still].any()
    assert (drift < reach)[still].all()
