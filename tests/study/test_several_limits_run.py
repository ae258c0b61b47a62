"""`stickslip limits` of everything in one run: the limits of single runs, in one table, and the same after SIGKILL."""

import csv
import json
import re
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.io import loadmat

from hbsolve.limits.result import SIDES, load_limits
from hbsolve.limits.several_result import join_limits, load_several_limits
from study import cli
from study.shipped_cases import LIMITS
from tests.slow import slow

#: Two pads on two masses that are joined by a spring; nothing shakes the plates on which they rub.
CASE = """\
schema = 2
title = "Two masses"
[structure]
kind = "plain"
file = "masses.npz"
[[joint]]
kind = "friction"
name = "pad"
tangent = { dof = 0 }
normal = { dof = 2 }
normal_stiffness = "1 N/um"
tangential_stiffness = "0.3 N/um"
friction_coefficient = 0.5
preload = "20 N"
[[load]]
dof = 0
amplitude = "1 N"
[[sensor]]
name = "mass"
dof = 0
[[sensor]]
name = "other/mass"
dof = 1
quantity = "velocity"
[harmonics]
highest = 1
[limits]
objective = "all"
frequencies = ["130 Hz", "140 Hz"]
levels = [1, 4]
population = 2
samples = 4
"""
#: The plate is as stiff as the contact and yields to half of the preload.
PAD, LIMIT, NORMAL = 0.3e6, 0.5 * 20.0 / 2, 20.0 / 2
STIFFNESS, DAMPING = np.array([[1.2e6, -2e5], [-2e5, 1.2e6]]), 20.0
FORCES = [
    f"{direction} force of pad, {kind}" for direction in ("tangential", "normal") for kind in ("mean", "amplitude")
]


@pytest.fixture
def home(at_home: Path) -> Path:
    stiffness = np.zeros((3, 3))
    stiffness[:2, :2], stiffness[2, 2] = STIFFNESS, 1e6
    np.savez(at_home / "masses.npz", M=np.eye(3), K=stiffness, C=DAMPING * np.eye(3))
    return at_home


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """No pictures, which take longer than these searches."""
    monkeypatch.setattr("study.run_context.RunContext.draw", lambda *_: [])


def limits(home: Path, capfd: pytest.CaptureFixture[str], case: str, out: str = "out") -> dict[str, Any]:
    (home / "my.toml").write_text(case)
    assert cli.main(["limits", "my.toml", "--out", out, "--json"]) == 0
    return json.loads(capfd.readouterr().out)


def stuck_motion(frequency: float) -> np.ndarray:
    """Amplitudes of both masses with the pad stuck, per level [m]."""
    omega = 2 * np.pi * frequency
    matrix = STIFFNESS + np.diag([PAD, 0]) + (1j * omega * DAMPING - omega**2) * np.eye(2)
    return np.abs(np.linalg.solve(matrix, [1, 0]))


