"""Figures 15 to 23: the four nonlinear iterations, as the paper prints them and as they come out on this rig.

The paper tunes by hand, and says what for. The same steps, done by numbers:

1. k_t, k_n, root and density of the linear calibration, mu of section 4.1, perfect symmetry;
2. k_t, k_n, mu and the damping ratio for the response; dead weights shifted by the ratio of the static normal forces,
   predicted over measured, of the damper's horizontal length, as the paper shifts them;
3. dead weights shifted and inclined for the static forces of all levels;
4. the left damper rotated by the printed angle.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.family.family import Family
from correlation.family.frequencies import choose_frequencies
from diagnosis.fit.family_fit import FamilyTarget
from pipeline.parallel import process_pool
from study.paper.case import CriteriaTable, NonlinearTable, PaperCase
from study.paper.criteria import Criterion, judge_forces, judge_response, static_deviation
from study.paper.fit import fit_parameters
from study.paper.limits import IterationLimits, MeasuredFamilies, find_limits
from study.paper.model import PaperModel
from study.paper.parameters import RigParameters
from study.run_context import RunContext

#: Steps that matter, of parameters for the response as shares of their values, and of the alignment.
RESPONSE_STEPS = {"kt": 0.01, "kn": 0.05, "mu": 0.05, "damping": 0.05}
SHIFT_STEP, INCLINATION_STEP = 0.4e-3, np.radians(1.0)
ALIGNMENT_STEPS = {
    "shift_left": SHIFT_STEP, "shift_right": SHIFT_STEP,
    "inclination_left": INCLINATION_STEP, "inclination_right": INCLINATION_STEP,
}  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class NonlinearIteration:
    """One iteration of figure 16.

    Parameters
    ----------
    number
        From 1.
    printed
        What the paper prints.
    parameters
        Own parameters.
    limits
        Families over its limits.
    response, force
        Criteria.
    """

    number: int
    printed: NonlinearTable
    parameters: RigParameters
    limits: IterationLimits
    response: Criterion
    force: Criterion


def calibrate_nonlinear(
    case: PaperCase, model: PaperModel, start: RigParameters, measured: MeasuredFamilies, run: RunContext
) -> tuple[NonlinearIteration, ...]:
    """Go through the four iterations.

    Parameters
    ----------
    case
        Case of the replay.
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
            return judge_iteration(number, case.nonlinear[number - 1], parameters, limits, case.criteria)

        first = judged(1, start)
        tuned = _fit_response(model, start, measured, run)
        length = model.opened.case.structure.damper.damper().cylinder_length
        second = judged(2, replace(tuned, **_shifts(first, measured, length)))
        third = judged(3, _fit_alignment(model, second.parameters, measured, run))
        fourth = judged(4, replace(third.parameters, gap_angle=case.nonlinear[3].gap_angle))
    return first, second, third, fourth


def judge_iteration(
    number: int, printed: NonlinearTable, parameters: RigParameters, limits: IterationLimits, criteria: CriteriaTable
) -> NonlinearIteration:
    """An iteration with its criteria."""
    return NonlinearIteration(
        number=number, printed=printed, parameters=parameters, limits=limits,
        response=judge_response(limits, criteria), force=judge_forces(limits, criteria),
    )  # fmt: skip


def _target(
    families: Sequence[Family], measured: MeasuredFamilies, frequency: Float[NDArray[np.float64], " f"]
) -> FamilyTarget:
    return FamilyTarget(families=families, errors=measured.errors, frequency=frequency, shift=measured.errors.frequency)


def _fit_response(
    model: PaperModel, start: RigParameters, measured: MeasuredFamilies, run: RunContext
) -> RigParameters:
    """Contact parameters and damping whose bands hold the response of all levels."""
    scale = {name: share * getattr(start, name) for name, share in RESPONSE_STEPS.items()}
    step, count = run.step("iteration 2: contact parameters", expected=200), model.effort.loop_frequencies
    target = _target(measured.response, measured, choose_frequencies(measured.response, count, count))
    found = step.run(
        fit_parameters, model.opened.case, start, scale, target, model.effort.evaluations, model, report=step.report
    )
    return found.parameters


def _shifts(first: NonlinearIteration, measured: MeasuredFamilies, length: float) -> dict[str, float]:
    """Shifts of the dead weights by the rule of the paper, from the static normal forces of the highest level [m]."""
    top = max(measured.peak)
    result = {}
    for side in ("left", "right"):
        verdict = next(
            item
            for item in first.limits.forces
            if item.family.sensor == f"{side}_decoupler_N" and item.family.harmonic == 0 and item.family.level == top
        )
        result[f"shift_{side}"] = float(np.clip(-static_deviation(verdict), -0.5, 0.5)) * length
    return result


def _fit_alignment(
    model: PaperModel, start: RigParameters, measured: MeasuredFamilies, run: RunContext
) -> RigParameters:
    """Shifts and inclinations whose bands hold the static forces of all levels."""
    static = [family for family in measured.forces if family.harmonic == 0]
    step = run.step("iteration 3: alignment", expected=200)
    target = _target(static, measured, np.array(sorted(set(measured.peak.values()))))
    found = step.run(
        fit_parameters,
        model.opened.case,
        start,
        ALIGNMENT_STEPS,
        target,
        model.effort.evaluations,
        model,
        report=step.report,
    )
    return found.parameters
