"""Effects that the virtual test bench can hide in its specimen: each of a kind, at a place, with a strength."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from reduction.array_type import Row
from reduction.jointed_system import CubicSpring, ElasticStop, JointedSystem, QuadraticDamper
from transient.errors import TransientError
from transient.virtual_bench.beam import Beam, BeamParameters, free_beam, jointed_beam

NOTHING = "nothing"
#: Where each kind of effect can be hidden: at a point, or on a line.
KINDS: Mapping[str, tuple[str, ...]] = {
    "mass": ("tip",),
    "spring": ("mid", "excitation"),
    "cubic": ("tip",),
    "air_damping": ("tip",),
    "gap": ("left", "right"),
    "preload": ("left", "right"),
    "friction": ("left", "right"),
    "stop": ("tip",),
}
UNITS: Mapping[str, str] = {
    "mass": "kg",
    "spring": "N/m",
    "cubic": "N/m^3",
    "air_damping": "N s^2/m^2",
    "gap": "m",
    "preload": "N",
    "friction": "1",
    "stop": "N/m",
    NOTHING: "1",
}
#: Kinds whose strength may be negative.
SIGNED = ("preload", "friction")
#: Way of the tip to its stop [m]: out of reach at 1 N, within reach from 3 N on.
STOP_GAP = 20e-6


@dataclass(frozen=True, kw_only=True)
class HiddenEffect:
    """One hidden effect.

    Raises
    ------
    TransientError
        An unknown kind, or a place where it cannot be.
    """

    kind: str
    """A key of `KINDS`, or `NOTHING`."""
    place: str = ""
    """Point or line; "" where nothing is hidden."""
    strength: float = 0.0
    """In the unit of `UNITS`: added mass, stiffness of a spring to the ground, of a cubic one, quadratic damping,
    added gap at the end of the line (linear from 0 at its beginning), added preload of the line, added
    friction coefficient of the line, stiffness of a one-sided stop."""

    def __post_init__(self) -> None:
        if self.kind == NOTHING:
            return
        if self.kind not in KINDS:
            raise TransientError(f'the effect "{self.kind}" is not one of {", ".join([*KINDS, NOTHING])}')
        if self.place not in KINDS[self.kind]:
            raise TransientError(f'"{self.kind}" at "{self.place}" is not known: give {" or ".join(KINDS[self.kind])}')
        if not np.isfinite(self.strength) or (self.strength < 0 and self.kind not in SIGNED):
            raise TransientError(f'the strength {self.strength} of "{self.kind}" must be finite and not negative')


def insert_effect(beam: Beam, parameters: BeamParameters, effect: HiddenEffect) -> tuple[JointedSystem, JointedSystem]:
    """Insert an effect into the jointed and the free specimen.

    The stop belongs to the rig of the contacts and is taken away with it.
    """
    parameters = _change_line_parameters(parameters, effect)
    jointed, free = jointed_beam(beam, parameters), free_beam(beam, parameters)
    if effect.kind not in ("mass", "spring", "cubic", "air_damping", "stop"):
        return jointed, free
    row, strength = beam.places[effect.place], effect.strength
    if effect.kind == "stop":
        if effect.strength == 0:
            return jointed, free
        stop = ElasticStop(name="hidden stop", direction=row, stiffness=strength, gap=STOP_GAP)
        return replace(jointed, joints=[*jointed.joints, stop]), free
    return _add_to_structure(jointed, effect, row), _add_to_structure(free, effect, row)


def _add_to_structure(system: JointedSystem, effect: HiddenEffect, row: Row) -> JointedSystem:
    square = effect.strength * np.outer(row, row)
    match effect.kind:
        case "mass":
            return replace(system, mass=system.mass + square)
        case "spring":
            return replace(system, stiffness=system.stiffness + square)
        case "cubic":
            cubic = CubicSpring(name="hidden spring", direction=row, stiffness=effect.strength)
            return replace(system, joints=[*system.joints, cubic])
        case _:
            damper = QuadraticDamper(name="hidden damper", direction=row, damping=effect.strength)
            return replace(system, joints=[*system.joints, damper])


def _change_line_parameters(parameters: BeamParameters, effect: HiddenEffect) -> BeamParameters:
    def changed(line: tuple[float, float]) -> tuple[float, float]:
        added = (effect.strength, 0.0) if effect.place == "left" else (0.0, effect.strength)
        return line[0] + added[0], line[1] + added[1]

    match effect.kind:
        case "gap":
            return replace(parameters, gap=changed(parameters.gap))
        case "preload":
            return replace(parameters, preload=changed(parameters.preload))
        case "friction":
            return replace(parameters, friction_coefficient=changed(parameters.friction_coefficient))
        case _:
            return parameters
