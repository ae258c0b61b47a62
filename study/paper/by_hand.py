"""The calibration by hand of the paper, done numerically, for the virtual or a user's campaign: linear, nonlinear."""

from concurrent.futures import Executor
from dataclasses import asdict, dataclass, replace
from math import hypot
from typing import Any

import numpy as np

from pipeline.pool import make_map
from study.paper.frequency_error import FrequencyError, find_frequency_error
from study.paper.interval import (
    FREQUENCIES,
    Interval,
    find_damping_interval,
    find_density_interval,
    find_intervals,
)
from study.paper.limits import MeasuredFamilies, read_families
from study.paper.linear import LinearCalibration, calibrate_linear
from study.paper.model import PaperModel
from study.paper.nonlinear import NonlinearCalibration, NonlinearIteration, calibrate_nonlinear, make_target
from study.paper.parameters import RigParameters
from study.paper.plan import ByHandPlan
from study.run_context import RunContext

#: Modules that the processes of searches and fits need.
POOL_MODULES = ("study.paper.fit", "hbsolve.limits.several_limits")
#: Levels of the paper [-].
PAPER_LEVELS = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class ByHand:
    """Result of the calibration by hand.

    Parameters
    ----------
    measured
        Families of the campaign.
    linear, nonlinear
        Iterations.
    intervals
        Intervals of the parameters of the calibrated iteration.
    missing
        Missing data and the steps that were left out for that reason, as sentences.
    """

    measured: MeasuredFamilies
    linear: LinearCalibration
    nonlinear: NonlinearCalibration
    intervals: tuple[Interval, ...]
    missing: tuple[str, ...]

    @property
    def last(self) -> NonlinearIteration:
        """The calibrated iteration."""
        return self.nonlinear.last


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearStage:
    """Result of the linear iterations, with which the nonlinear ones begin.

    Parameters
    ----------
    measured
        Families of the campaign.
    linear
        Iterations.
    start
        Parameters of the first nonlinear iteration.
    """

    measured: MeasuredFamilies
    linear: LinearCalibration
    start: RigParameters


def calibrate_linear_stage(plan: ByHandPlan, model: PaperModel, mu: float, run: RunContext) -> LinearStage:
    """Go through the linear iterations.

    Parameters
    ----------
    plan
        Starts, thresholds and effort.
    model
        Makes models of the rig, with the campaign.
    mu
        First guess of the friction coefficient [-].
    run
        Output folder, store and progress.

    Raises
    ------
    CampaignError
        No response of the structure with its dampers was measured.
    ComputationFailed
        No resonance in the tests, or no rest under the dead weights.
    """
    measured = read_families(model.campaign)
    linear = calibrate_linear(plan, model, mu, run)
    # The paper keeps the stiffness of the linear calibration, and returns to the damping of the narrow stuck resonance.
    start = replace(linear.iterations[-1].own.parameters, mu=mu, damping=linear.stuck.damping)
    return LinearStage(measured=measured, linear=linear, start=start)


def calibrate_by_hand(
    plan: ByHandPlan, model: PaperModel, stage: LinearStage, run: RunContext, executor: Executor
) -> ByHand:
    """Go through the nonlinear iterations, and find the intervals of the parameters.

    Parameters
    ----------
    plan, model, run
        As for `calibrate_linear_stage`.
    stage
        Its result.
    executor
        Processes of searches and fits.

    Raises
    ------
    ComputationFailed
        No rest under the dead weights, or a process that was killed.
    """
    measured, linear = stage.measured, stage.linear
    nonlinear = calibrate_nonlinear(plan, model, stage.start, measured, run, executor)
    return ByHand(
        measured=measured, linear=linear, nonlinear=nonlinear,
        intervals=_find_all_intervals(model, linear, nonlinear, measured, run, executor),
        missing=tuple(list_missing(measured, linear)),
    )  # fmt: skip


