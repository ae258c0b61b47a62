"""A force that stays below its set point at the higher levels is suspected; one that drops at a resonance is not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.data_quality.campaign import find_suspicions
from correlation.data_quality.drive import find_drive_suspicions

LEVELS, FREQUENCY = np.array([1.0, 3.0, 10.0]), np.linspace(90.0, 110.0, 11)


def campaign(largest: float = np.inf, drop: float = 0.0, gain: float = 1.0, *, measured: bool = True) -> Campaign:
    """A force with 0.2 % of noise that goes no further than the largest one, and drops at a resonance."""
    level, frequency = (item.ravel() for item in np.meshgrid(LEVELS, FREQUENCY, indexing="ij"))
    noise = 0.002 * np.random.default_rng(1).standard_normal(len(level))
    shape: NDArray[np.float64] = 1 - drop / (1 + ((frequency - 100) / 2) ** 2)
    force = gain * np.minimum(level * shape * (1 + noise), largest)
    whole = np.ones(len(level), dtype=int)
    return Campaign(
        title="", folder=Path(), tests=(Test(name="stepped"),), held_out=HeldOut(),
        sensors=(MeasuredSensor(name="tip", quantity="displacement", direction="z", place="tip"),),
        measurement=Measurement(
            test=0 * whole, order=np.arange(len(level)), repeat=whole, sweep=whole, level=level, frequency=frequency,
            sensor=0 * whole, harmonic=whole, value=level * 1e-6 / (frequency - 100 + 1j),
            force=force if measured else level,
        ),
    )  # fmt: skip


def test_a_drive_that_clips_is_suspected_at_the_levels_that_it_does_not_reach() -> None:
    (result,) = find_drive_suspicions(campaign(largest=8.0))
    assert result.where == 'test "stepped", level 10 N'
    assert "at most 8 N, 80% of its set point" in result.sentence
    assert "11 of 11 readings" in result.sentence
    assert str(result) in map(str, find_suspicions(campaign(largest=8.0)))
    assert [item.where[-4:] for item in find_drive_suspicions(campaign(largest=2.0))] == [" 3 N", "10 N"]


def test_lower_levels_whose_force_is_their_set_point_in_every_digit_hide_no_drive_that_clips() -> None:
    made = campaign(largest=8.0)
    table = made.measurement
    force = np.where(table.level < 10, table.level, table.force)
    (result,) = find_drive_suspicions(replace(made, measurement=replace(table, force=force)))
    assert "level 10 N" in result.where


@pytest.mark.parametrize(
    ("gain", "words"),
    [(1e-3, "the force in kN instead of N or the level in mN instead of N"), (102.0, "the force in gf instead of N"),
     (0.225, "the force in lbf instead of N"), (3.0, "is the sensitivity of the force, or the level, right")],
)  # fmt: skip
def test_a_force_that_is_one_factor_off_all_set_points_names_the_unit(gain: float, words: str) -> None:
    (result,) = find_drive_suspicions(campaign(gain=gain))
    assert result.where == 'test "stepped"'
    assert result.of_test == (gain != 3.0)
    assert f"{gain:.3g} times its set point" in result.sentence
    assert words in result.sentence


def relabelled(level: dict[float, float]) -> Campaign:
    """Forces as they are, with other set points."""
    made = campaign()
    table = made.measurement
    return replace(made, measurement=replace(table, level=np.array([level.get(item, item) for item in table.level])))


def test_levels_with_the_forces_of_each_other_are_exchanged() -> None:
    first, second = find_drive_suspicions(relabelled({3.0: 10.0, 10.0: 3.0}))
    assert [item.where for item in (first, second)] == ['test "stepped", level 3 N', 'test "stepped", level 10 N']
    assert "333% of its set point, and that of the level 10 N: are levels exchanged?" in first.sentence
    assert "30% of its set point, and that of the level 3 N: are levels exchanged?" in second.sentence
    mixed = list(find_drive_suspicions(relabelled({1.0: 3.0, 3.0: 10.0, 10.0: 1.0})))
    assert len(mixed) == 3
    assert all("are levels mixed up?" in item.sentence for item in mixed)


def test_a_force_far_above_its_set_point_makes_one_level_doubtful() -> None:
    (result,) = find_drive_suspicions(relabelled({10.0: 5.0}))
    assert result.where == 'test "stepped", level 5 N'
    assert "200% of its set point: is this level right?" in result.sentence


def test_a_force_that_drops_at_a_resonance_or_is_off_by_one_factor_is_not_suspected() -> None:
    for made in (campaign(), campaign(drop=0.6), campaign(gain=0.7), campaign(measured=False)):
        assert not list(find_drive_suspicions(made))
