"""Convergence of the solver for 500 random structures with friction contacts, at 40 frequencies each.

Each frequency is one solve with `steady_state` from the solution at the previous frequency (the first without a start);
a point fails if the solver raises an exception. Failures are counted by their message. The ranges below were fixed
before the first run and are not tuned to the solver: a change of them is a new benchmark.

systems             seeds 0 to 499, each independent of the others
masses              2 to 20, uniform; 0.2 to 5 kg, log-uniform; three translations each
structure           a chain of connections; half of the systems also have connections between random pairs (half as
                    many as masses); at least every third mass is connected to the ground; a connection has three
                    orthogonal springs in random orientation, each 1e5 to 1e7 N/m, log-uniform
damping             one modal damping ratio, 0.1 to 2 %, log-uniform
load                harmonic 1, 0.1 to 100 N, log-uniform, at one mass, within 60 degrees of x, any phase
contacts            1 to 10, uniform, of the four kinds of `CONTACT_KINDS` with equal probability
where               mass to mass 50 %, mass to ground 35 %, a point between two neighbours to the ground 15 %
normal              0 to 90 degrees from x, uniform, any direction around it: wedges, in which the normal load varies
tangents            one 40 %, two uncoupled 30 %, two coupled (isotropic Coulomb) 30 %
contact stiffness   normal 0.05 to 20 times the geometric mean of the springs, log-uniform; tangential 0.3 to 2 times
                    the normal, uniform
friction            coefficient 0.05 to 1, uniform
mu N / F            0.05 to 20, log-uniform, for the kinds with a normal load at rest
gap                 0.02 to 1 times the amplitude of the free structure along the normal at its first resonance,
                    log-uniform
sliders at t = 0    zero in half of the systems; else with tangential forces of -1 to 1 times mu N, uniform
frequencies         40, equidistant, from 0.85 times the first free resonance (contacts removed) to 1.15 times the first
                    stuck one (contacts as springs), in rising or falling order at random
solver              H = 5, 128 samples per period, defaults for everything else

Run it with

    python benchmarks/random_systems.py [--systems 0:500] [--processes 2] [--output failures.json]
    python benchmarks/random_systems.py --merge part1.json part2.json
"""

import argparse
import json
import multiprocessing
import os
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from reduction.jointed_system import Friction, FrictionContact, JointedSystem

N_SYSTEM = 500
N_FREQUENCY = 40
N_HARMONIC = 6
N_SAMPLE = 128
#: Kinds of contacts. preloaded: N_0 > 0; interference: gap < 0; pressed: closed by a static load; gap: open at rest.
CONTACT_KINDS = ("preloaded", "interference", "pressed", "gap")

Vector = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Problem:
    """Random system with its angular frequencies [rad/s] in the order of the sweep, and initial sliders [m]."""

    seed: int
    system: JointedSystem
    angular_frequency: Vector
    slider: Vector
    kinds: tuple[str, ...]


def random_problem(seed: int) -> Problem:
    rng = np.random.default_rng([20261121, seed])
    n_mass = int(rng.integers(2, 21))
    mass = np.diag(np.repeat(log_uniform(rng, 0.2, 5.0, n_mass), 3))
    stiffness, mean_spring = random_springs(rng, n_mass)
    damping_ratio = log_uniform(rng, 0.001, 0.02)
    squared, shapes = scipy.linalg.eigh(stiffness, mass)
    natural = np.sqrt(squared)
    weighted = mass @ shapes
    damping = weighted * (2 * damping_ratio * natural) @ weighted.T

    force = log_uniform(rng, 0.1, 100.0)
    loaded = int(rng.integers(n_mass))
    load = np.zeros((2, 3 * n_mass), dtype=complex)
    load[1, 3 * loaded : 3 * loaded + 3] = (
        force * np.exp(2j * np.pi * rng.uniform()) * inclined(rng, np.deg2rad(rng.uniform(0, 60)))
    )
    resonance = natural[0]
    modal = (shapes.T @ load[1]) / (squared - resonance**2 + 2j * damping_ratio * natural * resonance)
    free_motion = shapes @ modal

    static = np.zeros(3 * n_mass)
    contacts, kinds, normal_loads = [], [], []
    for index in range(int(rng.integers(1, 11))):
        contact, kind, normal_load = random_contact(rng, index, n_mass, mean_spring, force, free_motion)
        if kind == "pressed":
            static += normal_load * contact.normal
        contacts.append(contact)
        kinds.append(kind)
        normal_loads.append(normal_load)
    stuck = stiffness.copy()
    for contact in contacts:
        stuck += contact.normal_stiffness * np.outer(contact.normal, contact.normal)
        stuck += contact.tangential_stiffness * contact.tangents.T @ contact.tangents
    first_stuck = np.sqrt(scipy.linalg.eigh(stuck, mass, eigvals_only=True, subset_by_index=[0, 0])[0])
    frequencies = np.linspace(0.85 * natural[0], 1.15 * first_stuck, N_FREQUENCY)
    if rng.uniform() < 0.5:
        frequencies = frequencies[::-1].copy()
    system = JointedSystem(
        mass=mass, damping=damping, stiffness=stiffness, joints=contacts, static_load=static, harmonic_force=load
    )
    slider = random_sliders(rng, contacts, normal_loads)
    return Problem(seed=seed, system=system, angular_frequency=frequencies, slider=slider, kinds=tuple(kinds))


