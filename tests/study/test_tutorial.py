"""The commands of docs/first_verdict.md run one after the other, as a reader copies them."""

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from pipeline.store import Store
from study import cli
from tests.slow import slow

TwoMasses = Callable[..., Path]
ROOT = Path(__file__).parents[2]
DOCUMENT = (ROOT / "docs" / "first_verdict.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```sh\n(.*?)```", DOCUMENT, re.MULTILINE | re.DOTALL)
LINES = [line for block in BLOCKS for line in block.splitlines()]
#: Lines about the campaign of the tutorial, after the one that makes it.
STORY = [line for line in LINES if line.startswith("stickslip") and "mine/" not in line]
#: Numbers of the last digits differ between processors.
DIGITS = re.compile(r"\d+\.\d+")


def test_the_story_runs_and_ends_where_it_began(
    two_masses: TwoMasses, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, kept_rounds: Store
) -> None:
    """A campaign of seconds stands for that of the tutorial, with the same effect hidden in it."""
    case = two_masses({"mass at tip": 0.006}).rename("beam.toml")
    monkeypatch.setenv("STICKSLIP_CACHE", str(kept_rounds.folder))
    drawn = case.read_text()
    assert [shlex.split(line)[1] for line in STORY] == ["compare", "diagnose", "add", "compare", "diagnose", "undo"]
    said = []
    for line in STORY:
        assert cli.main([*shlex.split(line)[1:], "--quiet"]) == 0
        said.append(capsys.readouterr().out)
    assert "Mass at tip" in said[1].split("is missing")[0]
    assert "Nothing is missing" in said[4]
    assert case.read_text() == drawn
    for folder in ("compared", "diagnosed", "corrected", "again"):
        assert list(Path(folder).glob("*.html")), folder


@slow
def test_the_numbers_of_the_tutorial_are_those_of_its_commands(tmp_path: Path) -> None:
    tools = {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    said = ""
    for line in LINES:
        if "campaign new" in line:
            line += " --yes"
        done = subprocess.run(
            line,
            shell=True,
            cwd=tmp_path,
            env=os.environ | tools,
            capture_output=True,
            text=True,
            check=True,
            timeout=900,
        )
        said += done.stdout
    shown = re.findall(r"(?:^ {4}.+\n)+", DOCUMENT, re.MULTILINE)
    for block in shown:
        for line in block.splitlines():
            assert DIGITS.sub("", line.strip()) in DIGITS.sub("", said), line
    # What the page says in numbers: the strength and the error with it.
    assert "Mass at tip (115.3 +- 43 mg) is missing: the held-out error falls from 3.13 to 1.06 %" in said