def test_every_output_and_force_has_its_closed_form_in_all_files(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    document = limits(home, capfd, CASE.replace("levels", 'reach = "unbounded"\nlevels'))
    names = ["displacement of mass", "velocity of other/mass", *FORCES]
    assert [item["quantity"] for item in document["quantities"]] == names
    result = load_several_limits("out/my_limits.nc")
    assert list(result) == names
    motion = np.array([[level * stuck_motion(f) for f in (130, 140)] for level in (1, 4)])
    left = LIMIT - PAD * motion[..., 0]
    # Newton's method stops at 1e-9 of the linear motion.
    for name, exact in zip(names, [motion[..., 0], motion[..., 1], None, PAD * motion[..., 0]], strict=False):
        if exact is not None:
            np.testing.assert_allclose(result[name].value, [exact, exact], rtol=1e-8)
    # The search stops where a step gains less than 1e-4; the highest instant lies between two of 128 samples.
    np.testing.assert_allclose(result[FORCES[0]].value, [-left, left], rtol=2e-4)
    np.testing.assert_allclose(result[FORCES[2]].value, NORMAL, rtol=1e-8)
    np.testing.assert_allclose(result[FORCES[3]].value, 0, atol=1e-8 * NORMAL)
    with Path("out/my_limits.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [row["quantity"] for row in rows] == [name for name in names for _ in range(4)]
    speed = 2 * np.pi * np.array([130, 140]) * motion[..., 1]
    told = [(row["unit"], float(row["upper"])) for row in rows if row["quantity"] == names[1]]
    assert [unit for unit, _ in told] == ["mm/s"] * 4
    assert [value for _, value in told] == pytest.approx(1e3 * speed.ravel(), rel=1e-8)
    content = loadmat("out/my_limits.mat")
    assert [str(item[0][0]) for item in content["quantity_name"]] == names
    assert content["value"].shape == (6, 2, 2, 2)
    assert {Path(file).name for file in document["files"]} == {entry.name for entry in Path("out").iterdir()} == {
        "my_limits.nc", "my_limits.mat", "my_limits.csv", "my_limits.html", "my_limit_forces_pad.png",
        *(f"my_{kind}_{name}.png" for kind in ("limits", "limit_states", "limit_levels")
          for name in ("mass", "other_mass")),
    }  # fmt: skip


@pytest.mark.usefixtures("undrawn")
def test_a_sensor_or_a_contact_is_the_only_one_and_one_frequency_is_told_in_words(
    home: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    case = CASE.replace('["130 Hz", "140 Hz"]', '["140 Hz"]') + 'sensor = "mass"\ncontact = "pad"\n'
    (home / "my.toml").write_text(case)
    assert cli.main(["limits", "my.toml", "--out", "out"]) == 0
    text = capfd.readouterr().out
    assert "at 140 Hz; 1 slider" in text
    cells = [line.split() for line in text.splitlines() if line.startswith("  displacement of ")]
    assert [line[2] for line in cells] == ["mass", "mass"]
    exact = [1e6 * level * stuck_motion(140)[0] for level in (1, 4)]
    # Five digits are shown.
    assert [float(line[5]) for line in cells] == pytest.approx(exact, rel=1e-4)
    assert sum(line.startswith(("  tangential", "  normal")) for line in text.splitlines()) == 8


@pytest.mark.parametrize(
    ("added", "message"),
    [
        ('direction = "normal"\n', 'direction is not used with objective = "all"'),
        ('sensor = "tip"\n', 'my.toml:.*limits.sensor = "tip": .* give one of "mass", "other/mass"'),
        ('contact = "lid"\n', 'my.toml:.*limits.contact = "lid": .* give one of "pad"'),
    ],
)
def test_a_mistake_is_one_sentence(home: Path, capsys: pytest.CaptureFixture[str], added: str, message: str) -> None:
    (home / "my.toml").write_text(CASE + added)
    assert cli.main(["limits", "my.toml", "--out", "out", "--quiet"]) == 2
    shown = capsys.readouterr()
    assert shown.err.count("\n") == 1
    assert re.search(".*".join(map(re.escape, message.split(".*"))), shown.err), shown.err


@slow
def test_a_sweep_of_everything_has_the_limits_of_each_point_and_a_picture_of_all_forces(
    home: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    # A single frequency is searched with others beside it, and takes longer than two.
    case = CASE.replace("highest = 1", 'highest = 1\ntolerance = "5 %"')
    more = limits(home, capfd, case.replace('"20 N"', '"30 N"'))
    (home / "my.toml").write_text(case)
    assert cli.main(["sweep", "my.toml", "pad.preload=20 N,30 N", "--out", "swept", "--json"]) == 0
    document = json.loads(capfd.readouterr().out)
    names = ["displacement of mass", "velocity of other/mass", *FORCES]
    second = document["points"][1]["limits"]
    assert [(row["quantity"], row["level"]) for row in second] == [(name, level) for name in names for level in (1, 4)]
    alone = [row for item in more["quantities"] for row in item["levels"]]
    for row, own in zip(second, alone, strict=True):
        assert [row[side]["value"] for side in SIDES] == [own[side]["value"] for side in SIDES]
    data = xr.open_dataset("swept/my_sweep.nc", engine="h5netcdf")
    assert data["limit_quantity"].values.tolist() == names
    assert data["limit_unit"].values.tolist() == ["um", "mm/s", "N", "N", "N", "N"]
    with Path("swept/my_sweep_limits.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    for side, word in enumerate(SIDES):
        # Of quantity, point, level and frequency; the CSV has ten digits.
        result = np.array([float(row[word]) for row in rows]).reshape(6, 2, 2, 2)
        np.testing.assert_allclose(result, data["limit"].values[:, :, side], rtol=1e-9, atol=1e-12)
    assert {Path(file).name for file in document["files"]} == {entry.name for entry in Path("swept").iterdir()} == {
        "my_sweep.nc", "my_sweep_limits.csv", "my_sweep.html", "my_sweep_limit_forces_1.png",
        "my_sweep_limit_forces_2.png",
        *(f"my_sweep_limits_{name}_{number}.png" for name in ("mass", "other_mass") for number in (1, 2)),
    }  # fmt: skip


@slow
def test_a_spread_of_everything_tells_quantities_apart(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (home / "my.toml").write_text(
        f'{CASE}[[uncertain]]\nparameter = "pad.friction_coefficient"\ndistribution = "uniform"\nfrom = 0.4\nto = 0.6\n'
    )
    assert cli.main(["spread", "my.toml", "--draws", "2", "--out", "out", "--json"]) == 0
    document = json.loads(capfd.readouterr().out)
    rows = {(item["curve"], item["quantity"]): item for item in document["quantities"]}
    assert len(rows) == 2 * 2 * (2 + len(FORCES))
    # The mean of a stuck pad is bounded by mu N, which spreads, less the vibration, which does not.
    upper = rows["level 1", f"upper limit of the {FORCES[0]}"]
    assert upper["standard_deviation"] > 0
    data = xr.open_dataset("out/my_spread.nc", engine="h5netcdf")
    assert data["limit_band"].sizes["limit_quantity"] == 6
    drawn = {Path(file).name for file in document["files"] if file.endswith("png")}
    assert drawn == {f"my_spread_{what}_{number + 1}.png" for what in ("limits", "limit_shares") for number in range(6)}


@slow
def test_limits_of_different_searches_are_not_joined(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    limits(home, capfd, CASE)
    one = load_several_limits("out/my_limits.nc")[FORCES[0]]
    limits(home, capfd, CASE.replace("levels = [1, 4]", "levels = [1, 5]"), "other")
    two = load_several_limits("other/my_limits.nc")[FORCES[1]]
    with pytest.raises(ValueError, match=f'limits of "{FORCES[1]}" have a different level'):
        join_limits({FORCES[0]: one, FORCES[1]: two}, dict.fromkeys(FORCES, "N"))


WEDGE = (
    '[limits]\nfrom = "262 Hz"\nto = "271 Hz"\nstep = "3 Hz"\nlevels = [0.4]\nsamples = {samples}\nblock = 3\n'
    "population = {population}\n"
)


def wedge(at_home: Path, table: str) -> None:
    """The shipped wedge damper with one harmonic and another table [limits]."""
    text = LIMITS.read_text().split("[limits]")[0].replace("highest = 5", "highest = 1")
    (at_home / "wedge.toml").write_text(text.split("# Limits over")[0] + table)
    (at_home / "wedge_damper.npz").write_bytes(LIMITS.with_suffix(".npz").read_bytes())


@slow
@pytest.mark.usefixtures("home", "undrawn")
def test_the_limits_of_a_wedge_damper_are_those_of_single_runs(at_home: Path) -> None:
    table = WEDGE.format(samples=30, population=12)
    wedge(at_home, table + 'objective = "all"\ncontact = "blade 1"\n')
    assert cli.main(["limits", "wedge.toml", "--out", "all", "--quiet"]) == 0
    together = load_several_limits("all/wedge_limits.nc")
    single = {
        "displacement of blade": "",
        "tangential force of blade 1, mean": 'objective = "static force"\ncontact = "blade 1"\n',
        "normal force of blade 1, amplitude": (
            'objective = "dynamic force"\ncontact = "blade 1"\ndirection = "normal"\n'
        ),
    }
    for name, asked in single.items():
        wedge(at_home, table + asked)
        assert cli.main(["limits", "wedge.toml", "--out", "one", "--quiet"]) == 0
        alone, both = load_limits("one/wedge_limits.nc").value, together[name].value
        # Searches from different starts end within 0.5 % of each other, the target of two seeds; of a mean, which may
        # be zero, within that share of the widest band.
        scale = np.abs(alone) if "mean" not in name else np.ptp(alone, axis=0).max()
        assert np.all(np.abs(both - alone) <= 5e-3 * scale), name


DRIVER = """\
import os, signal, sys
from pathlib import Path
from pipeline.checkpoint import StoredTasks
from pipeline.parallel import process_pool
from study.limits import stored_search
from study.limits.several.run import run_several_limits
from study.run_context import Options, RunContext
from study.sweep import limits as sweep_limits
from study.sweep.run import run_sweep

last, out, n_task = int(sys.argv[1]), Path(sys.argv[2]), 0
keep = StoredTasks.__setitem__

def counted(kept, task, result):
    global n_task
    keep(kept, task, result)
    n_task += 1
    print(task, flush=True)
    if n_task == last:
        os.kill(os.getpid(), signal.SIGKILL)

if __name__ == "__main__":
    StoredTasks.__setitem__ = counted
    RunContext.draw = lambda *_: []
    # One process beside this one: each takes seconds to begin.
    stored_search.worker_pool = lambda modules, _: process_pool(modules, workers=1)
    sweep_limits.worker_pool = stored_search.worker_pool
    run = Options(quiet=True, cache=out / "cache").open(out)
    if sys.argv[3:]:
        run_sweep(Path("wedge.toml"), sys.argv[3:], run)
    else:
        run_several_limits(Path("wedge.toml"), run)
"""


@slow
@pytest.mark.parametrize(
    ("words", "table"),
    [((), "wedge_limits.csv"), (("load[0].amplitude=1,2 N",), "wedge_sweep_limits.csv")],
    ids=["limits", "sweep"],
)
def test_a_search_that_was_killed_repeats_no_finished_task_and_ends_with_the_same_bits(
    at_home: Path, words: tuple[str, ...], table: str
) -> None:
    wedge(at_home, WEDGE.format(samples=2, population=2) + 'objective = "all"\ncontact = "ground 2"\n')
    (at_home / "driver.py").write_text(DRIVER)

    def start(last: int, out: str) -> tuple[int, list[str]]:
        command = [sys.executable, "driver.py", str(last), out, *words]
        done = subprocess.run(command, cwd=at_home, timeout=600, check=False, stdout=subprocess.PIPE, text=True)
        return done.returncode, done.stdout.splitlines()

    code, whole = start(-1, "whole")
    assert code == 0
    # Of a sweep the first point is finished then, and the second is not.
    code, first = start(len(whole) * 3 // 4, "killed")
    assert code == -signal.SIGKILL
    assert not (at_home / "killed" / table).exists()
    code, second = start(-1, "killed")
    assert code == 0
    assert sorted(first + second) == sorted(whole)
    killed, plain = ((at_home / out / table).read_bytes() for out in ("killed", "whole"))
    assert killed == plain
    assert not list((at_home / "killed").glob(".*.part"))
