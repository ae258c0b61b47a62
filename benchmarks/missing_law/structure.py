"""Random structures: chains and beams, some with friction contacts, and specimens that differ from them."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from benchmarks.random_systems import log_uniform
from correlation.model import Model, Sensor
from reduction.jointed_system import FrictionContact, JointedSystem

Row = NDArray[np.float64]

#: Standard deviations of the specimen's factors and of each natural frequency [-].
DEVIATION = {"tangential_stiffness": 0.03, "friction_coefficient": 0.05, "zeta": 0.10, "E": 0.003}
MODES = 5e-4


@dataclass(frozen=True, kw_only=True, eq=False)
class Structure:
    """Model with properties of its first resonance.

    Parameters
    ----------
    model
        Model with a sensor at each place.
    drive
        Place of the force.
    shape
        First mode with the contacts stuck, of unit modal mass, by place, shape (r,) [kg^-1/2].
    natural
        Angular frequency of this mode, and of the first mode without contacts [rad/s].
    ratio
        Modal damping ratio [-].
    force
        Amplitude of the force at the highest level, at which contacts slip [N].
    """

    model: Model
    drive: str
    shape: Row
    natural: tuple[float, float]
    ratio: float
    force: float


def draw_structure(random: np.random.Generator) -> Structure:
    """Draw a random structure."""
    is_beam, held = bool(random.uniform() < 0.5), bool(random.uniform() < 0.4)
    n = int(random.integers(4, 7) if is_beam else random.integers(3, 7))
    mass = np.diag(log_uniform(random, 0.5, 2.0, n))
    stiffness = _beam(n, held) if is_beam else _chain(random, n, held)
    first = float(scipy.linalg.eigvalsh(stiffness, mass)[0])
    stiffness = stiffness * (2 * np.pi * random.uniform(20, 80)) ** 2 / first
    squared, shapes = scipy.linalg.eigh(stiffness, mass)
    ratio = float(log_uniform(random, 0.003, 0.015))
    weighted = mass @ shapes
    damping = weighted * (2 * ratio * np.sqrt(squared)) @ weighted.T
    drive = int(random.integers(n))
    while abs(shapes[drive, 0]) < 0.2 * np.abs(shapes[:, 0]).max():
        drive = int(random.integers(n))
    harmonic = np.zeros((2, n), dtype=complex)
    harmonic[1, drive] = 1.0
    force = float(log_uniform(random, 0.5, 5.0))
    contacts, static = [], np.zeros(n)
    if random.uniform() < 0.4:
        # Resonant motion without contacts; the contacts slip beyond 0.1 to 0.4 of it.
        motion = np.abs(shapes[:, 0] * shapes[drive, 0]) * force / (2 * ratio * squared[0])
        contacts = _contacts(random, n, squared[0], shapes[:, 0], motion)
        static = np.sum([contact.preload * contact.normal for contact in contacts], axis=0)
    system = JointedSystem(
        mass=mass, damping=damping, stiffness=stiffness, joints=contacts, static_load=static, harmonic_force=harmonic
    )
    places = {f"m{number}": np.eye(n)[number] for number in range(n)}
    model = Model(
        system=system, places=places, sensors=tuple(Sensor(name=f"at {name}", row=row) for name, row in places.items()),
        lines={"line": tuple(contact.name for contact in contacts)} if contacts else {},
    )  # fmt: skip
    stuck = stiffness + sum(
        (c.normal_stiffness * np.outer(c.normal, c.normal) + c.tangential_stiffness * c.tangents.T @ c.tangents)
        for c in contacts
    )
    squares, stuck_shapes = scipy.linalg.eigh(stuck, mass)
    return Structure(
        model=model, drive=f"m{drive}", shape=stuck_shapes[:, 0],
        natural=(float(np.sqrt(squares[0])), float(np.sqrt(squared[0]))), ratio=ratio, force=force,
    )  # fmt: skip


def make_specimen(model: Model, random: np.random.Generator) -> Model:
    """Specimen: the model with random deviations, without parts."""
    factors = {name: float(1 + sigma * random.standard_normal()) for name, sigma in DEVIATION.items()}
    system = model.system
    squared, shapes = scipy.linalg.eigh(system.stiffness, system.mass)
    weighted = system.mass @ shapes
    squared = squared * factors["E"] * (1 + 2 * MODES * random.standard_normal(len(squared)))
    joints = [
        joint.with_values({name: factors[name] * getattr(joint, name) for name in list(DEVIATION)[:2]})
        for joint in system.joints
    ]
    made = model.with_system(
        stiffness=weighted * squared @ weighted.T, damping=factors["zeta"] * system.damping, joints=joints
    )
    return replace(made, parts=())


def _chain(random: np.random.Generator, n: int, held: bool) -> Row:
    springs = log_uniform(random, 0.3, 3.0, n + 1)
    springs[-1] *= held
    return np.asarray(np.diag(springs[:-1] + springs[1:]) - np.diag(springs[1:-1], 1) - np.diag(springs[1:-1], -1))


def _beam(n: int, held: bool) -> Row:
    """Bending stiffness of a cantilever, or of a beam clamped at both ends, from second differences of deflection."""
    fixed = 2
    total = n + fixed + (2 if held else 0)
    second = np.diff(np.eye(total), n=2, axis=0)
    kept = slice(fixed, fixed + n)
    return np.asarray((second.T @ second)[kept, kept])


def _contacts(random: np.random.Generator, n: int, squared: float, shape: Row, motion: Row) -> list[FrictionContact]:
    able = np.flatnonzero(np.abs(shape) > 0.3 * np.abs(shape).max())
    where = random.permutation(able)[: int(random.integers(1, 3))]
    share = random.uniform(0.1, 0.4)
    contacts = []
    for number, at in enumerate(where.tolist()):
        row, angle = np.eye(n)[at], random.uniform(0.2, 0.5)
        spring = share * squared / shape[at] ** 2 / len(where)
        slips = motion[at] * random.uniform(0.1, 0.4)
        contacts.append(
            FrictionContact(
                name=f"line {number}", normal=np.sin(angle) * row, tangents=np.cos(angle) * row[None],
                normal_stiffness=float(spring), tangential_stiffness=float(spring), friction_coefficient=0.5,
                preload=float(spring * np.cos(angle) * slips / 0.5),
            )
        )  # fmt: skip
    return contacts
