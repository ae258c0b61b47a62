"""The case file of a mesh study."""

from typing import Annotated

from pydantic import Field

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
    """A row that nothing was tuned to."""

    name: Annotated[str, Field(min_length=1)]
    element: ElementName
    elements_through_thickness: Count
    thickness_factor: Annotated[Ratio, Field(gt=0)] = 1.0


class LimitTable(CaseModel):
    """Nested meshes for the extrapolated limit: a coarse base, and how often it is subdivided."""

    element: ElementName = "hex20"
    elements_through_thickness: Count = 1
    length_cap: Length
    subdivisions: tuple[Count, Count, Count] = (1, 2, 4)
    pads: PadTable = PadTable()


class Table1Case(BladeTables):
    """A mesh study of a blade."""

    title: str
    measured: Frequency
    tuned: tuple[str, ...] = ()
    root: RootTable
    model: Annotated[tuple[ModelTable, ...], Field(min_length=1)]
    prediction: tuple[PredictionTable, ...] = ()
    limit: LimitTable | None = None
