"""Contact forces with swapped cables are named where they can be told apart; friction histories are not suspected."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.measurement import CONTACT_FORCE, Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.data_quality.swapped_force import find_forces_swapped_in_a_repeat, find_swapped_forces
from correlation.feature.table import FeatureTable, extract_features
from tests.slow import slow

NAMES = ("left_T", "left_N", "right_T", "right_N")
FREQUENCY = np.linspace(90.0, 110.0, 9)


def exact(sensor: int, harmonic: int, level: float) -> complex:
    """Lines whose fundamentals of T are equal; at the high level slip makes their means opposite."""
    line, component = divmod(sensor, 2)
    side = 1 - 2 * line
    if harmonic == 1:
        return level * (0.4 if component == 0 else 0.2j * side)
    return 24.0 - 4 * line if component == 1 else (5.0 * side if level > 5 else 0.0)


def campaign(n_repeat: int = 3, seed: int = 1) -> Campaign:
    """At the low level the means of T are those of a random friction history each."""
    random = np.random.default_rng(seed)
    rows = []
    for sensor in range(4):
        for harmonic in (0, 1):
            for level in (1.0, 10.0):
                for repeat in range(1, n_repeat + 1):
                    history = 5 * random.uniform(-1, 1) if (sensor % 2, harmonic, level) == (0, 0, 1.0) else 0.0
                    for frequency in FREQUENCY:
                        noise = 0.01 * random.standard_normal()
                        value = exact(sensor, harmonic, level) + history + noise
                        rows.append((0, 1, repeat, 1, level, frequency, sensor, harmonic, value))
    names = ("test", "order", "repeat", "sweep", "level", "frequency", "sensor", "harmonic", "value")
    columns = {name: np.array(column) for name, column in zip(names, zip(*rows, strict=True), strict=True)}
    columns["value"] = columns["value"].astype(complex)
    sensors = tuple(
        MeasuredSensor(
            name=name, quantity=CONTACT_FORCE, line=name.split("_")[0],
            component="tangential" if name.endswith("T") else "normal",
        )
        for name in NAMES
    )  # fmt: skip
    return Campaign(
        title="", folder=Path(), sensors=sensors, tests=(Test(name="stepped"),), held_out=HeldOut(),
        measurement=Measurement(**columns),
    )  # fmt: skip


def swapped(made: Campaign, one: str, other: str, repeat: int | None = None) -> Campaign:
    table = made.measurement
    i, j = NAMES.index(one), NAMES.index(other)
    order = np.arange(len(NAMES))
    order[[i, j]] = j, i
    rows = (table.repeat == repeat) | (repeat is None)
    return replace(made, measurement=replace(table, sensor=np.where(rows, order[table.sensor], table.sensor)))


def predict(table: FeatureTable) -> np.ndarray:
    """A model that is wrong by 20 %."""
    rows = zip(table.sensor.tolist(), table.harmonic.tolist(), table.level.tolist(), strict=True)
    return np.array([1.2 * exact(*row) for row in rows], dtype=complex)


def beside_the_model(made: Campaign) -> list[str]:
    table = extract_features(made)
    return [str(item) for item in find_swapped_forces(made, table, predict(table))]


@pytest.mark.parametrize("pair", [("left_T", "right_T"), ("left_N", "right_N"), ("left_T", "left_N")])
def test_forces_that_are_swapped_in_all_repeats_fit_the_model_only_if_swapped_back(pair: tuple[str, str]) -> None:
    (result,) = beside_the_model(swapped(campaign(), *pair))
    assert all(f'"{name}"' in result for name in pair)


def test_forces_that_are_swapped_at_one_level_are_named_with_it() -> None:
    made = campaign()
    table = made.measurement
    turn = np.array([0, 3, 2, 1])
    at = table.level == 10.0
    mixed = replace(made, measurement=replace(table, sensor=np.where(at, turn[table.sensor], table.sensor)))
    (result,) = beside_the_model(mixed)
    assert "at 10 N" in result
    assert '"left_N" and "right_N"' in result


@pytest.mark.parametrize("pair", [("left_T", "right_T"), ("left_N", "right_N"), ("left_T", "left_N")])
@pytest.mark.parametrize("n_repeat", [3, 5])
def test_forces_that_are_swapped_in_one_repeat_are_found_in_that_one(pair: tuple[str, str], n_repeat: int) -> None:
    (result,) = find_forces_swapped_in_a_repeat(swapped(campaign(n_repeat), *pair, repeat=2))
    assert "repeat 2" in result.where
    assert all(f'"{name}"' in result.sentence for name in pair)


@pytest.mark.parametrize("n_repeat", [1, 2, pytest.param(3, marks=slow), pytest.param(5, marks=slow)])
def test_random_friction_histories_are_no_swapped_cables(n_repeat: int) -> None:
    for seed in range(20):
        made = campaign(n_repeat, seed)
        assert not beside_the_model(made)
        assert not list(find_forces_swapped_in_a_repeat(made))


def test_forces_that_are_equal_in_the_model_cannot_be_told_apart() -> None:
    made = campaign()
    table = made.measurement
    made = replace(made, measurement=table.where((table.harmonic == 1) & (table.sensor % 2 == 0)))
    assert not beside_the_model(swapped(made, "left_T", "right_T"))
    assert not list(find_forces_swapped_in_a_repeat(swapped(made, "left_T", "right_T", repeat=2)))


def test_frequencies_that_differ_by_rounding_are_one() -> None:
    """Counters and files round: 79.35000000000001 Hz in one repeat is 79.35 Hz in the other."""
    made = campaign()
    table = made.measurement
    rounded = np.where(table.repeat == 2, np.nextafter(table.frequency, np.inf), table.frequency)
    again = replace(made, measurement=replace(table, frequency=rounded))
    assert np.array_equal(again.measurement.frequency, table.frequency)
    assert not beside_the_model(again)
