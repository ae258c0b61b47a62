"""The mesh study as a user runs it: interrupted, taken up again, complete, and the second time from the cache."""

import csv
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path

import pytest

from geometry.errors import InputError
from pipeline.record import read_record
from pipeline.store import Store
from study import cli

TIMEOUT = 120  # s; a hang is an error, a slow machine is none
COLUMNS = (
    "model,element,elements_through_thickness,root,frequency_hz,rom_frequency_hz,hb_peak_hz,paper_hz,n_dof,seconds"
)


pytestmark = pytest.mark.draws


@dataclass(frozen=True, kw_only=True)
class Run:
    """A study that was interrupted and then finished, in one folder."""

    folder: Path
    interrupted: "subprocess.CompletedProcess[str]"
    finished: "subprocess.CompletedProcess[str]"
    kept: dict[Path, int]


def command(folder: Path) -> list[str]:
    words = ["table1", "coarse.toml", "--out", "out", "--cache", str(folder / "cache")]
    return [sys.executable, "-m", "stickslip", *words]


def entries(folder: Path) -> dict[Path, int]:
    """Results that are kept, and when each was written; the sizes of the meshes, which are known first, left out."""
    records = {file: read_record(file) for file in (folder / "cache" / "objects").glob("*/*.npz")}
    return {file: file.stat().st_mtime_ns for file, record in records.items() if record and record.name != "mesh size"}


@pytest.fixture(scope="module")
def run(
    tmp_path_factory: pytest.TempPathFactory,
    case_text: dict[str, str],
    stickslip: Callable[..., "subprocess.CompletedProcess[str]"],
) -> Run:
    folder = tmp_path_factory.mktemp("table1")
    (folder / "coarse.toml").write_text(case_text["coarse"])
    process = subprocess.Popen(
        command(folder), cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    end = time.monotonic() + TIMEOUT
    while not entries(folder):
        assert process.poll() is None
        assert time.monotonic() < end
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)  # what a terminal does for Ctrl-C
    output, errors = process.communicate(timeout=TIMEOUT)
    interrupted = subprocess.CompletedProcess(process.args, process.returncode, output, errors)
    kept = entries(folder)
    finished = stickslip(folder, "table1", "coarse.toml", "--out", "out", "--json")
    return Run(folder=folder, interrupted=interrupted, finished=finished, kept=kept)


def test_interrupted_it_says_so_and_keeps_what_was_finished(run: Run) -> None:
    assert run.interrupted.returncode == 3
    assert "stickslip: interrupted; finished work is stored" in run.interrupted.stderr
    assert "Traceback" not in run.interrupted.stderr
    assert 0 < len(run.kept) < len(entries(run.folder))
    assert not run.interrupted.stdout


def test_the_same_command_goes_on_from_there(run: Run) -> None:
    assert (run.finished.returncode, run.finished.stderr) == (0, "")
    after = entries(run.folder)
    assert {file: after[file] for file in run.kept} == run.kept


def rows(run: Run) -> list[dict[str, str]]:
    return list(csv.DictReader((run.folder / "out" / "table1.csv").open()))


def test_the_table_has_exactly_the_published_columns_and_a_row_for_each_model(run: Run) -> None:
    text = (run.folder / "out" / "table1.csv").read_text()
    assert text.splitlines()[0] == COLUMNS
    assert [(row["model"], row["element"], row["elements_through_thickness"], row["root"]) for row in rows(run)] == [
        ("1", "hex8", "2", "full"),
        ("2", "hex20", "1", "relaxed"),
    ]
    assert [row["paper_hz"] for row in rows(run)] == ["500", ""]
    assert all(int(row["n_dof"]) > 100 and float(row["seconds"]) > 0 for row in rows(run))


def test_the_three_ways_agree(run: Run) -> None:
    for row in rows(run):
        full, reduced, peak = (float(row[name]) for name in ("frequency_hz", "rom_frequency_hz", "hb_peak_hz"))
        assert reduced == pytest.approx(full, rel=1e-6)
        assert reduced >= full * (1 - 2e-9)  # never softer; the file has nine digits
        assert peak == pytest.approx(full, rel=1e-5)


