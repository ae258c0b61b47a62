"""Runs whose phases count from something else than the force are told; shifted resonances and lone sensors are not."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, Measurement
from correlation.data_quality.campaign import find_suspicions
from correlation.data_quality.phase_reference import find_turned_runs
from tests.correlation.data_quality.test_campaign_suspicion import campaign


def turned(made: Campaign, angle: Callable[[Measurement], NDArray[np.float64]]) -> Campaign:
    table = made.measurement
    return replace(made, measurement=replace(table, value=table.value * np.exp(1j * table.harmonic * angle(table))))


def test_a_clock_that_runs_freely_is_told_once() -> None:
    random = np.random.default_rng(4).uniform(-np.pi, np.pi, 20)
    free = turned(campaign(), lambda table: random[(2 * table.repeat + table.sweep + 3 * table.level).astype(int) % 20])
    (result,) = find_suspicions(free)
    assert result.where == 'test "stepped"'
    assert result.of_test
    assert "14 of 15 times" in result.sentence
    assert "are not relative to the force" in result.sentence


def test_one_run_that_counts_from_something_else_is_told() -> None:
    odd = turned(campaign(), lambda table: np.where((table.repeat == 2) & (table.sweep == 1), 0.3, 0.0))
    (result,) = find_turned_runs(odd)
    assert "6 of 15 times" in result.sentence
    assert "up to 17 deg" in result.sentence


@pytest.mark.parametrize("angle", [0.0, 0.02, np.pi])
def test_equal_small_and_opposite_phases_are_not_told(angle: float) -> None:
    """What is opposite may be a cable; `find_conjugate_repeats` names it."""
    assert not [*find_turned_runs(turned(campaign(), lambda table: np.where(table.repeat == 2, angle, 0.0)))]


def test_one_sensor_that_is_late_is_no_matter_of_the_force() -> None:
    late = turned(campaign(), lambda table: np.where((table.repeat == 2) & (table.sensor == 0), 0.5, 0.0))
    assert not [*find_turned_runs(late)]


@pytest.mark.parametrize("shift", [0.002, 0.01, 0.03])
def test_a_resonance_that_shifts_between_repeats_is_not_told(shift: float) -> None:
    made = campaign()
    table = made.measurement
    ratio = 1 - (table.frequency / 100.0) ** 2 + 0.04j * table.frequency / 100.0
    other = 1 - (table.frequency / (100.0 * (1 + shift))) ** 2 + 0.04j * table.frequency / 100.0
    values = np.where(table.repeat == 2, table.value * ratio / other, table.value)
    assert not [*find_turned_runs(replace(made, measurement=replace(table, value=values)))]
