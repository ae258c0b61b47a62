"""`stickslip sweep` as a user runs it: each point is the solved case, and nothing finished is computed again."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from casefile.errors import CaseError
from study import cli
from study.kind.registry import open_case
from study.limits.run import run_limits
from study.run_context import Options
from study.sweep.curve import find_peak
from study.sweep.grid import MOST_POINTS, read_grid
from study.sweep.run import sweep
from tests.slow import slow
from tests.study.rubbing_mass import CASE as RUBBING_MASS
from tests.study.rubbing_mass import LIMITS, write_matrices

ROOT = Path(__file__).parents[2]
TIMEOUT = 120  # s; a hang is an error, a slow machine is none
CASE = f"""{RUBBING_MASS}
[harmonics]
highest = 3
[sweep]
from = "140 Hz"
to = "200 Hz"
levels = [0.01, 2]
"""


@pytest.fixture
def home(at_home: Path) -> Path:
    write_matrices(at_home)
    (at_home / "my.toml").write_text(CASE)
    return at_home


@pytest.fixture
def no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Drawing takes longer than these curves."""
    for name in ("study.solve.run._list_results", "study.sweep.run.draw_sweep"):
        monkeypatch.setattr(name, lambda *_: {})


def rows(file: Path) -> list[dict[str, str]]:
    with file.open() as stream:
        return list(csv.DictReader(stream))


@pytest.mark.usefixtures("no_figures")
@pytest.mark.parametrize(
    ("word", "old", "new"),
    [
        ("mu=0.6:1.2:3", "[harmonics]", "[calibrated]\nmu = 0.9\n[harmonics]"),
        pytest.param("wall.friction_coefficient=0.3,0.45,0.6", "coefficient = 0.5", "coefficient = 0.45", marks=slow),
        pytest.param("wall.preload=2,3.6 N", '"4 N"', '"3.6 N"', marks=slow),
        ("structure.damping.ratio=0.4 %,2 %", "0.7 %", "2 %"),
        ("wall.preload=2 N,2.5 N", '"4 N"', '"2.5 N"'),
    ],
)
def test_a_point_of_the_grid_is_the_solved_case_to_the_last_digit(home: Path, word: str, old: str, new: str) -> None:
    case = CASE
    if "damping" in word:
        case = CASE.replace("[[line]]", '[structure.damping]\nratio = "0.7 %"\nreplace = true\n[[line]]')
    if "2.5 N" in word:
        case = CASE.replace("highest = 3", 'highest = 3\ntolerance = "0.2 %"')
    (home / "my.toml").write_text(case)
    (home / "changed.toml").write_text(case.replace(old, new, 1))
    assert cli.main(["sweep", "my.toml", word, "--out", "swept", "--quiet"]) == 0
    assert cli.main(["solve", "changed.toml", "--out", "solved", "--quiet"]) == 0
    middle = rows(home / "swept" / "my_sweep.csv")
    column = next(iter(middle[0]))
    values = list(dict.fromkeys(row[column] for row in middle))
    middle = [row for row in middle if row[column] == values[1]]
    shared = ["curve", "frequency [Hz]", "level", "mass amplitude [um]", "mass phase [deg]", "truncation error"]
    expected = [[row[key] for key in shared] for row in rows(home / "solved" / "changed_response.csv")]
    assert [[row[key] for key in shared] for row in middle] == expected


def test_the_files_agree_and_a_linear_peak_has_its_closed_form(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["sweep", "my.toml", "zeta=0.5,1,2", "mu=1,0.5", "--out", "out", "--json"]) == 0
    document = json.loads(capfd.readouterr().out)
    assert {Path(file).name for file in document["files"]} == {file.name for file in (home / "out").iterdir()}
    assert {Path(file).name for file in document["files"] if file.endswith("png")} == {
        f"my_sweep_{what}_{number}.png" for what in ("curves", "peaks") for number in (1, 2)
    }
    assert [point["values"] for point in document["points"]] == [[z, m] for z in (0.5, 1, 2) for m in (1, 0.5)]
    data = xr.open_dataset(home / "out" / "my_sweep.nc", engine="h5netcdf")
    assert data["value"].values.tolist() == [point["values"] for point in document["points"]]
    for number, point in enumerate(document["points"]):
        # At level 0.01 the contact sticks: one mass on two springs.
        omega0, damping = np.sqrt(1.3e6), point["values"][0] * 20.0
        zeta = damping / (2 * omega0)
        stuck = point["curves"][0]
        # The parabola is exact for one mode; the solver's own error is 1e-9 of the motion.
        assert stuck["peak_amplitude"] == pytest.approx(1e4 / (damping * omega0 * np.sqrt(1 - zeta**2)), rel=1e-6)
        expected = omega0 * np.sqrt(1 - 2 * zeta**2) / (2 * np.pi)
        # At the top a relative error e of the amplitude moves the frequency by sqrt(e) of the width.
        assert stuck["peak_frequency_hz"] == pytest.approx(expected, rel=1e-6)
        # 2 zeta omega / omega0 at the highest point, which lies a step from the resonance: 1 % of it at most.
        assert stuck["equivalent_damping"] == pytest.approx(zeta, rel=0.01)
        own = data["peak_amplitude"].values[number, :, 0]
        assert (1e6 * own).tolist() == [curve["peak_amplitude"] for curve in point["curves"]]
        points = (data["sample_of_point"] == number) & (data["curve_of_point"] == 1)
        assert int(points.sum()) == point["curves"][1]["n_point"]


