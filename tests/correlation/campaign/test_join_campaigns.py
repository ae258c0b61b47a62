"""Further tests joined to a campaign: every reading stays what it was, under numbers of its own."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.join_campaigns import join_campaigns
from correlation.campaign.measurement import Campaign, Drive, HeldOut, MeasuredSensor, Measurement, Test
from correlation.campaign.read_campaign import read_campaign
from correlation.campaign.write_campaign import write_campaign
from correlation.errors import CampaignError


def make(places: tuple[str, ...], level: float, value: complex) -> Campaign:
    n = len(places)
    one = np.ones(2 * n)
    return Campaign(
        title="", folder=Path("a"), tests=(Test(name="sweep"),), held_out=HeldOut(levels=(level,)),
        sensors=tuple(MeasuredSensor(name=item, quantity="displacement", direction="z", place=item) for item in places),
        measurement=Measurement(
            test=0 * one, order=np.arange(2 * n), repeat=np.repeat([1, 2], n), sweep=one, level=level * one,
            frequency=10 * one, sensor=np.tile(np.arange(n), 2), harmonic=one, value=value * np.arange(1, 2 * n + 1),
        ),
    )  # fmt: skip


def test_joined_readings_keep_their_values_sensors_and_levels_as_other_repeats_of_other_tests(tmp_path: Path) -> None:
    first, further = make(("tip", "base"), 1.0, 1.0), make(("mid", "tip"), 3.0, 1j)
    both = join_campaigns(first, further)
    table = both.measurement
    assert [item.name for item in both.sensors] == ["tip", "base", "mid"]
    assert [item.name for item in both.tests] == ["sweep", "sweep 2"]
    assert (both.held_out.levels, both.held_out.repeats) == (first.held_out.levels, ())
    held = join_campaigns(first, replace(further, held_out=HeldOut(repeats=(2,))))
    assert held.held_out.repeats == (4,)
    later = table.where(table.test == 1)
    assert [both.sensors[item].name for item in later.sensor] == ["mid", "tip"] * 2
    assert later.repeat.tolist() == [3, 3, 4, 4]
    assert later.value.tolist() == further.measurement.value.tolist()
    assert len(np.unique(table.order)) == len(table)
    # As files it is the same campaign.
    write_campaign(both, tmp_path)
    read = read_campaign(tmp_path).measurement
    assert sorted(zip(read.level.tolist(), read.repeat.tolist(), read.value.imag.tolist(), strict=True)) == sorted(
        zip(table.level.tolist(), table.repeat.tolist(), table.value.imag.tolist(), strict=True)
    )


def test_another_drive_or_another_sensor_of_the_same_name_is_refused() -> None:
    first, further = make(("tip",), 1.0, 1.0), make(("tip",), 3.0, 1j)
    with pytest.raises(CampaignError, match="drive"):
        join_campaigns(first, replace(further, drive=Drive(quantity="base acceleration", unit="m/s^2")))
    other = MeasuredSensor(name="tip", quantity="velocity", direction="z", place="tip")
    with pytest.raises(CampaignError, match='"tip"'):
        join_campaigns(first, replace(further, sensors=(other,)))
