"""`stickslip limits` as a user runs it: limits known in closed form, and the same bits after SIGKILL."""

import csv
import json
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from hbsolve.balance import HarmonicBalance
from hbsolve.limits.result import load_limits
from hbsolve.steady_state import steady_state
from pipeline.store import Store
from reduction.jointed_system import JenkinsElement, JointedSystem
from study import cli
from study.case.setup import read_case
from study.limits.run import run_limits
from study.run_context import Options, silent_run
from study.shipped_cases import LIMITS
from tests.in_this_process import InThisProcess, pool_in_this_process
from tests.slow import slow

#: A mass on a spring, rubbing on a plate that nothing shakes: only the mean of the friction force depends on history.
CASE = """\
schema = 2
title = "One mass"
[structure]
kind = "plain"
file = "mass.npz"
[[joint]]
kind = "friction"
name = "pad"
tangent = { dof = 0 }
normal = { dof = 1 }
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
name = "speed"
dof = 0
quantity = "velocity"
[harmonics]
highest = 1
[sweep]
parameter = "frequency"
from = "150 Hz"
to = "130 Hz"
step = "8 Hz"
levels = [4, 1]
[limits]
population = 2
samples = 4
"""
#: The plate is as stiff as the contact and yields to half of the preload.
STIFFNESS, PAD, DAMPING, LIMIT = 1e6, 0.3e6, 20.0, 0.5 * 20.0 / 2


@pytest.fixture
def home(at_home: Path) -> Path:
    np.savez(at_home / "mass.npz", M=np.eye(2), K=np.diag([STIFFNESS, 1e6]), C=np.diag([DAMPING, 20.0]))
    return at_home


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """No pictures, which take longer than these searches."""
    monkeypatch.setattr("study.run_context.RunContext.draw", lambda *_: [])


