"""Families have every reading of a campaign, whichever repeat, sweep and frequency; their noise is what was put in."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.family.family import measured_families, number_points
from correlation.family.frequencies import choose_frequencies, find_stops
from correlation.family.noise import estimate_repeat_errors

FREQUENCY = np.linspace(95.0, 105.0, 30)
REPEATS, SWEEPS, LEVELS = 5, (1, -1), (1.0, 5.0)
NOISE, SHIFT = 4e-3, 3e-4


def resonance(frequency: np.ndarray, level: float, history: float) -> np.ndarray:
    """A peak that a friction history moves and lowers, the more the higher the level."""
    slip = level * history
    ratio = frequency / (100.0 - 0.2 * slip)
    return level / np.hypot(1 - ratio**2, 2 * (0.01 + 0.002 * slip) * ratio)


def campaign(noise: float = NOISE, shift: float = SHIFT, jitter: float = 0.0, seed: int = 1) -> Campaign:
    random = np.random.default_rng(seed)
    columns: list[np.ndarray] = []
    offset = 1 + shift * random.standard_normal(REPEATS)
    for repeat in range(REPEATS):
        for level in LEVELS:
            history = random.uniform(0, 1) if level > 1 else 0.0
            for sweep in SWEEPS:
                f = FREQUENCY * (1 + jitter * random.uniform(-1, 1, len(FREQUENCY)))
                x = resonance(f / offset[repeat], level, history + 0.05 * sweep)
                x = x * (1 + noise * random.standard_normal(len(f)))
                one = np.ones(len(f))
                columns.append(np.array([(repeat + 1) * one, sweep * one, level * one, f, x]))
    repeat_, sweep_, level_, frequency_, value = np.concatenate(columns, axis=1)
    n = len(value)
    return Campaign(
        title="peaks",
        folder=Path(),
        sensors=(MeasuredSensor(name="tip", quantity="displacement", direction="z", place="tip", has_phase=False),),
        tests=(Test(name="stepped"),),
        measurement=Measurement(
            test=np.zeros(n), order=np.arange(n), repeat=repeat_, sweep=sweep_, level=level_, frequency=frequency_,
            sensor=np.zeros(n), harmonic=np.ones(n), value=value.astype(complex),
        ),
        held_out=HeldOut(),
    )  # fmt: skip


@pytest.mark.parametrize("control", ["force", "response"])
def test_amplitudes_are_scaled_to_the_force_of_the_level(control: str) -> None:
    measured = campaign()
    table = measured.measurement
    off = 1 + 0.05 * np.random.default_rng(3).uniform(-1, 1, len(table))
    moved = replace(table, value=table.value * off, force=table.level * off)
    driven = replace(measured, measurement=moved, tests=(Test(name="stepped", control=control),))
    for own, scaled in zip(measured_families(measured), measured_families(driven), strict=True):
        assert not own.scaled.any()
        if control == "force":
            np.testing.assert_allclose(scaled.value, own.value, rtol=1e-12)
            assert 0.03 < scaled.scaled.max() <= 0.05 / 0.95
        else:  # the force follows from the response there
            assert not scaled.scaled.any()
            assert np.abs(scaled.value / own.value - 1).max() > 0.03


def test_every_reading_is_in_exactly_one_family() -> None:
    measured = campaign()
    families = measured_families(measured)
    assert [(item.sensor, item.harmonic, item.level) for item in families] == [("tip", 1, 1.0), ("tip", 1, 5.0)]
    assert all(len(item.curves) == REPEATS * len(SWEEPS) for item in families)
    values = np.sort(np.concatenate([item.value for item in families]))
    np.testing.assert_array_equal(values, np.sort(np.abs(measured.measurement.value)))
    for item in families:
        assert all((np.diff(curve.frequency) > 0).all() for curve in item.curves)


def test_amplitudes_do_not_depend_on_the_phase_and_means_keep_their_sign() -> None:
    measured = campaign()
    table = measured.measurement
    turned = replace(measured, measurement=replace(table, value=table.value * np.exp(1j * table.frequency)))
    for a, b in zip(measured_families(measured), measured_families(turned), strict=True):
        np.testing.assert_allclose(a.value, b.value, rtol=1e-12)  # round-off of the rotation
    means = replace(measured, measurement=replace(table, value=-table.value, harmonic=0 * table.harmonic))
    assert (measured_families(means)[0].value < 0).all()


def test_repeats_whose_frequencies_jitter_share_their_points() -> None:
    # A jitter of a sixth of the step.
    for family in measured_families(campaign(jitter=5e-4)):
        point = number_points(family.curves)
        assert set(point) == set(range(len(FREQUENCY)))
        assert (np.bincount(point) == REPEATS * len(SWEEPS)).all()
        chosen = choose_frequencies([family], most=100, fewest=1)
        assert len(chosen) == len(FREQUENCY)
        # The mean of ten readings.
        np.testing.assert_allclose(chosen, FREQUENCY, rtol=5e-4)


def test_frequencies_of_another_level_are_points_of_their_own() -> None:
    """The limits were asked for between both, and a sharp resonance of one level was cut off there."""
    low, *_, high = measured_families(campaign())
    third = float(np.diff(FREQUENCY).min()) / 3
    shifted = tuple(replace(curve, frequency=curve.frequency + third) for curve in high.curves)
    chosen = choose_frequencies([low, replace(high, curves=shifted)], most=1000, fewest=1)
    np.testing.assert_allclose(chosen, np.sort([*FREQUENCY, *(FREQUENCY + third)]))


def test_stops_are_those_of_each_curve_the_longest_steps_first() -> None:
    families = measured_families(campaign(jitter=5e-4))
    frequency = choose_frequencies(families, most=100, fewest=2 * len(FREQUENCY))
    every = tuple(np.abs(frequency[:, None] - FREQUENCY).argmin(axis=0).tolist())
    assert find_stops(families, frequency) == (every,)
    coarse = replace(families[0], curves=tuple(
        item.where(slice(None, None, 2)) for item in families[0].curves
    ))  # fmt: skip
    assert find_stops([*families, coarse], frequency) == (every[::2], every)


def test_a_free_test_is_no_family() -> None:
    measured = replace(campaign(), tests=(Test(name="stepped", configuration="free"),))
    assert measured_families(measured) == ()


@pytest.mark.parametrize("jitter", [0.0, 5e-4])
def test_noise_and_frequency_jitter_are_those_of_the_set_ups_and_not_of_the_histories(jitter: float) -> None:
    noise, shift = [], []
    for seed in range(8):
        measured = campaign(jitter=jitter, seed=seed)
        errors = estimate_repeat_errors(measured, measured_families(measured))
        at = errors.noise["tip", 1]
        assert at.source == "curves"
        noise.append(float(at.deviation(np.array([50.0]))[0]) / 50.0)
        shift.append(errors.frequency)
    # The scatter of the families at 5 N is 20 times the noise. Robust estimates from ten curves are some 30 % off.
    assert NOISE / 1.5 < np.median(noise) < 1.5 * NOISE
    # A deviation of five set-ups, taken with a margin of 1.6 in the mean.
    assert SHIFT / 1.5 < np.median(shift) < 3 * SHIFT


def test_stated_noise_is_used_as_it_is_and_a_single_curve_tells_none() -> None:
    measured = campaign()
    sensor = replace(measured.sensors[0], noise=(0.01, 0.5))
    stated = replace(measured, sensors=(sensor,))
    at = estimate_repeat_errors(stated, measured_families(stated)).noise["tip", 1]
    assert (at.relative, at.absolute, at.source) == (0.01, 0.5, "stated")
    table = measured.measurement
    alone = replace(measured, measurement=table.where((table.repeat == 1) & (table.sweep == 1)))
    errors = estimate_repeat_errors(alone, measured_families(alone))
    assert errors.noise["tip", 1].source == "unknown"
    assert errors.frequency == 0.0


def test_thinned_frequencies_stay_where_the_resonance_is_and_few_are_filled_in() -> None:
    families = measured_families(campaign())
    thinned = choose_frequencies(families, most=12, fewest=1)
    assert len(thinned) == 12
    assert set(np.round(thinned, 9)) <= set(np.round(FREQUENCY, 9))
    assert thinned[0] == FREQUENCY[0]
    assert thinned[-1] == FREQUENCY[-1]
    # Half of them in the third of the band with the peaks.
    assert ((thinned > 98.0) & (thinned < 101.4)).sum() >= 5
    filled = choose_frequencies(families, most=100, fewest=50)
    assert len(filled) == 50
    assert set(np.round(FREQUENCY, 9)) <= set(np.round(filled, 9))
