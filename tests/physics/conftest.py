"""Ten jointed systems on which harmonic balance and time integration have to agree."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pytest
import scipy.linalg
from numpy.typing import NDArray

from reduction.jointed_system import (
    CubicSpring,
    ElasticStop,
    Friction,
    FrictionContact,
    JenkinsElement,
    Joint,
    JointedSystem,
    along,
    between,
)
from tests.slow import slow

Matrix = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Witnessed:
    """A system, the row of its output, its frequencies [rad/s], the levels of its histories, and its damping ratio."""

    system: JointedSystem
    row: Matrix
    first: float
    last: float
    damping_ratio: float
    histories: tuple[float, ...] = ()
    """Levels at which its steady state depends on the past; empty where there is one steady state."""


def damped(
    mass: Matrix,
    stiffness: Matrix,
    joints: list[Joint],
    ratio: float,
    force: Mapping[int, complex],
    static: Matrix | None = None,
) -> JointedSystem:
    """With the same damping ratio in all modes of the structure whose joints stick."""
    n = len(mass)
    stuck = stiffness.copy()
    for joint in joints:
        if isinstance(joint, JenkinsElement):
            stuck += joint.tangential_stiffness * np.outer(joint.direction, joint.direction)
        if isinstance(joint, FrictionContact):
            stuck += joint.tangential_stiffness * joint.tangents.T @ joint.tangents
            stuck += joint.normal_stiffness * np.outer(joint.normal, joint.normal)
    squared, shapes = scipy.linalg.eigh(stuck, mass)
    weighted = mass @ shapes
    loads = np.zeros((2, n), dtype=np.complex128)
    for dof, value in force.items():
        loads[1, dof] = value
    return JointedSystem(
        mass=mass,
        damping=weighted @ np.diag(2 * ratio * np.sqrt(squared)) @ weighted.T,
        stiffness=stiffness,
        joints=joints,
        static_load=static,
        harmonic_force=loads,
    )


def jenkins_oscillator() -> Witnessed:
    joint = JenkinsElement(name="j", direction=np.ones(1), tangential_stiffness=5e3, limit_force=10.0)
    system = damped(np.eye(1), np.array([[1e4]]), [joint], 0.01, {0: 8.0})
    return Witnessed(system=system, row=np.ones(1), first=85.0, last=140.0, damping_ratio=0.01, histories=(0.3, 1, 1.5))


def jenkins_chain() -> Witnessed:
    n = 5
    stiffness = 1e4 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    joints: list[Joint] = [
        JenkinsElement(name="wall", direction=between(n, 1), tangential_stiffness=4e3, limit_force=5.0),
        JenkinsElement(name="pair", direction=between(n, 4, 3), tangential_stiffness=8e3, limit_force=3.0),
    ]
    system = damped(np.eye(n), stiffness, joints, 0.01, {0: 3.0, 4: 2.0j})
    row = along(n, {2: 1.0})
    return Witnessed(system=system, row=row, first=40.0, last=75.0, damping_ratio=0.01, histories=(0.4, 1, 2))


def lifting_contact() -> Witnessed:
    """Normal load that varies down to lift-off, in another phase than the sliding."""
    contact = FrictionContact(
        name="c",
        tangents=along(2, {0: 1.0}),
        normal=along(2, {1: 1.0, 0: 0.2}),
        normal_stiffness=6e3,
        tangential_stiffness=5e3,
        friction_coefficient=0.5,
        preload=10.0,
    )
    stiffness = np.array([[1e4, -1e3], [-1e3, 2.5e4]])
    # The static load holds the contact at its preload.
    static = np.array([2.0, 10.0])
    system = damped(np.eye(2), stiffness, [contact], 0.01, {0: 7.0, 1: 90.0j}, static)
    row = along(2, {0: 1.0})
    return Witnessed(system=system, row=row, first=80.0, last=140.0, damping_ratio=0.01, histories=(0.15, 0.5, 1))


def gapped_contact() -> Witnessed:
    """Friction that acts only where the vibration closes a gap."""
    contact = FrictionContact(
        name="c",
        tangents=along(2, {0: 1.0}),
        normal=along(2, {1: 1.0}),
        normal_stiffness=4e3,
        tangential_stiffness=3e3,
        friction_coefficient=0.4,
        gap=1e-3,
    )
    stiffness = np.array([[1e4, -2e3], [-2e3, 1.6e4]])
    system = damped(np.eye(2), stiffness, [contact], 0.01, {0: 4.0, 1: 2.0})
    row = along(2, {0: 1.0})
    return Witnessed(system=system, row=row, first=80.0, last=115.0, damping_ratio=0.01)


def stopped_oscillator() -> Witnessed:
    stop = ElasticStop(name="stop", direction=along(2, {1: 1.0}), stiffness=5e3, gap=2e-3)
    stiffness = np.array([[1.5e4, -5e3], [-5e3, 1e4]])
    system = damped(np.eye(2), stiffness, [stop], 0.01, {0: 2.0})
    row = along(2, {1: 1.0})
    return Witnessed(system=system, row=row, first=75.0, last=100.0, damping_ratio=0.01)


def turning_friction() -> Witnessed:
    """Two tangents that share one limit, on an ellipse that changes its shape with the frequency."""
    contact = FrictionContact(
        name="c",
        tangents=np.eye(3)[:2],
        normal=np.eye(3)[2],
        normal_stiffness=1e4,
        tangential_stiffness=5e3,
        friction_coefficient=0.5,
        preload=20.0,
        friction=Friction.COULOMB,
    )
    static = np.array([0.0, 0.0, 20.0])
    system = damped(np.eye(3), np.diag([1e4, 1.3e4, 3e4]), [contact], 0.01, {0: 9.0, 1: -6.0j, 2: 5.0}, static)
    row = along(3, {0: 1.0})
    return Witnessed(system=system, row=row, first=85.0, last=145.0, damping_ratio=0.01, histories=(0.3, 1, 1.5))


def duffing_oscillator() -> Witnessed:
    spring = CubicSpring(name="s", direction=np.ones(1), stiffness=1e8)
    system = damped(np.eye(1), np.array([[1e4]]), [spring], 0.01, {0: 1.0})
    return Witnessed(system=system, row=np.ones(1), first=85.0, last=125.0, damping_ratio=0.01)


def rubbing_beam() -> Witnessed:
    """A clamped steel beam of six elements, 300 x 20 x 6 mm, whose tip rubs on an inclined wall."""
    length, width, height, young, density, n_element = 0.3, 0.02, 0.006, 210e9, 7800.0, 6
    le, area, inertia = length / n_element, width * height, width * height**3 / 12
    bending = [[12, 6 * le, -12, 6 * le], [6 * le, 4 * le**2, -6 * le, 2 * le**2]]
    bending += [[-12, -6 * le, 12, -6 * le], [6 * le, 2 * le**2, -6 * le, 4 * le**2]]
    swing = [[156, 22 * le, 54, -13 * le], [22 * le, 4 * le**2, 13 * le, -3 * le**2]]
    swing += [[54, 13 * le, 156, -22 * le], [-13 * le, -3 * le**2, -22 * le, 4 * le**2]]
    n = 3 * (n_element + 1)
    mass, stiffness = np.zeros((n, n)), np.zeros((n, n))
    for element in range(n_element):
        axial, plane = 3 * element + np.array([0, 3]), 3 * element + np.array([1, 2, 4, 5])
        stiffness[np.ix_(axial, axial)] += young * area / le * np.array([[1, -1], [-1, 1]])
        stiffness[np.ix_(plane, plane)] += young * inertia / le**3 * np.array(bending)
        mass[np.ix_(axial, axial)] += density * area * le / 6 * np.array([[2, 1], [1, 2]])
        mass[np.ix_(plane, plane)] += density * area * le / 420 * np.array(swing)
    mass, stiffness = mass[3:, 3:], stiffness[3:, 3:]
    n -= 3
    slope = np.deg2rad(20)
    tip = {"axial": n - 3, "transverse": n - 2}
    contact = FrictionContact(
        name="tip",
        tangents=along(n, {tip["transverse"]: np.cos(slope), tip["axial"]: -np.sin(slope)}),
        normal=along(n, {tip["transverse"]: np.sin(slope), tip["axial"]: np.cos(slope)}),
        normal_stiffness=2e4,
        tangential_stiffness=1.5e4,
        friction_coefficient=0.3,
        preload=5.0,
    )
    system = damped(mass, stiffness, [contact], 0.005, {3 * 2 + 1: 2.0})
    row = along(n, {tip["transverse"]: 1.0})
    first, last = 2 * np.pi * np.array([45.0, 120.0])
    return Witnessed(system=system, row=row, first=first, last=last, damping_ratio=0.005, histories=(0.3, 1.0, 2.0))


def wedge_damper(friction_coefficient: float = 0.3) -> Witnessed:
    """Two masses that vibrate past each other, and a wedge that its centrifugal load presses between them."""
    n, angle = 4, np.deg2rad(25)
    joints: list[Joint] = []
    for body, side in ((0, -1.0), (1, 1.0)):
        # Degrees of freedom 2 and 3: the wedge along x and y; the masses move along (1, 0.25).
        normal, tangent = (
            np.array([side * np.sin(angle), np.cos(angle)]),
            np.array([np.cos(angle), -side * np.sin(angle)]),
        )
        path = np.array([1.0, 0.25])
        joints.append(
            FrictionContact(
                name="left" if side < 0 else "right",
                tangents=along(n, {2: tangent[0], 3: tangent[1], body: -tangent @ path}),
                normal=along(n, {2: normal[0], 3: normal[1], body: -normal @ path}),
                normal_stiffness=2.4e6,
                tangential_stiffness=1.2e6,
                friction_coefficient=friction_coefficient,
            )
        )
    mass = np.diag([0.5, 0.55, 0.06, 0.06])
    own = 0.5 * (2 * np.pi * 122.0) ** 2
    stiffness = np.diag([own, own, 2e5, 2e5])
    static = np.array([0.0, 0.0, 0.0, 40.0])
    system = damped(mass, stiffness, joints, 0.01, {0: 3.0, 1: -2.0}, static)
    row = along(n, {0: 1.0, 1: -1.0})
    first, last = 2 * np.pi * np.array([330.0, 250.0])
    return Witnessed(system=system, row=row, first=first, last=last, damping_ratio=0.01, histories=(0.5, 1.0, 2.0))


WITNESSED = {
    "jenkins oscillator": jenkins_oscillator,
    "jenkins chain": jenkins_chain,
    "lifting contact": lifting_contact,
    "gapped contact": gapped_contact,
    "stopped oscillator": stopped_oscillator,
    "turning friction": turning_friction,
    "duffing oscillator": duffing_oscillator,
    "rubbing beam": rubbing_beam,
    "wedge damper": wedge_damper,
}


#: Those that the tests of time integration and of harmonic balance have in part.
RARE = {"wedge damper", "jenkins chain", "gapped contact", "duffing oscillator"}


@pytest.fixture(
    params=[pytest.param(name, marks=slow) if name in RARE else name for name in WITNESSED],
    ids=list(WITNESSED),
    scope="module",
)
def witnessed(request: pytest.FixtureRequest) -> Witnessed:
    return WITNESSED[request.param]()
