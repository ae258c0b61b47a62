"""Parameters of the rig that the paper calibrates, and the case of the rig with them."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from geometry.rig import SIDES
from study.case.tables import Case
from study.kind.rig.table import RigTable

#: Parameters that are above zero.
POSITIVE = ("kt", "kn", "mu", "damping", "root", "density")


@dataclass(frozen=True, kw_only=True)
class RigParameters:
    """Parameters of one iteration, or of the truth.

    Parameters
    ----------
    kt, kn
        Stiffness of each contact line [N/m].
    mu
        Friction coefficient [-].
    damping
        Damping ratio of the first stuck mode that the force excites [-].
    root
        Stiffness of the springs of the root [N/m]; None for a fixed one.
    density
        Density of the blade [kg/m^3]; None for that of all bodies.
    shift_left, shift_right
        Shift of the dead weights, positive away from the blade [m].
    inclination_left, inclination_right
        Inclination of their wires, positive towards the right [rad].
    gap_angle
        Rotation of the left damper: angle between its line and the blade's [rad].
    """

    kt: float
    kn: float
    mu: float
    damping: float
    root: float | None = None
    density: float | None = None
    shift_left: float = 0.0
    shift_right: float = 0.0
    inclination_left: float = 0.0
    inclination_right: float = 0.0
    gap_angle: float = 0.0


def read_parameters(case: Case[RigTable]) -> RigParameters:
    """The parameters that a case of a rig has."""
    table = case.structure
    contact, weight = table.contact, table.dead_weight
    return RigParameters(
        kt=contact.kt, kn=contact.kn, mu=contact.mu, damping=table.damping.ratio, root=table.root.stiffness,
        density=table.blade_material.density, shift_left=weight.left.shift, shift_right=weight.right.shift,
        inclination_left=weight.left.inclination, inclination_right=weight.right.inclination,
        gap_angle=contact.left_blade.gap_angle or 0.0,
    )  # fmt: skip


def meshed(case: Case[RigTable], size: float, n_mode: int) -> Case[RigTable]:
    """The case with an element size [m] and a number of modes of all bodies."""
    return _with_tables(case, mesh={"size": size}, reduction={"modes": n_mode})


def configure(case: Case[RigTable], parameters: RigParameters) -> Case[RigTable]:
    """The case of a rig with these parameters.

    Parameters
    ----------
    case
        Case; its other numbers are kept.
    parameters
        New parameters.
    """
    drawn, own = case.structure, parameters
    sides = {
        side: getattr(drawn.dead_weight, side).model_copy(
            update={"shift": getattr(own, f"shift_{side}"), "inclination": getattr(own, f"inclination_{side}")}
        )
        for side in SIDES
    }
    line = drawn.contact.left_blade.model_copy(update={"gap_angle": own.gap_angle or None})
    tables: dict[str, Mapping[str, Any]] = {
        "contact": {"kt": own.kt, "kn": own.kn, "mu": own.mu, "left_blade": line},
        "dead_weight": sides,
        "damping": {"ratio": own.damping},
        "root": {"stiffness": own.root},
        "blade_material": {"density": own.density},
    }
    return _with_tables(case, **tables)


def _with_tables(case: Case[RigTable], **tables: Mapping[str, Any]) -> Case[RigTable]:
    changed = {name: getattr(case.structure, name).model_copy(update=dict(new)) for name, new in tables.items()}
    return case.model_copy(update={"structure": case.structure.model_copy(update=changed)})
