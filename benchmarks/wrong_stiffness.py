"""Detection of stiffnesses in a wrong unit by `stickslip compare`.

    python -m benchmarks.wrong_stiffness [--seeds A:B]

Each seed gives a specimen, measured with 1 % of noise around its first resonance at two levels, and two cases of it:

unit        one stiffness of one contact is 1e3, 1e-3, 1e6 or 1e-6 times that of the specimen, all others are within 7 %
other       no unit is wrong: stiffnesses of contacts differ by up to a factor of 50, masses by 10 %, friction by 60 %

Only cases with a misfit of a factor of two or more count, as in the program. The specimens are chains of three to six
masses with one to three Jenkins elements, and the structures of `benchmarks.random_systems`: 6 to 60 degrees of freedom
and 1 to 10 contacts with gaps, wedges and coupled friction.
"""

import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.linalg import eigh

from benchmarks.random_systems import random_problem
from correlation.model import Model, Sensor
from correlation.prediction import Points, Predictor
from reduction.joint_law.jenkins import JenkinsElement
from reduction.jointed_system import JointedSystem
from study.compare.gross_misfit import GROSS, ROUGH_TOLERANCE, MotionReadings
from study.compare.visible_resonance import find_visible_resonances
from study.compare.wrong_stiffness import POWERS, STIFFNESS, find_wrong_stiffness

#: First scored seed and number of seeds; no constant was set with them.
FIRST, N_SEED = 88_000, 60
LEVELS, NOISE = (1 / 6, 1.0), 0.01
#: Measured frequencies relative to the first resonance [-].
BAND = np.linspace(0.94, 1.03, 10)
#: Largest deviations of stiffnesses and friction [decades], and standard deviation of the natural logarithm of masses:
#: in cases with a wrong unit, and without.
NEARLY_RIGHT, WRONG = (0.03, 0.03, 0.003), (1.7, 0.2, 0.1)
FRICTION = ("friction_coefficient", "limit_force")


def draw_chain(random: np.random.Generator) -> Model:
    """Draw a chain of masses, the first on the ground, with Jenkins elements between any two or to the ground."""
    n, n_contact = int(random.integers(3, 7)), int(random.integers(1, 4))
    mass = np.diag(random.uniform(0.5, 2.0, n))
    step = np.eye(n) - np.eye(n, k=-1)
    stiffness = step.T @ (10 ** random.uniform(5.5, 6.5, n)[:, None] * step)
    rows = np.zeros((n_contact, n))
    for row in rows:
        first, second = random.permutation(n)[:2]
        row[first], row[second] = 1.0, -float(random.integers(2))
    tangential = 10 ** random.uniform(5.0, 6.5, n_contact)
    square, shapes = eigh(stiffness + rows.T @ (tangential[:, None] * rows), mass)
    ratio, force = random.uniform(0.002, 0.01), np.eye(2, n, k=-1) * 1.0
    damping = mass @ shapes @ np.diag(2 * ratio * np.sqrt(square)) @ shapes.T @ mass
    slip = np.abs(tangential * (rows @ shapes[:, 0])) * np.abs(shapes[0, 0]) / (2 * ratio * square[0])
    limit = np.maximum(slip, 1e-3 * slip.max()) * 10 ** random.uniform(-0.5, 0.5, n_contact)
    contacts = [
        JenkinsElement(name=f"c{i}", direction=row, tangential_stiffness=float(kt), limit_force=float(most))
        for i, (row, kt, most) in enumerate(zip(rows, tangential, limit, strict=True))
    ]
    system = JointedSystem(
        mass=mass, damping=damping, stiffness=stiffness, joints=contacts, harmonic_force=force.astype(complex)
    )
    sensors = tuple(Sensor(name=name, row=np.eye(n)[at]) for name, at in (("a", 0), ("b", n - 1)))
    return Model(system=system, sensors=sensors)


def draw_structure(random: np.random.Generator) -> Model:
    """Draw a structure of `random_systems`, measured along the force and at another degree of freedom."""
    system = random_problem(int(random.integers(10**6, 10**9))).system
    row = np.abs(system.harmonic_force[1])
    other = np.eye(system.n_dof)[int(random.integers(system.n_dof))]
    return Model(system=system, sensors=(Sensor(name="a", row=row / np.linalg.norm(row)), Sensor(name="b", row=other)))


FAMILIES: dict[str, Callable[[np.random.Generator], Model]] = {"chains": draw_chain, "structures": draw_structure}


