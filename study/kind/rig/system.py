"""A rig under its dead weights, from its case and its reduced bodies."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import cos, sin

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from casefile.source import value_at
from casefile.table import located
from fe.distributed_load import distributed_load
from geometry.errors import InputError
from geometry.rig import SIDES, Rig, named_points
from reduction.joined import Joined, joined
from reduction.rigid_body import RigidBody, check_held, rigid_body, rigid_motions
from reduction.seat import seated
from reduction.static_contact import StaticState
from study.case.tables import Case
from study.kind.rig.contact import DeadWeight, dead_weights, line_pairs
from study.kind.rig.model import RigModel
from study.kind.rig.reduction import RigReduction
from study.kind.rig.table import RigTable

Row = Float[NDArray[np.float64], " r"]

#: The direction of vibration, through the blade's thickness.
Y = 1


@dataclass(frozen=True, kw_only=True, eq=False)
class RestingRig:
    """A rig under its dead weights.

    Parameters
    ----------
    model, reduction
        Its dimensions and meshes, and its reduced bodies.
    weights
        Of each side.
    joined
        Bodies and contacts, unloaded.
    pull
        Of the dead weight of each side, over all coordinates, shape (r,) [N].
    rest
        How the dead weights press the contacts.
    dampers
        How the contacts hold them, as rigid bodies.
    """

    model: RigModel
    reduction: RigReduction
    weights: Mapping[str, DeadWeight]
    joined: Joined
    pull: Mapping[str, Row]
    rest: StaticState
    dampers: tuple[RigidBody, ...]


def resting_rig(case: Case[RigTable], model: RigModel, reduction: RigReduction) -> RestingRig:
    """The rig of a case under its dead weights.

    Raises
    ------
    CaseError
        A damper that nothing holds, leaves its groove or finds no rest.
    """
    assembly, table, rig = reduction.assembly, case.structure, model.rig
    weights = dead_weights(case)
    with located(case, "structure", "contact"):
        bodies = joined(assembly, line_pairs(case, rig), tangents=table.contact.sliding)
    dampers = tuple(
        rigid_body(assembly, f"damper_{side}", reduction.places(f"damper_{side}"), bodies.springs) for side in SIDES
    )
    with located(case, "structure", "contact"):
        check_held(dampers)
    if any(getattr(table.contact, name).uneven for name in bodies.lines):
        bodies = seated(bodies, _dampers(reduction))
    pull = _pulls(weights, rig, reduction)
    try:
        rest = bodies.rest(np.sum([*pull.values()], axis=0))
    except InputError as error:
        with located(case, "structure", "dead_weight", *_side_at_fault(case, str(error))):
            raise error
    return RestingRig(
        model=model, reduction=reduction, weights=weights, joined=bodies, pull=pull, rest=rest, dampers=dampers
    )


def _side_at_fault(case: Case[RigTable], message: str) -> tuple[str, ...]:
    """The table of the side that a message on a contact line speaks of, if the case has one."""
    given = value_at({} if case.source is None else case.source.data, ("structure", "dead_weight")) or {}
    return tuple(side for side in SIDES if f'"{side}_' in message and side in given)[:1]


def _dampers(reduction: RigReduction) -> dict[str, Float[NDArray[np.float64], "r 6"]]:
    """Their rigid motions: contact alone holds them."""
    return {
        body: rigid_motions(reduction.assembly, body, reduction.places(body), np.zeros(3))
        for body in (f"damper_{side}" for side in SIDES)
    }


def excitation(reduction: RigReduction) -> Complex[NDArray[np.complex128], "2 r"]:
    """A harmonic force of 1 N along y on the disc that the shaker pushes, shape (2, r) [N]."""
    force = np.zeros((2, reduction.assembly.n_dof), dtype=np.complex128)
    force[1, reduction.assembly.rows("blade", "excitation", Y)] = 1.0
    return force


def _pulls(weights: Mapping[str, DeadWeight], rig: Rig, reduction: RigReduction) -> dict[str, Row]:
    """The dead weight of each side, spread over the lower half of the cylinder that its wire lies under [N]."""
    found, points = {}, named_points(rig)
    for side, weight in weights.items():
        body, (sign, _) = f"damper_{side}", SIDES[side]
        mesh = reduction.meshes[body]
        cylinder = mesh.nodes("cylinder")
        below = cylinder[mesh.points[cylinder, 2] < rig.damper_axis]
        place = points[body]["dead_weight"] + np.array([0.0, sign * weight.shift, 0.0])
        found[side] = reduction.assembly.load(body, distributed_load(mesh, below, _pull(weight), place))
    return found


def _pull(weight: DeadWeight) -> Float[NDArray[np.float64], "3"]:
    return weight.force * np.array([0.0, sin(weight.inclination), cos(weight.inclination)])
