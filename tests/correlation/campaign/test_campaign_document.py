"""The worked example of the document is a campaign."""

import re
from pathlib import Path

import pytest

from correlation.campaign.manifest import PEAK_OF, TIME_SIGNS
from correlation.campaign.measurement import SI_UNIT
from correlation.campaign.read_campaign import read_campaign
from correlation.campaign.sensor_entry import DIRECTIONS
from correlation.campaign.stepped_sine import COLUMNS
from correlation.feature.table import extract_features, split

DOCUMENT = Path(__file__).parents[3] / "docs" / "campaign.md"


def test_the_worked_example_can_be_read(tmp_path: Path) -> None:
    text = DOCUMENT.read_text(encoding="utf-8")
    blocks = re.findall(r"`([a-z_.]+)`:\n\n```(?:toml|csv)\n(.*?)```", text, re.DOTALL)
    assert [name for name, _ in blocks] == ["campaign.toml", "stepped.csv", "ring_down.csv"]
    for name, block in blocks:
        (tmp_path / name).write_text(block, encoding="utf-8")
    campaign = read_campaign(tmp_path)
    assert campaign.suspicions == ()
    assert campaign.records[0].time == pytest.approx([0, 5e-5, 1e-4])
    assert len(extract_features(campaign)) == 8
    training, held_out = split(campaign)
    assert (len(training), len(held_out)) == (8, 8)


def test_every_column_and_word_is_described() -> None:
    text = DOCUMENT.read_text(encoding="utf-8")
    for word in (*COLUMNS, *SI_UNIT, *DIRECTIONS, *PEAK_OF, "exp(+i omega t)", "exp(-i omega t)"):
        assert f'"{word}"' in text or f"`{word}`" in text, word
    assert "exp(-i omega t)" in TIME_SIGNS
