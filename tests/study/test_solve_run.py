"""`stickslip solve` as a user runs it: curves right at both limits of friction, and the same bits after Ctrl-C."""

import csv
import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy.io import loadmat

from hbsolve.continuation.step import Continuation
from pipeline.checkpoint import Checkpoint
from study import cli
from study.shipped_cases import SOLVE

#: One mass on a spring that rubs: stuck below a level, sliding nearly freely far above it.
CASE = """\
schema = 2
title = "One mass"
[structure]
kind = "plain"
file = "mass.npz"
[[joint]]
kind = "jenkins"
name = "pad"
dof = 0
tangential_stiffness = "0.3 N/um"
limit_force = "2 N"
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
highest = 3
[sweep]
parameter = "frequency"
from = "140 Hz"
to = "200 Hz"
levels = [0.01, 2]
"""
MASS, STIFFNESS, PAD, DAMPING = 1.0, 1e6, 0.3e6, 20.0


def csv_rows(path: Path, curve: str) -> list[dict[str, str]]:
    with path.open() as stream:
        return [row for row in csv.DictReader(stream) if row["curve"] == curve]


@pytest.fixture
def home(at_home: Path) -> Path:
    np.savez(at_home / "mass.npz", M=[[MASS]], K=[[STIFFNESS]], C=[[DAMPING]])
    (at_home / "my.toml").write_text(CASE)
    return at_home


