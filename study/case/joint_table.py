"""The tables of a case for joints: contact lines, and one table per joint law, generated from the law's description."""

from collections.abc import Sequence
from functools import partial
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, create_model, model_validator

from casefile.quantity import (
    CUBIC_STIFFNESS,
    DIMENSIONS,
    QUADRATIC_DAMPING,
    RATIO,
    Dimension,
    Force,
    Length,
    Ratio,
    Stiffness,
)
from casefile.table import CaseModel
from reduction.joint_law.pressed_joint import PLAUSIBLE_FRICTION
from reduction.joint_law.registry import Joint, LawParameter, Plausible
from study.case.place import Places, PlaceTable, listed

Positive = Annotated[Stiffness, Field(gt=0)]
NotNegative = Annotated[Ratio, Field(ge=0)]
Name = Annotated[str, Field(min_length=1, max_length=60)]

Stiffnesses = Annotated[tuple[Positive, ...], BeforeValidator(listed), Field(min_length=1)]


def _refuse_beyond(plausible: Plausible, value: float) -> float:
    if doubt := plausible.doubt(value):
        raise ValueError(doubt)
    return value


Friction = Annotated[Ratio, Field(ge=0, examples=[0.8]), AfterValidator(partial(_refuse_beyond, PLAUSIBLE_FRICTION))]
Ratios = Annotated[tuple[Friction, ...], BeforeValidator(listed), Field(min_length=1)]
Forces = Annotated[tuple[Force, ...], BeforeValidator(listed), Field(min_length=1)]
Lengths = Annotated[tuple[Length, ...], BeforeValidator(listed), Field(min_length=1)]
#: Name of the place of a law that acts along one row; the keys of this place are in the joint's table itself.
DIRECTION = "direction"


def make_joint_type(laws: Sequence[type[Joint]]) -> Any:
    """Make the type of an entry of ``[[joint]]``: the tables of laws, distinguished by ``kind``."""
    tables = [make_law_table(law) for law in laws]
    union: Any = tables[0]
    for table in tables[1:]:
        union |= table
    return Annotated[union, Field(discriminator="kind")]


def make_law_table(law: type[Joint]) -> type[CaseModel]:
    """Make the model of a law's table: name, places, and parameters with units, bounds and defaults."""
    fields: dict[str, Any] = {"kind": (Literal[law.kind], ...), "name": (Name, ...)}
    is_single = set(law.places) == {DIRECTION}
    for place, is_needed in {} if is_single else law.places.items():
        fields[place] = (PlaceTable, ...) if is_needed else (PlaceTable | None, None)
    for parameter in law.parameters:
        fields[parameter.name] = (_make_quantity(parameter), ... if parameter.default is None else parameter.default)
    for option in law.options:
        fields[option.name] = (Literal[option.choices], option.choices[0])
    base = PlaceTable if is_single else CaseModel
    table: type[CaseModel] = create_model(f"{law.__name__}Table", __base__=base, __doc__=law.__doc__, **fields)
    return table


def _make_quantity(parameter: LawParameter) -> Any:
    bounds: dict[str, Any] = {}
    if parameter.positive:
        bounds["gt"] = 0
    elif parameter.lower > float("-inf"):
        bounds["ge"] = parameter.lower
    dimension = _find_dimension(parameter)
    example = parameter.typical if dimension is RATIO else dimension.example
    number: Any = Annotated[float, BeforeValidator(dimension.read), Field(**bounds, examples=[example])]
    if parameter.plausible is not None:
        number = Annotated[number, AfterValidator(partial(_refuse_beyond, parameter.plausible))]
    if parameter.is_list:
        return Annotated[tuple[number, ...], BeforeValidator(listed), Field(min_length=1)]
    return number


def _find_dimension(parameter: LawParameter) -> Dimension:
    if parameter.unit == "-":
        return RATIO
    known = next(
        (item for item in (*DIMENSIONS, CUBIC_STIFFNESS, QUADRATIC_DAMPING) if item.si == parameter.unit), None
    )
    return known or Dimension(f"a {parameter.name}", parameter.unit, f"{parameter.typical:g} {parameter.unit}")


class LineTable(CaseModel):
    """A contact line: values for each contact, or for the whole line with the share of each contact."""

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
                        f"{name} has a value for each contact, but shares are given too: give one value for the "
                        "line, or remove shares"
                    )
        return self