def random_springs(rng: np.random.Generator, n_mass: int) -> tuple[NDArray[np.float64], float]:
    """Draw springs; returns the positive definite stiffness [N/m] and the geometric mean of the springs [N/m]."""
    pairs: list[tuple[int, int | None]] = [(i, i + 1) for i in range(n_mass - 1)]
    if rng.uniform() < 0.5:
        for _ in range(n_mass // 2):
            i, j = rng.choice(n_mass, size=2, replace=False)
            pairs.append((int(i), int(j)))
    pairs += [(i, None) for i in range(n_mass) if i % 3 == 0 or rng.uniform() < 0.3]
    stiffness = np.zeros((3 * n_mass, 3 * n_mass))
    values = log_uniform(rng, 1e5, 1e7, (len(pairs), 3))
    for (i, j), springs in zip(pairs, values, strict=True):
        rows = np.zeros((3, 3 * n_mass))
        rows[:, 3 * i : 3 * i + 3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        if j is not None:
            rows[:, 3 * j : 3 * j + 3] = -rows[:, 3 * i : 3 * i + 3]
        stiffness += rows.T * springs @ rows
    return stiffness, float(np.exp(np.log(values).mean()))


def random_contact(
    rng: np.random.Generator,
    index: int,
    n_mass: int,
    mean_spring: float,
    force: float,
    free_motion: NDArray[np.complex128],
) -> tuple[FrictionContact, str, float]:
    """Draw a contact; returns it, its kind, and its normal load at rest without motion of the structure [N]."""
    place = np.zeros((3, 3 * n_mass))
    first = int(rng.integers(n_mass))
    where = rng.uniform()
    place[:, 3 * first : 3 * first + 3] = np.eye(3)
    if where < 0.5:
        other = int((first + rng.integers(1, n_mass)) % n_mass)
        place[:, 3 * other : 3 * other + 3] = -np.eye(3)
    elif where > 0.85:
        other, share = (first + 1) % n_mass, rng.uniform(0.1, 0.9)
        place *= 1 - share
        place[:, 3 * other : 3 * other + 3] = share * np.eye(3)
    normal = inclined(rng, np.deg2rad(rng.uniform(0, 90)))
    tangents = scipy.linalg.null_space(normal[None, :]).T
    turn = rng.uniform(0, 2 * np.pi)
    tangents = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]) @ tangents
    style = rng.uniform()
    if style < 0.4:
        tangents = tangents[:1]
    kind = CONTACT_KINDS[int(rng.integers(len(CONTACT_KINDS)))]
    normal_stiffness = mean_spring * log_uniform(rng, 0.05, 20.0)
    friction_coefficient = rng.uniform(0.05, 1.0)
    normal_load = log_uniform(rng, 0.05, 20.0) * force / friction_coefficient
    gap = log_uniform(rng, 0.02, 1.0) * abs(normal @ place @ free_motion)
    contact = FrictionContact(
        name=f"{kind} {index}",
        normal=normal @ place,
        tangents=tangents @ place,
        normal_stiffness=normal_stiffness,
        tangential_stiffness=normal_stiffness * rng.uniform(0.3, 2.0),
        friction_coefficient=friction_coefficient,
        preload=normal_load if kind == "preloaded" else 0.0,
        gap={"interference": -normal_load / normal_stiffness, "gap": gap}.get(kind, 0.0),
        friction=Friction.COULOMB if style > 0.7 else Friction.UNCOUPLED,
    )
    return contact, kind, 0.0 if kind == "gap" else normal_load


