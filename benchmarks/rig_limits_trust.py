"""Reliability of the limits of the shipped rig, and their cost against other methods.

    OMP_NUM_THREADS=1 python -m benchmarks.rig_limits_trust [--histories 300] [--race SECONDS] [--spacing HZ]

The case is `study/cases/rig.toml` with another frequency step. The limits are searched with two seeds. New histories
outside the finished limits of the first are counted, the limits are repaired by an audit with further histories, and as
many new histories are counted again. Where upper and lower limit are far apart, one local search from the best sampled
state is compared with the limit. The race compares the local search with searches in the full space
(`limits_full_space.py`) for single upper limits from the same start: `trust-constr` until a state is within 1 % of the
best known value, IPOPT until it has converged.
"""

import argparse
import os
import time
from collections.abc import Sequence

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(threads, "1")  # before numpy reads them

import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from benchmarks.limits_full_space import race  # noqa: E402
from benchmarks.rig_case import prepared  # noqa: E402
from hbsolve.limits.local_search import LimitSide, local_search  # noqa: E402
from hbsolve.limits.optimum import Optima, Optimum  # noqa: E402
from hbsolve.limits.problem import LimitCurve, LimitProblem  # noqa: E402
from hbsolve.limits.random_histories import (  # noqa: E402
    audit,
    independent_histories,
    sampled_states,
)
from hbsolve.limits.response_limits import response_limits  # noqa: E402
from hbsolve.limits.result import ResponseLimits  # noqa: E402
from hbsolve.limits.search import LimitSettings  # noqa: E402
from hbsolve.limits.task import StageProgress  # noqa: E402
from study.kind.registry import open_case  # noqa: E402
from study.limits.model import make_limit_search  # noqa: E402
from study.limits.table import LimitsTable  # noqa: E402
from study.shipped_cases import RIG  # noqa: E402

Real = NDArray[np.float64]
#: Levels [N] and frequencies [Hz] of the race: the resonance and its flanks.
RACE = ((3.0, 254.0), (5.0, 254.0), (10.0, 253.0))
#: Smallest ratio of upper to lower limit for the comparison with a local search, and its target, which is only printed.
WIDE, REACHED = 1.02, 0.05


def rig_problem(spacing: float) -> tuple[LimitProblem, Real, tuple[float, ...]]:
    """Limit problem of the shipped case, its angular frequencies at the given spacing [Hz], and its levels."""
    rig = prepared(open_case(RIG), contact={"tangents": "along"})
    table = LimitsTable.model_validate({"step": f"{spacing} Hz"})
    search = make_limit_search(rig.case, table, rig.case.sweep, rig.model)
    return search.problem(), np.array(search.angular_frequency), search.levels


def timed(
    problem: LimitProblem, omega: Sequence[float] | Real, levels: Sequence[float], settings: LimitSettings
) -> tuple[ResponseLimits, float, float]:
    """Limits, and the processor time of the search and of its audit [s]."""
    audit, last = 0.0, time.process_time()

    def progress(step: StageProgress) -> None:
        nonlocal audit, last
        now = time.process_time()
        audit += (now - last) * (step.stage == "audit")
        last = now

    began = last
    limits = response_limits(problem, omega, levels, settings=settings, progress=progress)
    return limits, time.process_time() - began - audit, audit


def count_outside(problem: LimitProblem, limits: ResponseLimits, histories: int, seed: int) -> None:
    """Print how many new histories lie outside the limits."""
    fresh = independent_histories(problem, limits, histories, seed=seed)
    for level, excess in zip(limits.level, fresh.excess, strict=True):
        result = excess[np.isfinite(excess)]
        if not result.size:
            print(f"  {level:g} N: no states")
            continue
        worst = np.unravel_index(np.nanargmax(excess), excess.shape)[0]
        print(
            f"  {level:g} N: {result.size} states, {(result > 1e-3).sum()} outside by more than 0.1 %, "
            f"{(result > 5e-3).sum()} by more than 0.5 %, worst {result.max():.3%} at {limits.frequency[worst]:.2f} Hz"
        )
    print(f"  all: {fresh.share_outside(1e-3):.4%} outside by more than 0.1 %", flush=True)


