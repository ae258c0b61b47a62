"""Specimen: a finer model with random deviations, reduced for its tests, which are simulated by time integration.

Differences from the model, besides the hidden effects (standard deviations):

calibration   kt and kn 3 %, mu 5 %, zeta 10 %, E 0.5 %, each one factor for the specimen
modes         each natural frequency of the structure without contacts 0.1 to 0.3 %, and the damping of each of these
              modes 2 to 8 %
mesh          twice as many elements along each edge
repeats       preload 1 % and frequency 0.03 % for each repeat, a random friction history for each level of each repeat

A structure with more than `LARGEST` degrees of freedom is reduced to its first modes with the contacts stuck and its
static deflections under the force and under the force of each joint; sensors read displacements.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from benchmarks.strangers.hidden import Hidden
from correlation.model import Model, Sensor
from reduction.joint_law.registry import DirectedJoint
from reduction.jointed_system import FrictionContact, JointedSystem
from reduction.stuck import stuck_stiffness

Matrix = NDArray[np.float64]

DEVIATION = {
    "tangential_stiffness": 0.03, "normal_stiffness": 0.03, "friction_coefficient": 0.05, "zeta": 0.10, "E": 0.005,
}  # fmt: skip
#: Range of the standard deviation of modal damping [-].
MODAL_DAMPING = (0.02, 0.08)
#: Range of the standard deviation of natural frequencies [-]; largest number of degrees of freedom without reduction;
#: number of modes of a reduction.
MODES, LARGEST, N_MODE = (1e-3, 3e-3), 30, 18


@dataclass(frozen=True, kw_only=True, eq=False)
class Specimen:
    """Models of the tested structure, jointed and free, with the deviations from which they were made."""

    jointed: Model
    free: Model
    factors: dict[str, float]
    mode_deviation: float

    def system(self, configuration: str) -> tuple[JointedSystem, dict[str, Matrix]]:
        """Reduced system with contacts as first joints, and rows of its motion sensors."""
        model = self.free if configuration == "free" else self.jointed
        contacts = [joint for joint in model.system.joints if isinstance(joint, FrictionContact)]
        # The bench takes the first word of a contact's name as its line.
        named = [replace(joint, name=joint.name.replace(".", " ")) for joint in contacts]
        others = [joint for joint in model.system.joints if not isinstance(joint, FrictionContact)]
        rows = {item.name: item.row for item in model.sensors if isinstance(item, Sensor)}
        return reduced(replace(model.system, joints=[*named, *others]), rows)


def pressed(system: JointedSystem, ratio: float) -> JointedSystem:
    """System with the preloads of all contacts, and the static load that balances them, multiplied by a ratio."""
    joints = [
        joint.with_values({"preload": ratio * joint.preload}) if isinstance(joint, FrictionContact) else joint
        for joint in system.joints
    ]
    return replace(system, joints=joints, static_load=ratio * system.static)


def make_specimen(model: Model, random: np.random.Generator) -> Specimen:
    """Make a specimen without hidden effects from a fine model with its sensors."""
    factors = {name: float(1 + sigma * random.standard_normal()) for name, sigma in DEVIATION.items()}
    deviation = float(random.uniform(*MODES))
    system = model.system
    squared, shapes = scipy.linalg.eigh(system.stiffness, system.mass)
    weighted = system.mass @ shapes
    squared = squared * factors["E"] * (1 + 2 * deviation * random.standard_normal(len(squared)))
    joints = [
        joint.with_values({name: factors[name] * getattr(joint, name) for name in list(DEVIATION)[:3]})
        if isinstance(joint, FrictionContact)
        else joint
        for joint in system.joints
    ]
    # A separate random stream, so that the errors of damping do not change the other random numbers.
    (own,) = random.spawn(1)
    errors = own.uniform(*MODAL_DAMPING) * own.standard_normal(len(squared))
    modal = np.einsum("ri,rs,si->i", shapes, system.damping, shapes)
    damping = factors["zeta"] * (system.damping + weighted * (errors * modal) @ weighted.T)
    made = model.with_system(stiffness=weighted * squared @ weighted.T, damping=damping, joints=joints)
    made = replace(made, parts=())
    return Specimen(jointed=made, free=made.without_contacts(), factors=factors, mode_deviation=deviation)


def hide(specimen: Specimen, hidden: Sequence[Hidden]) -> Specimen:
    """Specimen with hidden effects."""
    jointed, free = specimen.jointed, specimen.free
    for effect in hidden:
        apply = effect.bound(specimen.jointed)
        jointed, free = apply(jointed), apply(free)
    return replace(specimen, jointed=jointed, free=free)


def reduced(system: JointedSystem, rows: dict[str, Matrix]) -> tuple[JointedSystem, dict[str, Matrix]]:
    """Reduce system and rows to the first stuck modes and the static deflections."""
    if system.n_dof <= LARGEST:
        return system, rows
    stuck = stuck_stiffness(system.stiffness, system.joints)
    modes = scipy.linalg.eigh(stuck, system.mass, subset_by_index=(0, N_MODE - 1))[1]
    loads = np.vstack([system.dynamic.real, *(joint.directions for joint in system.joints)])
    static = scipy.linalg.solve(stuck, loads.T, assume_a="pos")
    static = static - modes @ (modes.T @ system.mass @ static)
    # Linear combinations of deflections without modal mass are linearly dependent and removed.
    inner = static.T @ system.mass @ static
    size, turn = scipy.linalg.eigh(inner / np.sqrt(np.outer(np.diag(inner), np.diag(inner)) + 1e-300))
    kept = size > 1e-8
    scale = np.sqrt(np.diag(inner) + 1e-300)
    static = (static / scale) @ (turn[:, kept] / np.sqrt(size[kept]))
    basis = np.hstack([modes, static])
    joints = []
    for joint in system.joints:
        if isinstance(joint, FrictionContact):
            joints.append(replace(joint, normal=joint.normal @ basis, tangents=joint.tangents @ basis))
        elif isinstance(joint, DirectedJoint):
            joints.append(replace(joint, direction=joint.direction @ basis))
    small = JointedSystem(
        mass=basis.T @ system.mass @ basis, damping=basis.T @ system.damping @ basis,
        stiffness=basis.T @ system.stiffness @ basis, joints=joints, static_load=basis.T @ system.static,
        harmonic_force=system.dynamic @ basis,
    )  # fmt: skip
    return small, {name: row @ basis for name, row in rows.items()}
