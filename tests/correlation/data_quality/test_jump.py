"""Where half of the repeats jump a state is left out; where one does, that one; noise and jitter alone are no jump."""

from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign, Drive
from correlation.data_quality.jump import find_jump_suspicions
from correlation.feature.branch import FEWEST
from correlation.feature.observation import arrange_campaign, split_held_out
from correlation.model import Model

#: The state that jumps: between its two responses the larger is 1.3 times the other.
FREE, FREQUENCY, LEVEL, RATIO = False, 26.5, 3.0, 1.3


def jumped(campaign: Campaign, repeats: tuple[int, ...] = (1, 3)) -> Campaign:
    table = campaign.measurement
    free = np.array([test.configuration == "free" for test in campaign.tests])[table.test]
    there = (free == FREE) & (table.frequency == FREQUENCY) & (table.level == LEVEL) & np.isin(table.repeat, repeats)
    assert there.any()
    return replace(campaign, measurement=replace(table, value=np.where(there, RATIO * table.value, table.value)))


@pytest.mark.parametrize(("jitter", "seed"), [(0.0, 1), (3e-5, 5), (1e-4, 11), (3e-4, 2)])
def test_noise_and_jitter_are_no_jump(small: Model, paper: ModuleType, jitter: float, seed: int) -> None:
    """F / X scatters ten times as much at the ends of the grid as at the resonance, and X the other way round."""
    campaign = paper.make_campaign(small, jitter=jitter, seed=seed)
    assert not find_jump_suspicions(campaign)


@pytest.mark.parametrize("jitter", [0.0, 1e-4])
def test_a_jump_is_found_at_its_state_alone(small: Model, paper: ModuleType, jitter: float) -> None:
    campaign = jumped(paper.make_campaign(small, jitter=jitter, seed=3))
    (suspicion,) = find_jump_suspicions(campaign)
    assert suspicion.where == "jointed test, 3 N, 26.5 Hz"
    (of_base,) = find_jump_suspicions(replace(campaign, drive=Drive(quantity="base acceleration", unit="m/s^2")))
    assert of_base.where == "jointed test, 3 m/s^2, 26.5 Hz"


def test_neither_fits_nor_tests_see_a_state_that_jumps(small: Model, paper: ModuleType) -> None:
    campaign = jumped(paper.make_campaign(small, seed=3))
    for seen in split_held_out(campaign):
        points = seen.points
        there = (points.free == FREE) & (points.level == LEVEL)
        assert there.any()
        assert FREQUENCY not in points.frequency[there]
        # At another level the same frequency stays.
        assert FREQUENCY in points.frequency[(points.free == FREE) & (points.level != LEVEL)]


def test_a_few_readings_tell_no_jump(small: Model, paper: ModuleType) -> None:
    campaign = jumped(paper.make_campaign(small, seed=3, n_repeat=FEWEST - 1, held=()))
    assert not find_jump_suspicions(campaign)


def test_a_zero_reading_is_no_jump(small: Model, paper: ModuleType) -> None:
    """A channel that reads nothing has no dynamic stiffness; that is another mistake, told elsewhere."""
    campaign = paper.make_campaign(small, seed=3)
    table = campaign.measurement
    silent = replace(campaign, measurement=replace(table, value=np.zeros_like(table.value)))
    assert not find_jump_suspicions(silent)


def test_a_jump_is_told_with_its_place(small: Model, paper: ModuleType) -> None:
    campaign = paper.make_campaign(small, seed=3)
    assert find_jump_suspicions(campaign) == ()
    (told,) = find_jump_suspicions(jumped(campaign))
    assert told.where == "jointed test, 3 N, 26.5 Hz"
    assert "left out" in told.sentence
    assert told.remark  # structures jump: the reading is no mistake


def test_a_repeat_that_jumped_alone_is_recognised(small: Model, paper: ModuleType) -> None:
    campaign = jumped(paper.make_campaign(small, seed=3), repeats=(2,))
    seen = arrange_campaign(campaign)
    there = (seen.points.free == FREE) & (seen.points.frequency == FREQUENCY) & (seen.points.level == LEVEL)
    np.testing.assert_array_equal(np.isnan(seen.repeat), there[:, None] & (np.arange(1, 5) == 2))
    (suspicion,) = find_jump_suspicions(campaign)
    assert suspicion.sentence.startswith("repeat 2 is ")


def test_repeats_that_are_left_out_in_one_sweep_alone_are_told_with_it(small: Model, paper: ModuleType) -> None:
    """Where other repeats jump in each sweep no repeat is free of it, and none is beside others."""
    campaign = paper.make_campaign(small, seed=3, n_repeat=6, held=())
    up, down = (jumped(campaign, repeats).measurement for repeats in ((1, 2), (4, 5)))
    ways = [replace(item, sweep=np.full_like(item.sweep, way)) for way, item in ((1, up), (-1, down))]
    both = replace(up, **{name: np.concatenate([getattr(item, name) for item in ways]) for name in vars(up)})
    (suspicion,) = find_jump_suspicions(replace(campaign, measurement=both))
    assert "repeats 1 and 2 of the sweep up are on" in suspicion.sentence
    assert "repeats 4 and 5 of the sweep down are on" in suspicion.sentence


@pytest.mark.parametrize(("apart", "found"), [(1.1, True), (1.0, False)])
def test_sweeps_that_disagree_in_every_repeat_are_two_rows(
    small: Model, paper: ModuleType, apart: float, found: bool
) -> None:
    """Be the scatter of the repeats as large."""
    campaign = paper.make_campaign(small, seed=3)
    table = campaign.measurement
    there = (table.frequency == FREQUENCY) & (table.level == LEVEL)
    random = np.random.default_rng(4)
    of_repeat = 1 + 0.1 * random.standard_normal(int(table.repeat.max()) + 1)
    off = of_repeat[table.repeat]
    ways = [
        replace(table, sweep=np.full_like(table.sweep, way), value=table.value * off * noise * np.where(there, by, 1.0))
        for way, by in ((1, apart), (-1, 1.0))
        for noise in [1 + 1e-3 * random.standard_normal(len(table.value))]
    ]
    both = replace(ways[0], **{name: np.concatenate([getattr(item, name) for item in ways]) for name in vars(table)})
    seen = arrange_campaign(replace(campaign, measurement=both))
    points = seen.points
    expected = found & (points.free == FREE) & (points.frequency == FREQUENCY) & (points.level == LEVEL)
    np.testing.assert_array_equal(points.sweep != 0, expected)
    once = arrange_campaign(campaign)
    assert len(points) == len(once.points) + expected.sum() // 2
    for way, factor in ((1, apart), (-1, 1.0)) if found else ():
        own = seen.where(expected & (points.sweep == way) & (points.sensor == "tip") & (points.harmonic == 1))
        at = once.where(
            (once.points.frequency == FREQUENCY) & (once.points.level == LEVEL) & ~once.points.free
            & (once.points.sensor == "tip") & (once.points.harmonic == 1)
        )  # fmt: skip
        # The noise of 1e-3.
        np.testing.assert_allclose(own.repeat, factor * at.repeat * of_repeat[1:], rtol=5e-3)
