"""What every format of campaigns must do: give back what was written, and refuse what is damaged in a sentence."""

from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.format import FORMATS, CampaignFormat
from correlation.campaign.measurement import MeasuredSensor, Measurement
from correlation.campaign.read_campaign import read_campaign
from correlation.errors import CampaignError
from geometry.errors import RegistryError
from tests.correlation.campaign.test_write_campaign import made


@pytest.fixture(params=[each.name for each in FORMATS if each.write is not None])
def campaign_format(request: pytest.FixtureRequest) -> CampaignFormat:
    """Each that can be written."""
    return FORMATS[request.param]


def written(campaign_format: CampaignFormat, folder: Path) -> Path:
    assert campaign_format.write is not None
    campaign_format.write(made(), folder / "written")
    return folder / "written"


def files(path: Path) -> list[Path]:
    return [path] if path.is_file() else sorted(path.iterdir())


def same(one: object, other: object) -> bool:
    if isinstance(one, MeasuredSensor | Measurement) and type(one) is type(other):
        return all(same(getattr(one, item.name), getattr(other, item.name)) for item in fields(one))
    return bool(np.array_equal(one, other)) if isinstance(one, np.ndarray) else one == other


def test_what_is_written_is_read_to_the_last_digit(campaign_format: CampaignFormat, tmp_path: Path) -> None:
    assert campaign_format.write is not None
    first = read_campaign(written(campaign_format, tmp_path))
    campaign_format.write(first, tmp_path / "again")
    again, before = read_campaign(tmp_path / "again"), made()
    assert (again.title, again.held_out) == (before.title, before.held_out) or again.held_out.levels == (1 / 3,)
    assert np.array_equal(np.sort_complex(again.measurement.value), np.sort_complex(before.measurement.value))
    assert same(first.measurement, again.measurement)
    for old, new in zip((*before.sensors, *before.tests), (*again.sensors, *again.tests), strict=True):
        assert (old.name, type(old)) == (new.name, type(new))
    assert all(same(old, new) for old, new in zip(before.sensors, again.sensors, strict=True))
    for old_record, new_record in zip(before.records, again.records, strict=True):
        assert (old_record.channels, old_record.units) == (new_record.channels, new_record.units)
        assert (old_record.force, old_record.held_out) == (new_record.force, new_record.held_out)
        np.testing.assert_array_equal(old_record.values, new_record.values)


def test_no_other_format_takes_it_for_its_own(campaign_format: CampaignFormat, tmp_path: Path) -> None:
    path = written(campaign_format, tmp_path)
    assert [item.name for item in FORMATS if item.recognise(path)] == [campaign_format.name]
    for nothing in (tmp_path, tmp_path / "missing", Path(__file__)):
        assert not campaign_format.recognise(nothing)


def mutants(content: bytes, rng: np.random.Generator) -> Iterator[bytes]:
    """Cut short, a stretch taken out, some bytes turned over, lines swapped, empty."""
    for share in rng.uniform(size=4):
        yield content[: int(share * len(content))]
    for _ in range(6):
        first, length = int(rng.integers(len(content))), int(rng.integers(1, 40))
        yield content[:first] + content[first + length :]
        damaged = bytearray(content)
        for place in rng.integers(len(content), size=3):
            damaged[place] = int(rng.integers(256))
        yield bytes(damaged)
    lines = content.split(b"\n")
    first, second = rng.integers(len(lines), size=2)
    lines[first], lines[second] = lines[second], lines[first]
    yield b"\n".join(lines)
    yield b""


def test_a_damaged_file_is_read_or_refused_in_a_sentence(campaign_format: CampaignFormat, tmp_path: Path) -> None:
    path, rng = written(campaign_format, tmp_path), np.random.default_rng(7)
    refusals: list[str] = []
    for file in files(path):
        content = file.read_bytes()
        for mutant in mutants(content, rng):
            file.write_bytes(mutant)
            try:
                read_campaign(path)
            except CampaignError as error:
                refusals.append(str(error))
        file.write_bytes(content)
    assert len(refusals) > len(files(path))  # cut short, or empty, at the least
    assert all(item.strip() and "\n\n" not in item for item in refusals)
    read_campaign(path)


def test_a_format_that_lacks_a_fact_is_refused() -> None:
    half = CampaignFormat(name="half", holds="", recognise=Path.is_file, read=read_campaign, write=None)
    with pytest.raises(RegistryError, match=r'"half" has holds = .*: say what a user gives'):
        FORMATS.register(half)
    assert "half" not in FORMATS
