"""What every registered joint law must pass: exact derivatives, agreement with time integration, refusal of bad input.

A test that takes the fixture `law` runs for each law of the product; `tests/extension/test_joint_law.py` runs the same
for laws from outside.
"""

from collections.abc import Callable, Iterator
from itertools import product
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from hbsolve.aft import InitialSliders, JointForces, joint_forces
from hbsolve.balance import HarmonicBalance
from hbsolve.energy import energy_balance
from hbsolve.joint_arrays import instant_force, make_joint_table, make_slope_table, step_slopes
from hbsolve.joint_law.registry import PARAMETERS
from hbsolve.sampling import sampling
from hbsolve.steady_state import steady_state
from reduction.errors import ExchangeError, JointError
from reduction.joint_law.registry import LAWS, Joint
from reduction.jointed_system import JointedSystem
from reduction.pyharm import make_pyharm_input
from tests.slow import slow
from transient.steady import steady_motion

N_HARMONIC, N_SAMPLE, OMEGA = 4, 128, 300.0
#: Step of the differences as a share of each quantity, and the relative error allowed: round-off over the step is some
#: 1e-10. Differences of fourth order leave the fourth power of the step, so that its size does not count.
STEP, TOLERANCE = 2e-6, 1e-9
#: Weights of the force at multiples of the step.
FOURTH = {1: 2 / 3, -1: -2 / 3, 2: -1 / 12, -2: 1 / 12}
#: Periods after which changes of sliders repeat.
PERIODS = 20
#: Numbers of a list over the typical one.
THIRDS = np.array([1.0, 0.7, 0.4])


@pytest.fixture(params=LAWS.names())
def law(request: pytest.FixtureRequest) -> type[Joint]:
    return LAWS[request.param]


def typical(law: type[Joint]) -> dict[str, Any]:
    """Typical parameters; lists of three, the first of which is the typical one."""
    return {item.name: (item.typical * THIRDS).tolist() if item.is_list else item.typical for item in law.parameters}


def variants(law: type[Joint]) -> Iterator[Joint]:
    """A joint for each choice of its places and options, with typical parameters."""
    optional = [place for place, needed in law.places.items() if not needed]
    for count in range(len(optional) + 1):
        left_out = set(optional[count:])
        places = [place for place in law.places if place not in left_out]
        # Tangents first: so are the rows of `directions`, and each direction is a degree of freedom of its own.
        rows = dict(zip(sorted(places, key=lambda place: place == "normal"), np.eye(len(places)), strict=True))
        for choice in product(*(item.choices for item in law.options)):
            chosen = dict(zip((item.name for item in law.options), choice, strict=True))
            yield law.build("joint", rows, typical(law) | chosen)


def motion(joint: Joint, seed: int) -> NDArray[np.float64]:
    d, nh = len(joint.directions), 2 * N_HARMONIC - 1
    return np.random.default_rng(seed).normal(size=(d, nh)) * joint.typical_displacement / 2


def evaluated(
    x: NDArray[np.float64], joint: Joint, start: NDArray[np.float64], values: NDArray[np.float64] | None = None,
    omega: float = OMEGA, want: int = 0,
) -> JointForces:  # fmt: skip
    table = make_joint_table([joint])
    if values is not None:
        table = table._replace(value=values)
    flags = np.zeros(len(start), dtype=np.int64)
    forces: JointForces = joint_forces(
        x, omega, table, InitialSliders(start, flags), sampling(N_HARMONIC, N_SAMPLE), want
    )
    return forces


def check_column(exact: NDArray[np.float64], at: Callable[[float], JointForces], step: float) -> None:
    """Compare a derivative with differences of the coefficients over a shift."""
    forces = {times: at(times * step).coefficients for times in FOURTH}
    difference = sum(weight * forces[times] for times, weight in FOURTH.items()) / step
    round_off = 1e-15 * np.abs(forces[1]).max() / step
    np.testing.assert_allclose(exact, difference, rtol=0, atol=TOLERANCE * np.abs(difference).max() + round_off)


