"""The tables of a case file: one structure, and the computations with it. Every command reads the same file.

The kind of ``[structure]`` determines the source of the matrices (`study.kind`); all other tables are the same for
every kind.
"""

from collections.abc import Mapping
from typing import Annotated, Any, Generic, Self, TypeVar

from pydantic import ConfigDict, Field, model_validator

from casefile.quantity import Ratio
from casefile.table import CaseModel
from casefile.validation import did_you_mean
from study.case.joint_table import LineTable, Name, NotNegative
from study.case.load_table import DeadWeightTable, LoadTable, StaticLoadTable
from study.case.place import PlaceTable
from study.case.sensor_table import SensorTable
from study.case.sweep_table import Sweep
from study.case.uncertain_table import UncertainTable
from study.limits.table import LimitsTable

#: Recommended samples per period if too few are given: minimum number, and number per harmonic.
FEWEST_SAMPLES, SAMPLES_PER_HARMONIC = 128, 32
MOST_HARMONICS, MOST_SAMPLES = 500, 65536

Factor = Annotated[Ratio, Field(gt=0)]


class StructureTable(CaseModel):
    """Source of the matrices; each kind adds its own keys."""

    kind: str


class NamedPlaceTable(PlaceTable):
    """A point with a direction, for effects and sensors."""

    name: Name


class HarmonicsTable(CaseModel):
    """Resolution of a motion: harmonics, samples per period and tolerance."""

    highest: Annotated[int, Field(strict=True, ge=0, le=MOST_HARMONICS)] = 7
    samples: Annotated[int, Field(strict=True, ge=1, le=MOST_SAMPLES)] | None = None
    tolerance: Annotated[Ratio, Field(gt=0, le=1, examples=["0.5 %"])] | None = None

    @property
    def n_sample(self) -> int:
        """Samples per period [-]; 0 leaves the choice to the solver."""
        return self.samples or 0

    @model_validator(mode="after")
    def _enough_samples(self) -> Self:
        fewest = 4 * self.highest + 1
        if self.samples is not None and self.samples < fewest:
            raise ValueError(
                f"samples = {self.samples} are too few for harmonics 0 to {self.highest}: take at least {fewest}, "
                f"better {max(FEWEST_SAMPLES, SAMPLES_PER_HARMONIC * self.highest)}, or remove samples"
            )
        return self


class ParameterTable(CaseModel):
    """A number for all or some calibration parameters; keys of parameters of one line, joint or part have a dot."""

    model_config = ConfigDict(extra="allow")

    @property
    def given(self) -> Mapping[str, float]:
        """Given numbers, by name [-]."""
        return {name: value for name, value in self.model_dump().items() if value is not None}

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown(cls, data: Any) -> Any:
        known = list(cls.model_fields)
        for name, value in data.items() if isinstance(data, Mapping) else ():
            if isinstance(value, Mapping):
                key = f"{name}.{next(iter(value), 'key')}"
                raise ValueError(f'{name} is read as a table: write the key in quotes, such as "{key}"')
            if name not in known and "." not in name:
                hint = did_you_mean(name, known) or f"; known keys: {', '.join(known)}"
                example = f'"{name}.limit_force"'
                raise ValueError(
                    f"unknown key {name}{hint}, or a number of one line, joint or part in quotes, such as {example}"
                )
        return data


class AcceptedTable(ParameterTable):
    """Relative standard deviations of the calibration parameters; 0 excludes a parameter from the calibration."""

    __pydantic_extra__: dict[str, NotNegative] = Field(init=False)

    kt: NotNegative | None = None
    kn: NotNegative | None = None
    mu: NotNegative | None = None
    zeta: NotNegative | None = None
    E: NotNegative | None = None
    bearing: NotNegative | None = None


class NumericalErrorTable(CaseModel):
    """Standard deviations of the errors of the discretisation, and finer cases of the same structure."""

    frequency: NotNegative = 2e-4
    damping: NotNegative | None = None
    compliance: NotNegative = 0.01
    model: NotNegative = 1e-3
    shares: NotNegative = 0.05
    refined: tuple[str, ...] = ()


class PluginsTable(CaseModel):
    """Python files with the user's extensions, of any kind (docs/extending.md)."""

    files: Annotated[tuple[str, ...], Field(examples=[["my_law.py"]])] = ()


class EffectsTable(CaseModel):
    """Python files with the user's effects, and kinds of effects that are left out."""

    files: tuple[str, ...] = ()
    without: tuple[str, ...] = ()


class AddedTable(CaseModel):
    """An added effect, with one value for each of its parameters."""

    # The keys depend on the effect.
    model_config = ConfigDict(extra="allow")

    effect: Annotated[str, Field(min_length=1, examples=["mass at tip"])]

    @property
    def values(self) -> Mapping[str, Any]:
        """Given values, by key."""
        return self.model_extra or {}


class CalibratedTable(ParameterTable):
    """Factors on the values of the case, from a calibration."""

    __pydantic_extra__: dict[str, Factor] = Field(init=False)

    kt: Factor | None = None
    kn: Factor | None = None
    mu: Factor | None = None
    zeta: Factor | None = None
    E: Factor | None = None
    bearing: Factor | None = None


S = TypeVar("S", bound=StructureTable)


class Case(CaseModel, Generic[S]):
    """A case file.

    `S` is the table of the structure's kind. `study.kind.registry.OpenCase.lacks` reports a table that a command needs.
    """

    title: str = ""
    structure: S
    place: tuple[NamedPlaceTable, ...] = ()
    line: tuple[LineTable, ...] = ()
    joint: tuple[Any, ...] = ()  # tables of the registered laws, see `study.kind.registry.make_joint_case_model`
    load: tuple[LoadTable, ...] = ()
    static_load: tuple[StaticLoadTable, ...] = ()
    dead_weight: tuple[DeadWeightTable, ...] = ()
    sensor: tuple[SensorTable, ...] = ()
    harmonics: HarmonicsTable = HarmonicsTable()
    sweep: Sweep | None = None
    limits: LimitsTable = LimitsTable()
    uncertain: tuple[UncertainTable, ...] = ()
    accepted: AcceptedTable = AcceptedTable()
    numerical_error: NumericalErrorTable = NumericalErrorTable()
    plugins: PluginsTable = PluginsTable()
    effects: EffectsTable = EffectsTable()
    added: tuple[AddedTable, ...] = ()
    calibrated: CalibratedTable = CalibratedTable()
