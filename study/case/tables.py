"""The case file of ``stickslip compare``: a structure from a file, its contact lines, sensors, loads, priors."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import BeforeValidator, ConfigDict, Field, field_validator, model_validator

from casefile.quantity import Angle, Dimension, Force, Length, Ratio, Stiffness, Time
from casefile.table import CaseModel
from study.case.joint_table import MOST_HARMONICS, MOST_SAMPLES, ContactTable, DampingTable, ModelTable, Name
from study.case.place import TestPlaceTable

RATE = Dimension("a rate", "1/s", "12 1/s")
Rate = Annotated[float, BeforeValidator(RATE.read), Field(examples=[RATE.example])]
Positive = Annotated[Stiffness, Field(gt=0)]
NotNegative = Annotated[Ratio, Field(ge=0)]
Factor = Annotated[Ratio, Field(gt=0)]


def _listed(value: Any) -> Any:
    """One entry counts as a list of one."""
    return value if isinstance(value, list | tuple) else [value]


Places = Annotated[tuple[TestPlaceTable, ...], BeforeValidator(_listed), Field(min_length=1)]
Stiffnesses = Annotated[tuple[Positive, ...], BeforeValidator(_listed), Field(min_length=1)]
Ratios = Annotated[tuple[NotNegative, ...], BeforeValidator(_listed), Field(min_length=1)]
Forces = Annotated[tuple[Force, ...], BeforeValidator(_listed), Field(min_length=1)]
Lengths = Annotated[tuple[Length, ...], BeforeValidator(_listed), Field(min_length=1)]


class DofTable(CaseModel):
    """What one degree of freedom is; as many tables as the matrices have rows, in their order."""

    body: str = "structure"
    node: Annotated[int, Field(strict=True)] = 0
    direction: Literal["x", "y", "z", "rx", "ry", "rz", "modal"] = "modal"
    coordinates: tuple[Length, Length, Length] | None = None


class RayleighTable(CaseModel):
    """Damping ``mass_factor`` M + ``stiffness_factor`` K, or by its ``ratio`` on the first stuck mode."""

    ratio: Annotated[Ratio, Field(ge=0, lt=1)] | None = None
    mass_factor: Annotated[Rate, Field(ge=0)] | None = None
    stiffness_factor: Annotated[Time, Field(ge=0)] | None = None
    replace: bool = False

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        factors = (self.mass_factor, self.stiffness_factor) != (None, None)
        if (self.ratio is not None) == factors:
            raise ValueError('give either ratio, or mass_factor and stiffness_factor, e.g. "12 1/s" and "2 us"')
        return self

    @property
    def by_ratio(self) -> DampingTable | None:
        """The same as a table of ``stickslip solve``; none if the factors are given."""
        return None if self.ratio is None else DampingTable(ratio=self.ratio, replace=self.replace)


class NamedPlaceTable(TestPlaceTable):
    """A point with a direction: where effects may act and sensors sit."""

    name: Name


class SensorTable(TestPlaceTable):
    """What reads a motion."""

    name: Name
    quantity: Literal["displacement", "velocity", "acceleration"] = "displacement"
    gain: Ratio = 1.0


class LineSensorTable(CaseModel):
    """What reads the force of a line on the structure."""

    name: Name
    line: str
    component: Literal["tangential", "normal"]
    gain: Ratio = 1.0


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


class TestLoadTable(TestPlaceTable):
    """A harmonic force amplitude cos(harmonic Omega t + phase) at a level of 1 N."""

    amplitude: Annotated[Force, Field(ge=0)] = 1.0
    harmonic: Annotated[int, Field(strict=True, ge=1)] = 1
    phase: Angle = 0.0


class TestStaticLoadTable(TestPlaceTable):
    """A constant force."""

    force: Force


class DeadWeightTable(TestPlaceTable):
    """A constant force that presses lines; their pre-loads are those under it, so that it is not added to them."""

    name: Name
    force: Force
    presses: Annotated[tuple[Name, ...], Field(min_length=1, examples=[["left"]])]


class AcceptedTable(CaseModel):
    """Relative standard deviations of what every fit calibrates; 0 leaves one out as known."""

    kt: NotNegative | None = None
    kn: NotNegative | None = None
    mu: NotNegative | None = None
    zeta: NotNegative | None = None
    E: NotNegative | None = None
    bearing: NotNegative | None = None

    @property
    def deviation(self) -> Mapping[str, float]:
        """Those that are given, by name [-]."""
        return {name: value for name, value in self.model_dump().items() if value is not None}


class NumericalErrorTable(CaseModel):
    """Standard deviations of what discretisation changes, and finer cases of the same structure."""

    frequency: NotNegative = 2e-4
    compliance: NotNegative = 0.01
    shares: NotNegative = 0.05
    refined: tuple[str, ...] = ()


class HarmonicsTable(CaseModel):
    """How finely a motion is resolved."""

    highest: Annotated[int, Field(strict=True, ge=1, le=MOST_HARMONICS)] = 7
    samples: Annotated[int, Field(strict=True, ge=1, le=MOST_SAMPLES)] | None = None

    @model_validator(mode="after")
    def _enough_samples(self) -> Self:
        fewest = 4 * self.highest + 1
        if self.samples is not None and self.samples < fewest:
            raise ValueError(
                f"samples = {self.samples} are too few for harmonics 0 to {self.highest}: take at least {fewest}, or "
                "leave samples out"
            )
        return self


class EffectsTable(CaseModel):
    """Effects of one's own, and kinds that are left out."""

    files: tuple[str, ...] = ()
    without: tuple[str, ...] = ()


