"""`stickslip solve` finds an isola by default, names it, and writes it beside its curve."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from reduction.joint_law.registry import LAWS
from study import cli
from tests.slow import slow

DAMPER = Path(__file__).parents[1] / "extension" / "polynomial_damper.py"


def isola_of_the_oscillator() -> list[float]:
    """Least and greatest angular frequency [rad/s] with one harmonic; see `test_detached.py`."""
    c1, c3, c5, level = 0.1, -0.3, 0.24, 0.02
    v = np.linspace(0.05, 2.0, 200001)
    left = level**2 - (c1 * v + 0.75 * c3 * v**3 + 0.625 * c5 * v**5) ** 2
    upper = v > v[np.flatnonzero(left < 0)].min()  # beyond the velocities of the curve itself
    width = np.max(np.sqrt(np.maximum(left[upper], 0)) / v[upper])
    return [np.sqrt(1 + width**2 / 4) + side * width / 2 for side in (-1, 1)]


#: The nonlinear absorber of `tests/hbsolve/continuation/test_detached.py`.
CASE = """\
schema = 2
title = "Nonlinear absorber"
[structure]
kind = "plain"
file = "absorber.npz"
[[joint]]
kind = "cubic"
name = "ground"
dof = 0
stiffness = "1 N/m^3"
[[joint]]
kind = "cubic"
name = "absorber"
weights = { 0 = 1, 1 = -1 }
stiffness = "0.0041666667 N/m^3"
[[load]]
dof = 0
amplitude = "1 N"
[[sensor]]
name = "mass"
dof = 0
[harmonics]
highest = 5
[sweep]
from = "0.5 rad/s"
to = "3 rad/s"
levels = [0.11, 0.15]
"""
K, C = 0.0453506, 0.0127559


@pytest.fixture
def home(at_home: Path) -> Path:
    np.savez(
        at_home / "absorber.npz",
        M=np.diag([1.0, 0.05]),
        C=[[0.002 + C, -C], [-C, C]],
        K=[[1 + K, -K], [-K, K]],
    )
    (at_home / "my.toml").write_text(CASE)
    return at_home


def solved(capfd: pytest.CaptureFixture[str], *words: str) -> dict:
    assert cli.main(["solve", "my.toml", "--out", "out", "--json", "--quiet", *words]) == 0
    return json.loads(capfd.readouterr().out)


def test_an_isola_is_a_curve_of_its_own_in_all_results(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    curves = solved(capfd)["curves"]
    assert [item["label"] for item in curves] == ["level 0.11", "level 0.15", "level 0.15, isola 1"]
    main, isola = curves[1:]
    assert isola["peak_amplitude"] > 2 * main["peak_amplitude"]
    assert not isola["peak_at_end"]
    assert isola["stop_reason"].startswith("it is an isola")
    data = xr.open_dataset(home / "out" / "my_response.nc", engine="h5netcdf")
    of_isola = data.isel(point=np.flatnonzero(data["curve"] == 2))
    assert of_isola.sizes["point"] == isola["n_point"]
    # It closes: the last point is the first one.
    np.testing.assert_array_equal(of_isola["output_real"][0], of_isola["output_real"][-1])
    assert (of_isola["level"] == 0.15).all()
    with (home / "out" / "my_response.csv").open() as stream:
        rows = [row for row in csv.DictReader(stream) if row["curve"] == "level 0.15, isola 1"]
    amplitude = max(float(row["mass amplitude [um]"]) for row in rows)
    assert amplitude == pytest.approx(isola["peak_amplitude"], rel=1e-9)  # ten digits in the CSV
    assert (home / "out" / "my_response.png").exists()


#: The other two published systems of `tests/hbsolve/continuation/test_detached.py`, in ranges ten times their isolas.
SHARED = """\
schema = 2
title = "Nonlinear damping"
[plugins]
files = ["polynomial_damper.py"]
[structure]
kind = "plain"
file = "masses.npz"
[[load]]
dof = 0
amplitude = "1 N"
[[sensor]]
name = "mass"
dof = 0
"""
CHAIN = """\
[[joint]]
kind = "cubic"
name = "spring"
dof = 0
stiffness = "0.4 N/m^3"
[[joint]]
kind = "polynomial damper"
name = "damper"
dof = 0
cubic = "-0.6 N s^3/m^3"
quintic = "1.2 N s^5/m^5"
[sweep]
from = "1.5 rad/s"
to = "2 rad/s"
levels = [0.006]
"""
OSCILLATOR = """\
[[joint]]
kind = "polynomial damper"
name = "damper"
dof = 0
cubic = "-0.3 N s^3/m^3"
quintic = "0.24 N s^5/m^5"
[sweep]
from = "0.5 rad/s"
to = "1.5 rad/s"
levels = [0.02]
"""
C_CHAIN = np.sqrt(3) * 0.03


@pytest.mark.parametrize(
    ("tables", "matrices", "lowest", "highest"),
    [
        # Frequencies of the isola of Ponsioen et al., 1.731 to 1.740 rad/s.
        (
            CHAIN,
            {
                "M": np.eye(2),
                "C": [[0.03 + C_CHAIN, -C_CHAIN], [-C_CHAIN, 0.03 + C_CHAIN]],
                "K": [[6.0, -3.0], [-3.0, 6.0]],
            },
            1.731,
            1.740,
        ),
        # Habib et al.: resonance is at 1 rad/s, and the closed form of one harmonic gives the ends.
        (OSCILLATOR, {"M": [[1.0]], "C": [[0.1]], "K": [[1.0]]}, *isola_of_the_oscillator()),
    ],
    ids=["chain", "oscillator"],
)
def test_the_other_published_isolas_are_found_without_a_word(
    at_home: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tables: str,
    matrices: dict[str, object],
    lowest: float,
    highest: float,
) -> None:
    monkeypatch.setattr("study.solve.run._list_results", lambda *_: {})  # drawing takes longer than these curves
    np.savez(at_home / "masses.npz", **matrices)
    (at_home / "polynomial_damper.py").write_text(DAMPER.read_text())
    (at_home / "my.toml").write_text(SHARED + tables)
    try:
        main, isola = solved(capfd)["curves"]
    finally:
        LAWS.forget(at_home / "polynomial_damper.py")
    assert isola["label"] == f"{main['label']}, isola 1"
    assert isola["stop_reason"].startswith("it is an isola")
    data = xr.open_dataset(at_home / "out" / "my_response.nc", engine="h5netcdf")
    omega = 2 * np.pi * data["frequency"].values[data["curve"].values == 1]
    # Points miss the ends by the curvature of a step; three decimals are known of the chain.
    assert [omega.min(), omega.max()] == pytest.approx([lowest, highest], abs=0.03 * (highest - lowest) + 5e-4)


@slow
def test_isolas_are_left_out_on_request_and_have_stability_if_it_is_asked_for(
    home: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("study.solve.run._list_results", lambda *_: {})  # drawing takes longer than these curves
    (home / "my.toml").write_text(CASE + "isolas = false\n")
    assert [item["label"] for item in solved(capfd)["curves"]] == ["level 0.11", "level 0.15"]
    (home / "my.toml").write_text(CASE.replace("[0.11, 0.15]", "[0.15]") + "stability = true\n")
    isola = solved(capfd)["curves"][1]
    assert isola["label"] == "level 0.15, isola 1"
    # An isola turns back at its two ends, where two states meet.
    folds = [item["frequency_hz"] for item in isola["bifurcations"] if item["kind"] == "fold"]
    data = xr.open_dataset(home / "out" / "my_response.nc", engine="h5netcdf")
    frequency = data["frequency"].values[data["curve"].values == 1]
    # Points are close to the ends: the curve is a parabola there.
    assert [min(folds), max(folds)] == pytest.approx([frequency.min(), frequency.max()], rel=5e-3)
