"""Units that are known without pint mean what pint says they mean."""

import itertools
from decimal import Decimal
from typing import Any

import pytest

from correlation.campaign.familiar_unit import SYMBOLS, find_familiar_root_units
from correlation.campaign.measurement_unit import get_unit_registry

FORMS = ("{a}", "{a}^2", "{a}/{b}", "{a}*{b}", "{a} {b}", "{a}/{b}^3", "{a}^3/{b}", "{a} {b}^2/{a}", "{a}/{b}/{a}")


@pytest.mark.parametrize("form", FORMS)
def test_familiar_units_agree_with_pint(form: str) -> None:
    registry: Any = get_unit_registry()
    for a, b in itertools.product(SYMBOLS, repeat=2):
        result = find_familiar_root_units(unit := form.format(a=a, b=b))
        assert result is not None, unit
        factor, root = registry.get_root_units(registry.parse_units(unit))
        exponents = {name: float(power) for name, power in root._units.items()}
        assert abs(result[0] / factor - 1) < 1e-20, unit  # of 28 digits
        assert dict(result[1]) == exponents, unit


def test_a_bare_number_has_the_factor_one() -> None:
    assert find_familiar_root_units("") == (Decimal(1), ())


@pytest.mark.parametrize(
    "unit", ["furlong", "N/", "/m", "m/s N", "N**2", "m^-1", "m^2.5", "m  s", "1/s", "N/um^", "m^22"]
)
def test_other_units_are_left_to_pint(unit: str) -> None:
    assert find_familiar_root_units(unit) is None
