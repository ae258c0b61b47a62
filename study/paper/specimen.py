"""The specimen on its own mesh, as the bench takes it: with and without dampers, its sensors and its resonances."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.dense_modes import compute_dense_modes
from geometry.rig import SIDES, mating_pairs
from reduction.jointed_system import JointedSystem
from reduction.stuck import stuck_stiffness
from study.case.setup import read_case
from study.kind.registry import OpenCase
from study.kind.rig.structure import measured_places
from study.paper.parameters import configure
from study.paper.truth import Truth
from study.run_context import RunContext

Row = Float[NDArray[np.float64], " r"]

#: What the bench measures, in its order: the tip, and the right damper against the blade.
TIP, LASER = "tip", "laser"
#: Share of what the force does most in any mode that tells one which it drives: dampers roll in lower ones.
DRIVEN = 0.1
#: Modes that may be the one which the force drives.
LOWEST = 20


@dataclass(frozen=True, kw_only=True, eq=False)
class Specimen:
    """What is measured.

    Parameters
    ----------
    jointed, free
        Rig at rest under its dead weights, and blade without dampers.
    sensors
        Rows of the motions by name.
    signs
        Sign of the tangential force of each line where it acts on its other body away from the damper [-].
    dead_weight
        Upward pull on the right damper [N].
    resonance, free_resonance
        Frequency of the first mode that the force drives, stuck and free [Hz].
    """

    jointed: JointedSystem
    free: JointedSystem
    sensors: Mapping[str, Row]
    signs: Mapping[str, float]
    dead_weight: float
    resonance: float
    free_resonance: float


def find_density(opened: OpenCase, truth: Truth, run: RunContext) -> Truth:
    """The truth with the density of the blade that gives its free frequency."""
    case = configure(opened.case, truth.parameters)
    structure = opened.kind.structure(replace(opened, case=case), run)
    frequency = float(structure.details.reduction.assembly.bodies["blade"].modes(1).frequency[0])
    # One density of the whole blade scales all of its frequencies alike.
    density = case.structure.material.density * (frequency / truth.free_frequency) ** 2
    return replace(truth, parameters=replace(truth.parameters, density=density))


def make_specimen(opened: OpenCase, truth: Truth, run: RunContext) -> Specimen:
    """The specimen of a truth.

    Parameters
    ----------
    opened
        Case of the rig on the specimen's mesh.
    truth
        Truth with its density.
    run
        Store of the reduced bodies, and progress.
    """
    read = read_case(replace(opened, case=configure(opened.case, truth.parameters)), run=run)
    resting = read.structure.details
    model = read.setup.model
    free, rig = model.free().system, resting.model.rig
    # The bench knows a line by the first word of its contacts' names.
    joints = [replace(item, name=item.name.replace(".", " ")) for item in model.system.joints]
    jointed = replace(model.system, joints=joints)
    places = measured_places(resting.reduction)
    weight = resting.weights["right"]
    laser = next(sensor.row for sensor in model.sensors if sensor.name == "damper right against blade")
    return Specimen(
        jointed=jointed,
        free=free,
        sensors={TIP: places["tip"], LASER: laser},
        signs={name: find_sign(name, pair.damper_line.tangents[0, 0]) for name, pair in mating_pairs(rig).items()},
        dead_weight=weight.force * float(np.cos(weight.inclination)),
        resonance=find_resonance(jointed, places["tip"]),
        free_resonance=find_resonance(free, places["tip"]),
    )


def find_sign(line: str, tangent: Float[NDArray[np.float64], "3"]) -> float:
    """Whether a tangent of a line points away from its damper, 1, or towards it, -1 [-]."""
    side, _, other = line.partition("_")
    outward = SIDES[side][0]
    return float(np.sign(tangent[1] * (outward if other == "decoupler" else -outward)))


def find_resonance(system: JointedSystem, row: Row) -> float:
    """Frequency of the first mode in which the force moves a sensor, all contacts stuck [Hz].

    Parameters
    ----------
    system
        Structure, joints and loads.
    row
        Row of the sensor, shape (r,) [-].
    """
    modes = compute_dense_modes(system.mass, stuck_stiffness(system.stiffness, system.joints))
    eigenvalue, shapes = modes.lambda_[:LOWEST], modes.mode_shapes[:, :LOWEST]
    moved = np.abs((row @ shapes) * (system.harmonic_force[1].real @ shapes)) / eigenvalue
    return float(np.sqrt(eigenvalue[np.argmax(moved > DRIVEN * moved.max())]) / (2 * np.pi))