@pytest.fixture
def no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Drawing takes longer than these curves."""
    monkeypatch.setattr("study.solve.run._list_results", lambda *_: {})


def solve(out: str, *words: str, case: str = "my.toml") -> int:
    return cli.main(["solve", case, "--out", out, "--cache", f"cache-{out}", "--quiet", *words])


def test_a_stuck_slider_is_a_spring_and_results_are_the_same_in_all_files(
    home: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert solve("out", "--json") == 0
    document = json.loads(capfd.readouterr().out)
    files = {Path(file).name for file in document["files"]}
    assert files == {file.name for file in (home / "out").iterdir()}
    assert files == {
        "my_response.nc",
        "my_response.mat",
        "my_response.csv",
        "my_response_1.png",
        "my_response_2.png",
        "my_states.png",
        "my_loops.png",
        "my_solve.html",
    }
    data = xr.open_dataset(home / "out" / "my_response.nc", engine="h5netcdf")
    stuck = data.isel(point=np.flatnonzero(data["curve"] == 0))
    omega = 2 * np.pi * stuck["frequency"].values
    assert omega[[0, -1]] == pytest.approx([2 * np.pi * 140, 2 * np.pi * 200], rel=1e-12)
    exact = 0.01 / (STIFFNESS + PAD - omega**2 * MASS + 1j * omega * DAMPING)
    result = (stuck["output_real"] + 1j * stuck["output_imag"]).values
    # Newton's method stops at 1e-9 of the linear motion, which this is.
    np.testing.assert_allclose(result[:, 1, 0], exact, rtol=1e-8)
    np.testing.assert_allclose(result[:, 1, 1], 1j * omega * exact, rtol=1e-8)
    assert (stuck["contact_share"].values[:, 0] == [1, 0, 0]).all()
    slid = data.isel(point=np.flatnonzero(data["curve"] == 1))
    assert (slid["contact_share"].values[:, 0, 1] > 0.2).any()
    assert data["level"].values[[0, -1]].tolist() == [0.01, 2.0]

    matlab = loadmat(home / "out" / "my_response.mat")
    np.testing.assert_array_equal(matlab["output"], (data["output_real"] + 1j * data["output_imag"]).values)
    assert [str(name[0]) for name in matlab["output_name"].ravel()] == ["mass", "speed"]
    assert str(matlab["units"]["frequency"][0, 0][0]) == "Hz"
    with (home / "out" / "my_response.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == data.sizes["point"] == sum(curve["n_point"] for curve in document["curves"])
    amplitude = np.array([float(row["mass amplitude [um]"]) for row in rows[: len(omega)]])
    np.testing.assert_allclose(amplitude, 1e6 * np.abs(exact), rtol=1e-8)
    # Half the range of a sinusoid sampled 128 times is its amplitude up to (pi / 128)^2 / 2.
    half_range = np.array([float(row["mass half range [um]"]) for row in rows[: len(omega)]])
    np.testing.assert_allclose(half_range, amplitude, rtol=4e-4)
    speed = np.array([float(row["speed amplitude [mm/s]"]) for row in rows[: len(omega)]])
    np.testing.assert_allclose(speed, 1e3 * omega * np.abs(exact), rtol=1e-8)

    first = document["curves"][0]
    assert first["peak_amplitude"] == pytest.approx(amplitude.max(), rel=1e-9)
    assert first["peak_frequency_hz"] == float(stuck["frequency"][int(np.argmax(amplitude))])
    assert first["stop_reason"] == "reached the last value"


@pytest.mark.usefixtures("no_figures")
def test_a_level_sweep_starts_linear_and_softens(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    sweep = 'parameter = "level"\nfrom = 0.01\nto = 5\nfrequencies = ["160 Hz"]\n'
    (home / "level.toml").write_text(CASE.split("parameter")[0] + sweep)
    assert solve("out", "--json", case="level.toml") == 0
    data = xr.open_dataset(home / "out" / "level_response.nc", engine="h5netcdf")
    amplitude = np.hypot(data["output_real"], data["output_imag"]).values[:, 1, 0]
    omega = 2 * np.pi * 160
    stuck = abs(STIFFNESS + PAD - omega**2 * MASS + 1j * omega * DAMPING)
    assert amplitude[0] == pytest.approx(0.01 / stuck, rel=1e-8)
    assert data["level"].values[[0, -1]].tolist() == [0.01, 5.0]
    # Below 165 Hz a slipping pad brings the resonance nearer.
    assert amplitude[-1] > 1.5 * 5 / stuck


@pytest.mark.usefixtures("no_figures")
def test_an_error_above_1_percent_is_told_in_one_sentence_and_a_tolerance_removes_it(
    home: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    # A stop that is much stiffer than the spring: its force is a pulse, which one harmonic cannot show.
    stop = '[[joint]]\nkind = "stop"\nname = "stop"\ndof = 0\nstiffness = "20 N/um"\ngap = "10 um"\n[[load]]'
    rough = CASE.replace("[[load]]", stop, 1).replace("highest = 3", "highest = 1").replace("[0.01, 2]", "[1, 20]")
    (home / "rough.toml").write_text(rough)
    assert solve("out", "--json", case="rough.toml") == 0
    output = capfd.readouterr()
    first, second = json.loads(output.out)["curves"]
    assert first["peak_truncation_error"] < 0.05 < second["peak_truncation_error"]
    rows = csv_rows(home / "out" / "rough_response.csv", "level 20")
    peak = max(rows, key=lambda row: float(row["mass amplitude [um]"]))
    # The CSV has ten digits.
    assert second["peak_truncation_error"] == pytest.approx(float(peak["truncation error"]), rel=1e-9)
    assert second["truncation_error"] == pytest.approx(max(float(row["truncation error"]) for row in rows), rel=1e-9)
    (warning,) = output.err.splitlines()
    count = sum(float(row["mass error"]) > 0.01 for row in rows)
    assert f"{100 * float(peak['mass error']):.2g} % at" in warning
    assert f"above 1 % at {count} of {len(rows)} points" in warning

    (home / "fine.toml").write_text(rough.replace("highest = 1", 'highest = 3\ntolerance = "2 %"'))
    assert solve("out", "--json", case="fine.toml") == 0
    output = capfd.readouterr()
    assert not output.err
    refined = csv_rows(home / "out" / "fine_response.csv", "level 20")
    highest = [float(row["highest harmonic"]) for row in refined]
    assert max(float(row["mass error"]) for row in refined) <= 0.02
    assert 3 < max(highest) <= json.loads(output.out)["highest_harmonic"]
    data = xr.open_dataset(home / "out" / "fine_response.nc", engine="h5netcdf")
    assert data.sizes["harmonic"] == data["highest_harmonic"].max() + 1
    np.testing.assert_array_equal(data["highest_harmonic"].values[data["curve"] == 1], highest)
    # Coefficients beyond the harmonics of a point are zero.
    for point, own in enumerate(data["highest_harmonic"].values.astype(int)):
        assert not data["coefficient_real"].values[point, own + 1 :].any()

    # Eight harmonics do not reach 0.001 %, and that is said.
    (home / "finest.toml").write_text(rough.replace("highest = 1", 'highest = 1\ntolerance = "0.001 %"'))
    assert solve("out", case="finest.toml") == 0
    assert "above 0.001 % at" in capfd.readouterr().err
    assert solve("out", case="rough.toml") == 0
    assert "truncation error at the peak" in capfd.readouterr().out


@pytest.mark.usefixtures("no_figures")
@pytest.mark.parametrize(
    ("start", "end", "marked"),
    [("140", "200", False), ("140", "170", True), ("190", "200", True), ("200", "190", True)],
)
def test_a_highest_point_at_either_end_of_the_sweep_is_said_to_be_there(
    home: Path, capfd: pytest.CaptureFixture[str], start: str, end: str, marked: bool
) -> None:
    # The stuck pad's resonance is at 181 Hz.
    case = CASE.replace('"140 Hz"\nto = "200 Hz"', f'"{start} Hz"\nto = "{end} Hz"').replace("[0.01, 2]", "[0.01]")
    (home / "end.toml").write_text(case)
    assert solve("out", "--json", case="end.toml") == 0
    assert json.loads(capfd.readouterr().out)["curves"][0]["peak_at_end"] is marked
    assert solve("out", case="end.toml") == 0
    assert ("  at the end of the sweep\n" in capfd.readouterr().out) is marked


def test_a_stop_in_contact_is_closed_and_its_force_is_normal(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.colors import to_hex
    from matplotlib.figure import Figure

    drawn: dict[str, Figure] = {}
    monkeypatch.setattr(
        FigureCanvasAgg,
        "draw",
        lambda canvas: drawn.update({canvas.figure.get_suptitle(): canvas.figure}),
    )
    text = """
