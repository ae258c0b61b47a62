"""Figures 15 to 23: the nonlinear iterations.

The paper tunes by hand, and says what for. The same steps, done by numbers:

1. k_t, k_n, root and density of the linear calibration, mu of section 4.1, perfect symmetry; the damping ratio is that
   of the stuck resonance from here on;
2. dead weights shifted by the ratio of the static normal forces, predicted over measured, of the damper's horizontal
   length, as the paper shifts them; then k_t, k_n and mu for the response;
3. all of these, and the inclinations of the dead weights, together for the response and all forces;
4. the left damper rotated by the printed angle, on the paper's rig alone.

Where a force was not measured, what it decides stays as the case has it.
"""

from dataclasses import dataclass, replace

import numpy as np

from correlation.family.frequencies import choose_frequencies
from diagnosis.fit.family_target import FamilyGroup, FamilyTarget
from geometry.rig import SIDES
from pipeline.parallel import process_pool
from study.paper.case import CriteriaTable
from study.paper.criteria import Criterion, judge_forces, judge_response, static_deviation
from study.paper.fit import ParameterFit, ParameterScale, fit_parameters
from study.paper.limits import IterationLimits, MeasuredFamilies, find_limits
from study.paper.model import PaperModel
from study.paper.parameters import RigParameters
from study.paper.plan import ByHandPlan
from study.run_context import RunContext

#: Steps that matter, of parameters for the response as shares of their values, and of the alignment.
RESPONSE_STEPS = {"kt": 0.003, "kn": 0.05, "mu": 0.05}
SHIFT_STEP, INCLINATION_STEP = 0.6e-3, np.radians(3.0)
ALIGNMENT_STEPS = {
    "shift_left": SHIFT_STEP, "shift_right": SHIFT_STEP,
    "inclination_left": INCLINATION_STEP, "inclination_right": INCLINATION_STEP,
}  # fmt: skip
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
        Own parameters.
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
    """All iterations, and the fits between them; without static forces there is none to all data."""

    iterations: tuple[NonlinearIteration, ...]
    response: ParameterFit
    all_data: ParameterFit | None

    @property
    def last(self) -> NonlinearIteration:
        """The calibrated one: the third, or the second without static forces."""
        return self.iterations[1 if self.all_data is None else 2]


def calibrate_nonlinear(
    plan: ByHandPlan, model: PaperModel, start: RigParameters, measured: MeasuredFamilies, run: RunContext
) -> NonlinearCalibration:
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
    """
    # One pool for all searches: its processes read the compiled code once.
    with process_pool(["hbsolve.limits.several_limits"]) as executor:

        def judged(number: int, parameters: RigParameters) -> NonlinearIteration:
            limits = find_limits(model, parameters, measured, run, f"iteration_{number}", executor)
            return judge_iteration(number, parameters, limits, plan.criteria)

        first = judged(1, start)
        length = model.opened.case.structure.damper.damper().cylinder_length
        response = _fit_response(model, _shift_weights(start, first, measured, length), measured, run)
        result = [first, judged(2, response.parameters)]
        all_data = _fit_all_data(model, response.parameters, measured, run)
        if all_data is not None:
            result.append(judged(3, all_data.parameters))
        if all_data is not None and plan.rotation is not None:
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


def make_targets(measured: MeasuredFamilies, count: int) -> tuple[FamilyTarget, FamilyTarget]:
    """What iteration 2 is fitted to, the response, and what iteration 3 is, the response and all forces.

    Parameters
    ----------
    measured
        Families.
    count
        Frequencies of the bands of the response [-].
    """
    response = FamilyGroup(measured.response, choose_frequencies(measured.response, count, count))
    forces = FamilyGroup(measured.forces, np.array(sorted(set(measured.peak.values()))))
    of_response, of_all = (
        FamilyTarget(groups=groups, errors=measured.errors, shift=measured.errors.frequency)
        for groups in ((response,), (response, forces))
    )
    return of_response, of_all


def _fit_response(model: PaperModel, start: RigParameters, measured: MeasuredFamilies, run: RunContext) -> ParameterFit:
    """Contact parameters whose bands hold the response of all levels."""
    step = run.step("iteration 2: contact parameters", expected=100)
    target, _ = make_targets(measured, model.effort.loop_frequencies)
    scale = ParameterScale(start=start, steps=_response_steps(start))
    return step.run(
        fit_parameters, model.opened.case, scale, target, model.effort.evaluations, model, report=step.report
    )


def _response_steps(start: RigParameters) -> dict[str, float]:
    return {name: share * getattr(start, name) for name, share in RESPONSE_STEPS.items()}


def _shift_weights(
    parameters: RigParameters, first: NonlinearIteration, measured: MeasuredFamilies, length: float
) -> RigParameters:
    """Dead weights shifted by the rule of the paper, from the static normal forces of the highest level.

    Each moves by the ratio of the forces, predicted over measured, less one, of the length of the cylinder [m].
    """
    top, moved = max(measured.peak), {}
    for item in first.limits.forces:
        family = item.family
        if family.sensor in SHIFTED and family.harmonic == 0 and family.level == top:
            name = f"shift_{family.sensor.partition('_')[0]}"
            shift = getattr(parameters, name) - static_deviation(item) * length
            moved[name] = float(np.clip(shift, -length / 2, length / 2))
    return replace(parameters, **moved)


def _fit_all_data(
    model: PaperModel, start: RigParameters, measured: MeasuredFamilies, run: RunContext
) -> ParameterFit | None:
    """Contact parameters and the alignment of the sides whose static forces were measured, to all data.

    Friction, stiffness and alignment change the same forces: fitted one after the other each takes over what belongs to
    the next.
    """
    sides = {family.sensor.partition("_")[0] for family in measured.forces if family.harmonic == 0}
    alignment = {name: step for name, step in ALIGNMENT_STEPS.items() if name.rpartition("_")[2] in sides}
    if not alignment:
        return None
    step = run.step("iteration 3: contact parameters and alignment", expected=200)
    _, target = make_targets(measured, model.effort.loop_frequencies)
    scale = ParameterScale(start=start, steps=_response_steps(start) | alignment)
    return step.run(
        fit_parameters, model.opened.case, scale, target, model.effort.evaluations, model, report=step.report
    )
