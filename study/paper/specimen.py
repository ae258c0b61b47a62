"""The specimen on its own mesh for the bench: with and without dampers, its sensors and its resonances."""

from dataclasses import replace
from math import pi

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Sensor
from geometry.rig import SIDES, mating_pairs
from reduction.joint_law.friction_contact import list_friction_contacts
from study.case.setup import read_case
from study.kind.registry import OpenCase
from study.kind.rig.structure import list_measured_places
from study.paper.parameters import configure
from study.paper.resonance import find_resonance, scale_damping
from study.paper.truth import Truth
from study.paper.virtual_tests import LASER, TIP, Specimen
from study.run_context import RunContext

Row = Float[NDArray[np.float64], " r"]

#: Step of a derivative by the stiffness of the root [-].
STEP = 1e-3


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
    preloaded = read.structure.details
    clamp = truth.root_loss / (2 * pi * truth.free_frequency) * _compute_root_stiffness(opened, truth, run)
    model = scale_damping(read.setup.model, truth.parameters.damping)
    model = model.with_system(damping=model.system.damping + clamp)
    free, rig = model.without_contacts().system, preloaded.model.rig
    # The bench knows a line by the first word of its contacts' names.
    joints = [replace(item, name=item.name.replace(".", " ")) for item in list_friction_contacts(model.system.joints)]
    jointed = replace(model.system, joints=joints)
    places = list_measured_places(preloaded.reduction)
    weight = preloaded.weights["right"]
    laser = next(
        item.row for item in model.sensors if isinstance(item, Sensor) and item.name == "damper right against blade"
    )
    return Specimen(
        jointed=jointed,
        free=free,
        sensors={TIP: places["tip"], LASER: laser},
        signs={name: find_sign(name, pair.damper_line.tangents[0, 0]) for name, pair in mating_pairs(rig).items()},
        dead_weight=weight.force * float(np.cos(weight.inclination)),
        resonance=find_resonance(jointed, places["tip"]),
        free_resonance=find_resonance(free, places["tip"]),
    )


def _compute_root_stiffness(opened: OpenCase, truth: Truth, run: RunContext) -> Float[NDArray[np.float64], "r r"]:
    """Energy of the springs of the root as a stiffness: kappa dK / dkappa, as they transmit a force statically."""
    root, ends = truth.parameters.root, []
    assert root is not None
    for factor in (1 - STEP, 1 + STEP):
        case = configure(opened.case, replace(truth.parameters, root=factor * root))
        ends.append(opened.kind.structure(replace(opened, case=case), run).details.reduction.assembly.stiffness)
    return np.asarray((ends[1] - ends[0]) / (2 * STEP))


def find_sign(line: str, tangent: Float[NDArray[np.float64], "3"]) -> float:
    """Whether a tangent of a line points away from its damper, 1, or towards it, -1 [-]."""
    side, _, other = line.partition("_")
    outward = SIDES[side][0]
    return float(np.sign(tangent[1] * (outward if other == "decoupler" else -outward)))
