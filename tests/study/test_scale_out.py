"""`--scheduler` as a user gives it: the files are those of this machine, and mistakes are one sentence."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from diagnosis.threshold.bootstrap import Trial
from pipeline.progress import SilentProgress
from pipeline.store import Store
from study import cli
from study.diagnose import thresholds
from study.diagnose.thresholds import simulate_layout_thresholds
from tests.slow import slow
from tests.study.rubbing_mass import CASE, LIMITS, write_matrices

distributed = pytest.importorskip("distributed")

SWEEP = '[harmonics]\nhighest = 2\n[sweep]\nfrom = "150 Hz"\nto = "190 Hz"\nlevels = [2]\n'


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster:
        yield str(cluster.scheduler_address)


@pytest.fixture
def home(at_home: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    write_matrices(at_home)
    (at_home / "my.toml").write_text(CASE + SWEEP + LIMITS)
    # No pictures, which take longer than these curves.
    monkeypatch.setattr("study.run_context.RunContext.draw", lambda *_: [])
    monkeypatch.setattr("study.sweep.run.draw_sweep", lambda *_: {})
    return at_home


def files(folder: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in sorted(folder.iterdir())}


@pytest.mark.parametrize(
    "words",
    [
        pytest.param(["sweep", "my.toml", "mu=0.9,1.1", "--no-limits"], id="sweep", marks=slow),
        pytest.param(["limits", "my.toml"], id="limits"),
    ],
)
def test_the_files_of_a_scheduler_are_those_of_this_machine(home: Path, address: str, words: list[str]) -> None:
    for out, where in (("here", []), ("there", ["--scheduler", address])):
        assert cli.main([*words, *where, "--out", out, "--cache", f"cache-{out}", "--quiet"]) == 0
    assert files(home / "here") == files(home / "there")
    assert len(files(home / "here")) >= 3


@pytest.mark.parametrize(
    "words", [["sweep", "my.toml", "mu=0.9,1.1", "--no-limits"], ["limits", "my.toml"]], ids=["sweep", "limits"]
)
def test_no_scheduler_at_an_address_is_bad_input(
    home: Path, words: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("pipeline.scheduler.PATIENCE", 0.5)
    assert cli.main([*words, "--scheduler", "tcp://127.0.0.1:9", "--quiet"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "tcp://127.0.0.1:9" in line


def test_simulated_campaigns_go_to_the_scheduler(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[Any] = []

    def run(tasks: list[Any], *_: object) -> list[dict[str, float]]:
        given.append(_[-1])
        return [vars(Trial(seed=number, gain=1.0 + number, misfit=1.0)) for number, _ in enumerate(tasks)]

    monkeypatch.setattr(thresholds, "run_pooled", run)
    nothing: Any = None
    simulate_layout_thresholds("layout", nothing, (), 3, Store(None), SilentProgress(), "tcp://127.0.0.1:9")
    assert given == ["tcp://127.0.0.1:9"]
