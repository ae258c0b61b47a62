"""Figures 15 to 23: the nonlinear iterations.

The paper tunes by hand and states the target of each step. The same steps, done numerically:

1. k_t, k_n, root and density of the linear calibration, mu of section 4.1, perfect symmetry; the damping ratio is that
   of the stuck resonance from here on;
2. dead weights shifted by the ratio of the static normal forces, predicted over measured, of the damper's horizontal
   length, as the paper shifts them; then k_t, k_n and mu for the response;
3. all of these, and the inclinations of the dead weights, together for the response and all forces;
4. the left damper rotated by the printed angle, on the paper's rig alone.

A parameter whose force was not measured keeps the value of the case.
"""

from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from correlation.family.frequencies import choose_frequencies
from diagnosis.fit.family_target import FamilyGroup, FamilyTarget, list_numerical_errors
from geometry.rig import SIDES
from pipeline.pool import make_map
from pipeline.progress import ShownStep
from study.paper.case import CriteriaTable
from study.paper.criteria import Criterion, compute_static_deviation, judge_forces, judge_response
from study.paper.fit import ParameterFit, ParameterScale, Tuning, fit_parameters
from study.paper.limits import IterationLimits, MeasuredFamilies, find_limits
from study.paper.model import PaperModel
from study.paper.parameters import RigParameters
from study.paper.plan import ByHandPlan
from study.run_context import RunContext

#: Tuning of contact parameters, as shares of their values: first guesses have errors of tens of per cent.
CONTACT = {
    "kt": Tuning(step=0.003, deviation=0.25), "kn": Tuning(step=0.05, deviation=0.25),
    "mu": Tuning(step=0.05, deviation=0.25),
}  # fmt: skip
#: Tuning of a shift, as shares of the damper's length, and of an inclination: what is visible in a wire.
SHIFT = Tuning(step=0.05, deviation=0.25)
INCLINATION = Tuning(step=1.0, deviation=5.0).scale(np.pi / 180)
#: Normal forces by which the paper shifts the dead weight of their side.
SHIFTED = tuple(f"{side}_decoupler_N" for side in SIDES)


@dataclass(frozen=True, kw_only=True, eq=False)
class NonlinearIteration:
    """One iteration of figure 16.

    Parameters
    ----------
    number
        From 1.
    parameters
        Parameters of the iteration.
    limits
        Families over its limits.
    response, force
        Criteria.
    """

    number: int
    parameters: RigParameters
    limits: IterationLimits
    response: Criterion
    force: Criterion


@dataclass(frozen=True, kw_only=True, eq=False)
class NonlinearCalibration:
    """All iterations, and the fits between them; without static forces there is no fit to all data."""

    iterations: tuple[NonlinearIteration, ...]
    response: ParameterFit
    all_data: ParameterFit | None

    @property
    def last(self) -> NonlinearIteration:
        """The calibrated one: the third, or the second without static forces."""
        return self.iterations[1 if self.all_data is None else 2]


