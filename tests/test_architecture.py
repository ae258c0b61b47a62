"""docs/architecture.md is what the sources say."""

import importlib.util
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[1]
SCRIPT = ROOT / "docs" / "draw_architecture.py"
#: Files between a command and the numerical packages; the aim of the project.
MOST_FILES = 15
#: Packages from the command line down; those that stand beside each other have one number.
LEVEL = {
    "stickslip": 0, "study": 1, "figure": 2, "pipeline": 2, "casefile": 2, "diagnosis": 3, "correlation": 4,
    "transient": 5, "hbsolve": 5, "reduction": 6, "fe": 7, "geometry": 8,
}  # fmt: skip


@pytest.fixture(scope="module")
def script() -> Iterator[ModuleType]:
    spec = importlib.util.spec_from_file_location("draw_architecture", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # data classes look their own module up
    spec.loader.exec_module(module)
    yield module
    del sys.modules[spec.name]


def test_the_tree_of_the_document_is_that_of_the_folders(script: ModuleType) -> None:
    document = script.DOCUMENT.read_text(encoding="utf-8")
    written = document.split(script.BEGIN)[1].split(script.END)[0]
    lines = [line[4:] for line in written.splitlines() if line.strip()]
    assert lines == script.tree().splitlines(), f"the tree is out of date: python {SCRIPT}"


def test_every_folder_that_the_document_names_exists() -> None:
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    table = text.split("Where a new member goes:")[1].split("##")[0]
    folders = re.findall(r"`([\w/]+)`", table)
    assert len(folders) >= 9
    assert [item for item in folders if not (ROOT / item).is_dir()] == []


def test_a_case_and_a_campaign_pass_through_few_files_and_never_back_up(script: ModuleType) -> None:
    for way in script.WAYS:
        links = script.links(way)
        for start, stop in links:
            assert LEVEL[start.split(".")[0]] <= LEVEL[stop.split(".")[0]], (start, stop)
        for _, stop in way.legs:
            passed = script.chain(way.legs[0][0], stop)
            assert len(passed) <= MOST_FILES, passed
