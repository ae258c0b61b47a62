"""Campaigns read ordinary files in their folder, and refuse whatever else a manifest may name or be."""

import os
from pathlib import Path

import pytest

from casefile.errors import CaseError
from casefile.table import read_case_head
from correlation.campaign.campaign_path import find_file
from correlation.campaign.manifest import MANIFEST
from correlation.campaign.read_campaign import read_campaign
from correlation.errors import CampaignError
from correlation.file.read_file import read_file
from study.kind.registry import open_case


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "campaign" / "deep").mkdir(parents=True)
    (tmp_path / "outside.csv").write_text("1")
    (tmp_path / "campaign" / "deep" / "inside.csv").write_text("1")
    return tmp_path / "campaign"


@pytest.mark.parametrize("name", ["deep/inside.csv", "deep/../deep/inside.csv", "./deep/inside.csv"])
def test_a_file_in_the_folder_is_found(folder: Path, name: str) -> None:
    assert find_file(folder, name).samefile(folder / "deep" / "inside.csv")
    (folder / "link.csv").symlink_to("deep/inside.csv")
    assert find_file(folder, "link.csv").is_file()


@pytest.mark.parametrize("name", ["../outside.csv", "deep/../../outside.csv", "/etc/passwd", "link.csv", "/dev/zero"])
def test_a_file_outside_the_folder_is_refused(folder: Path, name: str) -> None:
    (folder / "link.csv").symlink_to("../outside.csv")
    with pytest.raises(CampaignError, match="outside"):
        find_file(folder, name)


@pytest.mark.parametrize("name", ["missing.csv", "deep", "", "a" * 5000, "zero\0.csv", "circle"])
def test_what_is_no_file_is_refused(folder: Path, name: str) -> None:
    (folder / "circle").symlink_to("circle")
    with pytest.raises(CampaignError):
        find_file(folder, name)


def test_a_pipe_that_nobody_writes_is_refused(folder: Path) -> None:
    os.mkfifo(folder / "pipe.csv")
    with pytest.raises(CampaignError, match="device"):
        find_file(folder, "pipe.csv")
    with pytest.raises(CampaignError, match="device"):
        read_file(folder / "pipe.csv")


@pytest.mark.parametrize(
    "text",
    ["x = " + "[" * 5000, "x = " + "9" * 5000, "a." * 5000 + "b = 1", "x = {a=" * 2000],
    ids=["brackets", "digits", "dots", "tables"],
)
def test_a_manifest_of_brackets_or_digits_is_refused(folder: Path, text: str) -> None:
    (folder / MANIFEST).write_text(text)
    with pytest.raises(CampaignError, match=MANIFEST):
        read_campaign(folder)


def test_an_endless_device_is_no_manifest_and_no_case(folder: Path) -> None:
    (folder / MANIFEST).symlink_to("/dev/zero")
    with pytest.raises(CampaignError, match="device"):
        read_campaign(folder)
    with pytest.raises(CaseError, match="device"):
        open_case(Path("/dev/zero"))
    assert read_case_head(Path("/dev/zero")) == {}