def vary(model: Model, random: np.random.Generator, off: tuple[float, float, float]) -> Model:
    """Model with random deviations of contacts and masses."""
    stiffness, friction, mass = off
    changes: dict[str, dict[str, Any]] = {}
    for joint in model.system.joints:
        for parameter in joint.parameters:
            spread = stiffness if parameter.unit == STIFFNESS else friction if parameter.name in FRICTION else 0.0
            factor = 10 ** random.uniform(-spread, spread)
            if spread and not parameter.is_list:
                changes.setdefault(joint.name, {})[parameter.name] = factor * getattr(joint, parameter.name)
    root = np.exp(0.5 * mass * random.standard_normal(model.system.n_dof))
    return model.with_joints(changes).with_system(mass=model.system.mass * np.outer(root, root))


def plant_unit(model: Model, random: np.random.Generator) -> tuple[Model, str, str]:
    """Model with one stiffness in another unit, name of the joint, and words of the correct remedy."""
    joints = model.system.joints
    joint = joints[int(random.integers(len(joints)))]
    names = [parameter.name for parameter in joint.parameters if parameter.unit == STIFFNESS]
    name, power = str(random.choice(names)), int(random.choice(POWERS))
    wrong = model.with_joints({joint.name: {name: getattr(joint, name) * 10.0**power}})
    return wrong, joint.name, f"{name} {10.0**-power:g} times that"


def measure(specimen: Model, random: np.random.Generator) -> MotionReadings:
    """Measure motions of a specimen around its first resonance; `stated` is replaced by the prediction of a case."""
    frequency = find_visible_resonances(specimen)[0] * BAND
    level, at, number = (grid.ravel() for grid in np.meshgrid(LEVELS, frequency, [0, 1], indexing="ij"))
    points = Points(
        free=np.zeros(len(at), dtype=bool), level=level, frequency=at, sensor=np.array(["a", "b"])[number],
        harmonic=np.ones(len(at), dtype=np.int64),
    )  # fmt: skip
    exact = Predictor(points=points, tolerance=ROUGH_TOLERANCE).predict(specimen).value
    noise = random.standard_normal((2, len(at)))
    return MotionReadings(points=points, value=exact * (1 + NOISE * (noise[0] + 1j * noise[1])), stated=exact)


def judge(readings: MotionReadings, case: Model) -> tuple[bool, tuple[str, str]]:
    """Whether a case has a gross misfit, and place and sentence of the first suspicion."""
    stated = Predictor(points=readings.points, tolerance=ROUGH_TOLERANCE).predict(case).value
    beside = replace(readings, stated=stated)
    result = find_wrong_stiffness(beside, case)
    return beside.stated_misfit > GROSS, (result[0].where, result[0].sentence) if result else ("", "")


def score(family: str, first: int, last: int, report: Callable[[str], None]) -> Counter[str]:
    """Count cases with a gross misfit, and the suspicions that they raise."""
    count = Counter[str]()
    for seed in range(first, last):
        random = np.random.default_rng([seed, *family.encode()])
        specimen = FAMILIES[family](random)
        readings = measure(specimen, random)
        gross, (where, sentence) = judge(readings, vary(specimen, random, WRONG))
        count += Counter({"other": int(gross), "false": int(bool(where))})
        if where:
            report(f"{family} {seed}, no unit is wrong: {where}: {sentence}")
        case, joint, words = plant_unit(vary(specimen, random, NEARLY_RIGHT), random)
        gross, (where, sentence) = judge(readings, case)
        right = f'"{joint}"' in where and words in sentence
        count += Counter({"unit": int(gross), "found": int(right), "wrong place": int(bool(where) and not right)})
        if where and not right:
            report(f"{family} {seed}, {joint} has another unit ({words}): {where}: {sentence}")
    return count


def main() -> None:
    words = sys.argv[1:]
    chosen = words[words.index("--seeds") + 1] if "--seeds" in words else f"{FIRST}:{FIRST + N_SEED}"
    first, last = map(int, chosen.split(":"))
    for family in FAMILIES:
        count = score(family, first, last, print)
        print(
            f"{family}: a unit found in {count['found']} of {count['unit']}, another stiffness named in "
            f"{count['wrong place']}; false alarms in {count['false']} of {count['other']} without a wrong unit",
            flush=True,
        )


if __name__ == "__main__":
    main()