def check_derivatives(joint: Joint, seed: int) -> None:
    """Compare every derivative of a joint in a random motion."""
    x, table = motion(joint, seed), make_joint_table([joint])
    scale = joint.typical_displacement
    begin = np.random.default_rng(seed).uniform(-0.1, 0.1, joint.n_slider) * scale
    exact = evaluated(x, joint, begin, want=PARAMETERS)
    d, nh = x.shape
    jacobian = exact.jacobian.reshape(d, nh, 3, nh)
    for row, column in np.ndindex(x.shape):
        unit = np.zeros_like(x)
        unit[row, column] = 1.0
        check_column(
            jacobian[:, :, row, column], lambda by, unit=unit: evaluated(x + by * unit, joint, begin), STEP * scale
        )
    for number, value in enumerate(table.value):
        unit = np.eye(len(table.value))[number]
        check_column(
            exact.by_parameter[number, :d],
            lambda by, unit=unit: evaluated(x, joint, begin, table.value + by * unit),
            STEP * (abs(value) or scale),
        )
    for number in range(joint.n_slider):
        unit = np.eye(joint.n_slider)[number]
        check_column(
            exact.by_start[number, :d], lambda by, unit=unit: evaluated(x, joint, begin + by * unit), STEP * scale
        )
    check_column(exact.by_frequency, lambda by: evaluated(x, joint, begin, omega=OMEGA + by), STEP * OMEGA)


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=slow) for seed in (1, 2))])
def test_derivatives_equal_differences(law: type[Joint], seed: int) -> None:
    for joint in variants(law):
        check_derivatives(joint, seed)


