"""The case file of ``stickslip solve``: a structure from a file, joints, loads, outputs and a sweep."""

from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from casefile.quantity import Angle, CubicStiffness, Force, Frequency, Length, QuadraticDamping, Ratio, Stiffness
from casefile.table import CaseModel
from study.case.level import Level
from study.case.old_place import PlaceTable
from study.limits.table import LimitsTable

#: Advice to who takes too few samples a period: so many at least, and so many for each harmonic.
FEWEST_SAMPLES, SAMPLES_PER_HARMONIC = 128, 32
MOST_HARMONICS, MOST_SAMPLES = 500, 65536

Positive = Annotated[Stiffness, Field(gt=0)]
Name = Annotated[str, Field(min_length=1, max_length=60)]


class ModelTable(CaseModel):
    """The file of the structure, relative to the case file."""

    file: Annotated[str, Field(min_length=1, examples=["structure.npz"])]


class DampingTable(CaseModel):
    """Rayleigh damping by its ratio on the first mode with all contacts stuck."""

    ratio: Annotated[Ratio, Field(ge=0, lt=1)]
    replace: bool = False


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


ContactTable = Annotated[
    FrictionTable | JenkinsTable | CubicTable | StopTable | QuadraticDamperTable, Field(discriminator="kind")
]


class StaticLoadTable(PlaceTable):
    """A constant force."""

    force: Force


class LoadTable(PlaceTable):
    """A harmonic force amplitude cos(harmonic Omega t + phase), at level 1."""

    amplitude: Annotated[Force, Field(ge=0)]
    harmonic: Annotated[int, Field(strict=True, ge=1)] = 1
    phase: Angle = 0.0


class OutputTable(PlaceTable):
    """What the results show by name."""

    name: Name
    quantity: Literal["displacement", "velocity", "acceleration"] = "displacement"


class BalanceTable(CaseModel):
    """How finely a motion is resolved."""

    harmonics: Annotated[int, Field(strict=True, ge=0, le=MOST_HARMONICS)]
    samples: Annotated[int, Field(strict=True, ge=1, le=MOST_SAMPLES)] | None = None

    @property
    def n_sample(self) -> int:
        """Samples a period [-]; 0 leaves the choice to the solver."""
        return self.samples or 0

    @model_validator(mode="after")
    def _enough_samples(self) -> Self:
        fewest = 4 * self.harmonics + 1
        if self.samples is not None and self.samples < fewest:
            raise ValueError(
                f"samples = {self.samples} are too few for harmonics 0 to {self.harmonics}: take at least {fewest}, "
                f"better {max(FEWEST_SAMPLES, SAMPLES_PER_HARMONIC * self.harmonics)}, or leave samples out"
            )
        return self


class FrequencySweepTable(BalanceTable):
    """One curve over frequency for each level of the harmonic force."""

    parameter: Literal["frequency"]
    first: Annotated[Frequency, Field(alias="from", gt=0, examples=["20 Hz"])]
    last: Annotated[Frequency, Field(alias="to", gt=0, examples=["60 Hz"])]
    step: Annotated[Frequency, Field(gt=0)] | None = None
    levels: Annotated[tuple[Level, ...], Field(min_length=1)] = (1.0,)

    @model_validator(mode="after")
    def _ends_differ(self) -> Self:
        _check_ends(self.first, self.last, " Hz")
        return self

    @field_validator("levels", mode="after")
    @classmethod
    def _different(cls, levels: tuple[float, ...]) -> tuple[float, ...]:
        return _different(levels)


class LevelSweepTable(BalanceTable):
    """One curve over the level of the harmonic force for each frequency."""

    parameter: Literal["level"]
    first: Annotated[Level, Field(alias="from", examples=[1.0])]
    last: Annotated[Level, Field(alias="to", examples=[10.0])]
    step: Level | None = None
    frequencies: Annotated[tuple[Annotated[Frequency, Field(gt=0)], ...], Field(min_length=1, examples=[["40 Hz"]])]

    @model_validator(mode="after")
    def _ends_differ(self) -> Self:
        _check_ends(self.first, self.last, "")
        return self

    @field_validator("frequencies", mode="after")
    @classmethod
    def _different(cls, frequencies: tuple[float, ...]) -> tuple[float, ...]:
        return _different(frequencies)


SweepTable = Annotated[FrequencySweepTable | LevelSweepTable, Field(discriminator="parameter")]


class SolveCase(CaseModel):
    """A structure with joints, and the curves that are asked of it."""

    title: str = ""
    model: ModelTable
    damping: DampingTable | None = None
    contact: tuple[ContactTable, ...] = ()
    static_load: tuple[StaticLoadTable, ...] = ()
    load: tuple[LoadTable, ...]
    output: tuple[OutputTable, ...]
    sweep: SweepTable
    limits: LimitsTable = LimitsTable()

    @field_validator("load", "output", mode="before")
    @classmethod
    def _not_none(cls, tables: Any) -> Any:
        if tables == []:
            raise ValueError("is empty: give at least one, as a table in double brackets")
        return tables


def _check_ends(first: float, last: float, unit: str) -> None:
    if first == last:
        raise ValueError(f"from and to are both {first:g}{unit}: give two different ends, in either order")


def _different(values: tuple[float, ...]) -> tuple[float, ...]:
    for place, value in enumerate(values):
        if value in values[:place]:
            raise ValueError(f"{value:g} stands there twice: remove one")
    return values