def calibrate_nonlinear(
    plan: ByHandPlan, model: PaperModel, start: RigParameters, measured: MeasuredFamilies, run: RunContext,
    executor: Executor,
) -> NonlinearCalibration:  # fmt: skip
    """Go through the iterations.

    Parameters
    ----------
    plan
        Thresholds, and the rotation of a fourth iteration.
    model
        Makes models of the rig.
    start
        Parameters of iteration 1.
    measured
        Families.
    run
        Output folder, store and progress.
    executor
        Processes of searches and fits.
    """

    def judged(number: int, parameters: RigParameters) -> NonlinearIteration:
        limits = find_limits(model, parameters, measured, run, f"iteration_{number}", executor)
        return judge_iteration(number, parameters, limits, plan.criteria)

    def fit(scale: ParameterScale, target: FamilyTarget, step: ShownStep) -> ParameterFit:
        return step.run(
            fit_parameters, model.inputs, scale, target, model.effort.evaluations, model, report=step.report,
            map_over=make_map(executor),
        )  # fmt: skip

    first = judged(1, start)
    length = model.opened.case.structure.damper.damper().cylinder_length
    count = model.effort.loop_frequencies
    shifted = _shift_weights(start, first, measured, length)
    response = fit(
        ParameterScale(start=shifted, tuned=_tune_contact(shifted)),
        make_target(measured, first.limits, count, forces=False),
        run.step("iteration 2: contact parameters", expected=60),
    )
    result, all_data = [first, second := judged(2, response.parameters)], None
    if alignment := _tune_alignment(measured, length):
        all_data = fit(
            ParameterScale(start=second.parameters, tuned=_tune_contact(second.parameters) | alignment),
            make_target(measured, second.limits, count, forces=True),
            run.step("iteration 3: contact parameters and alignment", expected=120),
        )
        result.append(judged(3, all_data.parameters))
        if plan.rotation is not None:
            result.append(judged(4, replace(all_data.parameters, gap_angle=plan.rotation)))
    return NonlinearCalibration(iterations=tuple(result), response=response, all_data=all_data)


def judge_iteration(
    number: int, parameters: RigParameters, limits: IterationLimits, criteria: CriteriaTable
) -> NonlinearIteration:
    """An iteration with its criteria."""
    return NonlinearIteration(
        number=number, parameters=parameters, limits=limits,
        response=judge_response(limits, criteria), force=judge_forces(limits, criteria),
    )  # fmt: skip


def make_target(measured: MeasuredFamilies, limits: IterationLimits, count: int, *, forces: bool) -> FamilyTarget:
    """Target of the fit of an iteration.

    Parameters
    ----------
    measured
        Families.
    limits
        Limits of the previous iteration, for the numerical error of limits.
    count
        Frequencies of the bands of the response [-].
    forces
        Whether the target includes all forces besides the response.
    """
    groups = [FamilyGroup(measured.response, choose_frequencies(measured.response, count, count))]
    if forces:
        groups.append(FamilyGroup(measured.forces, np.array(sorted(set(measured.peak.values())))))
    families = [family for group in groups for family in group.families]
    return FamilyTarget(
        groups=groups, errors=measured.errors, shift=measured.errors.frequency,
        # The numerical error of forces at one frequency is mostly an error of the frequency, which kt compensates.
        numerical=list_numerical_errors(families, limits.response),
    )  # fmt: skip


def _tune_contact(start: RigParameters) -> dict[str, Tuning]:
    return {name: item.scale(getattr(start, name)) for name, item in CONTACT.items()}


def _shift_weights(
    parameters: RigParameters, first: NonlinearIteration, measured: MeasuredFamilies, length: float
) -> RigParameters:
    """Dead weights shifted by the rule of the paper, from the static normal forces of the highest level.

    Each moves by (ratio of the forces, predicted over measured, less one) times the length of the cylinder [m].
    """
    top, moved = max(measured.peak), {}
    for item in first.limits.forces:
        family = item.family
        if family.sensor in SHIFTED and family.harmonic == 0 and family.level == top:
            name = f"shift_{family.sensor.partition('_')[0]}"
            shift = getattr(parameters, name) - compute_static_deviation(item) * length
            moved[name] = float(np.clip(shift, -length / 2, length / 2))
    return replace(parameters, **moved)


def _tune_alignment(measured: MeasuredFamilies, length: float) -> dict[str, Tuning]:
    """Tuning of the alignment of the sides whose static forces were measured; empty without these.

    Friction, stiffness and alignment change the same forces: in a sequential fit each would absorb the share of the
    next, so that alignment and contact parameters are fitted together.
    """
    sides = {family.sensor.partition("_")[0] for family in measured.forces if family.harmonic == 0}
    tuned = {"shift": SHIFT.scale(length), "inclination": INCLINATION}
    return {f"{name}_{side}": item for name, item in tuned.items() for side in SIDES if side in sides}
