"""Families of a campaign over the limits of a model, for ``stickslip compare --limits``."""

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, MeasuredSensor
from correlation.family.band import PredictedBand
from correlation.family.correction import SetUp, correct_family
from correlation.family.family import Family, measured_families
from correlation.family.frequencies import choose_frequencies, find_stops
from correlation.family.frequency_offset import estimate_frequency_offsets
from correlation.family.level_order import find_earlier_levels
from correlation.family.noise import ReadingNoise, RepeatErrors, estimate_repeat_errors
from correlation.family.preload_offset import PRELOAD_SPAN, estimate_preload_offsets
from correlation.family.verdict import FamilyVerdict, count_readings, judge_family
from correlation.model import Model, Sensor
from correlation.noise.nuisance import Budget
from hbsolve.errors import BalanceError, NoSteadyState
from hbsolve.limits.search import LimitSettings
from study.case.structure import Structure
from study.compare.family_limits import FamilyLimits, FamilySearch, find_family_limits, find_reaches
from study.compare.family_pictures import make_family_figures
from study.limits.stored_search import run_search
from study.limits.table import LimitsTable
from study.run_context import RunContext

#: Number of frequencies of the limits at each level: the most after thinning, the least after filling in [-].
MAX_FREQUENCIES, MIN_FREQUENCIES = 40, 24
#: Natural logarithm of each preload over that of the model, by set-up.
Preloads = Mapping[SetUp, Float[NDArray[np.float64], " g"]]
#: Log ratio of a force to its level: values below the first are rounding, limits cover at most the second [-].
LEAST_SPAN, MOST_SPAN = 1e-4, 0.2


@dataclass(frozen=True, kw_only=True, eq=False)
class FamilyCalibration:
    """Calibration parameters fitted to families, and those fitted to the mean.

    Parameters
    ----------
    names
        Names of the parameters.
    to_mean, to_families
        Factors on the values of the case, shape (p,) [-].
    verdicts_of_mean
        Families over the limits of the model fitted to the mean.
    n_evaluation
        Models whose bands were sampled [-].
    """

    names: tuple[str, ...]
    to_mean: Float[NDArray[np.float64], " p"]
    to_families: Float[NDArray[np.float64], " p"]
    verdicts_of_mean: tuple[FamilyVerdict, ...]
    n_evaluation: int


@dataclass(frozen=True, kw_only=True, eq=False)
class FamilyComparison:
    """Families over limits.

    Parameters
    ----------
    verdicts
        Each family that was compared.
    not_compared
        Measurements that were not compared, and why, as sentences.
    errors
        Noise and frequency jitter; None if nothing was compared.
    limits
        Limits; None if nothing was compared.
    sensors
        Measured sensors.
    level_unit
        Unit of the levels.
    files
        Figures.
    calibration
        Calibration onto families, if it was asked for: the limits are then those of its model.
    preloads
        Preloads of each set-up in the comparison.
    """

    verdicts: tuple[FamilyVerdict, ...]
    not_compared: tuple[str, ...]
    errors: RepeatErrors | None
    limits: FamilyLimits | None
    sensors: tuple[MeasuredSensor, ...]
    level_unit: str
    files: tuple[Path, ...] = ()
    calibration: FamilyCalibration | None = None
    preloads: Preloads = field(default_factory=dict)


def compare_families(
    model: Model,
    budget: Budget,
    campaign: Campaign,
    table: LimitsTable,
    structure: Structure,
    run: RunContext,
    *,
    title: str,
    stem: str,
    executor: Executor | None = None,
) -> FamilyComparison:
    """`find_families`, and its figures in the output folder, under a title."""
    result = find_families(model, budget, campaign, table, structure, run, stem=stem, executor=executor)
    if not result.verdicts:
        return result
    sensors = {item.name: item for item in campaign.sensors}
    drawn = make_family_figures(result.verdicts, sensors, title, campaign.drive.unit)
    files = run.draw({f"{stem}_{name}": figure for name, figure in drawn.items()})
    return replace(result, files=tuple(files))


