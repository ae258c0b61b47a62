"""``[structure]`` with ``kind = "plain"``: dense matrices in a file, or a reduced model."""

from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from casefile.quantity import Dimension, Length, Ratio, Time
from casefile.table import CaseModel
from study.case.tables import StructureTable

RATE = Dimension("a rate", "1/s", "12 1/s")
Rate = Annotated[float, BeforeValidator(RATE.read), Field(examples=[RATE.example])]


class DofTable(CaseModel):
    """Degree of freedom; one table for each row of the matrices, in their order."""

    body: str = "structure"
    node: Annotated[int, Field(strict=True)] = 0
    direction: Literal["x", "y", "z", "rx", "ry", "rz", "modal"] = "modal"
    coordinates: tuple[Length, Length, Length] | None = None


class RayleighTable(CaseModel):
    """Damping ``mass_factor`` M + ``stiffness_factor`` K, or by the ``ratio`` of the first stuck mode.

    ``loss_factor`` adds structural damping, a complex stiffness (1 + i eta) K.
    """

    ratio: Annotated[Ratio, Field(ge=0, lt=1)] | None = None
    mass_factor: Annotated[Rate, Field(ge=0)] | None = None
    stiffness_factor: Annotated[Time, Field(ge=0)] | None = None
    loss_factor: Annotated[Ratio, Field(ge=0, lt=1)] = 0.0
    replace: bool = False

    @property
    def is_rayleigh(self) -> bool:
        """Whether there is viscous damping."""
        return (self.ratio, self.mass_factor, self.stiffness_factor) != (None, None, None)

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        factors = (self.mass_factor, self.stiffness_factor) != (None, None)
        if (self.ratio is not None and factors) or not (self.is_rayleigh or self.loss_factor):
            raise ValueError(
                'give either ratio, or mass_factor and stiffness_factor, e.g. "12 1/s" and "2 us"; or loss_factor'
            )
        return self


class PlainTable(StructureTable):
    """File of the matrices, relative to the case file, with degrees of freedom and damping that it does not contain."""

    kind: Literal["plain"]
    file: Annotated[str, Field(min_length=1, examples=["structure.npz"])]
    dof: tuple[DofTable, ...] = ()
    damping: RayleighTable | None = None
