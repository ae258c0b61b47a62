"""Measurements arranged by point and repeat: every reading is found in its place, and held-out ones stay apart."""

from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign, HeldOut
from correlation.campaign.run_table import join_rows
from correlation.errors import CampaignError
from correlation.feature.observation import Observation, arrange_campaign, split_held_out, take_training_part
from correlation.model import Model
from correlation.prediction import Points


@pytest.fixture(scope="module")
def campaign(small: Model, paper: ModuleType) -> Campaign:
    return paper.make_campaign(small)


def test_every_reading_is_in_the_row_of_its_point_and_the_column_of_its_repeat(campaign: Campaign) -> None:
    seen, table = arrange_campaign(campaign), campaign.measurement
    assert seen.repeat.shape == (len(table) // 4, 4)
    points = seen.points
    keys = zip(points.free, points.level, points.frequency, points.sensor, points.harmonic, strict=True)
    row = {key: number for number, key in enumerate(keys)}
    for item in range(len(table)):
        sensor = campaign.sensors[table.sensor[item]].name
        free = campaign.tests[table.test[item]].configuration == "free"
        key = (free, table.level[item], table.frequency[item], sensor, table.harmonic[item])
        assert seen.repeat[row[key], table.repeat[item] - 1] == table.value[item]
    np.testing.assert_array_equal(seen.motion, np.isin(points.sensor, ["tip", "root"]))


def test_both_sweeps_are_averaged_where_they_agree(campaign: Campaign) -> None:
    table = campaign.measurement
    both = {
        name: np.concatenate([getattr(table, name)] * 2)
        for name in ("test", "order", "repeat", "level", "force", "frequency", "sensor", "harmonic")
    }
    sweep = np.repeat([1, -1], len(table))
    value = np.concatenate([table.value, 1.04 * table.value])
    seen = arrange_campaign(replace(campaign, measurement=replace(table, **both, sweep=sweep, value=value)))
    # A mean of two numbers.
    np.testing.assert_allclose(seen.repeat, 1.02 * arrange_campaign(campaign).repeat, rtol=1e-15)
    assert not seen.points.sweep.any()


def test_a_state_that_was_read_in_one_sweep_alone_is_of_that_sweep(campaign: Campaign) -> None:
    table = campaign.measurement
    jointed = np.array([test.configuration != "free" for test in campaign.tests])[table.test]
    for factor in (1.0, 2.0):
        other = replace(
            table, frequency=table.frequency * 1.001, sweep=np.full(len(table), -1), value=factor * table.value
        )
        both = join_rows([replace(table, sweep=np.ones(len(table))), other.where(jointed)])
        points = arrange_campaign(replace(campaign, measurement=both)).points
        # Where the sweeps do not differ the mean of both is as good; and the free structure has one state.
        way = np.where(np.isin(points.frequency, table.frequency), 1, -1)
        np.testing.assert_array_equal(points.sweep, np.where(points.free | (factor == 1.0), 0, way))
    # Where all were swept one way, nothing else could have been.
    alone = arrange_campaign(replace(campaign, measurement=replace(table, sweep=np.ones(len(table)))))
    assert not alone.points.sweep.any()


@pytest.mark.parametrize("offset", [0.0, 0.3e-5, 0.5e-5, 0.77e-5])
def test_frequencies_that_differ_by_round_off_are_one(campaign: Campaign, offset: float) -> None:
    table = campaign.measurement
    frequency = table.frequency * (1 + offset) * (1 + 4e-6 * (table.repeat % 2))
    seen = arrange_campaign(replace(campaign, measurement=replace(table, frequency=frequency)))
    assert seen.repeat.shape == (len(table) // 4, 4)
    assert np.isfinite(seen.repeat).all()


def test_frequencies_that_differ_by_more_are_two(campaign: Campaign) -> None:
    table = campaign.measurement
    frequency = table.frequency * (1 + 3e-5 * (table.repeat == 2))
    seen = arrange_campaign(replace(campaign, measurement=replace(table, frequency=frequency)))
    assert len(seen.points) == len(table) // 2
    np.testing.assert_array_equal(np.isfinite(seen.repeat).sum(axis=1) % 2, 1)


def test_the_mean_is_over_the_repeats_taken(campaign: Campaign) -> None:
    seen = take_training_part(campaign)
    np.testing.assert_array_equal(seen.count, 3)
    # Sums in another order.
    np.testing.assert_allclose(seen.value, seen.repeat[:, :3].mean(axis=1), rtol=1e-14)
    fitted, tested = split_held_out(campaign)
    np.testing.assert_array_equal(fitted.value, seen.value)
    np.testing.assert_array_equal(tested.value, seen.repeat[:, 3])


def test_a_missing_reading_is_no_number_and_is_not_counted(campaign: Campaign) -> None:
    table = campaign.measurement
    first = arrange_campaign(campaign).points
    gone = (table.repeat == 1) & (table.frequency == first.frequency[0]) & (table.level == first.level[0])
    seen = take_training_part(replace(campaign, measurement=table.where(~gone)))
    lacking = (seen.points.frequency == first.frequency[0]) & (seen.points.level == first.level[0])
    assert lacking.any()
    assert np.isnan(seen.repeat[lacking, 0]).all()
    np.testing.assert_array_equal(seen.count, np.where(lacking, 2, 3))
    np.testing.assert_allclose(seen.value[lacking], seen.repeat[lacking, 1:3].mean(axis=1), rtol=1e-14)


def test_held_out_repeats_test_at_all_levels_what_was_fitted_to_the_rest(campaign: Campaign, paper: ModuleType) -> None:
    both = replace(campaign, held_out=HeldOut(levels=(paper.LEVELS[1],), repeats=(2,)))
    fitted, tested = split_held_out(both)
    assert set(fitted.points.level) == {paper.LEVELS[0]}
    np.testing.assert_array_equal(fitted.taken, np.tile([True, False, True, True], (len(fitted.points), 1)))
    # One set of repeats, at the held-out level as well: other repeats there test nothing.
    assert set(tested.points.level) == set(paper.LEVELS)
    np.testing.assert_array_equal(tested.taken, np.tile([False, True, False, False], (len(tested.points), 1)))
    # All repeats still tell about the noise.
    assert np.isfinite(tested.repeat).all()


def test_held_out_repeats_alone_leave_all_levels_to_the_fit(campaign: Campaign, paper: ModuleType) -> None:
    fitted, tested = split_held_out(campaign)
    assert set(fitted.points.level) == set(tested.points.level) == set(paper.LEVELS)
    assert fitted.count.sum() + tested.count.sum() == len(campaign.measurement)


def test_held_out_levels_alone_test_with_all_their_repeats(campaign: Campaign, paper: ModuleType) -> None:
    levels = replace(campaign, held_out=HeldOut(levels=(paper.LEVELS[1],)))
    fitted, tested = split_held_out(levels)
    assert set(fitted.points.level) == {paper.LEVELS[0]}
    assert set(tested.points.level) == {paper.LEVELS[1]}
    assert fitted.taken.all()
    assert tested.taken.all()
    assert fitted.count.sum() + tested.count.sum() == len(campaign.measurement)


def test_nothing_held_out_is_refused(campaign: Campaign) -> None:
    with pytest.raises(CampaignError, match=r"nothing is held out.*\[held_out\]"):
        split_held_out(replace(campaign, held_out=HeldOut()))


def swept(value: dict[str, np.ndarray], noise: float, n_repeat: int) -> Observation:
    """Repeats of the fundamentals of some sensors over some frequencies, with noise."""
    k, random = len(next(iter(value.values()))), np.random.default_rng(3)
    mean = np.concatenate(list(value.values()))
    parts = random.standard_normal((2, len(mean), n_repeat)) * noise
    repeat = mean[:, None] + parts[0] + 1j * parts[1]
    points = Points(
        free=np.ones(len(mean), dtype=bool), level=np.ones(len(mean)),
        frequency=np.tile(np.arange(1.0, k + 1), len(value)),
        sensor=np.repeat(list(value), k), harmonic=np.ones(len(mean), dtype=np.int64),
    )  # fmt: skip
    taken = np.isfinite(repeat)
    return Observation(points=points, repeat=repeat, motion=np.ones(len(mean), dtype=bool), taken=taken)


@pytest.mark.parametrize("n_repeat", [2, 3, 5])
def test_a_sensor_on_what_does_not_move_reads_noise(n_repeat: int) -> None:
    moving = np.array([3.0, 10.0, 4.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    seen = swept({"tip": moving, "hung": 0 * moving}, 0.1, n_repeat)
    # Its antiresonance, where noise drowns the tip as well, is a point of a sensor that reads more than noise.
    np.testing.assert_array_equal(seen.above_noise, seen.points.sensor == "tip")


@pytest.mark.parametrize("n_reading", [1, 2, 4])
@pytest.mark.parametrize("n_repeat", [2, 3, 5])
def test_amplitudes_of_noise_are_told_from_those_of_a_motion(n_repeat: int, n_reading: int) -> None:
    complexes = swept({"tip": np.full(40, 10.0), "hung": np.zeros(40)}, 0.1, n_repeat * n_reading)
    mean = np.abs(complexes.repeat).reshape(80, n_repeat, n_reading).mean(axis=2)
    seen = replace(
        complexes, repeat=mean.astype(complex), phased=np.zeros(80, dtype=bool), taken=np.isfinite(mean),
        n_reading=np.full(80, n_reading),
    )  # fmt: skip
    np.testing.assert_array_equal(seen.amplitude_of_noise, seen.points.sensor == "hung")
    assert not complexes.amplitude_of_noise.any()


def test_readings_of_a_single_repeat_count_as_noise_is_not_known() -> None:
    assert swept({"tip": np.zeros(4)}, 0.1, 1).above_noise.all()
