"""The tables ``[[load]]``, ``[[static_load]]`` and ``[[dead_weight]]`` of a case."""

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from casefile.quantity import Angle, Force
from study.case.joint_table import Name
from study.case.place import PlaceTable


class LoadTable(PlaceTable):
    """A harmonic force amplitude cos(harmonic Omega t + phase) at level 1, or a shaken base.

    On a base that moves with the acceleration cos(Omega t) at level 1, along an axis or with given motions of all
    degrees of freedom, the structure moves relative to it under the inertia load -M r.
    """

    also: ClassVar[tuple[str, ...]] = ("base",)

    base: Annotated[Literal["x", "y", "z"] | tuple[float, ...] | None, Field(examples=["z"])] = None
    amplitude: Annotated[Force, Field(ge=0)] = 1.0
    harmonic: Annotated[int, Field(strict=True, ge=1)] = 1
    phase: Angle = 0.0

    @model_validator(mode="after")
    def _plain_base(self) -> Self:
        if self.base is not None and (self.amplitude, self.harmonic, self.phase) != (1.0, 1, 0.0):
            raise ValueError("base is the acceleration of the level itself: leave out amplitude, harmonic and phase")
        return self


class StaticLoadTable(PlaceTable):
    """A constant force."""

    force: Force


class DeadWeightTable(PlaceTable):
    """A constant force that presses lines; their preloads are those under it, so that it is not added to them."""

    name: Name
    force: Force
    presses: Annotated[tuple[Name, ...], Field(min_length=1, examples=[["left"]])]
