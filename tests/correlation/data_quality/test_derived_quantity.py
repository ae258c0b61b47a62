"""A displacement that is called an acceleration is told from a reversed cable by its size."""

import numpy as np
import pytest

from correlation.data_quality.derived_quantity import name_derived_quantity

FREQUENCY = np.linspace(70.0, 85.0, 20)
OMEGA = 2 * np.pi * FREQUENCY
#: A model that is off by some per cent at each frequency.
OFF = np.exp(0.01 * np.random.default_rng(0).standard_normal(20))


@pytest.mark.parametrize(("factor", "unit"), [(1.0, "SI"), (1e3, "mm"), (1e6, "um")])
def test_omega_squared_and_a_power_of_ten_are_a_displacement_in_a_unit(factor: float, unit: str) -> None:
    ratio = -factor / OMEGA**2 * OFF + 0j
    assert name_derived_quantity("acceleration", ratio, FREQUENCY) == f"a displacement in {unit}"


def test_omega_squared_the_other_way_is_an_acceleration() -> None:
    assert name_derived_quantity("displacement", -(OMEGA**2) * OFF + 0j, FREQUENCY) == "an acceleration in SI"


@pytest.mark.parametrize("factor", [1.0, 2.0, 0.4, 4.4])
def test_a_reversed_cable_of_nearly_the_right_size_is_none(factor: float) -> None:
    for quantity in ("acceleration", "displacement", "velocity"):
        assert not name_derived_quantity(quantity, -factor * OFF + 0j, FREQUENCY)


@pytest.mark.parametrize(("stated", "ratio", "named"), [
    ("acceleration", -1j / OMEGA, "a velocity in SI"), ("velocity", 1j * OMEGA, "an acceleration in SI"),
    ("displacement", 1e3j * OMEGA, "a velocity in mm/s"), ("acceleration", 1j / OMEGA, ""),
])  # fmt: skip
def test_a_velocity_is_told_by_the_quarter_turn_of_its_phase(stated: str, ratio: np.ndarray, named: str) -> None:
    assert name_derived_quantity(stated, ratio * OFF, FREQUENCY) == named
