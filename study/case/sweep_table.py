"""The table ``[sweep]``: the response curves that `stickslip solve` computes.

The parameter of a curve is the frequency or the level, a factor on the loads; over frequency, the level can be
controlled to keep the amplitude of a sensor constant.
"""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, model_validator

from casefile.quantity import Frequency, Ratio
from casefile.table import CaseModel
from casefile.validation import did_you_mean, require_different
from study.case.joint_table import Name

#: Smallest and largest level: other levels are mistakes; far beyond these bounds the motion would overflow.
LEAST_LEVEL, MOST_LEVEL = 1e-12, 1e12
#: Largest number of points of a curve; more points are a mistake of the step, and take days.
MOST_POINTS = 100_000
#: Allowed parameters of a sweep.
PARAMETERS = ("frequency", "level")


def _in_range(level: float) -> float:
    if not LEAST_LEVEL <= level <= MOST_LEVEL:
        raise ValueError(
            f"must lie between {LEAST_LEVEL:g} and {MOST_LEVEL:g}: it scales the loads, so change the loads instead"
        )
    return level


Level = Annotated[Ratio, Field(gt=0), AfterValidator(_in_range)]


def _known(parameter: object) -> object:
    if parameter not in PARAMETERS:
        raise ValueError('must be "frequency" or "level"' + did_you_mean(str(parameter), PARAMETERS))
    return parameter


class FrequencySweepTable(CaseModel):
    """One curve over frequency for each level of the harmonic force and each friction history.

    History 1 starts from rest under the static load; in the others the initial slider positions are drawn at random.
    """

    parameter: Annotated[Literal["frequency"], BeforeValidator(_known)] = "frequency"
    first: Annotated[Frequency, Field(alias="from", gt=0, examples=["20 Hz"])]
    last: Annotated[Frequency, Field(alias="to", gt=0, examples=["60 Hz"])]
    step: Annotated[Frequency, Field(gt=0)] | None = None
    levels: Annotated[tuple[Level, ...], Field(min_length=1), AfterValidator(require_different)] = (1.0,)
    histories: Annotated[int, Field(ge=1, le=100, strict=True)] = 1
    seed: Annotated[int, Field(ge=0, strict=True)] = 0
    stability: Annotated[bool, Field(strict=True)] = False
    branches: Annotated[bool, Field(strict=True)] = False
    isolas: Annotated[bool, Field(strict=True)] = True

    @model_validator(mode="after")
    def _ends_differ(self) -> Self:
        _check_ends(self.first, self.last, self.step, " Hz")
        _check_branches(self.stability, self.branches)
        return self


class LevelSweepTable(CaseModel):
    """One curve over the level of the harmonic force for each frequency."""

    parameter: Literal["level"]
    first: Annotated[Level, Field(alias="from", examples=[1.0])]
    last: Annotated[Level, Field(alias="to", examples=[10.0])]
    step: Level | None = None
    frequencies: Annotated[
        tuple[Annotated[Frequency, Field(gt=0)], ...],
        Field(min_length=1, examples=[["40 Hz"]]),
        AfterValidator(require_different),
    ]
    stability: Annotated[bool, Field(strict=True)] = False
    branches: Annotated[bool, Field(strict=True)] = False

    @model_validator(mode="after")
    def _ends_differ(self) -> Self:
        _check_ends(self.first, self.last, self.step, "")
        _check_branches(self.stability, self.branches)
        return self


def _with_unit(amplitude: object) -> object:
    if not isinstance(amplitude, str):
        raise ValueError('give a unit, e.g. "3 um"')
    return amplitude


class ControlledSweepTable(CaseModel):
    """One curve over frequency for each amplitude of a sensor; the level of the harmonic force is controlled.

    The unit of the amplitudes is that of the sensor's reading; amplitudes are read when the sensor is known.
    """

    parameter: Annotated[Literal["frequency"], BeforeValidator(_known)] = "frequency"
    control: Name
    amplitudes: Annotated[
        tuple[Annotated[str, BeforeValidator(_with_unit)], ...],
        Field(min_length=1, examples=[["1 um", "3 um"]]),
        AfterValidator(require_different),
    ]
    first: Annotated[Frequency, Field(alias="from", gt=0, examples=["20 Hz"])]
    last: Annotated[Frequency, Field(alias="to", gt=0, examples=["60 Hz"])]
    step: Annotated[Frequency, Field(gt=0)] | None = None

    @model_validator(mode="before")
    @classmethod
    def _no_levels(cls, data: Any) -> Any:
        of_levels = [name for name in FrequencySweepTable.model_fields if name not in cls.model_fields]
        if given := [name for name in of_levels if isinstance(data, Mapping) and name in data]:
            raise ValueError(f"{given[0]} is for curves at given levels: remove it, or remove control and amplitudes")
        return data

    @model_validator(mode="after")
    def _ends_differ(self) -> Self:
        _check_ends(self.first, self.last, self.step, " Hz")
        return self


def _find_swept(sweep: Any) -> str:
    """Find the type of a sweep; frequency if the parameter is missing, or unknown, which its table refuses."""
    over = sweep.get("parameter") if isinstance(sweep, Mapping) else getattr(sweep, "parameter", None)
    if over == "level":
        return "level"
    controlled = "control" in sweep if isinstance(sweep, Mapping) else hasattr(sweep, "control")
    return "control" if controlled else "frequency"


Sweep = Annotated[
    Annotated[FrequencySweepTable, Tag("frequency")]
    | Annotated[LevelSweepTable, Tag("level")]
    | Annotated[ControlledSweepTable, Tag("control")],
    Discriminator(_find_swept),
]


def _check_ends(first: float, last: float, step: float | None, unit: str) -> None:
    if first == last:
        raise ValueError(f"from and to are both {first:g}{unit}: give two different ends, in either order")
    if step is not None and abs(last - first) > MOST_POINTS * step:
        raise ValueError(
            f"step = {step:g}{unit} gives a curve more than {MOST_POINTS} points: give one of at least "
            f"{abs(last - first) / MOST_POINTS:.2g}{unit}, or remove step"
        )


def _check_branches(stability: bool, branches: bool) -> None:
    if branches and not stability:
        raise ValueError(
            "branches = true follows curves from branch points, which are found by the stability analysis: give "
            "stability = true"
        )
