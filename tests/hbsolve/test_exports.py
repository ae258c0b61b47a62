"""Curves and limits as tables and MATLAB files: the numbers of the result, named and with units."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.branch import ResponseBranch
from hbsolve.continuation.response import frequency_response
from hbsolve.errors import BalanceError
from hbsolve.limits.objective import OutputHarmonic
from hbsolve.limits.response_limits import limit_problem, response_limits
from hbsolve.limits.result import ResponseLimits
from hbsolve.limits.search import LimitSettings
from reduction.jointed_system import JenkinsElement, JointedSystem

SLIP = JenkinsElement(name="pad", direction=[0, 1], tangential_stiffness=3e4, limit_force=2.0)
SYSTEM = JointedSystem(
    mass=np.eye(2), damping=4 * np.eye(2), stiffness=[[8e4, -4e4], [-4e4, 8e4]], joints=[SLIP],
    harmonic_force=[[0, 0], [10, 0]],
)  # fmt: skip
BALANCE = HarmonicBalance(system=SYSTEM, n_harmonic=4)


@pytest.fixture(scope="module")
def curve() -> ResponseBranch:
    return frequency_response(BALANCE, 150.0, 400.0, step=20.0)


@pytest.fixture(scope="module")
def limits() -> ResponseLimits:
    problem = limit_problem(BALANCE, OutputHarmonic(row=0))
    return response_limits(problem, [190.0, 210.0], [0.5, 1.0], settings=LimitSettings(sample=5, population=4))


def test_a_table_of_a_curve_has_a_row_for_each_point(curve: ResponseBranch) -> None:
    table = curve.to_pandas({"tip": 1, "sum": np.ones(2)})
    assert len(table) == len(curve.frequency)
    np.testing.assert_array_equal(table["frequency [Hz]"], curve.frequency)
    read = table["sum amplitude [m]"] * np.exp(1j * np.radians(table["sum phase [deg]"]))
    # Round-off of an angle.
    np.testing.assert_allclose(read, curve.output(np.ones(2)), rtol=1e-12)
    third = curve.to_pandas({"tip": 1}, harmonic=3)
    np.testing.assert_allclose(third["tip of harmonic 3 amplitude [m]"], curve.amplitude(1, 3))
    shares = table[["pad stick [-]", "pad slip [-]", "pad separated [-]"]]
    np.testing.assert_allclose(shares.sum(axis=1), 1.0)
    assert (table["pad slip [-]"] > 0).any()
    with pytest.raises(BalanceError, match="harmonic"):
        curve.to_pandas({"tip": 1}, harmonic=9)


def test_a_matlab_file_of_a_curve_has_its_complex_coefficients(curve: ResponseBranch, tmp_path: Path) -> None:
    curve.save_matlab(tmp_path / "curve.mat")
    content = loadmat(tmp_path / "curve.mat", simplify_cells=True)
    np.testing.assert_array_equal(content["coefficients"], curve.coefficients)
    np.testing.assert_array_equal(content["angular_frequency"], curve.angular_frequency)
    assert content["units"]["coefficients"] == "m"
    assert content["dimensions"]["coefficients"] == "point harmonic degree_of_freedom"
    assert content["attributes"]["convention"].startswith("q(t) = Re")
    assert list(np.atleast_1d(content["joint_name"])) == ["pad"]
    with pytest.raises(BalanceError, match="there is no folder"):
        curve.save_matlab(tmp_path / "missing" / "curve.mat")


def test_the_same_curve_is_the_same_matlab_file_at_any_time(
    curve: ResponseBranch, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    curve.save_matlab(tmp_path / "now.mat")
    monkeypatch.setattr("time.asctime", lambda: "Thu Jan  1 00:00:00 1970")
    curve.save_matlab(tmp_path / "then.mat")
    assert (tmp_path / "now.mat").read_bytes() == (tmp_path / "then.mat").read_bytes()


def test_limits_as_a_table_and_a_matlab_file_are_the_same_numbers(limits: ResponseLimits, tmp_path: Path) -> None:
    table = limits.to_pandas()
    assert len(table) == 4
    for level, point in np.ndindex(2, 2):
        row = table[(table["level [-]"] == limits.level[level]) & (table["frequency [Hz]"] == limits.frequency[point])]
        assert row["lower"].item() == limits.lower[level, point]
        assert row["upper"].item() == limits.upper[level, point]
    limits.save_matlab(tmp_path / "limits.mat")
    content = loadmat(tmp_path / "limits.mat", simplify_cells=True)
    np.testing.assert_array_equal(content["value"], limits.value)
    np.testing.assert_array_equal(content["frequency"], limits.frequency)
    assert list(content["side_name"]) == ["lower", "upper"]
