"""The band of steady responses that unknown friction history can produce, over frequency and level."""

from collections.abc import Callable, MutableMapping, Sequence
from concurrent.futures import Executor
from typing import Any

import numpy as np

from fe.blas_threads import on_one_blas_thread
from hbsolve.balance import HarmonicBalance
from hbsolve.errors import BalanceError
from hbsolve.limits.auxiliary_frequencies import SearchedFrequencies, add_auxiliary_frequencies
from hbsolve.limits.certificate import RADII, Certificate
from hbsolve.limits.local_search import LimitSide
from hbsolve.limits.objective import Objective
from hbsolve.limits.optimum import LimitKey, Optima
from hbsolve.limits.problem import Frequencies, LimitProblem
from hbsolve.limits.random_histories import Audit
from hbsolve.limits.result import ResponseLimits, make_blank_arrays
from hbsolve.limits.search import LimitSettings, StagedSearch
from hbsolve.limits.slider_bounds import SliderBox, Sliders, choose_starting_sliders, make_slider_box
from hbsolve.limits.task import Runner, StageProgress
from reduction.array_input import check_array
from reduction.array_type import Real


def limit_problem(
    balance: HarmonicBalance,
    objective: Objective,
    *,
    nominal: Sequence[float] | Real | None = None,
    reach: float | Sequence[float] | Real | None = None,
) -> LimitProblem:
    """Problem of bounding an objective over a box of slider states.

    Parameters
    ----------
    balance
        Balance of the system; its friction contacts have one tangent, or two, each with its own friction limit.
    objective
        `OutputHarmonic`, `ContactForceHarmonic` or `LossFactor`.
    nominal
        Centre of the box, shape (s,) [m]; by default the slider positions under the static load.
    reach
        w_max, largest distance by which the loading history may have dragged a slider from `nominal` [m], one number or
        shape (s,); by default the mean of mu N / k_t at rest. It may be infinite, but bodies held by friction alone
        then jam without bound.

    Raises
    ------
    BalanceError
        No sliders, coupled tangents, or an output, centre or reach that does not fit.
    NoSteadyState
        No state of rest under the static load.
    """
    # The structure at rest is the same at all frequencies.
    box = make_slider_box(balance, balance.at(1.0), nominal, reach)
    return LimitProblem(balance=balance, objective=objective, box=box)


@on_one_blas_thread
def response_limits(
    problem: LimitProblem,
    angular_frequency: Sequence[float] | Frequencies,
    levels: Sequence[float] | Real,
    *,
    settings: LimitSettings | None = None,
    store: MutableMapping[str, Any] | None = None,
    executor: Executor | None = None,
    progress: Callable[[StageProgress], None] | None = None,
) -> ResponseLimits:
    """Largest and smallest value of the objective over all slider states of the box, at each frequency and level.

    Parameters
    ----------
    problem
        Problem, from `limit_problem`.
    angular_frequency
        Omega, ascending, shape (f,) [rad/s]. The search uses neighbours, and adds frequencies if few are given.
    levels
        Scales of the harmonic force, ascending and positive [-].
    settings
        Effort of the search.
    store
        Mapping that keeps the result of each task by name: with a persistent store an interrupted search can continue.
        It is valid only for the same arguments, except the executor.
    executor
        Executor of the tasks, such as a process pool; this process by default. The limits do not depend on it.
    progress
        Called after each task.

    Raises
    ------
    BalanceError
        Frequencies or levels that are not positive and ascending.
    """
    chosen = settings or LimitSettings()
    omega = check_ascending(angular_frequency, "angular_frequency")
    scale = check_ascending(levels, "levels")
    searched = add_auxiliary_frequencies(problem.balance, omega, chosen.frequencies)
    starts = make_starts_by_level(problem, searched.angular_frequency, scale, chosen)
    run = Runner.from_problem(problem, searched.angular_frequency, store, executor, progress)
    best, audits, certificates = StagedSearch(run=run, levels=scale.tolist(), starts=starts, settings=chosen).limits()
    return collect_limits(problem, searched, scale, best, audits, certificates)


def make_starts_by_level(
    problem: LimitProblem, omega: Frequencies, levels: Real, settings: LimitSettings
) -> list[list[Sliders]]:
    """Sliders of the population at each level, in the box of the level."""
    at_rest = problem.balance.at(float(omega[0]))

    def starts(box: SliderBox) -> list[Sliders]:
        return choose_starting_sliders(
            problem.balance, at_rest, problem.sliders, box, settings.population, settings.seed
        )

    if not problem.boxes:
        return [starts(problem.box)] * len(levels)
    return [starts(problem.box_at(level)) for level in levels.tolist()]


def check_ascending(given: object, what: str) -> Frequencies:
    """Return positive, ascending numbers; refuse others (`BalanceError`)."""
    values = np.atleast_1d(np.array(check_array(given, what, BalanceError)))
    if values.ndim != 1 or not len(values) or not np.isfinite(values).all() or not (values > 0).all():
        raise BalanceError(f"{what} must be positive numbers: {values}")
    if (np.diff(values) <= 0).any():
        at = int(np.flatnonzero(np.diff(values) <= 0)[0])
        raise BalanceError(f"{what} must ascend, but {values[at + 1]:g} comes after {values[at]:g}")
    return values


def collect_limits(
    problem: LimitProblem,
    searched: SearchedFrequencies,
    levels: Real,
    best: list[Optima],
    audits: list[dict[int, Audit]],
    certificates: list[dict[LimitKey, Certificate]],
) -> ResponseLimits:
    """Arrays of the optima, audits and certificates of each level, at the requested frequencies."""
    balance, omega = problem.balance, searched.angular_frequency[searched.requested]
    requested = {int(index): row for row, index in enumerate(searched.requested)}
    arrays = make_blank_arrays(
        side=2, level=len(levels), point=len(omega), direction=balance.n_direction, radius=len(RADII), state=3,
        coefficient=2 * balance.n_harmonic - 1, slider_number=balance.n_slider,
    )  # fmt: skip
    for level in range(len(levels)):
        for (index, side), optimum in best[level].items():
            if (row := requested.get(index)) is None:
                continue
            answer = {"value": optimum.value, "motion": optimum.motion, "initial_slider": optimum.initial_slider}
            for name, value in (answer | certificates[level][index, side]).items():
                arrays[name][list(LimitSide).index(side), level, row] = value
        for index, audit in audits[level].items():
            if (row := requested.get(index)) is None:
                continue
            arrays["n_sampled"][level, row] = audit.count
            arrays["sampled"][:, level, row] = (audit.lowest, audit.highest) if audit.count else np.nan
            arrays["n_outside"][:, level, row] = audit.below, audit.above
    reach = np.array([problem.box_at(level).reach for level in levels.tolist()])
    given = {"angular_frequency": omega, "level": levels, "nominal": problem.box.nominal, "reach": reach}
    return ResponseLimits(**arrays | given)
