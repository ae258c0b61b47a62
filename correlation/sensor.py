"""Sensors of a model: of motion, with the heads of a laser; of the force of a contact line; and load cells."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import cos, sin
from typing import TypeAlias

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.errors import ModelDefinitionError
from geometry.read_only_array import freeze_fields

Row = Float[NDArray[np.float64], " r"]

#: How many time derivatives of the displacement a quantity is.
DERIVATIVE = {"displacement": 0, "velocity": 1, "acceleration": 2}
COMPONENTS = ("tangential", "normal")


@dataclass(frozen=True, kw_only=True, eq=False)
class Head:
    """Head of a laser vibrometer; a sensor adds the readings of its heads.

    Parameters
    ----------
    along, across
        Displacement along its beam, and that which it would read if it leaned by 90 degrees, shape (r,) each [-].
    """

    along: Row
    across: Row

    def __post_init__(self) -> None:
        freeze_fields(self, "along", "across")

    def leaning(self, angle: float) -> "Head":
        """The head turned by an angle more [rad]."""
        return Head(
            along=cos(angle) * self.along + sin(angle) * self.across,
            across=cos(angle) * self.across - sin(angle) * self.along,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Sensor:
    """Sensor of the motion of a point.

    Parameters
    ----------
    name
        As in the measurements.
    row
        Displacement that it follows, over the degrees of freedom, shape (r,) [-].
    quantity
        "displacement", "velocity" or "acceleration".
    gain
        Reading per unit [-].
    delay
        Time by which the reading is late [s].
    relative
        Whether it reads the motion relative to a shaken base, such as a strain gauge or a laser on the shaker; an
        accelerometer and a laser on the floor read the absolute motion. Without a shaken base both are one.
    heads
        Heads of a laser, by where they look; their rows add up to `row`. None where it is not known how they may lean.
    """

    name: str
    row: Row
    quantity: str = "displacement"
    gain: float = 1.0
    delay: float = 0.0
    relative: bool = False
    heads: Mapping[str, Head] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.quantity not in DERIVATIVE:
            raise ModelDefinitionError(f'sensor "{self.name}" reads "{self.quantity}": give {", ".join(DERIVATIVE)}')
        freeze_fields(self, "row")
        object.__setattr__(self, "heads", dict(self.heads))

    @classmethod
    def laser(cls, name: str, heads: Mapping[str, Head]) -> "Sensor":
        """A laser of some heads, whose readings add up."""
        return cls(name=name, row=np.sum([item.along for item in heads.values()], axis=0), heads=heads)

    def leaning(self, head: str, angle: float) -> "Sensor":
        """The sensor with one of its heads turned by an angle more [rad]."""
        before = self.heads[head]
        after = before.leaning(angle)
        return replace(self, row=self.row + after.along - before.along, heads={**self.heads, head: after})


@dataclass(frozen=True, kw_only=True, eq=False)
class LineSensor:
    """Sensor of the force of a contact line, summed over its contacts.

    The sign is that of the joints' laws: a line that sticks reads k_t u along its tangents, which the structure feels
    as a force that resists u.

    Parameters
    ----------
    name
        As in the measurements.
    line
        Name of the line.
    component
        "tangential" (along the first tangents) or "normal" (positive in compression).
    gain
        Reading per newton [-].
    delay
        Time by which the reading is late [s].
    """

    name: str
    line: str
    component: str
    gain: float = 1.0
    delay: float = 0.0

    def __post_init__(self) -> None:
        if self.component not in COMPONENTS:
            raise ModelDefinitionError(f'sensor "{self.name}" reads "{self.component}": give {" or ".join(COMPONENTS)}')


@dataclass(frozen=True, kw_only=True, eq=False)
class LoadCell:
    """Sensor of a force within the structure, such as that of an arm on the support behind it.

    Parameters
    ----------
    name
        As in the measurements.
    row
        Force over the displacement of the degrees of freedom, shape (r,) [N/m].
    at_rest
        Force at rest, from where displacements are reckoned [N].
    gain
        Reading per newton [-].
    delay
        Time by which the reading is late [s].
    """

    name: str
    row: Row
    at_rest: float = 0.0
    gain: float = 1.0
    delay: float = 0.0

    def __post_init__(self) -> None:
        freeze_fields(self, "row")


AnySensor: TypeAlias = Sensor | LineSensor | LoadCell
