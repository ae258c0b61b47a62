"""Convergence of the solver with joints of every law: systems of `random_systems.py` with additional joints.

The ranges below were fixed before the first run and are not tuned to the solver: a change of them is a new benchmark.

systems             seeds 0 to 199 of `random_systems.py`: structure, load, contacts, frequencies and sliders as there
additional joints   2 to 6, uniform, each with any registered law and any of its options, all with equal probability; a
                    law with several rows acts along orthogonal directions
where               mass to mass 50 %, mass to ground 50 %, in any direction
motion              typical displacement of the law: 0.1 to 3 times the amplitude of the free structure along the joint
                    at its first resonance, log-uniform; typical angular frequency: that resonance
force               forces are scaled so that a typical stiffness of 1e6 N/m becomes 0.05 to 20 times the mean spring,
                    log-uniform
parameters          each 0.7 to 1.4 times the value from these scales, uniform; values that the law refuses are drawn
                    again

Run it with

    python -m benchmarks.random_laws [--systems 0:200] [--processes 2] [--output failures.json]
"""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import scipy.linalg

from benchmarks.random_systems import Problem, Vector, log_uniform, main, random_problem, sweep
from reduction.errors import JointError
from reduction.joint_law.registry import LAWS, Joint, LawParameter
from reduction.jointed_system import JointedSystem

N_SYSTEM = 200
#: Stiffness [N/m] and angular frequency [rad/s] on which the typical parameters of the laws are based.
STIFFNESS, OMEGA = 1e6, 300.0


def random_law_problem(seed: int) -> Problem:
    """System of `random_systems.py` with additional joints of random laws."""
    problem = random_problem(seed)
    rng = np.random.default_rng([20261127, seed])
    system = problem.system
    squared, shapes = scipy.linalg.eigh(system.stiffness, system.mass)
    resonance = np.sqrt(squared[0])
    modal_damping = np.einsum("rm,rs,sm->m", shapes, system.damping, shapes)
    motion = shapes @ ((shapes.T @ system.dynamic[1]) / (squared - resonance**2 + 1j * resonance * modal_damping))
    spring = float(np.exp(np.log(np.diag(system.stiffness)).mean()))
    beside = [random_joint(rng, f"beside {number}", motion, spring, resonance) for number in range(rng.integers(2, 7))]
    return replace(
        problem,
        system=JointedSystem(
            mass=system.mass, damping=system.damping, stiffness=system.stiffness, joints=[*system.joints, *beside],
            static_load=system.static, harmonic_force=system.dynamic,
        ),
        slider=np.concatenate([problem.slider, np.zeros(sum(joint.n_slider for joint in beside))]),
        kinds=(*problem.kinds, *(joint.kind for joint in beside)),
    )  # fmt: skip


def random_joint(
    rng: np.random.Generator, name: str, motion: np.ndarray, spring: float, resonance: float
) -> Joint:  # fmt: skip
    law = LAWS[LAWS.names()[int(rng.integers(len(LAWS.names())))]]
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    first, other = rng.choice(len(motion) // 3, size=2, replace=False)
    place = np.zeros((3, len(motion)))
    place[:, 3 * first : 3 * first + 3] = axes
    if rng.uniform() < 0.5:
        place[:, 3 * other : 3 * other + 3] = -axes
    rows: dict[str, Vector] = dict(zip(law.places, place, strict=False))
    length = log_uniform(rng, 0.1, 3.0) * np.abs(place[: len(rows)] @ motion).max() / law.typical_displacement
    stiffness = log_uniform(rng, 0.05, 20.0) * spring / STIFFNESS
    options = {item.name: item.choices[int(rng.integers(len(item.choices)))] for item in law.options}
    while True:
        numbers = {item.name: random_number(rng, item, stiffness * length, length, OMEGA / resonance)
                   for item in law.parameters}  # fmt: skip
        try:
            return law.build(name, rows, numbers | options)
        except JointError:
            continue


def random_number(rng: np.random.Generator, parameter: LawParameter, force: float, length: float, time: float) -> Any:
    """Draw a parameter whose forces, lengths and times are scaled from the typical ones by the given factors."""
    scale, over = 1.0, False
    for symbol, power in re.findall(r"(/|[A-Za-z]+)(?:\^(\d))?", parameter.unit):
        over = over or symbol == "/"
        scale *= {"N": force, "m": length, "s": time, "/": 1.0}[symbol] ** (int(power or 1) * (-1 if over else 1))
    count = int(rng.integers(1, 5)) if parameter.is_list else 1
    numbers = parameter.typical * scale * rng.uniform(0.7, 1.4, count)
    return numbers.tolist() if parameter.is_list else float(numbers[0])


def solve(seed: int) -> dict[str, Any]:
    """Sweep one system."""
    return sweep(random_law_problem(seed))


if __name__ == "__main__":
    main(solve, N_SYSTEM, __doc__)