def find_families(
    model: Model,
    budget: Budget,
    campaign: Campaign,
    table: LimitsTable,
    structure: Structure,
    run: RunContext,
    *,
    stem: str,
    executor: Executor | None = None,
) -> FamilyComparison:
    """Search for the limits of all families of a campaign, and compare.

    Parameters
    ----------
    model, budget
        Model with the sensors of the campaign, and its numerical error.
    campaign
        Campaign as it was read.
    table
        Table [limits] of the case: reach, population, samples, block and seed of the search.
    structure
        Structure of the case, which may give the rest positions of its sliders.
    run
        Output folder with the finished parts of the search, store and progress.
    stem
        Stem of the file names.
    executor
        Runs the tasks; a process for each core by default.

    Raises
    ------
    ComputationFailed
        No rest under the static load, or a process that was killed.
    """
    families = measured_families(campaign)
    chosen, sentences = select_families(model, campaign, families)
    nothing = FamilyComparison(
        verdicts=(), not_compared=sentences, errors=None, limits=None, sensors=campaign.sensors,
        level_unit=campaign.drive.unit,
    )  # fmt: skip
    if not chosen:
        return nothing
    nominal = None if structure.histories is None else structure.histories(1, 0)[0]
    search = make_family_search(model, budget, campaign, chosen, table, nominal)
    step = run.step("reach of the sliders", expected=30)
    try:
        search = search.with_numeric_box(lambda rest: step.run(find_reaches, rest, report=step.report))
    except (BalanceError, NoSteadyState) as error:
        return replace(nothing, not_compared=(*sentences, f"limits of this model cannot be computed: {error}"))
    limits = run_search(find_family_limits, search, stem, run, executor)
    judged = compare_with_limits(campaign, families, chosen, limits, budget)
    return replace(nothing, verdicts=judged.verdicts, errors=judged.errors, preloads=judged.preloads, limits=limits)


def select_families(
    model: Model, campaign: Campaign, families: Sequence[Family]
) -> tuple[tuple[Family, ...], tuple[str, ...]]:
    """Families that have limits, and sentences on all measurements without limits."""
    sensors = {item.name: item for item in campaign.sensors}
    sentences = []
    free = [test.name for test in campaign.tests if test.configuration == "free"]
    if free:
        sentences.append(f"tests without contacts have no friction histories: {', '.join(free)}")
    if not campaign.drive.calibrated:
        sentences.append(
            f"levels are in {campaign.drive.unit}, not in a unit of the model: limits depend on the level, so "
            "calibrate the drive"
        )
        return (), tuple(sentences)
    if not families:
        sentences.append("there is no jointed test with harmonics")
    uncalibrated = [item.name for item in campaign.sensors if not item.calibrated]
    if uncalibrated:
        sentences.append(f"uncalibrated sensors cannot be compared with limits: {', '.join(uncalibrated)}")
    shaken = _list_base_sensors(model)
    if listed := ", ".join(item.name for item in campaign.sensors if item.name in shaken):
        sentences.append(
            f"sensors that read the motion of the shaken base, too: {listed}; limits are those of the motion relative "
            "to it, which a sensor with relative = true reads"
        )
    chosen = []
    others: dict[int, list[str]] = {}
    for family in families:
        sensor = sensors[family.sensor]
        if not sensor.calibrated or sensor.name in shaken:
            continue
        if family.harmonic == 1 or (family.harmonic == 0 and sensor.line is not None):
            chosen.append(family)
        else:
            others.setdefault(family.harmonic, []).append(family.sensor)
    for harmonic, names in sorted(others.items()):
        what = f"harmonic {harmonic}" if harmonic else "the mean"
        listed = ", ".join(dict.fromkeys(names))
        sentences.append(f"{what} of {listed}: limits are those of harmonic 1, and of static contact forces")
    return tuple(chosen), tuple(sentences)


def _list_base_sensors(model: Model) -> set[str]:
    """Names of the sensors that read the motion of a shaken base plus that of the structure relative to it."""
    base = model.base_acceleration
    if base is None:
        return set()
    return {
        item.name
        for item in model.sensors
        if isinstance(item, Sensor) and not item.relative and (base @ item.row).any()
    }


def make_family_search(
    model: Model,
    budget: Budget,
    campaign: Campaign,
    families: Sequence[Family],
    table: LimitsTable,
    nominal: Float[NDArray[np.float64], " s"] | None,
    most: int = MAX_FREQUENCIES,
    fewest: int = MIN_FREQUENCIES,
) -> FamilySearch:
    """The search for the limits of some families."""
    sensors = {item.name: item for item in campaign.sensors}
    channels = tuple(dict.fromkeys((family.sensor, family.harmonic) for family in families))
    moving = [family for family in families if sensors[family.sensor].line is None]
    reach = inf if isinstance(table.reach, str) else table.reach
    frequency = choose_frequencies(moving or families, most, fewest)
    levels = sorted({family.level for family in families})
    return FamilySearch(
        model=model,
        budget=replace(budget, refined=()),
        channels=channels,
        frequency=frequency,
        stops=find_stops(moving or families, frequency),
        levels=tuple(levels),
        nominal=nominal,
        earlier=find_earlier_levels(campaign, levels),
        reach=reach,
        preload_span=PRELOAD_SPAN,
        force_spans=tuple(_compute_force_span([item for item in families if item.level == level]) for level in levels),
        settings=LimitSettings(
            population=table.population,
            sample=table.samples,
            block=table.block,
            seed=table.seed,
            perturbations=1,
            frequencies=1,  # `choose_frequencies` has filled in those between measured ones
        ),
    )


