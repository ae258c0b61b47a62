"""Limits of all families of a campaign, in one search: a stage with stored tasks."""

from collections.abc import Callable, Mapping, MutableMapping
from concurrent.futures import BrokenExecutor, Executor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from correlation.family.band import PredictedBand
from correlation.family.family import Family
from correlation.family.limit_reading import LimitReadings, LimitStates, make_reading_objective, read_limits
from correlation.model import Model
from correlation.noise.nuisance import Budget
from geometry.errors import ComputationFailed
from hbsolve.balance import HarmonicBalance
from hbsolve.errors import NoSteadyState
from hbsolve.limits.problem import LimitProblem
from hbsolve.limits.response_limits import limit_problem
from hbsolve.limits.result import ResponseLimits
from hbsolve.limits.search import LimitSettings
from hbsolve.limits.several_limits import several_limits
from hbsolve.limits.task import Runner, SearchTask, StageProgress
from hbsolve.limits.vibration_bounds import compute_vibration_bounds
from pipeline.store import stage
from study.limits.several.progress import SeveralSearchProgress

#: Share of the time that the search takes; the rest is the reading of its limits. Measured on the shipped rig [-].
SEARCH = 0.5
#: Sensor and harmonic.
Channel = tuple[str, int]
Reaches = Float[NDArray[np.float64], "l s"]


@dataclass(frozen=True, kw_only=True, eq=False)
class FamilySearch:
    """All inputs of the limits of a campaign's families.

    Parameters
    ----------
    model
        Model with the sensors of the campaign.
    budget
        Its numerical error.
    channels
        Sensors and harmonics whose limits are searched for.
    frequency
        Ascending frequencies, shape (f,) [Hz].
    levels
        Ascending levels, shape (l,) [N, or the unit of the drive].
    nominal
        Centre of the box of slider positions, shape (s,) [m]; None for rest under the static load. Without a reach it
        is the middle of Coulomb's cone there.
    earlier
        Whether the test has passed a level (column) when it is at another or the same (row), shape (l, l).
    reach
        Largest distance that loading histories may have dragged a slider [m]: one number, or one per level and slider,
        shape (l, s). None to compute it: static forces within Coulomb's cone at rest, and the drag of each slider at
        the levels that the test has passed.
    settings
        Effort of the search.
    stops
        Frequencies at which the campaign's curves stop, each as ascending indices into `frequency`.
    force_spans
        Natural logarithm of the largest factor between the measured forces and each level, shape (l,); 0 for none [-].
    preload_span
        The same for the preloads of set-ups relative to those of the model [-].
    """

    model: Model
    budget: Budget
    channels: tuple[Channel, ...]
    frequency: Float[NDArray[np.float64], " f"]
    levels: tuple[float, ...]
    nominal: Float[NDArray[np.float64], " s"] | None
    earlier: Bool[NDArray[np.bool_], "l l"]
    reach: float | Float[NDArray[np.float64], "l s"] | None
    settings: LimitSettings
    stops: tuple[tuple[int, ...], ...] = ()
    force_spans: tuple[float, ...]
    preload_span: float

    @property
    def angular_frequency(self) -> Float[NDArray[np.float64], " f"]:
        """Angular frequencies of the model, with the frequency shift of its joints, shape (f,) [rad/s]."""
        return np.asarray(2 * np.pi * self.frequency * (1 + self.model.frequency_shift.get("jointed", 0.0)))

    def problem(self) -> LimitProblem:
        """System and box, with the objective of the first channel.

        Raises
        ------
        BalanceError
            No contact slides, or contacts whose limits cannot be searched for.
        NoSteadyState
            No rest under the static load.
        """
        model = self.model
        balance = HarmonicBalance(system=model.system, n_harmonic=model.n_harmonic, n_sample=model.n_sample)
        sensors = {item.name: item for item in model.sensors}
        name, harmonic = self.channels[0]
        objective = make_reading_objective(model, sensors[name], harmonic)
        if isinstance(self.reach, np.ndarray):
            problem = limit_problem(balance, objective, nominal=self.nominal, reach=self.reach.max(axis=0))
            return problem.with_reaches(self.levels, self.reach)
        return limit_problem(balance, objective, nominal=self.nominal, reach=self.reach)

    def with_numeric_box(self, find: "Callable[[FamilySearch], Reaches] | None" = None) -> "FamilySearch":
        """The same with the bounds of the sliders as numbers, so that every process searches the same box.

        Parameters
        ----------
        find
            `find_reaches`, or the same with a store and progress.

        Raises
        ------
        BalanceError, NoSteadyState
            As `problem`.
        """
        box = self.problem().box
        if self.reach is not None:
            return replace(self, nominal=box.nominal)
        # Allow any friction force at rest: the nominal one may be at one end of the cone.
        rest = replace(self, nominal=box.middle, reach=np.tile(box.static, (len(self.levels), 1)))
        reaches = (find or find_reaches)(rest)
        return replace(rest, reach=np.array([reaches[before].max(axis=0) for before in self.earlier]))


