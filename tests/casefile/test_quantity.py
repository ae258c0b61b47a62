"""Quantities keep their physical value through every unit, and a wrong unit is called by its name."""

import math
from typing import Annotated

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field, TypeAdapter, ValidationError

from casefile import quantity
from casefile.quantity import Dimension, Length, format_quantity, read_quantity

# Text to float, decimal arithmetic and float to text: a few units in the last place.
ROUND_OFF = 1e-14


@pytest.mark.parametrize(
    ("text", "dimension", "si"),
    [
        ("8.5 N/um", quantity.STIFFNESS, 8.5e6),
        ("8.5 N/µm", quantity.STIFFNESS, 8.5e6),
        ("250 mm", quantity.LENGTH, 0.25),
        ("0.1mm", quantity.LENGTH, 1e-4),
        ("-3 mm", quantity.LENGTH, -0.003),
        ("210 GPa", quantity.PRESSURE, 210e9),
        ("210e3 N/mm^2", quantity.PRESSURE, 210e9),
        ("7.8 g/cm^3", quantity.DENSITY, 7800.0),
        ("7800 kg/m³", quantity.DENSITY, 7800.0),
        ("7800 kg/m3", quantity.DENSITY, 7800.0),
        ("210e3 N/mm2", quantity.PRESSURE, 210e9),
        ("2.5 N/mm3", quantity.CUBIC_STIFFNESS, 2.5e9),
        ("9.81 m/s2", quantity.ACCELERATION, 9.81),
        ("0.1 N s2/m2", quantity.QUADRATIC_DAMPING, 0.1),
        ("0.2 %", quantity.RATIO, 0.002),
        ("0.002", quantity.RATIO, 0.002),
        (0.002, quantity.RATIO, 0.002),
        ("1.2 kHz", quantity.FREQUENCY, 1200.0),
        ("60 rpm", quantity.FREQUENCY, 1.0),
    ],
)
def test_a_decimal_value_becomes_the_nearest_si_float(text: str, dimension: Dimension, si: float) -> None:
    assert read_quantity(text, dimension) == si


def test_an_angle_is_in_radians_and_a_speed_of_rotation_is_a_frequency_times_two_pi() -> None:
    assert read_quantity("180 deg", quantity.ANGLE) == pytest.approx(math.pi, rel=ROUND_OFF)
    assert read_quantity("1 rad/s", quantity.FREQUENCY) == pytest.approx(1 / (2 * math.pi), rel=ROUND_OFF)


@given(
    value=st.floats(1e-12, 1e12),
    case=st.sampled_from(
        [
            ("N/um", quantity.STIFFNESS), ("mm", quantity.LENGTH), ("GPa", quantity.PRESSURE), ("deg", quantity.ANGLE),
            ("g/cm^3", quantity.DENSITY), ("kHz", quantity.FREQUENCY), ("%", quantity.RATIO), ("g", quantity.MASS),
        ]
    ),
)  # fmt: skip
def test_formatting_and_reading_are_inverse(value: float, case: tuple[str, Dimension]) -> None:
    unit, dimension = case
    back = read_quantity(format_quantity(value, unit, digits=17), dimension)
    assert back == pytest.approx(value, rel=ROUND_OFF)


@pytest.mark.parametrize(
    ("value", "dimension", "message"),
    [
        (250, quantity.LENGTH, 'give a unit, e.g. "250 mm"'),
        ("250", quantity.LENGTH, 'give a unit, e.g. "250 mm"'),
        ("250 kg", quantity.LENGTH, '"kg" makes it a mass, but a length is needed'),
        ("250 mm", quantity.STIFFNESS, '"mm" makes it a length, but a stiffness is needed'),
        ("3 deg", quantity.RATIO, '"deg" makes it an angle, but a ratio is needed'),
        ("5 %", quantity.ANGLE, '"%" makes it a ratio, but an angle is needed'),
        ("5 N s^2/m^2", quantity.STIFFNESS, "of another kind"),
        ("8.5 N/umm", quantity.STIFFNESS, 'unknown unit "umm"; did you mean "N/um"'),
        ("210 gpa", quantity.PRESSURE, 'unknown unit "gpa"; did you mean "GPa"'),
        ("210 wobble", quantity.PRESSURE, 'unknown unit "wobble"; units are written like'),
        ("3,5 mm", quantity.LENGTH, "decimal point, not a comma"),
        ("3 mm + 2 mm", quantity.LENGTH, "cannot read the unit"),
        ("3 mm^", quantity.LENGTH, "cannot read the unit"),
        ("long", quantity.LENGTH, "is not a number with a unit"),
        ("", quantity.LENGTH, "is not a number with a unit"),
        ("nan mm", quantity.LENGTH, "is not a number with a unit"),
        ("1e999 mm", quantity.LENGTH, "not a finite number"),
        (math.nan, quantity.RATIO, "nan is not a finite number"),
        (math.inf, quantity.RATIO, "inf is not a finite number"),
        (True, quantity.RATIO, "written as text with a unit"),
        ([1], quantity.LENGTH, "written as text with a unit"),
    ],
)
def test_what_is_no_such_quantity_is_refused_with_the_reason(value: object, dimension: Dimension, message: str) -> None:
    with pytest.raises(ValueError, match=r".") as caught:
        read_quantity(value, dimension)
    assert message in str(caught.value)


def test_an_exponent_beyond_all_reason_takes_no_time() -> None:
    # Exact arithmetic on it would need a billion digits.
    assert read_quantity("1e-999999999 mm", quantity.LENGTH) == 0.0


def test_bounds_of_a_model_apply_to_the_si_value() -> None:
    adapter = TypeAdapter(Annotated[Length, Field(gt=0.1)])
    assert adapter.validate_python("250 mm") == 0.25
    with pytest.raises(ValidationError, match=r"greater than 0\.1"):
        adapter.validate_python("99 mm")