[[joint]]
kind = "stop"
name = "stop"
dof = 0
stiffness = "0.2 N/um"
gap = "5 um"
[[joint]]
kind = "friction"
name = "rub"
normal = { dof = 0 }
tangent = { dof = 0 }
normal_stiffness = "0.1 N/um"
tangential_stiffness = "0.1 N/um"
friction_coefficient = 0.4
preload = "5 N"
[[load]]"""
    (home / "stop.toml").write_text(CASE.replace("[[load]]", text, 1).replace("[0.01, 2]", "[2]"))
    assert solve("out", case="stop.toml") == 0
    with (home / "out" / "stop_response.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    named = {name for name in rows[0] if name.split()[0] in {"pad", "stop", "rub"}}
    assert named == {"stop closed", "stop separated"} | {
        f"{joint} {state}" for joint in ("pad", "rub") for state in ("stick", "slip", "separated")
    }
    closed = np.array([float(row["stop closed"]) for row in rows])
    # It is nearer than the mass moves at resonance, by less than its whole motion: closed for a part of the period.
    assert 0 < closed.max() < 1
    # The CSV has ten digits.
    np.testing.assert_allclose(closed + [float(row["stop separated"]) for row in rows], 1, rtol=1e-9)

    states, loops = (
        drawn["One mass: contact states"],
        drawn["One mass: contacts at the highest point of each curve"],
    )
    assert [item.get_text() for item in states.legends[0].get_texts()] == ["stuck", "slipping", "closed", "separated"]
    colours = [{to_hex(area.get_facecolor()[0]) for area in axes.collections} for axes in states.axes]
    legend = [to_hex(patch.get_facecolor()) for patch in states.legends[0].get_patches()]
    assert colours == [{legend[0], legend[1], legend[3]}, {legend[2], legend[3]}, {legend[0], legend[1], legend[3]}]
    over_time = [axes.get_ylabel() for axes in loops.axes if axes.get_subplotspec().colspan.start == 1]
    assert over_time == ["T(t) [N]", "N(t) [N]", "T(t) [N]"]


def counted(monkeypatch: pytest.MonkeyPatch, stop: int | None) -> list[int]:
    """Count the steps of all curves, and press Ctrl-C before one of them."""
    steps = [0]
    advance = Continuation.advance

    def step(self: Continuation, state: object) -> object:
        if steps[0] == stop:
            raise KeyboardInterrupt
        steps[0] += 1
        return advance(self, state)  # type: ignore[arg-type]

    monkeypatch.setattr(Continuation, "advance", step)
    # Every point is saved, so that the test does not depend on the time.
    monkeypatch.setattr("study.solve.run.Checkpoint", partial(Checkpoint, every=0.0, clock=lambda: 0.0))
    return steps


@pytest.mark.usefixtures("no_figures")
def test_the_same_command_goes_on_after_ctrl_c_and_gives_the_same_bits(
    home: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    # The search for isolas is not saved point by point.
    (home / "my.toml").write_text(CASE.replace("levels =", "isolas = false\nlevels ="))
    with monkeypatch.context() as patch:
        whole = counted(patch, None)
        assert solve("whole") == 0
    # Within the first curve, and within the second.
    stops = [8, whole[0] - 8]
    done = 0
    for stop in stops:
        with monkeypatch.context() as patch:
            counted(patch, stop - done)
            assert solve("parts") == 3
        done = stop
        assert [file.suffix for file in (home / "parts").iterdir()] == [".part"]
    with monkeypatch.context() as patch:
        rest = counted(patch, None)
        assert solve("parts") == 0
    assert done + rest[0] == whole[0]
    assert not list((home / "parts").glob(".*"))
    one, other = (xr.open_dataset(home / out / "my_response.nc", engine="h5netcdf") for out in ("whole", "parts"))
    assert one.identical(other)
    assert (home / "whole" / "my_response.csv").read_bytes() == (home / "parts" / "my_response.csv").read_bytes()


@pytest.mark.usefixtures("no_figures")
def test_a_saved_point_of_another_case_is_not_continued(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        counted(patch, 8)
        assert solve("out") == 3
    (home / "my.toml").write_text(CASE.replace('"0.3 N/um"', '"0.2 N/um"'))
    assert solve("out") == 0
    data = xr.open_dataset(home / "out" / "my_response.nc", engine="h5netcdf")
    omega = 2 * np.pi * data["frequency"].values[0]
    exact = 0.01 / abs(STIFFNESS + 0.2e6 - omega**2 * MASS + 1j * omega * DAMPING)
    assert np.hypot(data["output_real"], data["output_imag"]).values[0, 1, 0] == pytest.approx(exact, rel=1e-8)


@pytest.mark.usefixtures("no_figures")
def test_a_second_run_computes_nothing(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert solve("out") == 0
    steps = counted(monkeypatch, 0)
    assert solve("out") == 0
    assert steps == [0]


def test_mistakes_are_answered_with_exit_code_2_and_the_help_has_an_example(
    home: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (home / "my.toml").write_text(CASE.replace("dof = 0", "dof = 7"))
    assert solve("out", "--json") == 2
    error = json.loads(capfd.readouterr().out)["error"]
    assert error["kind"] == "case"
    assert {problem["key"] for problem in error["problems"]} == {"joint[0]", "load[0]", "sensor[0]", "sensor[1]"}
    assert cli.main(["solve", "--help"]) == 0
    assert "stickslip solve my_rig.toml --out mine" in capfd.readouterr().out


def test_a_load_beyond_the_arithmetic_is_answered_with_exit_code_2(
    home: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (home / "my.toml").write_text(CASE.replace('"1 N"', '"1e200 N"'))
    assert solve("out") == 2
    error = capfd.readouterr().err
    assert "harmonic force of 1e+200 N" in error
    assert error.count("\n") == 1


@pytest.mark.usefixtures("no_figures")
def test_negative_damping_is_told_in_one_sentence(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    np.savez(home / "mass.npz", M=[[MASS]], K=[[STIFFNESS]], C=[[-DAMPING]])
    assert solve("out", "--json") == 0
    output = capfd.readouterr()
    assert json.loads(output.out)["n_dof"] == 1
    assert output.err.splitlines()[:1] == [
        "stickslip: warning: the damping has the eigenvalue -20 N s/m in its symmetric part, whose largest is -20 "
        "N s/m: it adds energy to a motion, like follower forces, so check its sign if the structure is passive"
    ]


@pytest.mark.usefixtures("no_figures")
def test_the_shipped_chain_rubs_with_a_varying_load_and_has_no_fold(home: Path) -> None:
    assert solve("out", case=str(SOLVE)) == 0
    data = xr.open_dataset(home / "out" / "solve_chain_response.nc", engine="h5netcdf")
    peaks = []
    for number in range(4):
        curve = data.isel(point=np.flatnonzero(data["curve"] == number))
        assert (np.diff(curve["frequency"]) > 0).all()
        amplitude = np.hypot(curve["output_real"], curve["output_imag"]).values[:, 1, 0]
        peaks.append(float(curve["frequency"][int(np.argmax(amplitude))]))
    # The more it slips, the softer it is: from the stuck mode at 105.9 Hz towards the free one at 70.8 Hz.
    assert 106 > peaks[0] > peaks[1] > peaks[2] > peaks[3] > 70.8


DUFFING = """\
schema = 2
title = "Hardening"
[structure]
kind = "plain"
file = "mass.npz"
[[joint]]
kind = "cubic"
name = "spring"
dof = 0
stiffness = "2000 N/mm^3"
[[load]]
dof = 0
amplitude = "1 N"
[[sensor]]
name = "mass"
dof = 0
[harmonics]
highest = 3
[sweep]
from = "158 Hz"
to = "175 Hz"
levels = [0.2, 3]
step = "0.1 Hz"
stability = true
"""


def test_a_hardening_curve_is_unstable_between_its_folds(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (home / "hard.toml").write_text(DUFFING)
    assert solve("out", "--json", case="hard.toml") == 0
    low, high = json.loads(capfd.readouterr().out)["curves"]
    assert low["bifurcations"] == []
    assert [item["kind"] for item in high["bifurcations"]] == ["fold", "fold"]
    upper, lower = (item["frequency_hz"] for item in high["bifurcations"])
    with (home / "out" / "hard_response.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["curve"] == "level 3"]
    unstable = [float(row["frequency [Hz]"]) for row in rows if float(row["unstable multipliers"])]
    assert lower < min(unstable) <= max(unstable) < upper
    data = xr.open_dataset(home / "out" / "hard_response.nc", engine="h5netcdf")
    assert int(data["n_unstable"].sum()) == len(unstable)
    assert solve("out", case="hard.toml") == 0
    assert f"fold at {upper:.6g} Hz" in capfd.readouterr().out
