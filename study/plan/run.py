"""``stickslip plan``: plan of the requested tests of a case, and its files."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from correlation.model import Model
from correlation.noise.nuisance import Budget
from correlation.prediction import Predictor
from diagnosis.candidate.catalogue import list_effects
from diagnosis.fit.calibration_parameter import CalibrationParameter
from diagnosis.next_test.next_test import NextTest
from diagnosis.next_test.plan import Plan, plan_tests
from pipeline.output import replace_file
from pipeline.store import stage
from study.case.setup import ReadCase, read_case, require_loads
from study.json_value import to_json
from study.plan.drawing import make_plan_drawing
from study.plan.planned_tests import PlanRequest, choose_sensors, make_noise, make_tests
from study.plan.report import PlanResult
from study.run_context import RunContext


@stage("plan of tests")
def compute_plan(
    model: Model, calibration: Sequence[CalibrationParameter], budget: Budget, tests: Sequence[NextTest], noise: str,
    effects: Sequence[Path], without: Sequence[str],
) -> Plan:  # fmt: skip
    """Compute the plan of tests with `diagnosis.next_test.plan.plan_tests`, as a stored stage."""
    tested: Mapping[str, float] = {item.configuration: max(item.levels) for item in tests}
    catalogue = list_effects(model, without=without, extra=effects, level=max(tested.values()), configurations=tested)
    lowest = [replace(item, levels=item.levels[:1], harmonics=(1,)) for item in tests[:1]]
    points = lowest[0].make_points()
    sizes = np.nan_to_num(np.abs(Predictor(points=points).predict(model).value))
    largest = {name: float(sizes[points.sensor == name].max()) for name in lowest[0].sensors}
    return plan_tests(tests, model, calibration, budget, make_noise(noise, model, largest), catalogue)


def run_plan(path: Path, request: PlanRequest, run: RunContext, *, without: Sequence[str] = ()) -> PlanResult:
    """Plan tests of a case, and write figure and JSON.

    Raises
    ------
    CaseError, InputError
        If the case or the options have mistakes.
    """
    assert run.output is not None
    read: ReadCase = require_loads(read_case(path, run=run))
    setup = read.setup
    model = choose_sensors(read, request.sensors)
    tests = make_tests(read, model, request)
    make_noise(request.noise, model, {})  # reports a mistake in the noise before the long computation
    kinds = tuple(sorted({*setup.without, *without}))
    # Refined models are not used: all sensitivities are those of one mesh.
    budget = replace(setup.budget, refined=())
    step = run.step("sensitivities", expected=20)
    plan = step.run(
        compute_plan, model, setup.calibration_parameters, budget, tests, request.noise, setup.effect_files, kinds
    )
    planned = PlanResult(
        title=setup.title, tests=tuple(tests), plan=plan, noise=request.noise,
        added=tuple(item.effect.name for item in setup.added),
    )  # fmt: skip
    files = run.draw({f"{path.stem}_plan": make_plan_drawing(plan, setup.title, planned.headline)})
    table = run.output / f"{path.stem}_plan.json"
    planned = replace(planned, files=(*files, table))
    replace_file(table, json.dumps(to_json(planned.document()), indent=1, ensure_ascii=False))
    return planned
