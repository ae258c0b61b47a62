"""Places at which effects may act: named places that move, without duplicates; joints added at them."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import ROTATIONS, TRANSLATIONS, Dof, Model, Sensor
from diagnosis.candidate.effect import Untestable
from diagnosis.candidate.scale import Scale
from reduction.jointed_system import CubicSpring, Joint, QuadraticDamper

Row = Float[NDArray[np.float64], " r"]

#: A place moves if its motion in the mode is at least this share of the largest.
MOVES = 1e-2


class PlaceUnits(NamedTuple):
    """Units of the motion of a place, and of the forces on it."""

    motion: str
    speed: str
    force: str
    stiffness: str
    damping: str
    inertia: str


#: Units of a displacement, and of an angle.
LINEAR = PlaceUnits(motion="m", speed="m/s", force="N", stiffness="N/m", damping="N s/m", inertia="kg")
ANGULAR = PlaceUnits(motion="rad", speed="rad/s", force="N m", stiffness="N m", damping="N m s", inertia="kg m^2")


@dataclass(frozen=True, kw_only=True, eq=False)
class Place:
    """A named displacement or rotation.

    Parameters
    ----------
    name
        Name in the model.
    row
        Row over the degrees of freedom, shape (r,) [-].
    rotational
        Whether it is an angle, so that forces are moments.
    """

    name: str
    row: Row
    rotational: bool = False

    def unit(self, of_displacement: str, of_rotation: str) -> str:
        """Unit for a displacement or for a rotation."""
        return of_rotation if self.rotational else of_displacement


def find_moving_places(
    model: Model, scale: Scale, kind: str, least: float = MOVES
) -> tuple[list[Place], list[Untestable]]:
    """Places where an effect can act, and effects at other places with the reason why they cannot be tested."""
    if not model.places:
        return [], [Untestable(name=kind, reason="the model has no named places: give places as rows over its DOFs")]
    rows = [*model.places.values(), *(item.row for item in model.sensors if isinstance(item, Sensor))]
    result: list[Place] = []
    left: list[Untestable] = []
    for name, row in model.places.items():
        share = scale.share(row, rows)
        twin = next((item.name for item in result if is_parallel(item.row, row)), None)
        reason = ""
        if not row.any():
            reason = "it does not move: its row is zero"
        elif share < least:
            reason = f"it moves by {share:.1e} of the largest motion in the first mode"
        elif twin is not None:
            reason = f'it moves with "{twin}"'
        if reason:
            left.append(Untestable(name=f"{kind} at {name}", reason=reason))
        else:
            result.append(Place(name=name, row=row, rotational=is_rotation(model, row)))
    return result, left


def is_parallel(one: Row, other: Row) -> bool:
    """Whether two rows are equal up to a factor."""
    return bool(abs(one @ other) >= (1 - 1e-9) * np.linalg.norm(one) * np.linalg.norm(other))


def find_dof(model: Model, row: Row) -> Dof | None:
    """Degree of freedom of a row with a single entry of 1 or -1; None for a combination or an unknown one."""
    where = np.flatnonzero(row)
    if len(where) != 1 or abs(row[where[0]]) != 1.0:
        return None
    dof = model.dofs[int(where[0])]
    return None if dof.direction == "modal" else dof


def is_rotation(model: Model, row: Row) -> bool:
    """Whether a row is a rotation."""
    known = find_dof(model, row)
    return known is not None and known.direction in ROTATIONS


def choose_units(model: Model, row: Row) -> PlaceUnits:
    """Units at a row."""
    return ANGULAR if is_rotation(model, row) else LINEAR


def find_translations(model: Model, row: Row) -> tuple[int, ...]:
    """Translations of the node of a row; empty if the row is no translation, a combination, or unknown."""
    known = find_dof(model, row)
    if known is None or known.direction not in TRANSLATIONS:
        return ()
    return tuple(
        number
        for number, dof in enumerate(model.dofs)
        if (dof.body, dof.node) == (known.body, known.node) and dof.direction in TRANSLATIONS
    )


def with_cubic_spring(model: Model, name: str, row: Row, stiffness: float) -> Model:
    """Model with an additional cubic spring; an existing one of this name is stiffened instead."""
    return _with_joint(model, CubicSpring(name=name, direction=row, stiffness=stiffness), "stiffness")


def with_quadratic_damper(model: Model, name: str, row: Row, damping: float) -> Model:
    """Model with an additional quadratic damper; the damping of an existing one of this name is increased instead."""
    return _with_joint(model, QuadraticDamper(name=name, direction=row, damping=damping), "damping")


def _with_joint(model: Model, joint: Joint, strength: str) -> Model:
    joints = list(model.system.joints)
    for number, there in enumerate(joints):
        if there.kind == joint.kind and there.name == joint.name:
            joints[number] = there.with_values({strength: getattr(there, strength) + getattr(joint, strength)})
            return model.with_system(joints=joints)
    return model.with_system(joints=[*joints, joint])
