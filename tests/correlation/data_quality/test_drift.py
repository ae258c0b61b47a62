"""Repeats that differ by one factor are told; noise, shifted resonances and one sensor's outliers are not."""

from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign
from correlation.data_quality.drift import find_drift_suspicions
from correlation.model import Model


def grown(campaign: Campaign, factors: list[float]) -> Campaign:
    """All readings of each repeat times a factor."""
    table = campaign.measurement
    numbers = np.unique(table.repeat, return_inverse=True)[1]
    return replace(campaign, measurement=replace(table, value=np.array(factors)[numbers] * table.value))


def told(campaign: Campaign) -> list[str]:
    return [item.sentence for item in find_drift_suspicions(campaign)]


@pytest.mark.parametrize("jitter", [0.0, 3e-4])
def test_repeats_that_scatter_do_not_drift(small: Model, paper: ModuleType, jitter: float) -> None:
    assert told(paper.make_campaign(small, jitter=jitter, seed=5)) == []


def test_a_drift_is_told_with_its_size_and_course(small: Model, paper: ModuleType) -> None:
    campaign = paper.make_campaign(small, seed=3)
    both = told(grown(campaign, [1.0, 1.03, 1.06, 1.1]))
    # One for each test.
    assert len(both) == 2
    for sentence in both:
        assert sentence.startswith("motions at all frequencies and levels are 10% larger in repeat 4 than in repeat 1,")
        assert "change in one direction" in sentence


def test_a_repeat_of_another_gain_is_told_without_a_course(small: Model, paper: ModuleType) -> None:
    sentence = told(grown(paper.make_campaign(small, seed=3), [1.0, 2.0, 1.0, 1.0]))[0]
    assert "100% larger in repeat 2" in sentence
    assert "one direction" not in sentence


@pytest.mark.parametrize("factors", [[1.0, 1.005, 1.01, 1.015], [1.0] * 4])
def test_what_is_below_two_per_cent_is_none(small: Model, paper: ModuleType, factors: list[float]) -> None:
    assert told(grown(paper.make_campaign(small, seed=3), factors)) == []


@pytest.mark.parametrize("factor", [0.9, 1.03, 1.3])
def test_one_sensor_of_another_gain_in_a_repeat_is_named(small: Model, paper: ModuleType, factor: float) -> None:
    campaign = paper.make_campaign(small, seed=3)
    table = campaign.measurement
    (odd,) = (number for number, item in enumerate(campaign.sensors) if item.name == "tip")
    other = np.where((table.sensor == odd) & (table.repeat == 2), factor, 1.0)
    result = [*find_drift_suspicions(replace(campaign, measurement=replace(table, value=other * table.value)))]
    assert result
    assert all('sensor "tip"' in item.where for item in result)
    assert all("repeat 2" in item.sentence for item in result)