def _compute_force_span(families: Sequence[Family]) -> float:
    """Natural logarithm of the largest factor between measured forces and the level of the limits [-]."""
    span = max(float(np.abs(np.log(family.ratio)).max()) for family in families)
    return min(span, MOST_SPAN) if span > LEAST_SPAN else 0.0


class JudgedFamilies(NamedTuple):
    """Families over their limits, with the estimated differences between set-ups."""

    verdicts: tuple[FamilyVerdict, ...]
    errors: RepeatErrors
    preloads: Preloads


def compare_with_limits(
    campaign: Campaign, families: Sequence[Family], chosen: Sequence[Family], limits: FamilyLimits, budget: Budget
) -> JudgedFamilies:
    """Compare families with their limits: correct them for force and preload, and estimate their noise.

    Parameters
    ----------
    campaign, families
        Campaign and all its families.
    chosen
        Families with limits. Sensors of the others still serve to estimate the frequency of a set-up.
    limits, budget
        Limits, and numerical error of the model.
    """
    rest = [family for family in families if family not in chosen]
    errors = estimate_repeat_errors(campaign, [*correct_families(chosen, limits), *rest])
    preloads = estimate_preloads(chosen, limits, errors, budget)
    corrected = correct_families(chosen, limits, preloads, errors)
    errors = estimate_repeat_errors(campaign, [*corrected, *rest])
    return JudgedFamilies(judge_families(corrected, limits, errors, budget), errors, preloads)


def correct_families(
    families: Sequence[Family],
    limits: FamilyLimits,
    preloads: Preloads | None = None,
    errors: RepeatErrors | None = None,
) -> tuple[Family, ...]:
    """Each family at the force of its level and the preloads of the model; see `correct_family`.

    If the noise is known, forces are assumed to have the noise of the sensor.
    """
    noise = {} if errors is None else {channel: own.relative for channel, own in errors.noise.items()}
    return tuple(
        correct_family(family, limits.band(family), preloads, noise.get((family.sensor, family.harmonic), 0.0))
        for family in families
    )


def estimate_preloads(
    families: Sequence[Family], limits: FamilyLimits, errors: RepeatErrors, budget: Budget
) -> Preloads:
    """Preloads of each set-up over those of the model; see `estimate_preload_offsets`."""
    set_up, model = _compute_frequency_errors(families, limits, errors, budget)
    return estimate_preload_offsets(*_with_bands(families, limits, errors), set_up=set_up, model=model)


def judge_families(
    families: Sequence[Family], limits: FamilyLimits, errors: RepeatErrors, budget: Budget
) -> tuple[FamilyVerdict, ...]:
    """Each family, as `correct_families` has it, over its band."""
    families, bands, noise = _with_bands(families, limits, errors)
    n_reading = count_readings(families)
    set_up, model = _compute_frequency_errors(families, limits, errors, budget)
    offsets = estimate_frequency_offsets(families, bands, noise, set_up=set_up, model=model)
    return tuple(
        judge_family(family, band, own, shift=0.0, n_reading=n_reading, offsets=offsets)
        for family, band, own in zip(families, bands, noise, strict=True)
    )


def _with_bands(
    families: Sequence[Family], limits: FamilyLimits, errors: RepeatErrors
) -> tuple[Sequence[Family], list[PredictedBand], list[ReadingNoise]]:
    """Families, and band and noise of each."""
    noise = [errors.noise[family.sensor, family.harmonic] for family in families]
    return families, [limits.band(family) for family in families], noise


def _compute_frequency_errors(
    families: Sequence[Family], limits: FamilyLimits, errors: RepeatErrors, budget: Budget
) -> tuple[float, float]:
    """Standard deviations of the frequency from one set-up to another and of the model, relative [-]."""
    # Resonances determine the frequency; the effect of a contact's error on it differs little from level to level.
    by_contact = [shift for family in families if (shift := limits.band(family).shift)]
    shift = float(np.hypot(budget.frequency, np.median(by_contact) if by_contact else 0.0))
    return errors.frequency, shift
