"""The case file of a mesh study."""

from typing import Annotated, Literal

from pydantic import Field, field_validator

from study.blade_case import (
    BladeTables,
    Count,
    ElementName,
    PadTable,
    RootName,
    RootTable,
)
from study.case import CaseModel
from study.quantity import Frequency, Length, Ratio


class ModelTable(CaseModel):
    """One row: a mesh, a clamp, and the published frequency if there is one."""

    model: Count
    element: ElementName
    elements_through_thickness: Count
    root: RootName
    paper: Frequency | None = None


class PredictionTable(CaseModel):
    """A row that nothing was tuned to; the closed form that it is compared with is that of the 8-node brick."""

    name: Annotated[str, Field(min_length=1)]
    element: Literal["hex8"]
    elements_through_thickness: Count
    thickness_factor: Annotated[Ratio, Field(gt=0)] = 1.0


class LimitTable(CaseModel):
    """Nested meshes for the extrapolated limit: a coarse base, and how often it is subdivided."""

    element: ElementName = "hex20"
    elements_through_thickness: Count = 1
    length_cap: Length
    subdivisions: tuple[Count, Count, Count] = (1, 2, 4)
    pads: PadTable = PadTable()

    @field_validator("subdivisions")
    @classmethod
    def _one_ratio(cls, subdivisions: tuple[int, int, int]) -> tuple[int, int, int]:
        coarse, medium, fine = subdivisions
        if not coarse < medium < fine or medium * medium != coarse * fine:
            raise ValueError("must grow by one ratio, e.g. [1, 2, 4]")
        return subdivisions


class Table1Case(BladeTables):
    """A mesh study of a blade."""

    title: str
    measured: Frequency
    tuned: tuple[str, ...] = ()
    root: RootTable
    model: Annotated[tuple[ModelTable, ...], Field(min_length=1)]
    prediction: tuple[PredictionTable, ...] = ()
    limit: LimitTable | None = None
