"""Limits hold the branches of a contact that lifts off, which no slider leads to."""

import numpy as np

from benchmarks.family_coverage import STEPS_PER_PERIOD, frequencies, random_model
from correlation.family.limit_reading import make_reading_objective
from hbsolve.balance import HarmonicBalance
from hbsolve.limits.response_limits import limit_problem
from hbsolve.limits.search import LimitSettings
from hbsolve.limits.several_limits import several_limits
from tests.slow import slow
from transient.virtual_bench.sweep import VirtualSweepTest

LEVEL = 0.3


@slow
def test_a_stable_state_of_integration_in_time_lies_inside_limits_that_were_searched_from_elsewhere() -> None:
    model = random_model(100137)
    assert model is not None
    place = frequencies(model)
    bench = VirtualSweepTest(model.system, {"near": model.sensors[0].row}, STEPS_PER_PERIOD)  # type: ignore[union-attr]
    # From rest: along the unstable states below, round-off decides where a sweep ends.
    swept = bench.sweep([place[-1]], LEVEL, np.array([0.3]), n_stability_period=30)
    omega = 2 * np.pi * np.linspace(place[2], place[-1], 6)
    balance = HarmonicBalance(system=model.system, n_harmonic=model.n_harmonic, n_sample=model.n_sample)
    objectives = {sensor.name: make_reading_objective(model, sensor, 1) for sensor in model.sensors}
    problem = limit_problem(balance, objectives["near"])
    settings = LimitSettings(population=8, sample=16, perturbations=1)
    result = several_limits(problem, objectives, omega, [LEVEL], settings=settings)
    measured = {"near": swept.motion[:, 0, 0], "a_t": swept.force[:, 0, 1], "a_n": swept.force[:, 1, 1]}
    assert swept.periodic[-1]
    for name, limits in result.items():
        value = abs(measured[name][-1])
        # Seven harmonics leave 2.4 %; without the branch the tangential force has a lower limit six times as large.
        assert 0.95 * limits.lower[0, -1] <= value <= 1.05 * limits.upper[0, -1]
