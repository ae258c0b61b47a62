"""What commands take, and what a run of one knows of runs before it."""

from pathlib import Path

import pytest
from cyclopts import App

from pipeline.duration import Durations
from study.run_context import CampaignFolder, Options


def test_a_step_of_one_measured_folder_tells_no_time_of_another(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = Options(cache=tmp_path / "cache")
    place, file = tmp_path / "first", options.open().store.folder
    assert file is not None
    file.mkdir(parents=True, exist_ok=True)
    Durations(file / "durations.npz", place=str(place.resolve())).remember("read", 10.0)
    for name, known in (("first", True), ("second", False)):
        with options.open(place=tmp_path / name).progress.step("read"):
            pass
        assert ("about 10 s" in capsys.readouterr().err) == known


@pytest.mark.parametrize(
    ("given", "taken"),
    [("shaken", "shaken"), ("shaken/campaign.toml", "shaken"), ("no/campaign.toml", "no/campaign.toml")],
)
def test_the_manifest_of_a_campaign_stands_for_its_folder(tmp_path: Path, given: str, taken: str) -> None:
    def read(campaign: CampaignFolder, /) -> Path:
        return campaign

    (tmp_path / "shaken").mkdir()
    (tmp_path / "shaken" / "campaign.toml").write_text("schema = 1\n", encoding="utf-8")
    app = App(result_action="return_value")
    app.default(read)
    assert app([str(tmp_path / given)]) == tmp_path / taken
