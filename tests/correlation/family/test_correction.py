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


#: Logarithms of the forces at which limits are known.
RATIOS = SPAN * np.array([-1.0, -0.5, 0.5, 1.0])
BY_FORCE = LimitChange(RATIOS, np.array([scaled_limits(np.exp(ratio)) for ratio in RATIOS]))


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
    result = correct_family(family(measured, ratio), band())
    # Between the forces at which limits are known a line would be off by (5 x 0.02)^2 / 8.
    np.testing.assert_allclose(result.curves[0].value, LEVEL[side], rtol=1e-3)
    assert np.abs(measured / LEVEL[side] - 1).max() > 0.02
    # What it is uncertain by is less than what the correction changed.
    none = np.zeros((2, result.n_point))
    assert (result.widen(none, none) < 0.01 * LEVEL.mean()).all()
    np.testing.assert_array_equal(result.curves[1].value, result.curves[0].value[:4])


def test_readings_between_limits_keep_their_place_and_those_outside_their_distance() -> None:
    ratio = np.full(9, np.exp(SPAN))
    lower, upper = scaled_limits(ratio)
    middle = correct_family(family((lower + upper) / 2, ratio), band())
    np.testing.assert_allclose(middle.curves[0].value, LEVEL.mean(axis=0), rtol=1e-12)
    for value, expected in ((upper + 0.3, LEVEL[1] + 0.3), (lower - 0.3, LEVEL[0] - 0.3)):
        np.testing.assert_allclose(correct_family(family(value, ratio), band()).curves[0].value, expected, rtol=1e-12)


def test_beyond_known_forces_and_without_states_limits_are_as_uncertain_as_the_force_differs() -> None:
    ratio = np.full(9, np.exp(3 * SPAN))
    none = np.zeros((2, 13))
    beyond = correct_family(family(scaled_limits(ratio)[1], ratio), band())
    assert (beyond.widen(none, none)[:, :9] >= 2 * SPAN * LEVEL).all()
    missing = LimitChange(RATIOS, np.where(np.arange(9) == 4, np.nan, BY_FORCE.value))
    own = family(LEVEL[1], ratio)
    result = correct_family(own, band(by_force=missing))
    assert result.curves[0].value[4] == own.curves[0].value[4]
    np.testing.assert_allclose(result.widen(none, none)[:, 4], 3 * SPAN * LEVEL[:, 4], rtol=1e-12)
    assert correct_family(own, band(by_force=None)) is own


def changed_by(*change: float) -> LimitChange:
    """All limits change alike."""
    return LimitChange(RATIOS, LEVEL + np.array(change)[:, None, None])


def test_a_small_lower_limit_makes_the_upper_one_no_less_certain() -> None:
    """Of a static force that nearly vanishes at one end of the histories."""
    level = np.array([np.full(9, 1e-3), np.full(9, 100.0)])
    by = LimitChange(RATIOS, level + np.array([-2.0, -1.0, 1.0, 4.0])[:, None, None])
    result = correct_family(family(np.full(9, 100.0), np.full(9, np.exp(0.75 * SPAN))), band(value=level, by_force=by))
    none = np.zeros((2, 13))
    # In the half of a span the line rises by 3. The slopes at both ends are 3/2, the harmonic mean of 1 and 3, and 4,
    # that of the parabola through the last three points: half-way the cubic is an eighth of their difference lower. A
    # quarter of that counts.
    np.testing.assert_allclose(result.widen(none, none), 0.25 * (4.0 - 1.5) / 8, rtol=1e-9)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_limits_that_do_not_follow_on_one_side_are_not_moved_there(side: float) -> None:
    """A contact that opens with less preload: no curve goes beyond what is known at either end of an interval."""
    by = changed_by(*(np.array([0.0, 0.0, 10.0, 20.0])[:: int(side)]))
    for share in (0.25, 0.5, 0.75, 1.0):
        result = correct_family(family(LEVEL[1], np.full(9, np.exp(-side * share * SPAN))), band(by_force=by))
        np.testing.assert_allclose(result.curves[0].value, LEVEL[1], rtol=1e-12)


def test_a_static_force_that_is_steep_at_both_ends_alone_follows_no_parabola() -> None:
    """As integrated in time of system 14804 of the benchmark of coverage, 0.3 N at 87.88 Hz."""
    ratios = np.linspace(-0.0542, 0.0542, 9)
    force = np.array([0.35275, 0.38594, 0.40753, 0.43282, 0.44321, 0.44981, 0.46138, 0.48474, 0.54698])
    level = np.full((2, 9), force[4])
    by = LimitChange(ratios[[0, 2, 6, 8]], np.repeat(force[[0, 2, 6, 8], None, None], 2, axis=1) * np.ones(9))
    result = correct_family(family(force, np.exp(ratios)), band(value=level, by_force=by))
    none = np.zeros((2, 13))
    # The parabola through the ends and the middle is off by 0.03.
    np.testing.assert_allclose(result.curves[0].value, force[4], atol=0.011)
    np.testing.assert_allclose(result.curves[0].value[[3, 5]], force[4], atol=0.007)
    assert (result.widen(none, none) < 0.003).all()


def test_a_state_that_is_missing_leaves_what_is_known_before_it() -> None:
    by = changed_by(np.nan, -0.1, 0.2, np.nan)
    ratio = np.exp(np.full(9, SPAN))
    result = correct_family(family(LEVEL[1] + 0.2, ratio), band(by_force=by))
    np.testing.assert_allclose(result.curves[0].value, LEVEL[1], rtol=1e-12)
    np.testing.assert_allclose(result.widen(np.zeros((2, 13)), np.zeros((2, 13)))[:, :9], SPAN / 2 * LEVEL, rtol=1e-12)


def test_a_state_that_is_missing_leaves_the_slopes_of_what_is_known() -> None:
    """Limits that change in proportion are straight up to the last one that is known."""
    by = LimitChange(RATIOS, LEVEL + np.where(RATIOS[-1] > RATIOS, RATIOS, np.nan)[:, None, None])
    for share in (0.1, 0.25, 0.4):
        ratio = share * SPAN
        result = correct_family(family(LEVEL[1] + ratio, np.full(9, np.exp(ratio))), band(by_force=by), force_noise=0.1)
        np.testing.assert_allclose(result.curves[0].value, LEVEL[1], rtol=1e-12)
        none = np.zeros((2, 13))
        # A rate of one, of which the noise of the force is a tenth.
        np.testing.assert_allclose(result.widen(none, none)[:, :9], 0.1, rtol=1e-9)


def test_a_family_is_corrected_once() -> None:
    ratio = np.full(9, np.exp(SPAN))
    once = correct_family(family(scaled_limits(ratio)[0], ratio), band())
    np.testing.assert_allclose(correct_family(once, band()).value, once.value, rtol=1e-14)


def test_a_set_up_of_unknown_preload_is_taken_to_have_the_model_s() -> None:
    own = family(LEVEL[1], np.ones(9))
    pressed = band(by_force=None, by_preload=(BY_FORCE,))
    np.testing.assert_array_equal(correct_family(own, pressed, {("another", 1): np.array([0.02])}).value, own.value)
