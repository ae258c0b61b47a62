"""The table ``[limits]`` of a case: bounded quantity, frequencies, levels and effort of the search.

Frequencies and levels that are not given are those of ``[sweep]``.
"""

from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, field_validator, model_validator

from casefile.quantity import Dimension, Frequency
from casefile.table import CaseModel
from casefile.validation import require_different
from study.case.sweep_table import Level

#: Largest number of points of one level; more points are a mistake of the step.
MOST_POINTS = 2000

Hertz = Annotated[Frequency, Field(gt=0, examples=["122 Hz"])]
Name = Annotated[str, Field(min_length=1, max_length=60)]
Number = Annotated[int, Field(strict=True, ge=1, le=100_000)]
ObjectiveName = Literal["amplitude", "loss factor", "static force", "dynamic force", "all"]
FORCES = ("static force", "dynamic force")
#: Objective for amplitudes of all sensors of motion and static and dynamic forces of all lines, in one search.
EVERYTHING = "all"
UNBOUNDED = "unbounded"


#: Dimension of slider displacements.
SLIDER_BOUND = Dimension("a length", "m", "5 um")


def _reach(value: object) -> object:
    if value in (None, UNBOUNDED):
        return value
    reach = SLIDER_BOUND.read(value)
    if reach <= 0:
        raise ValueError(f'must be positive: it is the largest initial displacement of a slider, or "{UNBOUNDED}"')
    return reach


class LimitsTable(CaseModel):
    """Search for the limits of a quantity over all friction histories."""

    objective: ObjectiveName = "amplitude"
    sensor: Name | None = None
    contact: Name | None = None
    direction: Literal["tangential", "second tangential", "normal"] | None = None
    first: Annotated[Hertz | None, Field(alias="from")] = None
    last: Annotated[Hertz | None, Field(alias="to")] = None
    step: Hertz | None = None
    frequencies: Annotated[tuple[Hertz, ...] | None, Field(min_length=1, examples=[["254 Hz"]])] = None
    levels: Annotated[tuple[Level, ...] | None, Field(min_length=1)] = None
    reach: Annotated[Literal["unbounded"] | float | None, BeforeValidator(_reach)] = None
    nominal: Annotated[
        Literal["rest", "stuck"] | tuple[Annotated[float, BeforeValidator(SLIDER_BOUND.read)], ...],
        Field(examples=["stuck"]),
    ] = "rest"
    population: Number = 24
    samples: Annotated[int, Field(strict=True, ge=0, le=100_000)] = 100
    block: Number = 15
    seed: Annotated[int, Field(strict=True, ge=0)] = 0

    @field_validator("frequencies", "levels", mode="after")
    @classmethod
    def _ascending(cls, values: tuple[float, ...] | None) -> tuple[float, ...] | None:
        return None if values is None else tuple(sorted(require_different(values)))

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        given = [key for key, value in (("from", self.first), ("to", self.last), ("step", self.step)) if value]
        if self.frequencies and given:
            raise ValueError(f"frequencies replace from, to and step: remove frequencies, or {given[0]}")
        return self

    @model_validator(mode="after")
    def _of_its_objective(self) -> Self:
        if self.objective in FORCES:
            if self.contact is None:
                raise ValueError(f'objective = "{self.objective}" needs contact = "NAME", a contact or a contact line')
            if self.sensor is not None:
                raise ValueError(f'sensor is not used with objective = "{self.objective}": remove it')
        elif self.objective == EVERYTHING:
            if self.direction is not None:
                raise ValueError('direction is not used with objective = "all", which bounds all directions: remove it')
        elif self.contact is not None or self.direction is not None:
            key = "contact" if self.contact is not None else "direction"
            raise ValueError(
                f'{key} is not used with objective = "{self.objective}": remove it, or take "static force" or '
                '"dynamic force"'
            )
        return self