def test_the_document_says_what_the_table_says(run: Run) -> None:
    document = json.loads(run.finished.stdout)
    (study,) = document["studies"]
    for row, said in zip(rows(run), study["rows"], strict=True):
        for name in ("frequency_hz", "rom_frequency_hz", "hb_peak_hz"):
            assert float(row[name]) == pytest.approx(said[name], rel=1e-8)
        assert said["n_dof"] == int(row["n_dof"])
        assert 1e7 < said["memory_bytes"] < 4e9
    # The second row has no published value to be far from.
    assert study["worst_error_hz"] == pytest.approx(abs(study["rows"][0]["frequency_hz"] - 500))
    assert {Path(file).name for file in document["files"]} == {file.name for file in (run.folder / "out").iterdir()}


class Page(HTMLParser):
    """What a browser would load, and the text of the page."""

    def __init__(self) -> None:
        super().__init__()
        self.loaded: list[str] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.loaded += [value or "" for name, value in attrs if name in {"src", "srcset", "href", "data", "poster"}]
        assert tag not in {"script", "iframe", "link", "object", "embed"}

    def handle_data(self, data: str) -> None:
        self.text += data


def test_the_page_is_whole_by_itself_and_names_every_number(run: Run, case_text: dict[str, str]) -> None:
    source = (run.folder / "out" / "table1.html").read_text(encoding="utf-8")
    page = Page()
    page.feed(source)
    pictures = [
        address for address in page.loaded if re.match(r"data:image/(png|gif);base64,[A-Za-z0-9+/]{1000,}", address)
    ]
    assert len(pictures) == 6  # the figure, three modes, one stress, one film
    assert page.loaded == pictures
    assert "url(" not in source
    assert "@import" not in source
    for row in rows(run):
        assert f"{float(row['frequency_hz']):.3f}" in page.text
    for key in ("blade.length", "mesh.length_ratio", "root.drop_every", "limit.length_cap", "damping.ratio"):
        assert key in page.text
    assert "100 mm" in page.text
    # The three ways share their matrices, and the page admits it.
    assert "share one stiffness" in page.text
    assert "CalculiX" in page.text


def test_the_figure_the_pictures_and_the_solid_are_files_of_their_kind(run: Run) -> None:
    out = run.folder / "out"
    for name in ("table1", "table1_mode1", "table1_mode2", "table1_mode3", "table1_mode1_stress"):
        assert (out / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    assert (out / "table1_mode1.gif").read_bytes().startswith(b"GIF89a")
    assert (out / "table1.step").read_text().startswith("ISO-10303-21")


def again(run: Run, monkeypatch: pytest.MonkeyPatch, out: Path) -> int:
    """The same study in this process, where a computation of any stage is an error."""

    def outcome(store: Store, stage: object, *args: object, **kwargs: object) -> object:
        result = original(store, stage, *args, **kwargs)  # type: ignore[arg-type]
        assert result.cached, f"{stage} was computed again"
        return result

    original = Store.outcome
    monkeypatch.setattr(Store, "outcome", outcome)
    monkeypatch.setattr("pipeline.parallel._start", lambda *_: pytest.fail("a process was started"))
    words = ["table1", str(run.folder / "coarse.toml"), "--out", str(out), "--cache", str(run.folder / "cache")]
    return cli.main([*words, "--quiet"])


def test_a_second_run_computes_nothing_and_gives_the_same_table(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert again(run, monkeypatch, tmp_path) == 0
    assert (tmp_path / "table1.csv").read_bytes() == (run.folder / "out" / "table1.csv").read_bytes()
    printed = capsys.readouterr().out
    assert all(f"{float(row['frequency_hz']):.3f}" in printed for row in rows(run))


def test_nested_meshes_without_a_limit_leave_the_table_standing(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise InputError("frequencies 1, 2, 4 Hz do not converge: start from a finer mesh")

    monkeypatch.setattr("study.table1.study.richardson", refuse)
    before = entries(run.folder)
    assert again(run, monkeypatch, tmp_path) == 0
    assert "do not converge: start from a finer mesh" in (tmp_path / "table1.html").read_text(encoding="utf-8")
    assert entries(run.folder) == before
