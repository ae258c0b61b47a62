"""Lengths and forces are drawn in handy units; angles and readings without calibration stay in theirs."""

import pytest

from study.compare.drawn_unit import choose_unit


@pytest.mark.parametrize(
    ("unit", "largest", "drawn"),
    [
        ("m", 2.0, ("m", 1.0)),
        ("m", 4e-5, ("um", 1e6)),
        ("m/s^2", 1e-6, ("mm/s^2", 1e3)),
        ("N", 0.02, ("mN", 1e3)),
        ("rad", 1e-5, ("rad", 1.0)),
        ("rad/s^2", 1e-5, ("rad/s^2", 1.0)),
        ("V", 1e-3, ("V", 1.0)),
    ],
)
def test_only_lengths_and_forces_are_scaled(unit: str, largest: float, drawn: tuple[str, float]) -> None:
    assert choose_unit(unit, largest) == drawn
