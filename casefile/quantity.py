"""Values with units in case files: "8.5 N/um", "250 mm", "8.53 deg" become SI floats, and the way back.

Each type is a `float` in SI that pydantic reads from text. It is checked by *root units*, not by dimension alone,
because an angle has no dimension: "3 deg" is not a ratio, and 60 rpm is 1 Hz, not 6.28 Hz.
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal
from typing import Annotated, get_args

from pydantic import BeforeValidator, Field
from pydantic.fields import FieldInfo

from casefile import plausibility
from casefile.plausibility import Plausibility
from correlation.campaign.measurement_unit import find_root_units, get_unit_registry

NUMBER_AND_UNIT = re.compile(r"\s*([+-]?(?:\d[\d_]*\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*", re.DOTALL)
#: "m3" and "mm2", as units are often written without a caret.
BARE_EXPONENT = re.compile(r"(?<![A-Za-z])([mcdnuk]?m|in|ft|s)([234])(?![\d.])")


@dataclass(frozen=True)
class Dimension:
    """A physical quantity of a case file.

    Parameters
    ----------
    name
        Name in plain words, with its article.
    si
        The SI unit that values are converted to.
    example
        Example of a value, as a user writes it.
    plausibility
        Ranges of its values, where its place is known; a value beyond all solids is refused.
    """

    name: str
    si: str
    example: str
    plausibility: Plausibility | None = None

    def read(self, value: object) -> float:
        """SI value of an entry of a case file: `read_quantity`, as pydantic calls it."""
        return read_quantity(value, self)


LENGTH = Dimension("a length", "m", "250 mm")
AREA = Dimension("an area", "m^2", "20 mm^2")
VOLUME = Dimension("a volume", "m^3", "20 mm^3")
ANGLE = Dimension("an angle", "rad", "8.53 deg")
MASS = Dimension("a mass", "kg", "27 g")
TIME = Dimension("a time", "s", "20 ms")
FORCE = Dimension("a force", "N", "10 N")
PRESSURE = Dimension("a pressure or modulus", "Pa", "210 GPa")
DENSITY = Dimension("a density", "kg/m^3", "7800 kg/m^3")
YOUNGS_MODULUS = Dimension("a Young's modulus", "Pa", "210 GPa", plausibility.YOUNGS_MODULUS)
MATERIAL_DENSITY = Dimension("a density", "kg/m^3", "7800 kg/m^3", plausibility.MATERIAL_DENSITY)
STIFFNESS = Dimension("a stiffness", "N/m", "8.5 N/um")
CUBIC_STIFFNESS = Dimension("a cubic stiffness", "N/m^3", "2.5 N/mm^3")
QUADRATIC_DAMPING = Dimension("a quadratic damping", "N s^2/m^2", "0.1 N*s^2/m^2")
FREQUENCY = Dimension("a frequency", "Hz", "122.25 Hz")
VELOCITY = Dimension("a velocity", "m/s", "20 mm/s")
ACCELERATION = Dimension("an acceleration", "m/s^2", "9.81 m/s^2")
RATIO = Dimension("a ratio", "", "0.2 %")
DIMENSIONS = (
    LENGTH, AREA, VOLUME, ANGLE, MASS, TIME, FORCE, PRESSURE, DENSITY, STIFFNESS, FREQUENCY, VELOCITY, ACCELERATION,
    RATIO,
)  # fmt: skip


def read_quantity(value: object, dimension: Dimension) -> float:
    """SI value of an entry of a case file.

    Parameters
    ----------
    value
        Text such as "250 mm"; for a ratio a bare number too.
    dimension
        Dimension that the value must have.

    Returns
    -------
    A finite number [`dimension.si`].

    Raises
    ------
    ValueError
        No unit, an unreadable one, or one of another dimension; not a finite number; beyond what is possible.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError(f'{dimension.name} is written as text with a unit, e.g. "{dimension.example}"')
    if isinstance(value, int | float):
        if dimension is not RATIO:
            raise ValueError(f'give a unit, e.g. "{dimension.example}"')
        return _check_finite(float(value))
    match = NUMBER_AND_UNIT.fullmatch(value)
    if match is None:
        comma = "; write a decimal point, not a comma" if re.match(r"\s*[+-]?\d*,\d", value) else ""
        raise ValueError(f'is not a number with a unit{comma}; write e.g. "{dimension.example}"')
    number, unit = match.groups()
    if re.match(r",\d", unit):
        raise ValueError(f'write a decimal point, not a comma, e.g. "{dimension.example}"')
    if not unit and dimension is not RATIO:
        raise ValueError(f'give a unit, e.g. "{dimension.example}"')
    unit = BARE_EXPONENT.sub(r"\1^\2", unit)
    # Refused before Decimal sees it: float() overflows to inf on numbers that no unit could correct.
    _check_finite(float(number))
    si = _check_finite(_convert_to_si(Decimal(number), unit, dimension))
    refusal = dimension.plausibility.refusal(si, value) if dimension.plausibility else ""
    if refusal:
        raise ValueError(refusal)
    return si


