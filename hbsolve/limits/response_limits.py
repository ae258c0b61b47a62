"""The band of steady responses that unknown friction history can produce, over frequency and level."""

from collections.abc import Callable, MutableMapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fe.blas_threads import on_one_blas_thread
from hbsolve.balance import HarmonicBalance
from hbsolve.errors import BalanceError
from hbsolve.limits.audit import Audit
from hbsolve.limits.box import slider_box
from hbsolve.limits.certificate import RADII, Certificate
from hbsolve.limits.local_search import LimitSide
from hbsolve.limits.objective import Objective
from hbsolve.limits.optimum import Best, Key
from hbsolve.limits.problem import Frequencies, LimitProblem
from hbsolve.limits.result import ResponseLimits
from hbsolve.limits.search import StagedSearch
from hbsolve.limits.starts import starting_sliders
from hbsolve.limits.task import Runner, StageProgress
from reduction.array_input import real_array, whole_number


@dataclass(frozen=True, kw_only=True)
class LimitSettings:
    """How hard limits are searched for.

    Parameters
    ----------
    population
        Slider states that are continued along frequency [-].
    sample
        Random histories of the audit; 0 for none [-].
    block
        Frequencies of a task: results do depend on it, but not on the number of workers [-].
    seed
        Of random starts, kicks and histories.

    Raises
    ------
    BalanceError
        A number that is not whole, or too small.
    """

    population: int = 24
    sample: int = 100
    block: int = 15
    seed: int = 0

    def __post_init__(self) -> None:
        for name, least in (("population", 1), ("sample", 0), ("block", 1), ("seed", 0)):
            value = whole_number(getattr(self, name), name, BalanceError)
            if value < least:
                raise BalanceError(f"{name} = {value} must be {least} at least")


def limit_problem(
    balance: HarmonicBalance,
    objective: Objective,
    *,
    nominal: Sequence[float] | NDArray[np.float64] | None = None,
    reach: float | None = None,
) -> LimitProblem:
    """What shall be bounded, in which box of slider states.

    Parameters
    ----------
    balance
        The system; friction contacts with one tangent, or two with limits of their own.
    objective
        `Output`, `ContactForce` or `LossFactor`.
    nominal
        Centre of the box, shape (s,) [m]; by default where the static load leaves the sliders.
    reach
        w_max, how far the loading history may have dragged a slider from there [m]; by default the mean of mu N / k_t
        at rest. Infinite is allowed, but bodies that friction alone holds then jam without bound.

    Raises
    ------
    BalanceError
        No sliders, coupled tangents, or an output, centre or reach that does not fit.
    NoSteadyState
        There is no rest under the static load.
    """
    # The structure at rest is the same at all frequencies.
    box = slider_box(balance, balance.at(1.0), nominal, reach)
    return LimitProblem(balance=balance, objective=objective, box=box)


@on_one_blas_thread
def response_limits(
    problem: LimitProblem,
    angular_frequency: Sequence[float] | Frequencies,
    levels: Sequence[float] | NDArray[np.float64],
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
        From `limit_problem`.
    angular_frequency
        Ascending, shape (f,) [rad/s]; neighbours help each other, so one curve is better than single points.
    levels
        Scales of the harmonic force, ascending and positive [-].
    settings
        How hard to search.
    store
        Keeps the result of each task under a name: one that lasts lets a search that was stopped go on. It belongs to
        these arguments alone, the executor excepted.
    executor
        Runs the tasks, such as a process pool; this process by default. The limits are the same.
    progress
        Called after each task.

    Raises
    ------
    BalanceError
        Frequencies or levels that are not positive and ascending.
    """
    chosen = settings or LimitSettings()
    omega = _ascending(angular_frequency, "angular_frequency")
    scale = _ascending(levels, "levels")
    starts = starting_sliders(
        problem.balance, problem.balance.at(float(omega[0])), problem.sliders, problem.box, chosen.population,
        chosen.seed,
    )  # fmt: skip
    run = Runner.of(problem, omega, store, executor, progress)
    search = StagedSearch(
        run=run, levels=scale.tolist(), starts=starts, block=chosen.block, sample=chosen.sample, seed=chosen.seed
    )
    best, audits, certificates = search.limits()
    return _result(problem, omega, scale, best, audits, certificates)


def _ascending(given: object, what: str) -> Frequencies:
    values = np.atleast_1d(np.array(real_array(given, what, BalanceError)))
    if values.ndim != 1 or not len(values) or not np.isfinite(values).all() or not (values > 0).all():
        raise BalanceError(f"{what} must be positive numbers: {values}")
    if (np.diff(values) <= 0).any():
        at = int(np.flatnonzero(np.diff(values) <= 0)[0])
        raise BalanceError(f"{what} must ascend, but {values[at + 1]:g} comes after {values[at]:g}")
    return values


def _result(
    problem: LimitProblem,
    omega: Frequencies,
    levels: NDArray[np.float64],
    best: list[Best],
    audits: list[dict[int, Audit]],
    certificates: list[dict[Key, Certificate]],
) -> ResponseLimits:
    shape = (2, len(levels), len(omega))
    s, d, nh = problem.balance.n_slider, problem.balance.n_direction, 2 * problem.balance.n_harmonic - 1
    arrays: dict[str, NDArray[Any]] = {
        "value": np.full(shape, np.nan),
        "motion": np.full((*shape, d, nh), np.nan),
        "slider": np.full((*shape, s), np.nan),
        "sampled": np.full(shape, np.nan),
        "n_sampled": np.zeros(shape[1:], dtype=np.int64),
        "n_outside": np.zeros(shape, dtype=np.int64),
    }
    wide = {"predicted": len(RADII), "realised": len(RADII), "multiplier": s, "share": 3}
    kinds: dict[str, Any] = dict.fromkeys(("starts", "stuck", "on_bound"), np.int64)
    kinds |= dict.fromkeys(("repaired", "jump"), bool)
    names = [each.name for each in fields(Certificate)]
    for name in names:
        size = (*shape, wide[name]) if name in wide else shape
        kind = kinds.get(name, np.float64)
        arrays[name] = np.full(size, np.nan) if kind is np.float64 else np.zeros(size, dtype=kind)
    for level in range(len(levels)):
        for row, side in enumerate(LimitSide):
            for at in range(len(omega)):
                key = at, side
                if key not in best[level]:
                    continue
                optimum, where = best[level][key], (row, level, at)
                arrays["value"][where], arrays["motion"][where] = optimum.value, optimum.x
                arrays["slider"][where] = optimum.w
                for name in names:
                    arrays[name][where] = getattr(certificates[level][key], name)
        for at, audit in audits[level].items():
            arrays["n_sampled"][level, at] = audit.count
            arrays["sampled"][:, level, at] = (audit.lowest, audit.highest) if audit.count else np.nan
            arrays["n_outside"][:, level, at] = audit.below, audit.above
    return ResponseLimits(
        angular_frequency=omega, level=levels, nominal=problem.box.nominal, reach=problem.box.reach, **arrays
    )