def random_sliders(rng: np.random.Generator, contacts: list[FrictionContact], normal_loads: list[float]) -> Vector:
    spread = 1.0 if rng.uniform() < 0.5 else 0.0
    sliders = []
    for contact, normal_load in zip(contacts, normal_loads, strict=True):
        for _ in contact.tangents:
            share = spread * rng.uniform(-1, 1)
            sliders.append(-share * contact.friction_coefficient * normal_load / contact.tangential_stiffness)
    return np.array(sliders)


def log_uniform(rng: np.random.Generator, low: float, high: float, size: Any = None) -> Any:
    return np.exp(rng.uniform(np.log(low), np.log(high), size))


def inclined(rng: np.random.Generator, angle: float) -> Vector:
    """Unit vector at an angle [rad] to x, in a random direction around x."""
    around = rng.uniform(0, 2 * np.pi)
    return np.array([np.cos(angle), np.sin(angle) * np.cos(around), np.sin(angle) * np.sin(around)])


def solve(seed: int) -> dict[str, Any]:
    """Sweep one system."""
    return sweep(random_problem(seed))


def sweep(problem: Problem) -> dict[str, Any]:
    """Solve a system at all of its frequencies; returns iterations of converged points and messages of failed ones."""
    from hbsolve.balance import HarmonicBalance
    from hbsolve.errors import NoSteadyState
    from hbsolve.steady_state import steady_state

    balance = HarmonicBalance(system=problem.system, n_harmonic=N_HARMONIC, n_sample=N_SAMPLE)
    begin = time.process_time()
    state, failures, iterations = None, [], []
    for point, angular_frequency in enumerate(problem.angular_frequency):
        try:
            state = steady_state(balance, angular_frequency, start=state, slider=problem.slider)
        except NoSteadyState as failure:
            failures.append({"point": point, "frequency": angular_frequency / (2 * np.pi), "words": str(failure)})
        except Exception as failure:  # any exception is a failure of the solver
            failures.append({"point": point, "frequency": angular_frequency / (2 * np.pi), "words": repr(failure)})
        else:
            iterations.append(int(state.iterations))
    return {
        "seed": problem.seed,
        "masses": problem.system.n_dof // 3,
        "contacts": problem.kinds,
        "seconds": time.process_time() - begin,
        "iterations": iterations,
        "failures": failures,
    }


def summarise(systems: list[dict[str, Any]]) -> None:
    points = N_FREQUENCY * len(systems)
    failures = [failure for system in systems for failure in system["failures"]]
    iterations = np.array([count for system in systems for count in system["iterations"]] or [0])
    seconds = sum(system["seconds"] for system in systems)
    hit = sorted(system["seed"] for system in systems if system["failures"])
    print(f"{len(systems)} systems, {points} points: {len(failures)} do not converge ({len(failures) / points:.2%})")
    rare = np.quantile(iterations, 0.99)
    print(f"iterations: median {np.median(iterations):.0f}, 99 % {rare:.0f}, most {iterations.max()}")
    print(f"{seconds:.0f} s of processor time, {1e3 * seconds / points:.1f} ms a point")
    if failures:
        print(f"systems with failures ({len(hit)}): {hit}")
        causes = Counter("".join(c for c in failure["words"] if not c.isdigit())[:110] for failure in failures)
        for cause, count in causes.most_common():
            print(f"{count:6d}  {cause}")


def main(
    solve: Callable[[int], dict[str, Any]] = solve, n_system: int = N_SYSTEM, description: str | None = __doc__
) -> None:
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--systems", default=f"0:{n_system}", help="seeds, first:last+1")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--output", type=Path)
    parser.add_argument("--merge", type=Path, nargs="+")
    arguments = parser.parse_args()
    if arguments.merge:
        summarise([system for part in arguments.merge for system in json.loads(part.read_text())])
        return
    first, last = (int(number) for number in arguments.systems.split(":"))
    for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[threads] = "1"  # the processes below read them when they import numpy
    systems = []
    with multiprocessing.get_context("spawn").Pool(arguments.processes) as pool:
        for count, system in enumerate(pool.imap_unordered(solve, range(first, last)), 1):
            systems.append(system)
            if arguments.output:  # immediately, so that an interrupted run keeps its results
                arguments.output.write_text(json.dumps(systems, indent=1))
            if system["failures"]:
                print(
                    f"seed {system['seed']}: {len(system['failures'])} failures, {count} of {last - first} done",
                    flush=True,
                )
    summarise(systems)


if __name__ == "__main__":
    main()
