"""`stickslip solve` follows what leaves a curve at its branch points, if it is asked for."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from study import cli
from tests.slow import slow

#: The twins of `tests/hbsolve/stability/test_crossing_branch.py`, which need not move alike.
CASE = """\
schema = 2
title = "Twins"
[structure]
kind = "plain"
file = "twins.npz"
[[joint]]
kind = "cubic"
name = "one"
dof = 0
stiffness = "0.5 N/m^3"
[[joint]]
kind = "cubic"
name = "other"
dof = 1
stiffness = "0.5 N/m^3"
[[load]]
dof = 0
amplitude = "0.2 N"
[[load]]
dof = 1
amplitude = "0.2 N"
[[sensor]]
name = "one"
dof = 0
[[sensor]]
name = "other"
dof = 1
[harmonics]
highest = 1
[sweep]
from = "0.7 rad/s"
to = "2.2 rad/s"
isolas = false
"""


@pytest.fixture
def home(at_home: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("study.solve.run._list_results", lambda *_: {})  # drawing takes longer than these curves
    np.savez(at_home / "twins.npz", M=np.eye(2), C=0.03 * np.eye(2), K=np.eye(2) + 0.05 * np.array([[1, -1], [-1, 1]]))
    return at_home


@slow
def test_twins_that_need_not_move_alike_have_two_mirrored_branches(
    home: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (home / "my.toml").write_text(CASE + "stability = true\nbranches = true\n")
    assert cli.main(["solve", "my.toml", "--out", "out", "--json", "--quiet"]) == 0
    curves = json.loads(capfd.readouterr().out)["curves"]
    labels = [item["label"] for item in curves]
    assert labels[:3] == ["level 1", "level 1, branch 1", "level 1, branch 2"]
    assert len(labels) % 2 == 1  # a branch to either side of each branch point
    points = [item for item in curves[0]["bifurcations"] if item["kind"] == "branch point"]
    data = xr.open_dataset(home / "out" / "my_response.nc", engine="h5netcdf")
    one, other = (data.isel(point=np.flatnonzero(data["curve"] == number)) for number in (1, 2))
    # Each begins at a branch point, and they are mirror images: rounding of two continuations.
    assert np.abs(np.array([item["frequency_hz"] for item in points]) - float(one["frequency"][0])).min() < 1e-9
    motion, mirrored = (entry["output_real"].values for entry in (one, other))  # sensors last
    np.testing.assert_allclose(motion, mirrored[..., ::-1], rtol=0, atol=1e-6 * np.abs(motion).max())
    assert not np.allclose(motion, motion[..., ::-1], rtol=0, atol=0.1 * np.abs(motion).max())


def test_branches_without_stability_are_refused(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (home / "my.toml").write_text(CASE + "branches = true\n")
    assert cli.main(["solve", "my.toml", "--out", "out"]) == 2
    assert "give stability = true" in capfd.readouterr().err
