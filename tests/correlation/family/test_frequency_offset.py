"""Frequency offsets: what a set-up is off by is found and explains its readings, at one flank and not at both."""

import numpy as np
import pytest

from correlation.family.band import PredictedBand
from correlation.family.family import Family, FamilyCurve
from correlation.family.frequency_offset import estimate_frequency_offsets, split_frequency_part
from correlation.family.noise import ReadingNoise
from correlation.family.verdict import FamilyVerdict, judge_family

DAMPING, SET_UP, MODEL = 0.002, 1e-4, 2e-4
NOISE = ReadingNoise(relative=0.005, source="stated")
FREQUENCY = 250.0 * (1 + np.linspace(-0.01, 0.01, 81))


def resonance(frequency: np.ndarray, damping: float = DAMPING) -> np.ndarray:
    return 1 / np.hypot(frequency / 250.0 - 1, damping)


BAND = PredictedBand(
    frequency=FREQUENCY, value=resonance(FREQUENCY) * np.array([[0.98], [1.0]]), deviation=np.zeros((2, 81)),
    jump=np.zeros((2, 81), dtype=bool),
)  # fmt: skip
POINTS = FREQUENCY[4:-4:3]


def family(*values: np.ndarray, level: float = 1.0) -> Family:
    curves = [
        FamilyCurve(test="t", repeat=number, sweep=1, frequency=POINTS, value=value)
        for number, value in enumerate(values, start=1)
    ]
    return Family(sensor="tip", harmonic=1, level=level, curves=tuple(curves))


def judged(*families: Family) -> list[FamilyVerdict]:
    bands, noise = [BAND] * len(families), [NOISE] * len(families)
    offsets = estimate_frequency_offsets(families, bands, noise, set_up=SET_UP, model=MODEL)
    count = sum(item.n_point for item in families)
    return [judge_family(item, BAND, NOISE, shift=0.0, n_reading=count, offsets=offsets) for item in families]


def test_each_set_up_finds_the_offset_that_it_has() -> None:
    true = {1: 3e-4, 2: 1e-4}
    own = family(*(0.99 * resonance(POINTS * (1 + offset)) for offset in true.values()))
    result = estimate_frequency_offsets([own], [BAND], [NOISE], set_up=SET_UP, model=MODEL)
    # A band 2 % wide at flanks of 250 per unit is as wide as 8e-5; the grid has steps of a quarter deviation, 5e-5.
    assert {repeat: result["t", repeat] for repeat in true} == pytest.approx(true, abs=1.3e-4)


def test_curves_of_a_shifted_model_are_covered_and_those_of_a_narrower_one_are_not() -> None:
    shifted = [family(0.99 * resonance(POINTS * (1 + 3e-4)), level=level) for level in (1.0, 3.0)]
    assert all(item.coverage == 1.0 for item in judged(*shifted))
    # Twice as wide a resonance leaves at both flanks by more than any common frequency explains.
    wide = family(0.5 * resonance(POINTS, 2 * DAMPING) * np.array(2.0))
    (result,) = judged(wide)
    assert result.leaves_band
    # A tolerance of each reading by itself holds most of it.
    alone = judge_family(wide, BAND, NOISE, shift=float(np.hypot(SET_UP, MODEL)), n_reading=wide.n_point)
    assert result.coverage < alone.coverage


def test_offsets_are_no_further_than_three_deviations() -> None:
    far = family(0.99 * resonance(POINTS * (1 + 0.004)))
    found = estimate_frequency_offsets([far], [BAND], [NOISE], set_up=SET_UP, model=MODEL)
    assert 0 <= found["t", 1] <= (3 + 1e-9) * (SET_UP + MODEL)
    (result,) = judged(far)
    assert result.leaves_band


@pytest.mark.parametrize("seed", range(5))
def test_set_ups_within_their_scatter_are_no_failure(seed: int) -> None:
    random = np.random.default_rng(seed)
    model = MODEL * random.standard_normal()
    offsets = model + SET_UP * random.standard_normal(4)
    values = [
        resonance(POINTS * (1 + offset)) * random.uniform(0.98, 1.0) * (1 + 0.005 * random.standard_normal(len(POINTS)))
        for offset in offsets
    ]
    (result,) = judged(family(*values))
    # One of 370 readings of noise is beyond three deviations, and there are 100.
    assert result.coverage > 0.97
    assert not result.leaves_band


def test_a_change_that_is_a_shift_is_told_from_one_that_is_not() -> None:
    fine = 250.0 * (1 + np.linspace(-0.01, 0.01, 401))
    limits = resonance(fine) * np.array([[0.9], [1.0]])
    shifted = 1e4 * (resonance(fine * (1 + 1e-4)) * np.array([[0.9], [1.0]]) - limits)
    slope = fine * np.gradient(limits, fine, axis=1)
    shift, rest = split_frequency_part(np.array([shifted, 0.02 * limits]), limits, slope)
    # First order: the second derivative adds 1e-4 / 0.002 of the shift where the curve bends most.
    assert shift[0] == pytest.approx(1.0, rel=0.02)
    assert np.abs(rest[0] / limits).max() < 0.05 * np.abs(shifted / limits).max()
    # A change in proportion to a symmetric resonance moves it nowhere.
    assert shift[1] == pytest.approx(0.0, abs=1e-4)
    np.testing.assert_allclose(rest[1], 0.02 * limits, rtol=0.05)


def test_limits_at_one_frequency_have_no_shift() -> None:
    shift, rest = split_frequency_part(np.ones((3, 2, 1)), np.ones((2, 1)), np.ones((2, 1)))
    assert not shift.any()
    np.testing.assert_array_equal(rest, np.ones((3, 2, 1)))


def test_readings_on_another_branch_do_not_move_the_others_off_their_limits() -> None:
    """Four of a flank at twice the amplitude: the offset that would bring them nearer loses all others."""
    value = 0.99 * resonance(POINTS)
    value[3:7] *= 2
    own = family(value)
    found = estimate_frequency_offsets([own], [BAND], [NOISE], set_up=SET_UP, model=MODEL)
    assert found["t", 1] == 0.0
    (result,) = judged(own)
    assert result.outside.sum() == 4


@pytest.mark.parametrize(("scaled", "leaves"), [(0.0, True), (0.05, False)])
def test_a_reading_is_uncertain_by_as_much_as_it_was_scaled(scaled: float, leaves: bool) -> None:
    value = 0.99 * resonance(POINTS)
    value[5] *= 1.1
    curve = FamilyCurve(test="t", repeat=1, sweep=1, frequency=POINTS, value=value, scaled=np.full(len(value), scaled))
    (result,) = judged(Family(sensor="tip", harmonic=1, level=1.0, curves=(curve,)))
    assert result.leaves_band == leaves
