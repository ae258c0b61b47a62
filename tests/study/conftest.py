"""What the tests of the commands share: a mesh study that takes seconds, and the shipped ones to spoil."""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryFile

import pytest

from benchmarks.two_masses import write_two_masses
from pipeline.store import Store
from study import cli
from study.case.setup import ReadCase, read_case
from study.run_context import silent_run
from study.shipped_cases import BLADE, TABLE1
from tests.in_this_process import pool_in_this_process

Command = Callable[..., "subprocess.CompletedProcess[str]"]

#: A stubby bar: two rows, one prediction and three nested meshes of at most a thousand nodes.
COARSE = """\
schema = 2
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

#: A rig of a few thousand degrees of freedom: all that a case must say.
SHORT_RIG = """\
schema = 2
[structure]
kind = "rig"
[structure.material]
young = "210 GPa"
poisson = 0.3
density = "7800 kg/m^3"
[structure.mesh]
element = "hex8"
size = "8 mm"
[structure.reduction]
modes = 40
[structure.contact]
kn = "8.5 N/um"
kt = "4.6 N/um"
mu = 0.8
"""


@pytest.fixture(scope="session")
def case_text() -> dict[str, str]:
    """Text of case files by name: "coarse" runs in seconds, the others are shipped."""
    rig, plain = (path.read_text(encoding="utf-8") for path in TABLE1)
    return {"coarse": COARSE, "rig": rig, "plain": plain, "blade": BLADE.read_text(encoding="utf-8")}


@pytest.fixture(scope="session")
def short_rig() -> str:
    """Text of a case file of a coarse rig, without a sweep."""
    return SHORT_RIG


def run_here(folder: Path, *words: str) -> "subprocess.CompletedProcess[str]":
    """Run ``stickslip`` in this process: another one takes seconds of imports, and `test_cli.py` starts such."""
    with TemporaryFile("w+") as out, TemporaryFile("w+") as err, chdir(folder):
        sys.stdout.flush()
        sys.stderr.flush()
        kept = {number: os.dup(number) for number in (1, 2)}
        os.dup2(out.fileno(), 1)
        os.dup2(err.fileno(), 2)
        try:
            with redirect_stdout(out), redirect_stderr(err):
                code = cli.main([*words, "--cache", str(folder / "cache")])
        finally:
            for number, copy in kept.items():
                os.dup2(copy, number)
                os.close(copy)
        texts = []
        for stream in (out, err):
            stream.flush()
            stream.seek(0)
            texts.append(stream.read())
    return subprocess.CompletedProcess(["stickslip", *words], code, *texts)


@pytest.fixture(scope="session")
def stickslip() -> Command:
    """Runs ``stickslip`` with some words in a folder, with a cache there."""
    return run_here


@pytest.fixture(scope="session")
def reduced_rig(tmp_path_factory: pytest.TempPathFactory, short_rig: str) -> Path:
    """A cache folder in which the bodies of the short rig are stored, for tests to copy."""
    folder = tmp_path_factory.mktemp("reduced_rig")
    (folder / "rig.toml").write_text(short_rig, encoding="utf-8")
    read_case(folder / "rig.toml", run=replace(silent_run(), store=Store(folder / "cache")))
    return folder / "cache"


ReadRig = Callable[[str], ReadCase]


@pytest.fixture(scope="session")
def read_rig(tmp_path_factory: pytest.TempPathFactory, reduced_rig: Path, short_rig: str) -> ReadRig:
    """Reads the short rig with tables added; each text once in all tests of this process."""
    folder = tmp_path_factory.mktemp("read_rig")
    shutil.copytree(reduced_rig, folder / "cache")

    @cache
    def read(tables: str) -> ReadCase:
        (folder / "case.toml").write_text(short_rig + tables, encoding="utf-8")
        return read_case(folder / "case.toml", run=replace(silent_run(), store=Store(folder / "cache")))

    return read


@pytest.fixture(scope="session")
def kept_rounds(tmp_path_factory: pytest.TempPathFactory) -> Store:
    """Steps of diagnoses, for tests that need a diagnosis which another test of this process may have made already."""
    return Store(tmp_path_factory.mktemp("rounds"))


@pytest.fixture(scope="module", autouse=True)
def small_pictures() -> Iterator[None]:
    """Pictures that this process draws are small: `tests/figure` looks at them, here they only have to be there."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("figure.style.DPI", 60)
        patch.setattr("figure.scene.view.OVERSAMPLING", 1)
        patch.setattr("figure.scene.mode_picture.HEIGHT", 600)
        patch.setattr("figure.scene.mode_picture.FILM_HEIGHT", 450)
        patch.setattr("figure.scene.deflection_film.FILM_HEIGHT", 450)
        yield


@pytest.fixture(scope="module", autouse=True)
def no_processes() -> Iterator[None]:
    """What a pool would do is done here; `tests/pipeline` and the commands that are killed start processes."""
    with pytest.MonkeyPatch.context() as patch:
        for module in ("study.limits.stored_search", "study.sweep.limits", "pipeline.pool"):
            patch.setattr(f"{module}.worker_pool", pool_in_this_process)
        yield


@pytest.fixture
def at_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder of its own to work in, with a cache of its own."""
    monkeypatch.setenv("STICKSLIP_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    before = Path.cwd()
    os.chdir(tmp_path)
    yield tmp_path
    os.chdir(before)


TwoMasses = Callable[..., Path]


@pytest.fixture
def two_masses(at_home: Path) -> TwoMasses:
    """Writes the case ``chain.toml`` and a campaign of the same structure with effects and 1.1 times its damping."""
    return partial(write_two_masses, at_home)
