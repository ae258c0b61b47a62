"""Cost of time integration: microseconds per step and degree of freedom, after compilation, on one core.

    OMP_NUM_THREADS=1 python benchmarks/transient_cost.py

A clamped chain like a beam with friction contacts along it (normal and one tangent each), excited near its first
resonance so that contacts slip and open; also with non-proportional damping.
"""

import time

import numpy as np

from reduction.jointed_system import FrictionContact, JointedSystem, along
from transient.stepper import Stepper

PERIODS, STEPS = 20, 512


def chain(n_dof: int, n_contact: int, diagonal: bool) -> JointedSystem:
    """Make two chains of masses, for tangential and normal motion, with `n_contact` contacts to the ground."""
    half = n_dof // 2
    single = 2 * np.eye(half) - np.eye(half, k=1) - np.eye(half, k=-1)
    stiffness = np.kron(np.eye(2), single) * 1e8 * (half / 100) ** 2
    mass = np.eye(n_dof)
    damping = 1e-6 * stiffness + 2.0 * mass
    if not diagonal:
        damping = damping + np.diag(np.linspace(0.0, 5.0, n_dof))
    places = np.linspace(1, half - 2, n_contact).astype(int)
    joints = [
        FrictionContact(
            name=f"contact {place}",
            tangents=along(n_dof, {int(place): 1.0}),
            normal=along(n_dof, {half + int(place): 1.0}),
            normal_stiffness=5e6,
            tangential_stiffness=4e6,
            friction_coefficient=0.6,
            preload=80.0,
        )
        for place in places
    ]
    force = np.zeros((2, n_dof), dtype=complex)
    force[1, half // 2] = 40.0 * 20
    force[1, half + half // 3] = 15.0j * 20
    return JointedSystem(mass=mass, damping=damping, stiffness=stiffness, joints=joints, harmonic_force=force)


def main() -> None:
    print("  DOF  contacts   damping   us/step  us/step/DOF  iterations/step   slip   open")
    for diagonal in (True, False):
        for n_dof, n_contact in ((20, 4), (100, 14), (200, 28)):
            frequency = 1.02 * np.pi * 1e4 * (n_dof / 200) / (n_dof / 2 + 1) + 200
            stepper = Stepper(chain(n_dof, n_contact, diagonal), frequency, STEPS)
            for _ in range(30):
                stepper.advance()
            before = stepper.iterations
            start = time.perf_counter()
            for _ in range(PERIODS):
                stepper.advance()
            cost = (time.perf_counter() - start) / (PERIODS * STEPS) * 1e6
            record = stepper.record()
            normal = record.force[1::2]
            slip = np.mean((np.abs(record.force[0::2]) > 0.6 * normal * (1 - 1e-9)) & (normal > 0))
            print(
                f"{n_dof:5d} {n_contact:9d} {'diagonal' if diagonal else 'full':>9} {cost:9.2f} {cost / n_dof:12.4f} "
                f"{(stepper.iterations - before) / (PERIODS * STEPS):16.2f} {slip:6.2f} {np.mean(normal <= 0):6.2f}"
            )


if __name__ == "__main__":
    main()
