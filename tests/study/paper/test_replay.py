"""The whole replay in its quick form: it takes minutes, and so runs with STICKSLIP_SLOW."""

import json
from pathlib import Path

import pytest

from study.cli import main
from tests.slow import slow


@slow
def test_the_quick_replay_writes_every_figure_of_the_paper(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["study", "paper", "--quick", "--json", "--out", str(tmp_path), "--cache", str(tmp_path / "cache")]
    assert main(words) == 0
    document = json.loads(capsys.readouterr().out)
    figures = {"12a", "12b", *map(str, range(14, 24))} - {"15", "16"}
    assert figures <= {Path(file).stem.removeprefix("figure_") for file in document["files"]}
    # Table 2: the second iteration is fitted to the stuck resonance, the third to both; none to the free one before.
    first, *others = [(item["free_met"], item["stuck_met"]) for item in document["linear"]]
    assert not first[1]
    assert others == [(False, True), (True, True)]
    assert len(document["automatic"]["rounds"]) == 1
    assert all(item["verdict"] and item["evidence"] for item in document["findings"])
    page = (tmp_path / "paper.html").read_text(encoding="utf-8")
    assert "http" not in page.replace("http-equiv", "")
