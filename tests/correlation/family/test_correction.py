"""Readings at a force that is off, against limits that follow known powers of the force."""

import numpy as np
import pytest

from correlation.family.band import LimitChange, PredictedBand
from correlation.family.correction import correct_family
from correlation.family.family import Family, FamilyCurve

FREQUENCY = np.linspace(20.0, 22.0, 9)
#: Powers of the force that the limits grow with: slip below, the flank of a falling resonance above.
POWERS = np.array([0.4, 6.0])
LEVEL = np.array([1.0, 1.5])[:, None] * (1 + 0.1 * (FREQUENCY - 21))
SPAN = 0.04


def scaled_limits(ratio: float | np.ndarray) -> np.ndarray:
    return LEVEL * np.power(ratio, (POWERS - 1)[:, None])


BY_FORCE = LimitChange(SPAN, np.array([scaled_limits(np.exp(-SPAN)), scaled_limits(np.exp(SPAN))]))


def band(**changes: object) -> PredictedBand:
    values = {
        "frequency": FREQUENCY, "value": LEVEL, "deviation": np.zeros((2, 9)), "jump": np.zeros((2, 9), dtype=bool),
        "by_force": BY_FORCE,
    }  # fmt: skip
    return PredictedBand(**(values | changes))  # type: ignore[arg-type]


def family(value: np.ndarray, ratio: np.ndarray) -> Family:
    curve = FamilyCurve(
        test="t", repeat=1, sweep=1, frequency=FREQUENCY, value=value, ratio=ratio, scaled=np.abs(1 / ratio - 1)
    )
    return Family(sensor="tip", harmonic=1, level=1.0, curves=(curve, curve.where(slice(0, 4))))


@pytest.mark.parametrize("side", [0, 1])
def test_readings_at_a_limit_stay_there_whatever_power_it_grows_with(side: int) -> None:
    ratio = np.exp(np.linspace(-SPAN, SPAN, 9))
    measured = scaled_limits(ratio)[side]
    found = correct_family(family(measured, ratio), band())
    # The third order of exp(5 x 0.04) leaves 5e-4 between the forces at which limits are known.
    np.testing.assert_allclose(found.curves[0].value, LEVEL[side], rtol=1e-3)
    assert np.abs(measured / LEVEL[side] - 1).max() > 0.02
    # What it is uncertain by is less than what the correction changed.
    assert found.scaled.max() < 0.01
    np.testing.assert_array_equal(found.curves[1].value, found.curves[0].value[:4])


def test_readings_between_limits_keep_their_place_and_those_outside_their_distance() -> None:
    ratio = np.full(9, np.exp(SPAN))
    lower, upper = scaled_limits(ratio)
    middle = correct_family(family((lower + upper) / 2, ratio), band())
    np.testing.assert_allclose(middle.curves[0].value, LEVEL.mean(axis=0), rtol=1e-12)
    for value, expected in ((upper + 0.3, LEVEL[1] + 0.3), (lower - 0.3, LEVEL[0] - 0.3)):
        np.testing.assert_allclose(correct_family(family(value, ratio), band()).curves[0].value, expected, rtol=1e-12)


def test_beyond_known_forces_and_without_states_a_reading_is_as_uncertain_as_it_was_scaled() -> None:
    ratio = np.full(9, np.exp(3 * SPAN))
    beyond = correct_family(family(scaled_limits(ratio)[1], ratio), band())
    assert (beyond.scaled >= 2 * SPAN).all()
    missing = LimitChange(SPAN, np.where(np.arange(9) == 4, np.nan, BY_FORCE.value))
    own = family(LEVEL[1], ratio)
    found = correct_family(own, band(by_force=missing))
    assert found.curves[0].value[4] == own.curves[0].value[4]
    assert found.curves[0].scaled[4] == own.curves[0].scaled[4]
    assert correct_family(own, band(by_force=None)) is own
