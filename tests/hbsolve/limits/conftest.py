"""Systems whose limits are known."""

import numpy as np
import pytest
import scipy.linalg

from reduction.jointed_system import FrictionContact, JointedSystem


def wedge_damper() -> JointedSystem:
    """A blade of one degree of freedom and a rigid wedge damper of three, between two contacts to blade and ground.

    Lengths of the damper in mm: its rotation counts in m/m, its inertia in kg.
    """
    mass = np.diag([0.5, 0.06, 0.06, 0.06 * 6.0**2])
    stiffness = np.diag([0.5 * (2 * np.pi * 122.0) ** 2, 2e3, 2e3, 9 * 2e3])
    theta, half_width, half_length, kt, kn = np.deg2rad(25.0), 8.0, 4.0, 1.2e6, 2.4e6
    contacts = []
    for side in (-1, 1):
        normal = np.array([side * np.sin(theta), np.cos(theta)])
        tangent = np.array([np.cos(theta), -side * np.sin(theta)])
        for end in (-1, 1):
            place = np.array([side * half_width, 0.0]) + end * half_length * tangent
            rows = []
            for way in (tangent, normal):
                # The blade moves along (1, 1/4) as it vibrates.
                blade = -(way @ [1.0, 0.25]) if side < 0 else 0.0
                rows.append(np.array([blade, *way, place[0] * way[1] - place[1] * way[0]]))
            contacts.append(
                FrictionContact(
                    name=f"{'blade' if side < 0 else 'ground'} {1 + (end > 0)}",
                    tangents=rows[0],
                    normal=rows[1],
                    tangential_stiffness=kt,
                    normal_stiffness=kn,
                    friction_coefficient=0.5,
                )
            )
    stuck = stiffness + sum(
        kt * np.outer(item.tangents[0], item.tangents[0]) + kn * np.outer(item.normal, item.normal) for item in contacts
    )
    first, second = np.sqrt(scipy.linalg.eigh(stuck, mass, eigvals_only=True))[:2]
    damping = 2 * 0.002 / (first + second) * (first * second * mass + stuck)
    return JointedSystem(
        mass=mass,
        damping=damping,
        stiffness=stiffness,
        joints=contacts,
        static_load=np.array([0.0, 0.0, 30.0, 0.8 * 30.0]),
        harmonic_force=np.array([[0, 0, 0, 0], [1.0, 0, 0, 0]]),
    )


@pytest.fixture(scope="session")
def wedge() -> JointedSystem:
    return wedge_damper()