@pytest.fixture
def no_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Processes begin in seconds, which is longer than these searches take."""
    monkeypatch.setattr("study.limits.stored_search.worker_pool", pool_in_this_process)


def limits(home: Path, capfd: pytest.CaptureFixture[str], case: str) -> dict[str, Any]:
    (home / "my.toml").write_text(case)
    assert cli.main(["limits", "my.toml", "--out", "out", "--json"]) == 0
    return json.loads(capfd.readouterr().out)


def stuck_amplitude(frequency: float, level: float) -> float:
    omega = 2 * np.pi * frequency
    return level / abs(STIFFNESS + PAD - omega**2 + 1j * omega * DAMPING)


def about_resonance(harmonic: int) -> str:
    """A band about the frequency at which this harmonic drives the stuck mass."""
    case = CASE.replace('amplitude = "1 N"', f'amplitude = "1 N"\nharmonic = {harmonic}')
    case = case.replace("highest = 1", f"highest = {harmonic}").replace('"8 Hz"', f'"{8 / harmonic} Hz"')
    case = case.replace("levels = [4, 1]", "levels = [1]")
    ends = f'from = "{178 / harmonic} Hz"\nto = "{186 / harmonic} Hz"'
    return case.replace('from = "150 Hz"\nto = "130 Hz"', ends)


@pytest.mark.usefixtures("undrawn")
def test_limits_that_say_everything_need_no_sweep(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with_sweep = limits(home, capfd, CASE)
    head, _, rest = CASE.partition("[sweep]")
    own = '[limits]\nfrom = "130 Hz"\nto = "150 Hz"\nstep = "8 Hz"\nlevels = [1, 4]\n' + rest.partition("[limits]\n")[2]
    without = limits(home, capfd, head + own)
    assert without["levels"] == with_sweep["levels"]
    # Loads as they stand are level 1.
    at_one = limits(home, capfd, head + own.replace("levels = [1, 4]\n", ""))
    assert [level["level"] for level in at_one["levels"]] == [1.0]
    (home / "my.toml").write_text(head + own.replace('to = "150 Hz"\n', ""))
    assert cli.main(["limits", "my.toml", "--out", "out"]) == 2
    assert re.search(r"my.toml:\d+: .*to is missing, .*no \[sweep\].*: give from and to", capfd.readouterr().err)


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize("harmonic", [1, 2])
def test_a_step_that_passes_by_a_resonance_is_told_with_one_that_does_not(
    home: Path, capfd: pytest.CaptureFixture[str], harmonic: int
) -> None:
    case = about_resonance(harmonic)
    (home / "my.toml").write_text(case)
    assert cli.main(["limits", "my.toml", "--out", "out"]) == 0
    words = rf"are {8 / harmonic:g} Hz apart at (\S+) Hz, where .* is (\S+) Hz wide .* take a step of (\S+) Hz"
    said = re.search(words, capfd.readouterr().err)
    assert said is not None
    middle, width, step = map(float, said.groups())
    # Half a width away the amplitude is that of the top over the root of two, to the square of 1 % damping.
    top = max(stuck_amplitude(harmonic * f, 1) for f in np.linspace(middle - 1, middle + 1, 2001))
    for side in (-1, 1):
        beside = stuck_amplitude(harmonic * (middle + side * width / 2), 1)
        assert beside == pytest.approx(top / np.sqrt(2), rel=0.02)
    (home / "my.toml").write_text(case.replace(f'step = "{8 / harmonic} Hz"', f'step = "{step} Hz"'))
    assert cli.main(["limits", "my.toml", "--out", "out"]) == 0
    assert "apart" not in capfd.readouterr().err


#: A contact that is open at rest, stiffer than the one that is closed.
FAR = """\
[[joint]]
kind = "friction"
name = "far"
tangent = { dof = 0 }
normal = { dof = 1 }
normal_stiffness = "1 N/um"
tangential_stiffness = "1 N/um"
friction_coefficient = 0.5
gap = "5 mm"
[[load]]
"""


@pytest.mark.usefixtures("undrawn")
def test_contacts_that_are_open_at_rest_hold_no_resonance(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (home / "my.toml").write_text(about_resonance(1).replace("[[load]]\n", FAR, 1))
    assert cli.main(["limits", "my.toml", "--out", "out"]) == 0
    assert "are 8 Hz apart at 181.4" in capfd.readouterr().err


@pytest.mark.usefixtures("undrawn")
def test_the_remedy_for_a_list_of_frequencies_is_a_longer_one(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (home / "my.toml").write_text(CASE + 'frequencies = ["170 Hz", "194 Hz"]\n')
    assert cli.main(["limits", "my.toml", "--out", "out"]) == 0
    assert "may miss the peak; give more frequencies there, 0.8 Hz apart" in capfd.readouterr().err


@pytest.mark.usefixtures("undrawn")
def test_of_a_resonance_without_width_nothing_is_said(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    np.savez(home / "mass.npz", M=np.eye(2), K=np.diag([STIFFNESS, 1e6]), C=np.zeros((2, 2)))
    (home / "my.toml").write_text(about_resonance(1))
    assert cli.main(["limits", "my.toml", "--out", "out"]) == 0
    assert "apart" not in capfd.readouterr().err


def test_what_history_cannot_change_is_bounded_by_the_stuck_response_in_all_files(
    home: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    document = limits(home, capfd, CASE)
    names = {
        "my_limits.nc",
        "my_limits.mat",
        "my_limits.csv",
        "my_limits.png",
        "my_limit_states.png",
        "my_limit_levels.png",
        "my_limits.html",
    }
    assert {Path(file).name for file in document["files"]} == names == {item.name for item in Path("out").iterdir()}
    result = load_limits("out/my_limits.nc")
    # A step of 8 Hz at the most makes three equal ones; both lists ascend.
    assert result.frequency == pytest.approx([130, 136 + 2 / 3, 143 + 1 / 3, 150], rel=1e-12)
    assert result.level.tolist() == [1, 4]
    exact = np.array([[stuck_amplitude(f, level) for f in result.frequency] for level in result.level])
    # Newton's method stops at 1e-9 of the linear motion.
    np.testing.assert_allclose(result.value, [exact, exact], rtol=1e-8)
    with Path("out/my_limits.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [float(row["upper [um]"]) for row in rows] == pytest.approx(1e6 * exact.ravel(), rel=1e-8)
    assert {row["lower stick"] for row in rows} == {"1"}
    first = document["levels"][0]
    assert (first["upper"]["frequency_hz"], first["upper"]["at_end"]) == (150, True)
    assert first["upper"]["value"] == pytest.approx(1e6 * stuck_amplitude(150, 1), rel=1e-8)


def test_the_mean_of_a_friction_force_has_what_its_vibration_leaves_of_coulombs_limit(
    home: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    table = 'objective = "static force"\ncontact = "pad"\nreach = "unbounded"\nfrequencies = ["140 Hz"]\n'
    document = limits(home, capfd, CASE + table)
    for told in document["levels"]:
        most = LIMIT - PAD * stuck_amplitude(140, told["level"])
        # The search stops where a step gains less than 1e-4; the highest instant lies between two of 128 samples.
        assert told["upper"]["value"] == pytest.approx(most, rel=2e-4)
        assert told["lower"]["value"] == pytest.approx(-most, rel=2e-4)
    assert (document["reach_m"], document["unit"]) == (None, "N")
    # One frequency has no curve over frequency.
    assert {Path(file).suffix for file in document["files"]} == {".nc", ".mat", ".csv", ".png", ".html"}
    assert len(document["files"]) == 5


@pytest.mark.usefixtures("undrawn", "no_processes")
@pytest.mark.parametrize("objective", ["amplitude", pytest.param("all", marks=slow)])
def test_the_tolerance_of_a_case_holds_at_its_limits(
    home: Path, capfd: pytest.CaptureFixture[str], objective: str
) -> None:
    """The third harmonic of a contact that slips drives the stuck mass near its resonance."""
    case = CASE.replace("highest = 1", 'highest = 2\ntolerance = "0.1 %"')
    table = f'objective = "{objective}"\nsensor = "mass"\nfrequencies = ["55 Hz"]\nlevels = [30]\n'
    document = limits(home, capfd, case + table)
    jenkins = JenkinsElement(name="pad", direction=[1.0], tangential_stiffness=PAD, limit_force=LIMIT)
    slipping = JointedSystem(
        mass=[[1.0]], damping=[[DAMPING]], stiffness=[[STIFFNESS]], joints=[jenkins], harmonic_force=[[0], [30]]
    )
    exact = 1e6 * steady_state(HarmonicBalance(system=slipping, n_harmonic=40), 2 * np.pi * 55).amplitude(0)
    told = (document if objective == "amplitude" else document["quantities"][0])["levels"][0]
    assert [told[side]["value"] for side in ("lower", "upper")] == pytest.approx([exact, exact], rel=1e-3)
    with Path("out/my_limits.csv").open() as stream:
        row = next(csv.DictReader(stream))
    searched = float(row["upper searched [um]" if objective == "amplitude" else "upper searched"])
    assert searched == pytest.approx(0.93 * exact, rel=0.01)
    assert document["highest_harmonic"] == float(row["upper harmonics"]) > 2
    assert float(row["upper estimated error"]) <= 1e-3


@pytest.mark.usefixtures("undrawn", "no_processes")
def test_a_tolerance_that_is_not_reached_or_not_used_is_told(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    case = CASE.replace("highest = 1", 'highest = 1\ntolerance = "0.00001 %"')
    (home / "my.toml").write_text(case + 'frequencies = ["140 Hz"]\nlevels = [40]\n')
    assert cli.main(["limits", "my.toml", "--out", "out", "--quiet"]) == 0
    told = capfd.readouterr().err
    assert "error above 1e-05 % at 2 of 2 limits: raise highest or tolerance of [harmonics], now highest = 1" in told
    (home / "my.toml").write_text(case + 'objective = "loss factor"\nfrequencies = ["140 Hz"]\nlevels = [2]\n')
    assert cli.main(["limits", "my.toml", "--out", "out", "--quiet"]) == 0
    assert "tolerance of [harmonics] is not used for limits of the loss factor" in capfd.readouterr().err


def test_the_papers_limits_are_amplitudes_where_the_loss_factor_is_extreme(
    home: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    table = 'objective = "loss factor"\nsensor = "speed"\nfrequencies = ["140 Hz"]\nlevels = [2]\n'
    document = limits(home, capfd, CASE + table)
    exact = 1e3 * 2 * np.pi * 140 * stuck_amplitude(140, 2)
    told = document["levels"][0]
    assert document["unit"] == "mm/s"
    assert [told[side]["value"] for side in ("lower", "upper")] == pytest.approx([exact, exact], rel=1e-8)
    with Path("out/my_limits.csv").open() as stream:
        row = next(csv.DictReader(stream))
    assert float(row["upper loss factor"]) <= float(row["lower loss factor"])


MISTAKES = [
    ('sensor = "tip"\n', 'my.toml:36: limits.sensor = "tip": the case has no such sensor: give one of "mass"'),
    ('reach = "-1 um"\n', 'limits.reach = "-1 um": must be positive'),
    ("reach = 3\n", 'limits.reach = 3: .*give a unit, e.g. "5 um"'),
    ('step = "1 mHz"\n', 'limits.step = "1 mHz": .* 20001 points of each level: take at most 2000'),
    ('frequencies = ["140 Hz"]\nfrom = "1 Hz"\n', "frequencies replace from, to and step: remove frequencies, or from"),
    ('objective = "static force"\n', 'objective = "static force" needs contact = "NAME", a contact or a contact line'),
    ('objective = "static force"\ncontact = "lid"\n', 'limits.contact = "lid": .* give one of "pad"'),
    ('contact = "pad"\n', 'contact is not used with objective = "amplitude": remove it, or take'),
    ('objective = "static force"\ncontact = "pad"\ndirection = "second tangential"\n', 'no direction 1: give -1'),
    ('objective = "amplitud"\n', 'limits.objective = "amplitud": must be "amplitude"'),
    ("levels = [1, 1]\n", "limits.levels = [1, 1]: 1 appears twice: remove one"),
    ("block = 0\n", "limits.block = 0: must be greater than or equal to 1"),
    ("sample = 3\n", 'limits.sample: unknown key; did you mean "samples"?'),
]  # fmt: skip


@pytest.mark.parametrize(("added", "message"), MISTAKES)
def test_a_mistake_is_one_sentence_with_file_field_value_and_remedy(
    home: Path, capsys: pytest.CaptureFixture[str], added: str, message: str
) -> None:
    (home / "my.toml").write_text(CASE + added)
    assert cli.main(["limits", "my.toml", "--out", "out", "--quiet"]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.count("\n") == 1
    # The pattern is plain text but for ".*".
    assert re.search(".*".join(map(re.escape, message.split(".*"))), shown.err), shown.err


def test_contacts_without_sliders_or_with_coupled_tangents_are_refused(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = CASE.replace("tangent = { dof = 0 }", "tangent = { dof = 0 }\nsecond_tangent = { dof = 1 }").replace(
        'preload = "20 N"', 'preload = "20 N"\nfriction = "coulomb"'
    )
    (home / "my.toml").write_text(text)
    assert cli.main(["limits", "my.toml", "--out", "out", "--quiet"]) == 2
    assert "my.toml:" in (shown := capsys.readouterr().err)
    assert "the response limits cannot be computed" in shown


# A rig.

RIG_TABLES = """\
[harmonics]
highest = 1
samples = 32
[sweep]
from = "240 Hz"
to = "250 Hz"
levels = [0.01]
[limits]
objective = "static force"
contact = "left_decoupler"
direction = "normal"
frequencies = ["250 Hz"]
population = 2
samples = 2
"""


@pytest.mark.usefixtures("undrawn")
def test_the_normal_force_of_a_rigs_line_at_rest_lies_between_the_limits_of_its_mean(
    tmp_path: Path, short_rig: str, reduced_rig: Path, stickslip: Callable[..., "subprocess.CompletedProcess[str]"]
) -> None:
    shutil.copytree(reduced_rig, tmp_path / "cache")
    (tmp_path / "rig.toml").write_text(short_rig + RIG_TABLES)
    done = stickslip(tmp_path, "limits", "rig.toml", "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)["levels"][0]
    read = read_case(tmp_path / "rig.toml", run=replace(silent_run(), store=Store(tmp_path / "cache")))
    rest = read.structure.details.static_state
    names = [contact.name for contact in rest.contacts]
    at_rest = sum(rest.normal[names.index(name)] for name in read.model.lines["left_decoupler"])
    # Rest is the centre of the box; a damper that was dragged by a few um lies otherwise in its groove.
    assert told["lower"]["value"] < at_rest - 0.1
    assert told["upper"]["value"] > at_rest + 0.1


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (RIG_TABLES[RIG_TABLES.index("[sweep]") :], "", "there is no [sweep]"),
        ('frequencies = ["250 Hz"]', 'step = "0.1 mHz"', 'limits.step = "0.1 mHz": '),
    ],
)
def test_a_rigs_frequencies_are_checked_before_its_bodies_are_reduced(
    at_home: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], short_rig: str, old: str,
    new: str, message: str,
) -> None:  # fmt: skip
    monkeypatch.setattr("study.limits.run.read_case", lambda *_, **__: pytest.fail("the rig was reduced"))
    (at_home / "rig.toml").write_text((short_rig + RIG_TABLES).replace(old, new))
    assert cli.main(["limits", "rig.toml", "--out", "out", "--quiet"]) == 2
    assert message in capsys.readouterr().err


# After SIGKILL.

DRIVER = """\
import os, signal, sys
from pathlib import Path
from pipeline.checkpoint import StoredTasks
from pipeline.parallel import process_pool
from study.limits import run, stored_search
from study.run_context import Options