def _find_all_intervals(
    model: PaperModel, linear: LinearCalibration, nonlinear: NonlinearCalibration, measured: MeasuredFamilies,
    run: RunContext, executor: Executor,
) -> tuple[Interval, ...]:  # fmt: skip
    last, free = nonlinear.last, linear.free
    before = nonlinear.iterations[last.number - 2].limits
    fit = nonlinear.response if nonlinear.all_data is None else nonlinear.all_data
    target = make_target(measured, before, model.effort.loop_frequencies, forces=nonlinear.all_data is not None)
    step = run.step("intervals", expected=60)
    fitted = step.run(find_intervals, model.inputs, fit, target, model, report=step.report, map_over=make_map(executor))
    result = [*fitted, find_damping_interval(last.parameters.damping, linear.stuck)]
    if free is not None and last.parameters.density is not None:
        result.append(find_density_interval(last.parameters.density, free))
    error = _estimate_frequency_error(model, last, run, has_free=free is not None)
    widened = {"kt": error.kt, "density": error.density}
    return tuple(
        item.widen(widened[item.name] * item.value, FREQUENCIES, least=0.0) if item.name in widened else item
        for item in result
    )


def _estimate_frequency_error(
    model: PaperModel, last: NonlinearIteration, run: RunContext, *, has_free: bool
) -> FrequencyError:
    numerical = model.read(last.parameters).setup.budget.frequency
    # The effect of contact errors on a resonance differs little from level to level.
    by_contact = [item.band.shift for item in last.limits.response if item.band.shift]
    stuck = hypot(numerical, np.median(by_contact)) if by_contact else numerical
    step = run.step("errors of frequencies", expected=5)
    return step.run(find_frequency_error, model.inputs, last.parameters, stuck, numerical if has_free else None, model)


def list_missing(measured: MeasuredFamilies, linear: LinearCalibration) -> list[str]:
    """Data that a campaign lacks compared with the paper's, and the steps left out for it, one sentence each."""
    result, levels = [], sorted(measured.peak)
    if linear.free is None:
        result.append(
            "The blade without dampers was not measured: its density stays as the case has it, and the criterion "
            '"free" is not judged.'
        )
    static = {family.sensor for family in measured.forces if family.harmonic == 0}
    if not measured.forces:
        result.append(
            "No contact forces were measured: dead weights are neither shifted nor inclined, there is no iteration 3, "
            'and the criterion "force" is not judged.'
        )
    elif not static:
        result.append("Load cells without their mean: dead weights are neither shifted nor inclined.")
    else:
        result += [
            f"No static force of the {side} side was measured: its dead weight stays as the case has it."
            for side in ("left", "right")
            if not any(name.startswith(side) for name in static)
        ]
    if len(levels) < PAPER_LEVELS:
        listed = ", ".join(f"{level:g}" for level in levels)
        result.append(
            f"There are {len(levels)} levels ({listed} N) where the paper has {PAPER_LEVELS}: what happens between and "
            "beyond them is not judged."
        )
    if len({curve.repeat for family in measured.response for curve in family.curves}) < 2:
        result.append(
            "There is one repeat: what another loading history does, and how far frequencies scatter between set-ups, "
            "is not seen, so that coverage is that of one history."
        )
    if all(len(family.curves) < 2 for family in measured.response):
        result.append("There is one curve of each level: there is no spread for a tightness.")
    return result


def make_hand_document(hand: ByHand) -> dict[str, Any]:
    """Iterations and intervals for ``--json``."""
    return {
        "linear": [
            {"free_met": item.own.free_met, "stuck_met": item.own.stuck_met, "parameters": asdict(item.own.parameters)}
            for item in hand.linear.iterations
        ],
        "nonlinear": [
            {
                "response_met": item.response.met,
                "force_met": item.force.met,
                "parameters": asdict(item.parameters),
                "scores": [asdict(score) for score in (*item.response.scores, *item.force.scores)],
                "tightness": {f"{v.family.level:g}": v.tightness for v in item.limits.response},
            }
            for item in hand.nonlinear.iterations
        ],
        "intervals": [asdict(item) for item in hand.intervals],
    }
