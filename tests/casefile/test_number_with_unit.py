"""Numbers with units that are known later: none of them is infinite."""

import pytest

from casefile.number_with_unit import NumberWithUnit, split_quantity
from casefile.quantity import LENGTH
from correlation.campaign.measurement_unit import read_si_quantity


def test_a_number_that_is_finite_in_its_own_unit_alone_is_refused() -> None:
    assert split_quantity("1.7e308 km") == NumberWithUnit(1.7e308, "km")
    with pytest.raises(ValueError, match="not a finite number of m"):
        split_quantity("1.7e308 km").number_in("m")
    for read in (LENGTH.read, lambda text: read_si_quantity(text, "m")):
        with pytest.raises(ValueError, match="finite"):
            read("1.7e308 km")


def test_a_number_in_another_unit_of_its_quantity_is_exact() -> None:
    assert NumberWithUnit(0.1, "mm").number_in("m") == 1e-4
    assert NumberWithUnit(0.4, "").number_in("") == 0.4
