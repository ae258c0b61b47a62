"""A channel that reads one number at all frequencies of a run is named with its runs; a held amplitude is not."""

from dataclasses import replace

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign
from correlation.data_quality.campaign import find_suspicions
from correlation.data_quality.dead_channel import find_dead_channels, find_dead_rows
from tests.correlation.data_quality.test_campaign_suspicion import campaign


def dead(value: complex | np.ndarray, **where: float) -> Campaign:
    """With a value in all fundamentals of some runs of the sensor "slot"."""
    made = campaign()
    table = made.measurement
    rows = (table.sensor == 1) & (table.harmonic == 1)
    for name, wanted in where.items():
        rows &= getattr(table, name) == wanted
    return replace(made, measurement=replace(table, value=np.where(rows, value, table.value)))


@pytest.mark.parametrize(
    ("value", "where", "words"),
    [
        (0.0, {"repeat": 2}, "zero at all 102 points of repeat 2"),
        (3e-6, {"level": 3.0}, "3e-06 m at all 102 points of level 3 N"),
        (3e-6 * np.exp(1j * np.arange(1836)), {}, "3e-06 m at all 306 points"),
    ],
)
def test_a_dead_channel_is_named_with_its_runs(value: complex, where: dict[str, float], words: str) -> None:
    made = dead(value, **where)
    (result,) = find_dead_channels(made, find_dead_rows(made))
    assert result.where == 'test "stepped", sensor "slot"'
    assert words in result.sentence
    # What is dead is no copy of another repeat.
    assert not any("copies" in item.sentence for item in find_suspicions(made))


def test_live_channels_and_amplitudes_that_a_control_holds_are_not_suspected() -> None:
    assert not find_dead_rows(campaign()).any()
    made = dead(3e-6 * np.exp(1j * np.arange(1836)))
    held = tuple(replace(test, control="response") for test in made.tests)
    assert not find_dead_rows(replace(made, tests=held)).any()
