"""Figures 15 to 23: the nonlinear iterations.

The paper tunes by hand, and says what for. The same steps, done by numbers:

1. k_t, k_n, root and density of the linear calibration, mu of section 4.1, perfect symmetry;
2. k_t, k_n, mu and the damping ratio for the response; dead weights shifted by the ratio of the static normal forces,
   predicted over measured, of the damper's horizontal length, as the paper shifts them;
3. dead weights shifted and inclined for the static forces of all levels;
4. the left damper rotated by the printed angle, on the paper's rig alone.

Where a force was not measured, what it decides stays as the case has it.
"""

from dataclasses import dataclass, replace

import numpy as np

from correlation.family.frequencies import choose_frequencies
from diagnosis.fit.family_fit import FamilyTarget
from geometry.rig import SIDES
from pipeline.parallel import process_pool
from study.paper.case import CriteriaTable
from study.paper.criteria import Criterion, judge_forces, judge_response, static_deviation
from study.paper.fit import ParameterFit, fit_parameters
from study.paper.limits import IterationLimits, MeasuredFamilies, find_limits
from study.paper.model import PaperModel
from study.paper.parameters import RigParameters
from study.paper.plan import ByHandPlan
from study.run_context import RunContext

#: Steps that matter, of parameters for the response as shares of their values, and of the alignment.
RESPONSE_STEPS = {"kt": 0.01, "kn": 0.05, "mu": 0.05, "damping": 0.05}
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
    """All iterations, and the fits between them; without static forces no alignment is fitted."""

    iterations: tuple[NonlinearIteration, ...]
    response: ParameterFit
    alignment: ParameterFit | None

    @property
    def last(self) -> NonlinearIteration:
        """The calibrated one: the third, or the second without static forces."""
        return self.iterations[1 if self.alignment is None else 2]


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
        response = _fit_response(model, start, measured, run)
        length = model.opened.case.structure.damper.damper().cylinder_length
        result = [first, judged(2, _shifted(response.parameters, first, measured, length))]
        alignment = _fit_alignment(model, result[-1].parameters, measured, run)
        if alignment is not None:
            result.append(judged(3, alignment.parameters))
        if alignment is not None and plan.rotation is not None:
            result.append(judged(4, replace(alignment.parameters, gap_angle=plan.rotation)))
    return NonlinearCalibration(iterations=tuple(result), response=response, alignment=alignment)


def judge_iteration(
    number: int, parameters: RigParameters, limits: IterationLimits, criteria: CriteriaTable
) -> NonlinearIteration:
    """An iteration with its criteria."""
    return NonlinearIteration(
        number=number, parameters=parameters, limits=limits,
        response=judge_response(limits, criteria), force=judge_forces(limits, criteria),
    )  # fmt: skip


def make_targets(measured: MeasuredFamilies, count: int) -> tuple[FamilyTarget, FamilyTarget]:
    """What contact parameters and damping are fitted to, the response, and what the alignment is, static forces.

    Parameters
    ----------
    measured
        Families.
    count
        Frequencies of the bands of the response [-].
    """
    static = [family for family in measured.forces if family.harmonic == 0]
    ends = [
        (measured.response, choose_frequencies(measured.response, count, count)),
        (static, np.array(sorted(set(measured.peak.values())))),
    ]
    response, alignment = (
        FamilyTarget(families=families, errors=measured.errors, frequency=frequency, shift=measured.errors.frequency)
        for families, frequency in ends
    )
    return response, alignment


def _fit_response(model: PaperModel, start: RigParameters, measured: MeasuredFamilies, run: RunContext) -> ParameterFit:
    """Contact parameters and damping whose bands hold the response of all levels."""
    scale = {name: share * getattr(start, name) for name, share in RESPONSE_STEPS.items()}
    step = run.step("iteration 2: contact parameters", expected=200)
    target, _ = make_targets(measured, model.effort.loop_frequencies)
    return step.run(
        fit_parameters, model.opened.case, start, scale, target, model.effort.evaluations, model, report=step.report
    )


def _shifted(
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


def _fit_alignment(
    model: PaperModel, start: RigParameters, measured: MeasuredFamilies, run: RunContext
) -> ParameterFit | None:
    """Shifts and inclinations whose bands hold the static forces of all levels, of the sides that were measured."""
    _, target = make_targets(measured, model.effort.loop_frequencies)
    sides = {family.sensor.partition("_")[0] for family in target.families}
    scale = {name: step for name, step in ALIGNMENT_STEPS.items() if name.rpartition("_")[2] in sides}
    if not scale:
        return None
    step = run.step("iteration 3: alignment", expected=200)
    return step.run(
        fit_parameters, model.opened.case, start, scale, target, model.effort.evaluations, model, report=step.report
    )