@slow
@pytest.mark.usefixtures("no_figures")
def test_after_a_kill_the_same_bytes_come_out_and_no_finished_curve_is_computed_again(home: Path) -> None:
    words = ["my.toml", "mu=0.5:1.5:4", "zeta=0.5,1", "--quiet"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "stickslip", "sweep", *words, "--out", "out", "--cache", "killed"]
    objects = home / "killed" / "objects"
    with subprocess.Popen(command, env=environment, cwd=home, stderr=subprocess.DEVNULL) as process:
        begin = time.monotonic()
        while len(list(objects.rglob("*.npz"))) < 3 and time.monotonic() - begin < TIMEOUT:
            time.sleep(0.01)
        process.send_signal(signal.SIGKILL)
    time.sleep(1.0)  # its own processes end with it
    finished = {file: file.stat().st_mtime_ns for file in objects.rglob("*.npz")}
    assert 3 <= len(finished) < 16
    assert cli.main(["sweep", *words, "--out", "out", "--cache", "killed"]) == 0
    assert {file: file.stat().st_mtime_ns for file in finished} == finished
    assert cli.main(["sweep", *words, "--out", "whole", "--cache", "whole_cache"]) == 0
    names = {file.name for file in (home / "whole").iterdir()}
    assert names == {"my_sweep.nc", "my_sweep.csv", "my_sweep_peaks.csv"}
    for name in names:
        assert (home / "out" / name).read_bytes() == (home / "whole" / name).read_bytes(), name


@slow
def test_limits_of_a_point_are_those_of_the_case(home: Path) -> None:
    case = CASE.replace("highest = 3", 'highest = 3\ntolerance = "0.5 %"') + LIMITS
    (home / "my.toml").write_text(case)
    (home / "more.toml").write_text(case.replace('"4 N"', '"6 N"'))
    swept = sweep("my.toml", {"wall.preload": ["4 N", "6 N"]})
    alone = run_limits(Path("more.toml"), Options(quiet=True).open(home / "alone"))
    (result,) = swept.sampled.limits
    assert len(result.points) == 2
    np.testing.assert_array_equal(result.points[1].value, alone.curves.value)
    assert result.points[1].is_refined
    assert not sweep("my.toml", {"mu": [1]}, limits=False).sampled.limits


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], r"the grid is empty: give a parameter and its values, such as kt="),
        (["mu"], r'"mu" is not of the form NAME=VALUES: give a parameter'),
        (["mu="], r"mu = : a value is missing"),
        (["mu=0.5:2:0"], r"mu = 0\.5:2:0: a range of 0 values is not a range"),
        (["mu=1:1:3"], r"both ends are 1"),
        (["mu=0.5,1,0.5"], r"mu = 0\.5,1,0\.5: 0\.5 appears twice"),
        (["mu=1:2:5", "mu=3"], r"mu = 3: its values are given twice"),
        (["mu=nan"], r"mu = nan: must be a number"),
        (["mu=-1,1"], r"calibrated\.mu = -1: must be greater than 0"),
        (["ktt=1"], r'ktt = 1: the case has no such parameter; did you mean "kt"'),
        (["bearing=1"], r"bearing: it is a factor .*has nothing .*give one of kt, kn, mu, zeta, E, or .*wall\."),
        (["wall.prelaod=1 N"], r'line\[0\]\.prelaod: unknown key; did you mean "preload"'),
        (["wall.preload=3"], r'my\.toml:13: line\[0\]\.preload = 3: give a unit, e\.g\. "10 N"'),
        (["wall.preload=1 N,2 kg"], r'1 is in "N", but the other values are in "kg"'),
        (["wall.preload=1 zorg"], r'unknown unit "zorg"'),
        (["sweep.step=1 Hz"], r"sweep\.step = 1 Hz: this is not a number of the structure"),
        (["structure=1"], r"structure = 1: this is a table: name one of its keys"),
        (["wall.preload.x=1 N"], r"preload is a single value without keys: name preload itself"),
        (["wall.preload[0]=1 N"], r"preload is a single value without keys: name preload itself"),
        (["mu=0.5:2:50", "kt=0.5:2:50"], rf"the grid has 50 x 50 = 2500 points, but at most {MOST_POINTS} are allowed"),
    ],
)
def test_what_cannot_be_swept_is_refused_in_one_sentence(home: Path, words: list[str], message: str) -> None:
    with pytest.raises(CaseError, match=message) as refused:
        sweep(home / "my.toml", words)
    assert len(str(refused.value).splitlines()) == 1
    assert str(refused.value).startswith(str(home / "my.toml"))


def test_ranges_have_short_numbers_and_units_may_stand_once(home: Path) -> None:
    grid = read_grid(open_case("my.toml"), ["wall.preload=3:4.5 N:6", "mu=0.1:0.7:7"])
    assert grid.values == ((3.0, 3.3, 3.6, 3.9, 4.2, 4.5), (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7))
    assert [item.unit for item in grid.parameters] == ["N", ""]
    assert len(grid.points()) == 42
    assert grid.at(grid.points()[1]) == dict(zip(grid.parameters, ["3.0 N", 0.2], strict=True))
    # Other units of one parameter become those of the last.
    assert read_grid(open_case("my.toml"), {"wall.preload": ["0.003 kN", "4 N"]}).values == ((3.0, 4.0),)


def test_a_corner_or_a_fold_is_its_own_peak_and_an_end_is_told() -> None:
    along = np.array([1.0, 2.0, 3.0, 2.5, 4.0])
    folded = find_peak(along, np.array([1.0, 2.0, 5.0, 3.0, 1.0]), 0.1)
    assert (folded.parameter, folded.amplitude, folded.at_end) == (3.0, 5.0, False)
    assert find_peak(along, np.array([1.0, 2.0, 3.0, 3.5, 4.0]), 0.1).at_end
    assert np.isnan(find_peak(np.zeros(0), np.zeros(0), np.nan).amplitude)
