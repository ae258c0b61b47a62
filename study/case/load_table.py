"""The tables ``[[load]]``, ``[[static_load]]`` and ``[[dead_weight]]`` of a case."""

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from casefile.quantity import Acceleration, Angle, Force, Length, Velocity
from study.case.joint_table import Name
from study.case.place import PlaceTable

#: Quantities by which a table may give the motion of a base.
BASE_QUANTITIES = ("acceleration", "velocity", "displacement")


class LoadTable(PlaceTable):
    """A harmonic force amplitude cos(harmonic Omega t + phase) at level 1, or the motion of a base.

    The base moves along an axis, or with given motions r of all degrees of freedom; the structure moves relative to the
    base under the inertia load -M r. The acceleration, velocity or displacement of the base is given at level 1.
    """

    also: ClassVar[tuple[str, ...]] = ("base",)

    base: Annotated[Literal["x", "y", "z"] | tuple[float, ...] | None, Field(examples=["z"])] = None
    acceleration: Annotated[Acceleration, Field(gt=0)] | None = None
    velocity: Annotated[Velocity, Field(gt=0)] | None = None
    displacement: Annotated[Length, Field(gt=0)] | None = None
    amplitude: Annotated[Force, Field(ge=0)] = 1.0
    harmonic: Annotated[int, Field(strict=True, ge=1)] = 1
    phase: Angle = 0.0

    @model_validator(mode="after")
    def _one_amplitude(self) -> Self:
        given = [name for name in BASE_QUANTITIES if getattr(self, name) is not None]
        if self.base is None and given:
            raise ValueError(
                f'{given[0]} is the motion of a base: add base, e.g. base = "z", or give amplitude for a force'
            )
        if self.base is not None and "amplitude" in self.model_fields_set:
            raise ValueError(
                'amplitude is that of a force: give the motion of the base as acceleration, e.g. "2 m/s^2", velocity '
                "or displacement"
            )
        if len(given) > 1:
            raise ValueError(f"{given[0]} and {given[1]} both give the motion of the base: remove one of them")
        return self

    @property
    def base_quantity(self) -> tuple[str, float]:
        """Quantity of the base's motion, and its amplitude at level 1 [m/s^2, m/s or m]."""
        for name in BASE_QUANTITIES:
            if (value := getattr(self, name)) is not None:
                return name, value
        return "acceleration", 1.0


class StaticLoadTable(PlaceTable):
    """A constant force."""

    force: Force


class DeadWeightTable(PlaceTable):
    """A constant force that presses contact lines; it is part of their given preloads, and not added to them."""

    name: Name
    force: Force
    presses: Annotated[tuple[Name, ...], Field(min_length=1, examples=[["left"]])]