class AddedTable(CaseModel):
    """An effect that was missing, with one value for each of its parameters."""

    # Which keys there are depends on the effect.
    model_config = ConfigDict(extra="allow")

    effect: Annotated[str, Field(min_length=1, examples=["mass at tip"])]

    @property
    def values(self) -> Mapping[str, Any]:
        """What is given, by key."""
        return self.model_extra or {}


class CalibratedTable(CaseModel):
    """Factors on what the case says, as a calibration found them."""

    kt: Factor | None = None
    kn: Factor | None = None
    mu: Factor | None = None
    zeta: Factor | None = None
    E: Factor | None = None
    bearing: Factor | None = None

    @property
    def factors(self) -> Mapping[str, float]:
        """Those that are given, by name [-]."""
        return {name: value for name, value in self.model_dump().items() if value is not None}


class TestCase(CaseModel):
    """A structure beside its test set-up."""

    __test__: ClassVar[bool] = False  # no test of pytest's

    title: str = ""
    model: ModelTable
    dof: tuple[DofTable, ...] = ()
    damping: RayleighTable | None = None
    place: tuple[NamedPlaceTable, ...] = ()
    sensor: tuple[SensorTable, ...] = ()
    line_sensor: tuple[LineSensorTable, ...] = ()
    line: tuple[LineTable, ...] = ()
    contact: tuple[ContactTable, ...] = ()
    load: tuple[TestLoadTable, ...]
    static_load: tuple[TestStaticLoadTable, ...] = ()
    dead_weight: tuple[DeadWeightTable, ...] = ()
    accepted: AcceptedTable = AcceptedTable()
    numerical_error: NumericalErrorTable = NumericalErrorTable()
    harmonics: HarmonicsTable = HarmonicsTable()
    effects: EffectsTable = EffectsTable()
    added: tuple[AddedTable, ...] = ()
    calibrated: CalibratedTable = CalibratedTable()

    @field_validator("load", mode="before")
    @classmethod
    def _not_none(cls, tables: Any) -> Any:
        if tables == []:
            raise ValueError("is empty: give at least one, as a table in double brackets")
        return tables
