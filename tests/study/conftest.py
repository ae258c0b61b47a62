"""What the tests of the commands share: a mesh study that takes seconds, and the shipped ones to spoil."""

import os
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from study.errors import MissingSoftware
from study.figure.off_screen import require_egl
from study.shipped import BLADE, TABLE1

#: A stubby bar: two rows, one prediction and three nested meshes of at most a thousand nodes.
COARSE = """\
schema = 1
title = "Coarse bar"
measured = "122.25 Hz"
tuned = ["blade.length"]

[blade]
kind = "plain"
length = "100 mm"
thickness = "6 mm"
chord = "12 mm"
root_chord = "12 mm"
root_thickness = "12 mm"
root_height = "10 mm"
excitation_height = "20 mm"

[material]
young = "210 GPa"
poisson = 0.3
density = "7800 kg/m^3"

[mesh]
length_ratio = 2.0
length_cap = "10 mm"

[root]
drop_every = 3

[reduction]
modes = 30

[[model]]
model = 1
element = "hex8"
elements_through_thickness = 2
root = "full"
paper = "500 Hz"

[[model]]
model = 2
element = "hex20"
elements_through_thickness = 1
root = "relaxed"

[[prediction]]
name = "8-node, 3 elements"
element = "hex8"
elements_through_thickness = 3

[limit]
length_cap = "20 mm"
subdivisions = [1, 2, 4]
"""


def pytest_configure(config: pytest.Config) -> None:
    """Make the marker of this folder known."""
    config.addinivalue_line("markers", "draws: draws pictures off-screen; skipped where this machine cannot")


def pytest_itemcollected(item: pytest.Item) -> None:
    """Skip a test that draws where nothing can be drawn."""
    if item.get_closest_marker("draws") and (reason := drawing_is_impossible()):
        item.add_marker(pytest.mark.skip(reason=reason))


@cache
def drawing_is_impossible() -> str:
    """Why nothing can be drawn; empty if it can."""
    try:
        require_egl()
    except MissingSoftware as reason:
        return str(reason)
    return ""


@pytest.fixture(scope="session")
def case_text() -> dict[str, str]:
    """Text of case files by name: "coarse" runs in seconds, the others are shipped."""
    rig, plain = (path.read_text(encoding="utf-8") for path in TABLE1)
    return {"coarse": COARSE, "rig": rig, "plain": plain, "blade": BLADE.read_text(encoding="utf-8")}


@pytest.fixture
def at_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder of its own to work in, with a cache of its own."""
    monkeypatch.setenv("STICKSLIP_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    before = Path.cwd()
    os.chdir(tmp_path)
    yield tmp_path
    os.chdir(before)
