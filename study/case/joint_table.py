"""The tables of a case that describe joints: one joint per law, and lines of frictional contacts."""

from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from casefile.quantity import CubicStiffness, Force, Length, QuadraticDamping, Ratio, Stiffness
from casefile.table import CaseModel
from study.case.place import Places, PlaceTable, listed

Positive = Annotated[Stiffness, Field(gt=0)]
NotNegative = Annotated[Ratio, Field(ge=0)]
Name = Annotated[str, Field(min_length=1, max_length=60)]

Stiffnesses = Annotated[tuple[Positive, ...], BeforeValidator(listed), Field(min_length=1)]
Ratios = Annotated[tuple[NotNegative, ...], BeforeValidator(listed), Field(min_length=1)]
Forces = Annotated[tuple[Force, ...], BeforeValidator(listed), Field(min_length=1)]
Lengths = Annotated[tuple[Length, ...], BeforeValidator(listed), Field(min_length=1)]


class FrictionTable(CaseModel):
    """A contact: `reduction.jointed_system.FrictionContact`, one for each station of its places."""

    kind: Literal["friction"]
    name: Name
    normal: PlaceTable
    tangent: PlaceTable
    second_tangent: PlaceTable | None = None
    normal_stiffness: Positive
    tangential_stiffness: Positive
    friction_coefficient: Annotated[Ratio, Field(ge=0, examples=[0.4])]
    preload: Force = 0.0
    gap: Length = 0.0
    friction: Literal["uncoupled", "coulomb"] = "uncoupled"


class JenkinsTable(PlaceTable):
    """A spring and a slider in series with a constant limit."""

    kind: Literal["jenkins"]
    name: Name
    tangential_stiffness: Positive
    limit_force: Annotated[Force, Field(ge=0)]


class CubicTable(PlaceTable):
    """A spring with f = stiffness u^3."""

    kind: Literal["cubic"]
    name: Name
    stiffness: CubicStiffness


class StopTable(PlaceTable):
    """A one-sided elastic stop."""

    kind: Literal["stop"]
    name: Name
    stiffness: Positive
    gap: Length = 0.0


class QuadraticDamperTable(PlaceTable):
    """A damper with f = damping |v| v."""

    kind: Literal["quadratic_damper"]
    name: Name
    damping: Annotated[QuadraticDamping, Field(ge=0)]


JointTable = Annotated[
    FrictionTable | JenkinsTable | CubicTable | StopTable | QuadraticDamperTable, Field(discriminator="kind")
]


class LineTable(CaseModel):
    """Contacts in a row: of each its own, or of the whole line with the share of each contact."""

    name: Name
    normal: Places
    tangent: Places
    second_tangent: Places | None = None
    normal_stiffness: Stiffnesses
    tangential_stiffness: Stiffnesses
    friction_coefficient: Ratios
    preload: Forces = (0.0,)
    gap: Lengths = (0.0,)
    shares: Annotated[tuple[Annotated[float, Field(gt=0)], ...] | None, Field(examples=[[1, 4, 1]])] = None
    friction: Literal["uncoupled", "coulomb"] = "uncoupled"
    balanced_preload: bool = False
    pressed_by: Annotated[Name | None, Field(examples=["screw"])] = None

    @model_validator(mode="after")
    def _shared(self) -> Self:
        if self.shares is not None:
            for name in ("normal_stiffness", "tangential_stiffness", "preload"):
                if len(getattr(self, name)) > 1:
                    raise ValueError(
                        f"{name} has a value for each contact, and shares too: give one of the line, or none"
                    )
        return self
