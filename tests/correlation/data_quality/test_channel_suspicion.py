"""Mistakes of channels are found where they are planted in random campaigns, and not elsewhere."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.data_quality import draw_campaign, insert_mistake, is_found, score
from correlation.campaign.measurement import Campaign, Measurement, Test
from correlation.data_quality.channel import find_channel_suspicions
from correlation.feature.observation import arrange_campaign
from correlation.feature.settling import find_drifts, is_ordered
from tests.slow import slow

#: Share of the planted mistakes that must be found: of two hundred campaigns all were, but of fixed phases and settling
#: two of three; a fixed phase needs a peak inside the band, and settling more than the scatter of the repeats.
LEAST = {
    "zero phase": 1.0, "fixed phase": 0.4, "turned runs": 0.95, "swapped in a repeat": 0.95, "swapped at a level": 0.95,
    "unnamed sweeps": 0.9, "settling": 0.4,
}  # fmt: skip


def test_planted_mistakes_are_found_and_clean_campaigns_raise_none() -> None:
    alarms, finds = score(25, lambda _: None)
    # 0 of 200 in the benchmark.
    assert alarms <= 1
    for trait, (result, of) in finds.items():
        assert result >= LEAST[trait] * of > 0


@pytest.mark.parametrize("n_repeat", [4, 6, *(pytest.param(n_repeat, marks=slow) for n_repeat in (5, 7, 8))])
def test_repeats_without_an_order_seldom_look_ordered(n_repeat: int) -> None:
    draws = np.random.default_rng(1).standard_normal((4000, n_repeat))
    # Frequency and amplitude together stay below 2 %, at the upper end of what 4,000 draws tell.
    assert np.mean([is_ordered(draw) for draw in draws]) < 0.008


def settling_campaign() -> Campaign:
    seed = next(item for item in range(100) if draw_campaign(item).measurement.repeat.max() == 6)
    campaign = insert_mistake(draw_campaign(seed), "settling")
    assert campaign is not None
    return campaign


def test_early_repeats_of_a_settling_test_are_left_out() -> None:
    campaign = settling_campaign()
    assert is_found(campaign, "settling")
    (drift,) = find_drifts(campaign)
    assert drift.settles == ("amplitude",)
    # 5 % exp(-1.5 r): the third repeat is within a quarter of the whole change of the last.
    assert not drift.settled[0]
    assert drift.settled[2:].all()
    known = replace(campaign, tests=tuple(replace(test, settling=True) for test in campaign.tests))
    seen = arrange_campaign(known)
    assert np.isnan(seen.repeat[:, 0]).all()
    assert np.isfinite(seen.repeat[:, 2:]).any(axis=0).all()
    assert not any("still settle" in item.sentence for item in find_channel_suspicions(known))
    assert np.isfinite(arrange_campaign(campaign).repeat[:, 0]).any()


@pytest.mark.parametrize("turn", [0.0, 6.0])
def test_a_phase_in_radians_that_is_called_degrees_is_that_in_all_tests(turn: float) -> None:
    """The phase of the force, which is in degrees, adds to that of a test: `turn` is its change over the band [deg]."""
    frequency = np.linspace(90.0, 110.0, 41)
    h = 1 / (100.0**2 - frequency**2 + 4j * frequency)
    phase = np.stack([np.angle(h), np.angle(h) + np.linspace(0, turn, 41)])
    value = np.abs(h) * np.exp(1j * np.radians(phase))
    campaign = draw_campaign(0)
    k, one = 82, np.ones(82, dtype=np.int64)
    table = Measurement(
        test=np.repeat([0, 1], 41), order=np.arange(k), repeat=one, sweep=one, level=one.astype(float),
        frequency=np.tile(frequency, 2), sensor=0 * one, harmonic=one, value=value.ravel(), force=one.astype(float),
    )  # fmt: skip
    tests = (Test(name="free", configuration="free"), Test(name="jointed"))
    (result,) = find_channel_suspicions(replace(campaign, tests=tests, measurement=table))
    assert result.where == 'tests "free", "jointed", sensor "a"'
    assert "write rad" in result.sentence
    assert "phase = false" not in result.sentence
