"""Limits of one nonlinear iteration beside what was measured: the response over frequency, the forces at resonance."""

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from correlation.campaign.measurement import Campaign
from correlation.family.family import Family, FamilyCurve, measured_families
from correlation.family.noise import RepeatErrors, estimate_repeat_errors
from correlation.family.verdict import FamilyVerdict, count_readings, judge_family
from study.compare.families import family_search, judge_families
from study.compare.family_limits import FamilySearch, find_family_limits, find_reaches
from study.limits.stored_search import run_search
from study.limits.table import LimitsTable
from study.paper.model import PaperModel
from study.paper.parameters import RigParameters
from study.run_context import RunContext

TIP = "tip"


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredFamilies:
    """What was measured.

    Parameters
    ----------
    response
        Amplitude of the tip at each level.
    forces
        Static and dynamic forces at the frequency of the highest mean response of their level, one point per curve.
    errors
        Noise and frequency jitter.
    peak
        That frequency by level [Hz].
    """

    response: tuple[Family, ...]
    forces: tuple[Family, ...]
    errors: RepeatErrors
    peak: Mapping[float, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class IterationLimits:
    """Families over the limits of an iteration; no forces where they were not searched for."""

    response: tuple[FamilyVerdict, ...]
    forces: tuple[FamilyVerdict, ...]


def read_families(campaign: Campaign) -> MeasuredFamilies:
    """Families of the paper's figures: the tip, and the forces of each line at resonance."""
    families = measured_families(campaign)
    response = tuple(item for item in families if item.sensor == TIP and item.harmonic == 1)
    index, peak = {}, {}
    for family in response:
        # All repeats step through the same points; their frequencies differ by the jitter alone.
        mean = np.mean([curve.value for curve in family.curves], axis=0)
        index[family.level] = int(np.argmax(mean))
        peak[family.level] = float(np.mean([curve.frequency[np.argmax(mean)] for curve in family.curves]))
    forces = tuple(
        _at(family, index[family.level], peak[family.level])
        for family in families
        if family.sensor != TIP and family.harmonic in (0, 1)
    )
    return MeasuredFamilies(
        response=response, forces=forces, errors=estimate_repeat_errors(campaign, families), peak=peak
    )


def _at(family: Family, index: int, frequency: float) -> Family:
    curves = [
        FamilyCurve(
            test=curve.test, repeat=curve.repeat, sweep=curve.sweep, frequency=np.array([frequency]),
            value=curve.value[[index]],
        )
        for curve in family.curves
    ]  # fmt: skip
    return replace(family, curves=tuple(curves))


def find_limits(
    model: PaperModel, parameters: RigParameters, measured: MeasuredFamilies, run: RunContext, stem: str,
    executor: Executor,
) -> IterationLimits:  # fmt: skip
    """Search for the limits of an iteration, and lay what was measured over them.

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
    read = model.read(parameters)
    budget, effort = read.setup.budget, model.effort
    table = LimitsTable(population=effort.population, samples=effort.samples)
    search = family_search(
        read.setup.model, budget, model.campaign, measured.response, table, None, most=effort.frequencies,
        fewest=effort.frequencies,
    )  # fmt: skip
    step = run.step(f"{stem}: reach of the sliders", expected=20)
    search = search.boxed(lambda rest: step.run(find_reaches, rest, report=step.report))
    found = run_search(find_family_limits, search, f"{stem}_response", run, executor)
    response = judge_families(measured.response, found, measured.errors, budget, search)
    return IterationLimits(response=response, forces=tuple(_forces(search, measured, run, stem, executor)))


def _forces(
    search: FamilySearch, measured: MeasuredFamilies, run: RunContext, stem: str, executor: Executor
) -> Sequence[FamilyVerdict]:
    result = []
    for number, level in enumerate(search.levels):
        families = [family for family in measured.forces if family.level == level]
        assert isinstance(search.reach, np.ndarray)
        own = replace(
            search,
            channels=tuple((family.sensor, family.harmonic) for family in families),
            frequency=np.array([measured.peak[level]]),
            levels=(level,),
            earlier=np.eye(1, dtype=bool),
            reach=search.reach[[number]],
        )
        found = run_search(find_family_limits, own, f"{stem}_forces_{level:g}N", run, executor)
        n_reading = count_readings(measured.forces)
        for family in families:
            channel = family.sensor, family.harmonic
            result.append(
                judge_family(
                    family,
                    found.bands[channel][0],
                    measured.errors.noise[channel],
                    shift=measured.errors.frequency,
                    n_reading=n_reading,
                )
            )
    return result


def furthest_outside(verdict: FamilyVerdict) -> float:
    """Largest distance of a reading outside of its limits, 0 inside [SI unit of the sensor]."""
    lower, upper = verdict.limit
    beyond = np.maximum(lower - verdict.family.value, verdict.family.value - upper)
    return max(float(np.nanmax(beyond, initial=-inf)), 0.0)
