"""Case file of a mesh study."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, ValidationInfo, field_validator

from casefile.quantity import Frequency, Length, Ratio
from casefile.table import CaseModel
from casefile.validation import did_you_mean
from study.kind.blade.table import (
    BladeTables,
    BrickName,
    Count,
    PadTable,
    PlainBladeTable,
    RootName,
    RootTable,
)

#: Tables with the numbers of a study, except its rows.
TABLES = ("blade", "material", "mesh", "reduction", "damping", "root", "limit")


class ModelTable(CaseModel):
    """Row of the study: a mesh, a clamp, and the published frequency if there is one."""

    model: Count
    element: BrickName
    elements_through_thickness: Count
    root: RootName
    paper: Frequency | None = None


class PredictionTable(CaseModel):
    """Row to which nothing was tuned; it is compared with the closed form for the 8-node brick."""

    name: Annotated[str, Field(min_length=1)]
    element: Literal["hex8"]
    elements_through_thickness: Count
    thickness_factor: Annotated[Ratio, Field(gt=0)] = 1.0


class LimitTable(CaseModel):
    """Nested meshes for the extrapolated limit: a coarse mesh, and the numbers of its subdivisions."""

    element: BrickName = "hex20"
    elements_through_thickness: Count = 1
    length_cap: Length
    subdivisions: tuple[Count, Count, Count] = (1, 2, 4)
    pads: PadTable = PadTable()

    @field_validator("subdivisions")
    @classmethod
    def _one_ratio(cls, subdivisions: tuple[int, int, int]) -> tuple[int, int, int]:
        coarse, medium, fine = subdivisions
        if not coarse < medium < fine or medium * medium != coarse * fine:
            raise ValueError("must grow by a constant ratio, e.g. [1, 2, 4]")
        return subdivisions


def numbers(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Values of all tables except the rows, in SI, by dotted key in the order of `TABLES`; tables may be missing."""
    result: dict[str, Any] = {}
    for name in TABLES:
        if isinstance(table := tables.get(name), CaseModel):
            without = {"pads"} if isinstance(tables.get("blade"), PlainBladeTable) else set()
            result |= _flatten(table.model_dump(exclude=without), f"{name}.")
    return result


def _flatten(table: Mapping[str, Any], prefix: str) -> dict[str, Any]:
    result: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            result |= _flatten(value, f"{prefix}{key}.")
        elif value is not None:
            result[f"{prefix}{key}"] = value
    return result


def _number_of_the_case(key: str, info: ValidationInfo) -> str:
    """Refuse a key that is not the name of a number; a mistake in the table of the key has its own message."""
    table = key.partition(".")[0]
    known = [name for name, value in numbers(info.data).items() if isinstance(value, int | float)]
    if key not in known and (table not in TABLES or table in info.data):
        remedy = did_you_mean(key, known) or '; write it as table.key, e.g. "blade.length"'
        raise ValueError(f"is not the name of a number of this case{remedy}")
    return key


class Table1Case(BladeTables):
    """Mesh study of a blade; `tuned` is the last field, since its validation needs the others."""

    title: str
    measured: Frequency
    root: RootTable
    model: Annotated[tuple[ModelTable, ...], Field(min_length=1)]
    prediction: tuple[PredictionTable, ...] = ()
    limit: LimitTable | None = None
    tuned: tuple[Annotated[str, AfterValidator(_number_of_the_case)], ...] = ()

    @property
    def numbers(self) -> dict[str, Any]:
        """Values of all tables except the rows, in SI, by dotted key."""
        return numbers(dict(self))