def slopes_of_steps(joint: Joint, x: NDArray[np.float64], slider: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Of each step of a period to the next instant, as `hbsolve.joint_law.registry.CompiledLaw.step_slopes`."""
    table, laws, samples = make_joint_table([joint]), make_slope_table([joint]), sampling(N_HARMONIC, N_SAMPLE)
    u, velocity, d = x @ samples.evaluate, OMEGA * x @ samples.differentiate, len(x)
    result = []
    for k in range(N_SAMPLE):
        out = np.zeros((d + joint.n_slider, 3 * d + joint.n_slider))
        if laws.has_memory[0]:
            before = [np.ascontiguousarray(values[:, k - 1]) for values in (u, slider)]
            after = [np.ascontiguousarray(values[:, k]) for values in (u, velocity)]
            step_slopes(laws.kind[0], table.address[0], before[0], *after, before[1], table.value, out)
        else:
            slope = np.zeros(2 + len(table.value))
            instant_force(laws.kind[0], table.address[0], u[0, k], velocity[0, k], table.value, slope)
            out[0, :2] = slope[:2]
        result.append(out)
    return result


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=slow) for seed in (1, 2))])
def test_slopes_of_steps_add_up_to_the_jacobian_of_a_period(law: type[Joint], seed: int) -> None:
    """A change of the motion that repeats every period, carried on by the slopes until sliders repeat as well."""
    samples = sampling(N_HARMONIC, N_SAMPLE)
    for joint in variants(law):
        x = 2 * motion(joint, seed)
        d, nh = x.shape
        exact = evaluated(x, joint, np.zeros(joint.n_slider), want=PARAMETERS)
        slopes = slopes_of_steps(joint, x, exact.slider)
        moved = np.zeros((d, N_SAMPLE, d, nh))
        rate = np.zeros_like(moved)
        for row in range(d):
            moved[row, :, row], rate[row, :, row] = samples.evaluate.T, OMEGA * samples.differentiate.T
        moved, rate = moved.reshape(d, N_SAMPLE, d * nh), rate.reshape(d, N_SAMPLE, d * nh)
        slider, force = np.zeros((joint.n_slider, d * nh)), np.zeros_like(moved)
        for k in [*range(N_SAMPLE)] * PERIODS:
            after = slopes[k] @ np.vstack([moved[:, k], rate[:, k], moved[:, k - 1], slider])
            force[:, k], slider = after[:d], after[d:]
        force -= make_joint_table([joint]).reference[:, None, None] * moved
        result = np.einsum("dkc,ka->dac", force, samples.project)
        expected = exact.jacobian[:, :, : d * nh]
        # Round-off, and what a coupled contact keeps of its first turn after so many periods.
        np.testing.assert_allclose(
            result, expected, rtol=0, atol=1e-8 * max(np.abs(expected).max(), np.abs(force).max())
        )


def vibrating(joint: Joint) -> JointedSystem:
    """The joint between masses and the ground, pushed so hard that its force bends; 2 % of damping."""
    d, scale = len(joint.directions), joint.typical_displacement
    x = np.zeros((d, 2 * N_HARMONIC - 1))
    x[:, 1] = scale
    coefficients = evaluated(x, joint, np.zeros(joint.n_slider)).coefficients
    spring = np.abs(coefficients[:, 1:]).max() / scale + max(joint.reference_stiffness)
    mass, force = spring / OMEGA**2, np.zeros((2, d), dtype=np.complex128)
    force[1] = 1.2 * spring * scale * np.exp(0.7j * np.arange(d))
    return JointedSystem(
        mass=mass * np.eye(d),
        damping=0.1 * mass * OMEGA * np.eye(d),
        stiffness=spring * np.eye(d),
        joints=[joint],
        harmonic_force=force,
    )


def test_the_balance_agrees_with_time_integration(law: type[Joint]) -> None:
    for joint in variants(law):
        system = vibrating(joint)
        balance = HarmonicBalance(system=system, n_harmonic=26, n_sample=2048)
        state = steady_state(balance, OMEGA)
        amplitude = np.abs(state.coefficients[1])
        assert amplitude.max() > 0.3 * joint.typical_displacement
        steady = steady_motion(system, OMEGA, tolerance=1e-7, steps_per_period=1024, max_steps_per_period=2048)
        assert steady.periodic
        # Of both: harmonics above 25, 2,048 samples, kinks within a step of the integration. The largest is 7e-6.
        np.testing.assert_allclose(steady.coefficients(4), state.coefficients[:4], rtol=0, atol=2e-5 * amplitude.max())


def test_work_is_dissipated_work(law: type[Joint]) -> None:
    for joint in variants(law):
        balance = HarmonicBalance(system=vibrating(joint), n_harmonic=12, n_sample=1024)
        energy = energy_balance(balance, steady_state(balance, OMEGA))
        assert energy.input_work > 0
        assert energy.joint_dissipation.min() > -4e-5 * energy.input_work  # kinks between instants: (2 pi / n)^2
        np.testing.assert_allclose(energy.dissipated, energy.input_work, rtol=1e-8)  # the residual of the balance
        assert energy.stored > 0


def test_hostile_parameters_and_rows_are_one_sentence(law: type[Joint]) -> None:
    for joint in variants(law):
        for parameter in law.parameters:
            bad = [np.nan, np.inf, "much", None]
            bad += [0.0, -1.0] if parameter.positive else []
            bad += [parameter.lower - 1.0] if np.isfinite(parameter.lower) else []
            for value in bad:
                with pytest.raises(JointError, match=parameter.name) as error:
                    joint.with_values({parameter.name: value})
                assert '"joint"' in str(error.value)
        rows = dict(zip(law.places, np.eye(len(law.places)), strict=True))
        for wrong in (np.zeros(len(rows)), np.full(len(rows), np.nan), np.eye(2)):
            with pytest.raises(JointError, match="joint"):
                law.build("joint", rows | dict.fromkeys(law.places, wrong), typical(law))


def test_facts_fit_each_other(law: type[Joint]) -> None:
    assert law.typical_displacement > 0
    for joint in variants(law):
        d = len(joint.directions)
        assert len(joint.stuck_stiffness) == len(joint.reference_stiffness) == len(joint.stuck_force) == d
        assert joint.normal_direction is None or 0 <= joint.normal_direction < d
        intervals = joint.slider_intervals
        assert isinstance(intervals, str) or len(intervals) == joint.n_slider
        if joint.series_springs:
            assert all(joint.stuck_stiffness)
        for parameter in law.parameters:
            assert parameter.unit
            assert parameter.meaning
            assert parameter.default is None or parameter.default >= parameter.lower


def test_other_programs_get_it_or_a_sentence(law: type[Joint]) -> None:
    for joint in variants(law):
        try:
            assert "joint" in make_pyharm_input(vibrating(joint), 1.0, 2.0)["connectors"]
        except ExchangeError as error:
            assert '"joint"' in str(error)  # noqa: PT017  # either answer is right