def dimensions(field: FieldInfo) -> Iterator[Dimension]:
    """Dimensions of the quantities that a field of a model may hold."""
    waiting: list[object] = [*field.metadata, field.annotation]
    while waiting:
        part = waiting.pop(0)
        waiting += [*getattr(part, "__metadata__", ()), *get_args(part)]
        result = getattr(getattr(part, "func", None), "__self__", None)
        if isinstance(result, Dimension):
            yield result


def format_quantity(value: float, unit: str, digits: int = 4) -> str:
    """Text of an SI value in a unit of choice: ``format_quantity(8.5e6, "N/um") == "8.5 N/um"``.

    Parameters
    ----------
    value
        Value in the SI unit of the same dimension; for ``Hz`` in Hz, for ``deg`` in rad.
    unit
        Any unit that a case file may use; empty for a bare number.
    digits
        Significant digits.
    """
    if not unit:
        return f"{value:.{digits}g}"
    factor, _ = find_root_units(unit)
    dimension_factor = Decimal(1000) ** _find_mass_exponent(unit)
    # Root units count mass in grams, SI in kilograms; a Hz is a root unit already.
    return f"{value * float(dimension_factor / factor):.{digits}g} {unit}"


def _check_finite(value: float) -> float:
    if not math.isfinite(value):
        raise ValueError(f"{value} is not a finite number")
    return value


def _convert_to_si(number: Decimal, unit: str, dimension: Dimension) -> float:
    """Convert exactly in decimals, so that "0.1 mm" is the float 1e-4 and no neighbour of it."""
    factor, root = find_root_units(unit)
    wanted_factor, wanted = find_root_units(dimension.si)
    if root == wanted:
        return float(number * factor / wanted_factor)
    if dimension is FREQUENCY and root == find_root_units("rad/s")[1]:
        return float(number * factor) / (2 * math.pi)
    result = next((other for other in DIMENSIONS if find_root_units(other.si)[1] == root), None)
    what = result.name if result else ("a bare number" if not root else f"of another kind [{_format_unit(unit)}]")
    raise ValueError(f'"{unit}" makes it {what}, but {dimension.name} is needed, e.g. "{dimension.example}"')


def _find_mass_exponent(unit: str) -> int:
    return int(dict(find_root_units(unit)[1]).get("gram", 0))


def _format_unit(unit: str) -> str:
    return f"{get_unit_registry().parse_units(unit):~P}"


Length = Annotated[float, BeforeValidator(LENGTH.read), Field(examples=[LENGTH.example])]
Area = Annotated[float, BeforeValidator(AREA.read), Field(examples=[AREA.example])]
Volume = Annotated[float, BeforeValidator(VOLUME.read), Field(examples=[VOLUME.example])]
Angle = Annotated[float, BeforeValidator(ANGLE.read), Field(examples=[ANGLE.example])]
Mass = Annotated[float, BeforeValidator(MASS.read), Field(examples=[MASS.example])]
Time = Annotated[float, BeforeValidator(TIME.read), Field(examples=[TIME.example])]
Force = Annotated[float, BeforeValidator(FORCE.read), Field(examples=[FORCE.example])]
Pressure = Annotated[float, BeforeValidator(PRESSURE.read), Field(examples=[PRESSURE.example])]
Density = Annotated[float, BeforeValidator(DENSITY.read), Field(examples=[DENSITY.example])]
YoungsModulus = Annotated[float, BeforeValidator(YOUNGS_MODULUS.read), Field(examples=[YOUNGS_MODULUS.example])]
MaterialDensity = Annotated[float, BeforeValidator(MATERIAL_DENSITY.read), Field(examples=[MATERIAL_DENSITY.example])]
Stiffness = Annotated[float, BeforeValidator(STIFFNESS.read), Field(examples=[STIFFNESS.example])]
Frequency = Annotated[float, BeforeValidator(FREQUENCY.read), Field(examples=[FREQUENCY.example])]
Velocity = Annotated[float, BeforeValidator(VELOCITY.read), Field(examples=[VELOCITY.example])]
Acceleration = Annotated[float, BeforeValidator(ACCELERATION.read), Field(examples=[ACCELERATION.example])]
Ratio = Annotated[float, BeforeValidator(RATIO.read), Field(examples=[RATIO.example])]
# TOML has real integers: "3", 3.0 and true are none.
Count = Annotated[int, Field(strict=True, ge=1, examples=[3])]
