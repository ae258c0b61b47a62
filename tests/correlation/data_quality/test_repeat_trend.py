"""Repeats that change with the time are told, with what changes; random differences between repeats are not."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from scipy.stats import binom, pearsonr

from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Suspicion, Test
from correlation.data_quality.campaign import find_suspicions
from correlation.data_quality.repeat_trend import Trend, find_trend
from correlation.data_quality.trend_suspicion import CHANCE, find_trend_suspicions
from correlation.model import Model

FREQUENCY = np.linspace(45.0, 55.0, 21)
LEVELS = (1.0, 2.0, 4.0)
#: Responses of sensors a and b in a run, by its repeat (from 0), its level and its place in the order of all (0 to 1).
Run = Callable[[int, float, float], tuple[np.ndarray, np.ndarray]]


def response(level: float, *, frequency: float = 50.0, damping: float = 0.01) -> np.ndarray:
    return level / (frequency**2 - FREQUENCY**2 + 2j * damping * frequency * FREQUENCY)


def campaign_of(run: Run, runs: list[tuple[int, float]], noise: float = 1e-3, seed: int = 1) -> Campaign:
    """Runs in the order of measurement, each a repeat and a level."""
    random, columns = np.random.default_rng(seed), []
    for place, (repeat, level) in enumerate(runs):
        for number, value in enumerate(run(repeat, level, place / len(runs))):
            read = value * (1 + noise * random.standard_normal((len(value), 2)) @ [1, 1j])
            columns += [(place, repeat + 1, level, f, number, x) for f, x in zip(FREQUENCY, read, strict=True)]
    order, repeats, levels, frequency, sensor, value = (np.array(column) for column in zip(*columns, strict=True))
    one = np.ones(len(value), dtype=int)
    return Campaign(
        title="oscillator", folder=Path("oscillator"), tests=(Test(name="sine"),), held_out=HeldOut(),
        sensors=tuple(MeasuredSensor(name=name, quantity="displacement", direction="z") for name in ("a", "b")),
        measurement=Measurement(
            test=0 * one, order=order, repeat=repeats, sweep=one, level=levels, frequency=frequency, sensor=sensor,
            harmonic=one, value=value,
        ),
    )  # fmt: skip


def by_repeats(n: int) -> list[tuple[int, float]]:
    return [(repeat, level) for repeat in range(n) for level in LEVELS]


def trend_of(campaign: Campaign) -> Trend:
    trend = find_trend(campaign.measurement, [0, 1])
    assert trend is not None
    return trend


def told(campaign: Campaign) -> Suspicion:
    (suspicion,) = find_trend_suspicions(campaign)
    return suspicion


def both(value: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return value, -0.4 * value


def falling(share: float) -> Run:
    """A resonance whose frequency falls by a share in the whole test."""
    return lambda _, level, time: both(response(level, frequency=50 * (1 - share * time)))


def with_damping(numbers: np.ndarray) -> Run:
    """A damping of each repeat of its own, at all levels."""
    return lambda repeat, level, _: both(response(level, damping=0.01 * (1 + numbers[repeat])))


@pytest.mark.parametrize("scores", [[0.0, 1.0, 2.3], [1.0, 0.4, 0.5, -0.2], [0.1, -0.3, 0.5, 0.2, 0.9, 1.0]])
def test_the_chance_of_one_cause_is_that_of_student(scores: list[float]) -> None:
    runs = [(repeat, 1.0) for repeat in range(len(scores))]
    small = 1e-6 * np.array(scores)  # the response is linear in so small changes
    measured = trend_of(campaign_of(with_damping(small), runs, noise=0.0)).chance
    exact = pearsonr(np.arange(len(scores)), scores).pvalue
    # Four standard deviations of a share of the rotations, 2,000 of which tell a chance above 2 %.
    assert measured == pytest.approx(exact, abs=4 * np.sqrt(exact * (1 - exact) / 2_000))


@pytest.mark.parametrize("n_repeat", [3, 5, 7])
def test_random_repeats_have_any_chance(n_repeat: int) -> None:
    """All levels of a repeat share its damping, as they share a preload."""
    random, below, n = np.random.default_rng(n_repeat), 0, 200
    for seed in range(n):
        numbers = 0.1 * random.standard_normal(n_repeat)
        below += trend_of(campaign_of(with_damping(numbers), by_repeats(n_repeat), seed=seed)).chance < 0.1
    # Counts that a share of 0.1 does not leave in 99.9 % of such tests.
    assert binom.ppf(0.0005, n, 0.1) <= below <= binom.ppf(0.9995, n, 0.1)


def test_a_frequency_that_falls_is_told() -> None:
    suspicion = told(campaign_of(falling(0.003), by_repeats(5)))
    assert not suspicion.remark
    assert suspicion.of_time
    assert suspicion.where == 'test "sine"'
    # The last of five repeats is four fifths of the test after the first.
    assert "the frequencies of resonances change by -0.24 %" in suspicion.sentence
    assert "which the case does not explain" in suspicion.headline


@pytest.mark.parametrize("order", ["levels", "random"])
def test_a_fall_is_told_in_any_order_of_measurement(order: str) -> None:
    runs = sorted(by_repeats(6), key=lambda run: run[1])
    if order == "random":
        runs = [runs[place] for place in np.random.default_rng(4).permutation(len(runs))]
    assert trend_of(campaign_of(falling(0.01), runs)).chance < CHANCE


def test_three_repeats_in_order_leave_it_open() -> None:
    """A cause of its own in each repeat goes in one direction in a third of all tests."""
    suspicion = told(campaign_of(with_damping(np.array([0.0, 0.3, 0.42])), by_repeats(3)))
    assert suspicion.remark
    assert "is not clear" in suspicion.headline
    assert "4 more repeats would decide" in suspicion.sentence


@pytest.mark.parametrize(
    ("numbers", "n_repeat"),
    [([0.0, 0.42, 0.3], 3), ([0.0, 0.01, 0.014], 3), ([0.0, 0.3], 2), ([0.0, 0.3, 0.1, 0.2, 0.4, -0.1, 0.15], 7)],
)
def test_repeats_that_differ_at_random_or_little_or_are_two_tell_nothing(numbers: list[float], n_repeat: int) -> None:
    assert [*find_trend_suspicions(campaign_of(with_damping(np.array(numbers)), by_repeats(n_repeat)))] == []


def test_one_sensor_that_changes_is_named() -> None:
    def run(repeat: int, level: float, time: float) -> tuple[np.ndarray, np.ndarray]:
        first, second = both(response(level))
        return first, second * np.exp(0.3j * time)

    assert 'nearly all of it is of sensor "b"' in told(campaign_of(run, by_repeats(5))).sentence


def test_amplitudes_that_grow_are_told() -> None:
    result = told(campaign_of(lambda _, level, time: both((1 + 0.1 * time) * response(level)), by_repeats(5)))
    # Of their mean it is 0.08 / 1.04 = 7.69 %, and noise of 0.1 % moves the last digit at each level.
    assert "amplitudes change by +7." in result.sentence


def test_what_has_no_name_is_told_by_the_reading_that_changes_most() -> None:
    result = told(campaign_of(with_damping(np.linspace(0, 0.4, 6)), by_repeats(6)))
    assert "most of all" in result.sentence
    assert "50 Hz, from" in result.sentence


def test_points_that_a_repeat_lacks_and_orders_that_begin_anew_do_not_hide_it() -> None:
    campaign = campaign_of(falling(0.01), by_repeats(5))
    table = campaign.measurement
    fewer = replace(campaign, measurement=table.where((table.repeat != 2) | (table.frequency > 47)))
    anew = replace(campaign, measurement=replace(table, order=table.order % len(LEVELS)))
    assert all(not told(item).remark for item in (fewer, anew))


def test_a_test_that_settles_has_no_repeats() -> None:
    campaign = campaign_of(falling(0.01), by_repeats(5))
    assert [*find_trend_suspicions(replace(campaign, tests=(Test(name="sine", settling=True),)))] == []


def test_a_campaign_has_it_once_among_its_suspicions() -> None:
    def of_time(run: Run, n_repeat: int) -> list[str]:
        return [item.sentence for item in find_suspicions(campaign_of(run, by_repeats(n_repeat))) if item.of_time]

    (trend,) = of_time(with_damping(np.linspace(0, 0.4, 5)), 5)
    assert "did the structure change during the test" in trend
    # Steps that become smaller are told as settling, and a factor as a gain.
    (settling,) = of_time(with_damping(np.linspace(0, 0.4, 6)), 6)
    assert "do they still settle?" in settling
    assert of_time(lambda _, level, time: both((1 + 0.2 * time) * response(level)), 6) == []


@pytest.mark.parametrize("jitter", [0.0, 3e-4])
def test_repeats_with_noise_and_jitter_have_none(small: Model, paper: ModuleType, jitter: float) -> None:
    assert [*find_trend_suspicions(paper.make_campaign(small, jitter=jitter, seed=5))] == []