log, last = Path(sys.argv[1]), int(sys.argv[2])
keep = StoredTasks.__setitem__

def counted(kept, task, result):
    keep(kept, task, result)
    with log.open("a") as stream:
        stream.write(task + "\\n")
    if len(log.read_text().splitlines()) == last:
        os.kill(os.getpid(), signal.SIGKILL)

if __name__ == "__main__":
    StoredTasks.__setitem__ = counted
    # One process beside this one: each takes seconds to begin.
    stored_search.worker_pool = lambda modules, _: process_pool(modules, workers=1)
    out, cache = Path(sys.argv[3]), Path(sys.argv[4])
    run.run_limits(Path("wedge.toml"), Options(quiet=True, cache=cache).open(out))
"""
WEDGE_TABLE = '[limits]\nfrom = "279 Hz"\nto = "287 Hz"\nstep = "8 Hz"\nlevels = [0.4]\nsamples = 4\nblock = 3\n'


@slow
def test_a_search_that_was_killed_repeats_no_finished_task_and_ends_with_the_same_bits(
    at_home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = LIMITS.read_text().split("[limits]")[0].replace("highest = 5", "highest = 1")
    (at_home / "wedge.toml").write_text(text.split("# What `stickslip limits`")[0] + WEDGE_TABLE + "population = 2\n")
    (at_home / "wedge_damper.npz").write_bytes(LIMITS.with_suffix(".npz").read_bytes())
    (at_home / "driver.py").write_text(DRIVER)

    def start(log: str, last: int) -> tuple[int, list[str]]:
        words = [sys.executable, "driver.py", log, str(last), "killed", "cache-killed"]
        code = subprocess.run(words, cwd=at_home, timeout=600, check=False).returncode
        return code, (at_home / log).read_text().splitlines()

    # The whole search in this process, as an executor of the caller's may run it.
    names: list[str] = []
    monkeypatch.setattr("pipeline.checkpoint.StoredTasks.__setitem__", _noting(names))
    options = Options(quiet=True, cache=at_home / "cache-whole")
    whole = run_limits(at_home / "wedge.toml", options.open(at_home / "whole"), executor=InThisProcess())
    half = len(names) // 2
    code, first = start("first.txt", half)
    assert code == -signal.SIGKILL
    assert len(first) == half
    assert not (at_home / "killed" / "wedge_limits.nc").exists()
    code, second = start("second.txt", -1)
    assert code == 0
    assert len(names) == len(set(names))
    assert sorted(first + second) == sorted(names)
    with xr.open_dataset(at_home / "killed" / "wedge_limits.nc", engine="h5netcdf") as data:
        for name, result in data.data_vars.items():
            # NaN has equal bytes too.
            assert result.values.tobytes() == np.asarray(getattr(whole.curves.limits, str(name))).tobytes(), name
    killed, plain = ((at_home / folder / "wedge_limits.csv").read_bytes() for folder in ("killed", "whole"))
    assert killed == plain
    # Nothing is left of the unfinished search, and a third start finds the result.
    assert not list((at_home / "killed").glob(".*"))
    n_task = len(names)
    found_again = Options(quiet=True, cache=at_home / "cache-killed").open(at_home / "killed")
    run_limits(at_home / "wedge.toml", found_again, executor=InThisProcess())
    assert len(names) == n_task


def _noting(names: list[str]) -> Callable[..., None]:
    from pipeline.checkpoint import StoredTasks

    keep = StoredTasks.__setitem__

    def noted(kept: StoredTasks, task: str, result: object) -> None:
        names.append(task)
        keep(kept, task, result)

    return noted
