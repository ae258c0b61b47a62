"""Readings at limits do not depend on the harmonics and samples that limits were searched for with."""

import numpy as np
import pytest

from benchmarks.family_coverage import STEPS_PER_PERIOD, frequencies, random_model
from correlation.family.limit_reading import LimitStates, make_reading_objective, read_limits
from correlation.noise.nuisance import Budget
from hbsolve.balance import HarmonicBalance
from hbsolve.limits.problem import LimitCurve
from hbsolve.limits.response_limits import limit_problem
from hbsolve.steady_state import steady_state
from transient.virtual_bench.sweep import VirtualSweepTest


@pytest.mark.parametrize(
    ("seed", "level", "first", "vague"),
    [
        (76, 3.0, 0, 1e-2),
        (890, 3.0, 0, 1e-2),  # opens and closes
        # At the last two frequencies the first doubling of the harmonics leaves the reading as it was, a tenth off.
        (100193, 0.3, 4, 3e-2),
    ],
)
def test_a_static_force_in_full_slip_is_read_as_integration_in_time_finds_it(
    seed: int, level: float, first: int, vague: float
) -> None:
    # The contact slips in each period: its steady state is one, and the static force a small remainder.
    model = random_model(seed)
    assert model is not None
    balance = HarmonicBalance(system=model.system, n_harmonic=model.n_harmonic, n_sample=model.n_sample)
    (_, tangential, _) = model.sensors
    problem = limit_problem(balance, make_reading_objective(model, tangential, 0), reach=1e-5)
    frequency = frequencies(model)[first:]
    omega = 2 * np.pi * frequency
    result = np.array([steady_state(balance.at_level(level), item).motion for item in omega])
    states = LimitStates(
        sensor=tangential.name, harmonic=0, motion=np.array([result, result]), slider=np.zeros((2, len(omega), 1))
    )
    curve = LimitCurve(problem=problem, level=level, angular_frequency=omega)
    (readings,) = read_limits(curve, model, Budget(frequency=0.0, compliance=0.0, shares=0.0), [states])
    bench = VirtualSweepTest(model.system, {"near": np.eye(model.system.n_dof)[0]}, 4 * STEPS_PER_PERIOD)
    # The bench's usual tolerance leaves as much as three deviations.
    force = bench.sweep(list(frequency), level, tolerance=1e-6).force[:, 0]
    # The samples of the search are up to 30 % off. Three deviations hold the error of what is read, which stays below a
    # hundredth of the dynamic force, or three where harmonics go on changing it.
    assert (np.abs(readings.value[0] - force[:, 0].real) < 3 * readings.deviation[0]).all()
    assert (readings.deviation[0] < vague * np.abs(force[:, 1])).all()


def test_harmonics_that_ring_in_a_stiff_contact_are_part_of_the_error() -> None:
    # Four times the harmonics of the search change the motion by 0.4 %, and leave it 1.4 % off.
    model = random_model(9746)
    assert model is not None
    balance = HarmonicBalance(system=model.system, n_harmonic=model.n_harmonic, n_sample=model.n_sample)
    near = model.sensors[0]
    problem = limit_problem(balance, make_reading_objective(model, near, 1), reach=1e-9)
    frequency = frequencies(model)[1:3]
    omega = 2 * np.pi * frequency
    result = np.array([steady_state(balance.at_level(1.0), item).motion for item in omega])
    states = LimitStates(
        sensor=near.name, harmonic=1, motion=np.array([result, result]), slider=np.zeros((2, len(omega), 1))
    )
    curve = LimitCurve(problem=problem, level=1.0, angular_frequency=omega)
    (readings,) = read_limits(curve, model, Budget(frequency=0.0, compliance=0.0, shares=0.0), [states])
    bench = VirtualSweepTest(model.system, {near.name: near.row}, STEPS_PER_PERIOD)
    motion = np.abs(bench.sweep(list(frequency), 1.0).motion[:, 0, 0])
    assert (np.abs(readings.value[0] - motion) < 3 * readings.deviation[0]).all()
    assert (readings.deviation[0] < 0.02 * motion).all()


def test_readings_at_another_force_are_those_of_integration_in_time() -> None:
    """The contact slips at all three forces: an amplitude grows by another power of the force than the first."""
    model, level = random_model(3), 3.0
    assert model is not None
    balance = HarmonicBalance(system=model.system, n_harmonic=model.n_harmonic, n_sample=model.n_sample)
    near = model.sensors[0]
    problem = limit_problem(balance, make_reading_objective(model, near, 1), reach=1e-5)
    frequency = frequencies(model)[[1, 3]]
    omega = 2 * np.pi * frequency
    result = np.array([steady_state(balance.at_level(level), item).motion for item in omega])
    states = LimitStates(
        sensor=near.name, harmonic=1, motion=np.array([result, result]), slider=np.zeros((2, len(omega), 1))
    )
    curve = LimitCurve(problem=problem, level=level, angular_frequency=omega)
    (readings,) = read_limits(
        curve, model, Budget(frequency=0.0, compliance=0.0, shares=0.0), [states], force_span=np.log(1.1)
    )
    assert readings.by_force is not None
    bench = VirtualSweepTest(model.system, {near.name: near.row}, STEPS_PER_PERIOD)
    for number, factor in ((0, 1 / 1.1), (-1, 1.1)):
        motion = np.abs(bench.sweep(list(frequency), factor * level).motion[:, 0, 0]) / factor
        assert (np.abs(motion / readings.value[0] - 1) > 0.01).all()
        np.testing.assert_allclose(readings.by_force.value[number, 0], motion, rtol=1e-3)
