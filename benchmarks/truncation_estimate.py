"""Accuracy of estimated errors by harmonics and samples, and of refinement to a tolerance, on random systems.

The structures are those of `random_systems.py` with at most 24 degrees of freedom and 6 contacts. Each is solved at
every fourth of its frequencies with H = 7 and 256 samples, without further starts where Newton's method fails. For each
state with an estimated error of the joint directions above 0.001 %, the truth is the state with 4 H harmonics and four
times the samples, from the same sliders. Estimates are compared with it for the main harmonic of every degree of
freedom, relative to its amplitude. States are refined to 1 % and 0.1 % of three degrees of freedom, drawn for each
system, and compared with 12 H harmonics and 12 times the samples.

`MARGIN` of `hbsolve.refinement` was set with seeds below 1000, before seeds from 1000 on were used. Run it with

    python -m benchmarks.truncation_estimate [--systems 0:200]
"""

import argparse
from collections import defaultdict
from collections.abc import Iterator

import numpy as np

from benchmarks.random_systems import Problem, Vector, random_problem
from hbsolve.balance import HarmonicBalance
from hbsolve.errors import NoSteadyState
from hbsolve.refinement import refine_harmonics
from hbsolve.solution import newton_from, solve_at
from hbsolve.state import SteadyState, in_harmonics_of, make_initial_sliders
from hbsolve.truncation import compute_relative_change, truncation

HIGHEST, N_SAMPLE = 7, 256
MOST_DOF, MOST_CONTACT = 24, 6
#: Smallest estimated error that is compared: smaller ones are round-off and residuals [-].
LEAST = 1e-5
#: Smallest error, true or estimated, that counts in the score [-].
COMPARED = 1e-4
TOLERANCES = (1e-2, 1e-3)
FINER, FINEST = 4, 12
#: Distance of the solved frequencies in their list.
STRIDE = 4


def with_more(balance: HarmonicBalance, state: SteadyState, times: int) -> SteadyState | None:
    """State with `times` the harmonics and samples; None if Newton's method fails."""
    finer = balance.with_harmonics(times * HIGHEST + 1, times * N_SAMPLE)
    x = in_harmonics_of(finer, state.motion)
    return newton_from(finer, finer.at(state.angular_frequency), x, state.sliders)


def states_of(problem: Problem, balance: HarmonicBalance) -> Iterator[SteadyState]:
    """States along the sweep, each started from the previous one."""
    start = None
    sliders = make_initial_sliders(balance, problem.slider)
    for angular_frequency in problem.angular_frequency[::STRIDE]:
        try:
            state = solve_at(balance, balance.at(angular_frequency), start, sliders)
        except NoSteadyState:
            continue
        start = state.motion
        yield state


def measure(problem: Problem, results: dict[str, list[Vector]]) -> None:
    """Add estimates and errors of a system, as pairs by quantity, to the results."""
    balance = HarmonicBalance(system=problem.system, n_harmonic=HIGHEST + 1, n_sample=N_SAMPLE)
    every = np.eye(problem.system.n_dof)
    drawn = every[np.random.default_rng(problem.seed).choice(len(every), 3, replace=False)]
    for state in states_of(problem, balance):
        estimate = truncation(balance, state)
        if max(estimate.harmonics, estimate.samples) < LEAST:
            continue
        truth = with_more(balance, state, FINER)
        if truth is None:
            results["no finer state"].append(np.zeros((1, 2)))
            continue
        q, exact = state.coefficients[1], truth.coefficients[1]
        rows = [compute_relative_change(balance, change, q, every) for change in (estimate.change, exact - q)]
        together = [compute_relative_change(balance, change, q) for change in (estimate.change, exact - q)]
        by_directions = np.full(len(every), together[0][0])
        results["joint directions"].append(np.stack(together, axis=1))
        results["each degree of freedom"].append(np.stack(rows, axis=1))
        results["the worst degree of freedom"].append(np.array([[row.max() for row in rows]]))
        results["the same, by the joint directions"].append(np.array([[by_directions.max(), rows[1].max()]]))
        finest = with_more(balance, truth, FINEST)
        for tolerance in TOLERANCES if finest is not None else ():
            refined = refine_harmonics(balance, state, tolerance, rows=drawn)
            result = refined.state.coefficients[1]
            error = compute_relative_change(balance, finest.coefficients[1] - result, result, drawn).max()
            results[f"{tolerance:.1%}, {refined.stop.name}"].append(
                np.array([[refined.error, error, refined.balance.n_harmonic - 1]])
            )


def summarise(results: dict[str, list[Vector]]) -> None:
    for name, parts in results.items():
        values = np.concatenate(parts)
        if values.shape[1] == 3:
            tolerance = float(name.split("%")[0]) / 100
            beyond, counts = np.mean(values[:, 1] > tolerance), np.unique(values[:, 2], return_counts=True)
            used = ", ".join(f"H = {int(highest)}: {count}" for highest, count in zip(*counts, strict=True))
            above = np.mean((values[:, 1] > values[:, 0]) & (values[:, 1] > COMPARED))
            print(
                f"refined to {name}: {len(values)} states, error above the tolerance {beyond:.1%}, above the last "
                f"change {above:.1%}, largest {values[:, 1].max():.2%}; {used}"
            )
            continue
        values = values[values.max(axis=1) > COMPARED]
        if not len(values):
            print(f"{name}: {len(parts)}")
            continue
        ratio = values[:, 0] / values[:, 1]
        print(
            f"estimate over error of {name}: {len(ratio)}, median {np.median(ratio):.2f}, within a factor of 3 "
            f"{np.mean((ratio > 1 / 3) & (ratio < 3)):.1%}, below 1/3 {np.mean(ratio < 1 / 3):.1%}, below 1/10 "
            f"{np.mean(ratio < 0.1):.1%}, above 3 {np.mean(ratio > 3):.1%}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--systems", default="0:200", help="seeds, first:last+1")
    first, last = (int(number) for number in parser.parse_args().systems.split(":"))
    results: dict[str, list[Vector]] = defaultdict(list)
    for seed in range(first, last):
        problem = random_problem(seed)
        if problem.system.n_dof <= MOST_DOF and len(problem.kinds) <= MOST_CONTACT:
            measure(problem, results)
    summarise(results)


if __name__ == "__main__":
    main()