def repaired(problem: LimitProblem, limits: ResponseLimits, histories: int, seed: int) -> ResponseLimits:
    """Limits after repair by an audit with the given number of histories."""
    value = limits.value.copy()
    numbers = range(len(limits.angular_frequency))
    for row, level in enumerate(limits.level):
        best: Optima = {
            (at, side): Optimum(
                value=limits.value[k, row, at],
                motion=limits.motion[k, row, at],
                initial_slider=limits.initial_slider[k, row, at],
                residual_norm=0.0,
            )
            for at in numbers
            for k, side in enumerate(LimitSide)
            if np.isfinite(limits.value[k, row, at])
        }
        curve = LimitCurve(problem=problem, level=float(level), angular_frequency=limits.angular_frequency)
        mended, _, _ = audit(curve, numbers, best, histories, (seed, row))
        for (at, side), optimum in mended.items():
            value[list(LimitSide).index(side), row, at] = optimum.value
    changed = np.abs(value / limits.value - 1)
    print(
        f"  repaired: {(changed > 1e-5).sum()} of {value.size} limits, by {np.nanmax(changed):.2%} at most", flush=True
    )
    fields = {name: getattr(limits, name) for name in limits.__dataclass_fields__} | {"value": value}
    return ResponseLimits(**fields)


def reached(problem: LimitProblem, limits: ResponseLimits, histories: int, seed: int) -> None:
    """Print how near one local search from the best sampled state comes to limits that are far apart."""
    numbers = range(len(limits.angular_frequency))
    worst, points = 0.0, 0
    for row, level in enumerate(limits.level):
        curve = LimitCurve(problem=problem, level=float(level), angular_frequency=limits.angular_frequency)
        states = sampled_states(curve, numbers, histories, (seed, row))
        for at in numbers:
            if not limits.upper[row, at] > WIDE * limits.lower[row, at]:
                continue
            point = curve.point(at)
            for k, side in enumerate(LimitSide):
                if (at, side) not in states.extreme:
                    continue
                settled = point.settle(*states.extreme[at, side])
                if settled is None:
                    continue
                limit = limits.value[k, row, at]
                worst = max(worst, side * (limit - local_search(point, settled, side).value) / limit)
                points += 1
    print(f"samples and a local search: {points} limits of wide bands, at most {worst:.2%} short (aim {REACHED:.0%})")


def races(problem: LimitProblem, limits: ResponseLimits, seconds: float) -> None:
    """Print the cost of single upper limits: local search, full space, and limit search of this point alone."""
    for level, frequency in RACE:
        at, row = int(np.abs(limits.frequency - frequency).argmin()), list(limits.level).index(level)
        race(problem, limits, row, at, seconds)
        alone = LimitSettings(sample=0, frequencies=1)
        own, spent, _ = timed(problem, [float(limits.angular_frequency[at])], [level], alone)
        print(f"  search of this point alone, both limits: {own.upper[0, 0] * 1e6:.3f} um in {spent:.2f} s", flush=True)


def main() -> None:
    """Print all results."""
    words = argparse.ArgumentParser()
    words.add_argument("--histories", type=int, default=300)
    words.add_argument("--race", type=float, default=0.0, metavar="SECONDS", help="for each of the other ways")
    words.add_argument("--spacing", type=float, default=0.25, metavar="HZ")
    asked = words.parse_args()
    problem, omega, levels = rig_problem(asked.spacing)
    # Compile the kernels.
    response_limits(problem, [omega[0]], levels[:1], settings=LimitSettings(sample=2, frequencies=1))
    limits, search, audit = timed(problem, omega, levels, LimitSettings())
    points = limits.lower.size
    print(f"search {search:.1f} s, {search / points:.3f} s a point of {points}; audit {audit:.1f} s", flush=True)
    if asked.histories:
        print(f"{asked.histories} new histories a point against the frozen limits")
        count_outside(problem, limits, asked.histories, 77)
        mended = repaired(problem, limits, asked.histories, 78)
        print(f"{asked.histories} more, after repair")
        count_outside(problem, mended, asked.histories, 79)
        reached(problem, mended, asked.histories, 80)
        other, _, _ = timed(problem, omega, levels, LimitSettings(seed=1))
        for name, one, two in (("upper", limits.upper, other.upper), ("lower", limits.lower, other.lower)):
            differ = np.abs(two / one - 1)
            row, at = np.unravel_index(np.nanargmax(differ), differ.shape)
            print(
                f"two seeds, {name}: worst {differ[row, at]:.2%} at {limits.level[row]:g} N, "
                f"{limits.frequency[at]:.2f} Hz; {(differ > 5e-3).sum()} of {differ.size} above 0.5 %"
            )
    if asked.race:
        races(problem, limits, asked.race)


if __name__ == "__main__":
    main()