@stage("reach of the sliders", ignore=("report",))
def find_reaches(rest: FamilySearch, report: Callable[[float, float], None] | None = None) -> Reaches:
    """Bounds of the sliders at each level by `compute_vibration_bounds`, shape (l, s) [m]."""
    largest = [level * float(np.exp(span)) for level, span in zip(rest.levels, rest.force_spans, strict=True)]
    return compute_vibration_bounds(rest.problem(), rest.angular_frequency, largest, stops=rest.stops, report=report)


@dataclass(frozen=True, kw_only=True, eq=False)
class FamilyLimits:
    """Limits found by a search.

    Parameters
    ----------
    bands
        Bands in the order of the levels, by channel.
    levels
        Ascending levels, shape (l,).
    reach
        Largest distance that each slider may have been dragged at each level, shape (l, s) [m].
    n_sampled
        Random histories at each frequency and level, on average [-].
    """

    bands: Mapping[Channel, tuple[PredictedBand, ...]]
    levels: tuple[float, ...]
    reach: Reaches
    n_sampled: float

    def band(self, family: Family) -> PredictedBand:
        """The band of a family."""
        return self.bands[family.sensor, family.harmonic][self.levels.index(family.level)]


@stage("limits of families", ignore=("tasks", "executor", "report"))
def find_family_limits(
    search: FamilySearch,
    tasks: MutableMapping[str, Any] | None = None,
    executor: Executor | None = None,
    report: Callable[[float, float], None] | None = None,
) -> FamilyLimits:
    """Search for the limits, or go on with a search that was stopped.

    Parameters
    ----------
    search
        Inputs of the search.
    tasks
        Results of finished tasks.
    executor
        Runs them; this process by default.
    report
        Progress.

    Raises
    ------
    ComputationFailed
        No rest under the static load, or a process that was killed.
    """
    store = {} if tasks is None else tasks
    model, sensors = search.model, {item.name: item for item in search.model.sensors}
    omega = search.angular_frequency
    objectives = {
        f"{name}, harmonic {harmonic}": make_reading_objective(model, sensors[name], harmonic)
        for name, harmonic in search.channels
    }
    try:
        problem = search.problem()
        result = several_limits(
            problem, objectives, omega, search.levels, settings=search.settings, store=store, executor=executor,
            progress=None if report is None else SeveralSearchProgress(_report_first_part(report)),
        )  # fmt: skip
        readings = _run_readings(search, problem, omega, [*result.values()], store, executor, report)
    except NoSteadyState as error:
        raise ComputationFailed(f"limits: {error}") from error
    except BrokenExecutor as error:
        raise ComputationFailed(
            "a process of the search for limits was killed, most often for lack of memory: close other programs, or "
            "take fewer samples in [limits]; what was finished is stored, and the same command continues from there"
        ) from error
    bands = {
        channel: tuple(
            PredictedBand(
                frequency=search.frequency, value=read[number].value, deviation=read[number].deviation,
                jump=limits.jump[:, level], shift=read[number].shift,
                by_force=read[number].by_force, by_preload=read[number].by_preload,
            )
            for level, read in enumerate(readings)
        )
        for number, (channel, limits) in enumerate(zip(search.channels, result.values(), strict=True))
    }  # fmt: skip
    sampled = float(np.mean([limits.n_sampled.mean() for limits in result.values()]))
    reach = next(iter(result.values())).reach
    return FamilyLimits(bands=bands, levels=search.levels, reach=reach, n_sampled=sampled)


def _run_readings(
    search: FamilySearch, problem: LimitProblem, omega: NDArray[np.float64], searched: list[ResponseLimits],
    store: MutableMapping[str, Any], executor: Executor | None, report: Callable[[float, float], None] | None,
) -> list[list[LimitReadings]]:  # fmt: skip
    """Sensor readings at the limits, by level and channel."""

    def progress(stage: StageProgress) -> None:
        if report is not None and stage.done:
            report(SEARCH + (1 - SEARCH) * stage.done / stage.total, 1.0)

    tasks = []
    for number, level in enumerate(search.levels):
        states = [
            LimitStates(
                sensor=name, harmonic=harmonic, motion=limits.motion[:, number], slider=limits.initial_slider[:, number]
            )
            for (name, harmonic), limits in zip(search.channels, searched, strict=True)
        ]
        budget = replace(search.budget, refined=())
        arguments = search.model, budget, states, search.force_spans[number], search.preload_span
        tasks.append(SearchTask(f"readings, level {number}", read_limits, level, arguments))
    return Runner.from_problem(problem, omega, store, executor, progress)("readings", tasks)


def _report_first_part(report: Callable[[float, float], None]) -> Callable[[float, float], None]:
    """Progress of the search, before that of the readings."""
    return lambda done, total: report(SEARCH * done, total)
