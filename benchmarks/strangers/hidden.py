"""Hidden effects of a specimen: effects of the catalogue, and others.

An effect of the catalogue is found by its name in the catalogue of the changed model, coarse or fine, so that new kinds
of `diagnosis.effect` are hidden as well. Other effects are defined here:

one-sided stop   an elastic stop at 30 to 70 % of the largest motion of a place
play             a spring that acts beyond a clearance of 30 to 70 % of the largest motion of a place, on both sides
tuned mass       a mass on a damped spring (1 %), tuned to within 8 % of the tested resonance
quadratic        a force k u^2
fifth order      a force k u^5
sensor delay     a delay of a channel, as from a wrong anti-alias filter; the catalogue has it too, so it is known
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from correlation.model import Dof, LineSensor, Model
from diagnosis.candidate.catalogue import list_effects
from reduction.joint_law.function_law import joint_law
from reduction.joint_law.registry import DirectedJoint, LawParameter
from reduction.jointed_system import ElasticStop, FrictionContact

#: Damping ratio of a tuned mass [-].
ABSORBER = 0.01


class Hidden(Protocol):
    """Hidden effect with a strength."""

    name: str
    strength: float
    vanishes: float
    typical: float
    bounds: tuple[float, float]

    @property
    def known(self) -> bool:
        """Whether the catalogue has the effect."""
        ...

    def bound(self, model: Model) -> Callable[[Model], Model]:
        """Function that applies the effect to this model, and to the same model without contacts."""
        ...

    def delay(self, sensor: str) -> float:
        """Delay of a channel [s]."""
        ...


@dataclass(frozen=True, kw_only=True)
class Known:
    """Effect of the catalogue, by name; the typical strengths of the catalogue are those for these tests."""

    name: str
    strength: float
    vanishes: float
    typical: float
    bounds: tuple[float, float]
    tested: Mapping[str, float]
    """Highest force of each configuration [N]."""
    known: bool = True

    def bound(self, model: Model) -> Callable[[Model], Model]:
        """See `Hidden`."""
        effect = list_effects(model, level=max(self.tested.values()), configurations=self.tested).effect(self.name)
        values = [self.strength, *(item.vanishes for item in effect.parameters[1:])]
        return lambda other: effect.apply(other, values)

    def delay(self, sensor: str) -> float:
        """Zero: no delay."""
        del sensor
        return 0.0


@dataclass(frozen=True, kw_only=True)
class Stranger:
    """Effect defined here: kind, place (or channel), strength and a further number."""

    kind: str
    place: str
    strength: float
    typical: float
    reach: float = 0.0
    """Clearance [m], or the tuned angular frequency [rad/s]."""
    vanishes: float = 0.0
    bounds: tuple[float, float] = (0.0, np.inf)
    known: bool = False

    @property
    def name(self) -> str:
        """Name of the effect: kind and place."""
        return f"delay of {self.place}" if self.known else f"{self.kind} at {self.place}"

    def bound(self, model: Model) -> Callable[[Model], Model]:
        """See `Hidden`."""
        del model
        return self._apply

    def _apply(self, model: Model) -> Model:
        if self.kind == "sensor delay":
            return model
        row, joints = model.places[self.place], list(model.system.joints)
        if self.kind == "tuned mass":
            return _with_absorber(model, row, self.strength, self.reach)
        if self.kind in ("one-sided stop", "play"):
            for number, sign in enumerate((1.0, -1.0) if self.kind == "play" else (1.0,)):
                joints.append(
                    ElasticStop(name=f"hidden {number}", direction=sign * row, stiffness=self.strength, gap=self.reach)
                )
        else:
            law: Any = quadratic_spring if self.kind == "quadratic" else fifth_order_spring
            joints.append(law(name="hidden", direction=row, stiffness=self.strength))
        return model.with_system(joints=joints)

    def delay(self, sensor: str) -> float:
        """Delay of a channel [s]: the strength of a sensor delay for its channel, else zero."""
        return self.strength if self.kind == "sensor delay" and sensor == self.place else 0.0


STRANGERS = ("one-sided stop", "play", "tuned mass", "quadratic", "fifth order", "sensor delay")


@joint_law(
    kind="stranger quadratic",
    parameters=[LawParameter(name="stiffness", unit="N/m^2", meaning="f / u^2", typical=1e10)],
    typical_displacement=2e-5,
    n_state=0,
    stuck_stiffness=lambda stiffness: 0.0,  # noqa: ARG005  # a name of each parameter
    energy=None,
)
def quadratic_spring(u, velocity, state, parameters):  # type: ignore[no-untyped-def]  # noqa: ARG001  # as all laws
    """f = k u^2."""
    return parameters[0] * u * u


@joint_law(
    kind="stranger fifth order",
    parameters=[LawParameter(name="stiffness", unit="N/m^5", meaning="f / u^5", typical=1e24)],
    typical_displacement=2e-5,
    n_state=0,
    stuck_stiffness=lambda stiffness: 0.0,  # noqa: ARG005  # a name of each parameter
    energy=None,
)
def fifth_order_spring(u, velocity, state, parameters):  # type: ignore[no-untyped-def]  # noqa: ARG001  # as all laws
    """f = k u^5."""
    return parameters[0] * u * u * u * u * u


def _with_absorber(model: Model, row: Any, mass: float, natural: float) -> Model:
    """Model with an additional degree of freedom: a mass on a spring and a dashpot, attached at a row."""
    system, between = model.system, np.append(row, -1.0)
    spring = mass * natural**2

    def grown(matrix: Any) -> Any:
        return np.pad(matrix, ((0, 1), (0, 1)))

    def longer(rows: Any) -> Any:
        return np.concatenate([rows, np.zeros((*np.shape(rows)[:-1], 1))], axis=-1)

    joints = []
    for joint in system.joints:
        if isinstance(joint, FrictionContact):
            joints.append(replace(joint, normal=longer(joint.normal), tangents=longer(joint.tangents)))
        elif isinstance(joint, DirectedJoint):
            joints.append(replace(joint, direction=longer(joint.direction)))
    mass_matrix = grown(system.mass)
    mass_matrix[-1, -1] = mass
    changed = replace(
        system, mass=mass_matrix, joints=joints, static_load=longer(system.static), basis=None,
        stiffness=grown(system.stiffness) + spring * np.outer(between, between),
        damping=grown(system.damping) + 2 * ABSORBER * mass * natural * np.outer(between, between),
        harmonic_force=longer(system.dynamic),
    )  # fmt: skip
    sensors = tuple(
        item if isinstance(item, LineSensor) else replace(item, row=longer(item.row)) for item in model.sensors
    )
    return replace(
        model, system=changed, sensors=sensors, parts=(), dofs=(*model.dofs, Dof()),
        places={name: longer(place) for name, place in model.places.items()},
    )  # fmt: skip
