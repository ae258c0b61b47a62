"""Limits of one nonlinear iteration and measurements: the response over frequency, the forces at resonance."""

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from math import inf
from typing import Any

import numpy as np

from correlation.campaign.measurement import SAME_FREQUENCY, Campaign, MeasuredSensor
from correlation.errors import CampaignError
from correlation.family.family import Family, measured_families, number_points
from correlation.family.noise import RepeatErrors, estimate_repeat_errors
from correlation.family.verdict import FamilyVerdict, count_readings, judge_family
from pipeline.store import stage
from study.compare.families import (
    Preloads,
    correct_families,
    estimate_preloads,
    judge_families,
    make_family_search,
)
from study.compare.family_limits import FamilySearch, find_family_limits, find_reaches
from study.limits.stored_search import run_search
from study.limits.table import LimitsTable
from study.paper.case import EffortTable
from study.paper.model import ModelInputs, PaperModel
from study.paper.parameters import RigParameters
from study.run_context import RunContext

#: Preferred sensor of the response.
TIP = "tip"
#: Directions of contact forces in names of sensors.
LETTER = {"tangential": "T", "normal": "N"}


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredFamilies:
    """Measured families.

    Parameters
    ----------
    sensor
        Name of the sensor of the response.
    response
        Its amplitude at each level.
    forces
        Static and dynamic forces at the frequency of the highest mean response of their level, one point per curve;
        sensors are named by line and direction, such as left_decoupler_T.
    errors
        Noise and frequency jitter.
    peak
        Frequency of that highest mean response by level [Hz].
    """

    sensor: str
    response: tuple[Family, ...]
    forces: tuple[Family, ...]
    errors: RepeatErrors
    peak: Mapping[float, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class IterationLimits:
    """Families over the limits of an iteration; without forces if these were not searched for."""

    response: tuple[FamilyVerdict, ...]
    forces: tuple[FamilyVerdict, ...]


def rename_by_line(campaign: Campaign) -> Campaign:
    """The campaign with contact forces named by line and direction, as criteria and figures expect."""
    taken, sensors = {item.name for item in campaign.sensors if item.line is None}, []
    for item in campaign.sensors:
        name = f"{item.line}_{LETTER[item.component]}" if item.component in LETTER else item.name
        # If two instruments measure the same force, use the first.
        name = item.name if item.component in LETTER and name in taken else name
        taken.add(name)
        sensors.append(replace(item, name=name))
    return replace(campaign, sensors=tuple(sensors))


def read_families(campaign: Campaign) -> MeasuredFamilies:
    """Families of the paper's figures: the response, and the forces of each line at resonance.

    Parameters
    ----------
    campaign
        Campaign as `rename_by_line` gives it. The response is that of the tip, or of its first sensor of motion.

    Raises
    ------
    CampaignError
        No calibrated sensor of motion in the tests with dampers, or levels of unknown size.
    """
    families = measured_families(campaign)
    if not campaign.drive.calibrated:
        raise CampaignError(
            f"levels are in {campaign.drive.unit}, not in a unit of the model: limits depend on the level, so "
            "calibrate the drive"
        )
    sensors = {item.name: item for item in campaign.sensors}
    moving = [
        item.sensor
        for item in families
        if item.harmonic == 1 and not sensors[item.sensor].line and sensors[item.sensor].calibrated
    ]
    if not moving:
        raise CampaignError(
            "no calibrated sensor of motion was read in a test with dampers: the response is what contact parameters "
            "are calibrated to, so measure the tip"
        )
    own = TIP if TIP in moving else moving[0]
    response = tuple(item for item in families if item.sensor == own and item.harmonic == 1)
    peak = {family.level: find_peak(family) for family in response}
    forces = tuple(
        at_peak
        for family in families
        if _is_line_force(sensors[family.sensor]) and family.harmonic in (0, 1) and family.level in peak
        for at_peak in _find_family_at(family, peak[family.level])
    )
    return MeasuredFamilies(
        sensor=own, response=response, forces=forces, errors=estimate_repeat_errors(campaign, families), peak=peak
    )


def _is_line_force(sensor: MeasuredSensor) -> bool:
    return (
        sensor.calibrated and sensor.component in LETTER and sensor.name == f"{sensor.line}_{LETTER[sensor.component]}"
    )


def find_peak(family: Family) -> float:
    """Frequency of the point of the test whose readings are the highest on average [Hz].

    Repeats step through the same points; their frequencies differ by the jitter alone. The mean at a point is over the
    curves that have it.
    """
    point = number_points(family.curves)
    count = np.maximum(np.bincount(point), 1)
    highest = int(np.argmax(np.bincount(point, family.value) / count))
    return float(family.frequency[point == highest].mean())


def _find_family_at(family: Family, peak: float) -> list[Family]:
    """Readings nearest to a frequency, one per curve that has a point within half its step; empty without any."""
    curves = []
    for curve in family.curves:
        nearest = int(np.argmin(np.abs(curve.frequency - peak)))
        step = np.diff(curve.frequency[max(nearest - 1, 0) : nearest + 2])
        if abs(curve.frequency[nearest] - peak) <= step.max(initial=SAME_FREQUENCY * peak) / 2:
            curves.append(replace(curve.where(np.array([nearest])), frequency=np.array([peak])))
    return [replace(family, curves=tuple(curves))] if curves else []


def find_limits(
    model: PaperModel, parameters: RigParameters, measured: MeasuredFamilies, run: RunContext, stem: str,
    executor: Executor,
) -> IterationLimits:  # fmt: skip
    """Search for the limits of an iteration, and compare the measured families with them.

    Parameters
    ----------
    model, parameters
        Model of the iteration.
    measured
        Families.
    run
        Output folder, store and progress.
    stem
        Stem of the folders of unfinished tasks.
    executor
        Runs the tasks of all searches.

    Raises
    ------
    ComputationFailed
        No rest under the dead weights, or a process that was killed.
    """
    content = model.campaign.content
    outcome = run.store.outcome(
        compute_limits, model.inputs, parameters, measured, model.effort, content, model, run, stem, executor
    )
    if outcome.cached:
        run.progress.stored(f"{stem}: limits")
    return outcome.value


@stage("limits of an iteration", ignore=("model", "run", "stem", "executor"))
def compute_limits(
    inputs: ModelInputs,
    parameters: RigParameters,
    measured: MeasuredFamilies,
    effort: EffortTable,
    content: Mapping[str, Any],
    model: PaperModel,
    run: RunContext,
    stem: str,
    executor: Executor,
) -> IterationLimits:
    """`find_limits` as a stage: offsets of the measured families take seconds for each iteration.

    Parameters
    ----------
    inputs, effort, content
        What the result depends on besides `parameters` and `measured`: inputs of the models, effort of the searches,
        content of the campaign.
    parameters, measured, model, run, stem, executor
        As for `find_limits`.
    """
    del inputs, content
    read = model.read(parameters)
    budget = read.setup.budget
    table = LimitsTable(population=effort.population, samples=effort.samples)
    search = make_family_search(
        read.setup.model, budget, model.campaign, measured.response, table, None, most=effort.frequencies,
        fewest=effort.frequencies,
    )  # fmt: skip
    step = run.step(f"{stem}: reach of the sliders", expected=20)
    search = search.with_numeric_box(lambda rest: step.run(find_reaches, rest, report=step.report))
    result = run_search(find_family_limits, search, f"{stem}_response", run, executor)
    preloads = estimate_preloads(measured.response, result, measured.errors, budget)
    response = judge_families(
        correct_families(measured.response, result, preloads, measured.errors), result, measured.errors, budget
    )
    return IterationLimits(
        response=response, forces=tuple(_compute_forces(search, measured, preloads, run, stem, executor))
    )


def _compute_forces(
    search: FamilySearch, measured: MeasuredFamilies, preloads: Preloads, run: RunContext, stem: str, executor: Executor
) -> Sequence[FamilyVerdict]:
    result: list[FamilyVerdict] = []
    for number, level in enumerate(search.levels):
        families = [family for family in measured.forces if family.level == level]
        if not families:
            continue
        assert isinstance(search.reach, np.ndarray)
        own = replace(
            search,
            channels=tuple((family.sensor, family.harmonic) for family in families),
            frequency=np.array([measured.peak[level]]),
            levels=(level,),
            earlier=np.eye(1, dtype=bool),
            reach=search.reach[[number]],
            force_spans=search.force_spans[number : number + 1],
        )
        limits = run_search(find_family_limits, own, f"{stem}_forces_{level:g}N", run, executor)
        n_reading = count_readings(measured.forces)
        result += [
            judge_family(
                family,
                limits.band(family),
                measured.errors.noise[family.sensor, family.harmonic],
                shift=measured.errors.frequency,
                n_reading=n_reading,
            )
            for family in correct_families(families, limits, preloads, measured.errors)
        ]
    return result


def compute_furthest_outside(verdict: FamilyVerdict) -> float:
    """Largest distance of an outside reading from its limits, 0 without any [SI unit of the sensor].

    As for the coverage, a reading within noise and numerical error is not outside; for others the full distance counts.
    Infinite without limits.
    """
    lower, upper = verdict.limit
    if not np.isfinite(verdict.limit).any():
        return inf
    beyond = np.maximum(lower - verdict.family.value, verdict.family.value - upper)
    return float(np.max(beyond[verdict.outside], initial=0.0))
