"""A channel in another unit than its column says is named; a model that is wrong is not taken for one."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, Drive, HeldOut, MeasuredSensor, Measurement, Suspicion, Test
from correlation.data_quality.wrong_unit import find_wrong_units
from correlation.prediction import Points

LEVELS, FREQUENCY = (1.0, 3.0, 10.0), np.linspace(92.0, 108.0, 17)
#: The last is a contact force.
SHAPE = {"tip": 1e-6, "slot": 5.5e-7, "mid": -1.6e-7, "left_T": 0.8}
TESTS = ("stepped", "again")


def response(frequency: NDArray[np.float64], f0: float = 100.0, zeta: float = 0.02) -> NDArray[np.complex128]:
    return np.asarray(1 / (1 - (frequency / f0) ** 2 + 2j * zeta * frequency / f0))


def campaign() -> Campaign:
    """Four sensors of one mode in two tests, three repeats, up and down, 1 % of noise."""
    axes = (range(len(TESTS)), (1, 2, 3), (1, -1), LEVELS, FREQUENCY, range(len(SHAPE)))
    test, repeat, sweep, level, frequency, sensor = (item.ravel() for item in np.meshgrid(*axes, indexing="ij"))
    gain, random = np.array(list(SHAPE.values()))[sensor.astype(int)], np.random.default_rng(1)
    noise = 0.01 * (random.standard_normal(len(level)) + 1j * random.standard_normal(len(level)))
    sensors = [
        MeasuredSensor(name=name, quantity="contact force", line="left", component="tangential")
        if name.endswith("_T")
        else MeasuredSensor(name=name, quantity="displacement", direction="z", place=name)
        for name in SHAPE
    ]
    table = Measurement(
        test=test, order=np.arange(len(level)), repeat=repeat, sweep=sweep, level=level, frequency=frequency,
        sensor=sensor, harmonic=np.ones(len(level), dtype=int), value=level * gain * response(frequency) * (1 + noise),
    )  # fmt: skip
    return Campaign(
        title="", folder=Path(), sensors=tuple(sensors), tests=tuple(Test(name=name) for name in TESTS),
        measurement=table, held_out=HeldOut(),
    )  # fmt: skip


def suspected(made: Campaign, f0: float = 100.0, zeta: float = 0.02, gain: float = 1.0) -> tuple[Suspicion, ...]:
    """Beside a model of one mode, whose resonance, damping and size may be wrong."""
    level, frequency, sensor = (
        item.ravel() for item in np.meshgrid(LEVELS, FREQUENCY, np.arange(len(SHAPE)), indexing="ij")
    )
    points = Points(
        free=np.zeros(len(level), dtype=bool), level=level, frequency=frequency,
        sensor=np.array(list(SHAPE))[sensor], harmonic=np.ones(len(level), dtype=int),
    )  # fmt: skip
    shape = np.array(list(SHAPE.values()))[sensor]
    return find_wrong_units(made, points, gain * level * shape * response(frequency, f0, zeta))


def spoilt(made: Campaign, factor: float, **where: float) -> Campaign:
    """With the values of some runs in another unit."""
    table = made.measurement
    rows = np.ones(len(table), dtype=bool)
    for name, value in where.items():
        rows &= getattr(table, name) == value
    return replace(made, measurement=replace(table, value=np.where(rows, factor, 1.0) * table.value))


@pytest.mark.parametrize(("f0", "zeta", "gain"), [(100, 0.02, 1), (97, 0.02, 1), (103, 0.003, 1), (100, 0.2, 5)])
def test_a_model_that_is_wrong_raises_no_suspicion(f0: float, zeta: float, gain: float) -> None:
    assert suspected(campaign(), f0, zeta, gain) == ()


@pytest.mark.parametrize("f0", [100.0, 97.0, 103.0])
def test_millimetres_in_one_test_are_named_with_their_evidence(f0: float) -> None:
    (result,) = suspected(spoilt(campaign(), 1e3, test=1, sensor=2), f0)
    assert result.where == 'test "again", sensor "mid"'
    assert "it reads " in result.sentence
    assert "and itself " in result.sentence
    assert 'times in test "stepped": are its values in mm instead of m?' in result.sentence
    if f0 == 100.0:
        # The median of noise of 1 %: three digits.
        assert re.match(r"it reads (1,00\d|99\d) times what the model says, the other sensors .* 1 ti", result.sentence)


def test_under_a_drive_of_unknown_scale_a_channel_is_wrong_beside_the_others_alone() -> None:
    volts = replace(campaign(), drive=Drive(unit="V", calibrated=False))
    assert suspected(spoilt(volts, 0.012)) == ()
    (result,) = suspected(spoilt(spoilt(volts, 0.012), 1e3, test=1, sensor=2))
    assert result.where == 'test "again", sensor "mid"'


@pytest.mark.parametrize("stated", [True, False])
def test_readings_of_noise_raise_no_suspicion(stated: bool) -> None:
    """Four runs in which noise is some hundred times the motion: its size has a ratio to any flat response."""
    for seed in range(20):
        made, random = campaign(), np.random.default_rng(seed)
        table = made.measurement
        real, imaginary = 2e-4 * random.standard_normal((2, len(table)))
        noisy = replace(table, value=table.value + real + 1j * imaginary)
        moving = [replace(item, noise=(0.01, 2e-4) if stated else (0.0, 0.0)) for item in made.sensors]
        assert suspected(replace(made, measurement=noisy, sensors=tuple(moving)), 60.0, 0.3) == ()


@pytest.mark.parametrize(
    ("factor", "sensor", "unit"),
    [(1e-3, 3, "kN instead of N"), (102.0, 3, "gf instead of N"), (1e6, 0, "um instead of m")],
)
def test_a_channel_that_is_wrong_in_all_tests_is_named(factor: float, sensor: int, unit: str) -> None:
    result = suspected(spoilt(campaign(), factor, sensor=sensor))
    assert [item.where for item in result] == [f'test "{test}", sensor "{[*SHAPE][sensor]}"' for test in TESTS]
    assert all(f"are its values in {unit}?" in item.sentence for item in result)


def test_a_factor_of_ten_is_suspected_where_the_channel_is_right_elsewhere() -> None:
    (result,) = suspected(spoilt(campaign(), 10.0, test=0, sensor=0))
    assert result.where == 'test "stepped", sensor "tip"'
    # A model may be wrong by as much.
    assert suspected(spoilt(campaign(), 10.0, sensor=0)) == ()
    assert suspected(spoilt(campaign(), 10.0)) == ()


@pytest.mark.parametrize(
    ("where", "words"),
    [({"level": 10.0}, "at the level 10 N it reads 1,0"), ({"repeat": 2}, "at the repeat 2 it reads 1,0")],
)
def test_one_file_of_a_test_is_named_by_its_level_or_repeat(where: dict[str, float], words: str) -> None:
    (result,) = suspected(spoilt(campaign(), 1.01e3, test=0, sensor=1, **where))
    assert result.where == 'test "stepped", sensor "slot"'
    assert result.sentence.startswith(words)


@pytest.mark.parametrize(("unit", "words"), [("m/s^2", "in mm/s^2 instead of m/s^2"), ("V", "in another unit")])
def test_a_level_that_is_wrong_is_named_in_the_unit_of_the_drive(unit: str, words: str) -> None:
    (result,) = suspected(replace(spoilt(campaign(), 1e-3, test=1), drive=Drive(unit=unit)))
    assert words in result.sentence


def test_all_sensors_of_a_test_that_are_wrong_together_speak_of_its_level() -> None:
    (result,) = suspected(spoilt(campaign(), 1e-3, test=1))
    assert result.where == 'test "again"'
    assert (
        "all its sensors read about 0.001 times what the model says: is its level in mN instead of N" in result.sentence
    )


@pytest.mark.parametrize("factor", [0.3, 1.5])
def test_one_level_that_is_wrong_is_named(factor: float) -> None:
    made = campaign()
    motions = made.measurement.sensor < 3
    table = replace(
        made.measurement,
        value=np.where((made.measurement.level == LEVELS[-1]) & motions, factor, 1.0) * made.measurement.value,
    )
    result = suspected(replace(made, measurement=table))
    assert result
    assert all(f"level {LEVELS[-1]:g} N" in item.where and "is this level right" in item.sentence for item in result)


def test_a_peak_that_moves_between_the_points_at_one_level_is_no_wrong_level() -> None:
    made = campaign()
    table = made.measurement
    # At the lowest level the resonance is 1 % lower and as sharp as the spacing of the points: most read more.
    sharp = response(table.frequency, 99.0, 0.005) / response(table.frequency, 100.0, 0.005)
    value = np.where(table.level == LEVELS[0], sharp, 1.0) * table.value
    band = np.abs(table.frequency - 98) < 2.5
    assert np.median(np.abs(sharp[band])) > 1.25
    low = replace(made, measurement=replace(table, value=value).where(band))
    assert suspected(low) == ()


@pytest.mark.parametrize("sign", [1, -1])
def test_one_level_that_is_wrong_is_named_where_a_sensor_reads_the_other_way_round(sign: int) -> None:
    made = campaign()
    table = made.measurement
    value = np.where((table.level == LEVELS[-1]) & (table.sensor < 3), 1.5, 1.0) * table.value
    value = np.where(table.sensor == 1, sign, 1) * value
    result = suspected(replace(made, measurement=replace(table, value=value)))
    assert result
    assert all("is this level right" in item.sentence for item in result)


def test_a_channel_of_noise_or_of_nothing_in_the_model_is_passed_over() -> None:
    made = campaign()
    table, random = made.measurement, np.random.default_rng(2)
    noise = 1e-4 * (random.standard_normal(len(table)) + 1j * random.standard_normal(len(table)))
    assert (
        suspected(replace(made, measurement=replace(table, value=np.where(table.sensor == 1, noise, table.value))))
        == ()
    )
