"""What used to be wrong without a word: levels, friction and slider positions that no structure has."""

from pathlib import Path

import numpy as np
import pytest

from casefile.errors import CaseError
from reduction.jointed_system import JointedSystem
from study.case.setup import read_case
from study.cli import main
from study.kind.registry import open_case
from study.limits.model import LimitSearch, make_limit_search
from study.solve.model import make_vibrating_model

CASE = """\
schema = 2
[structure]
kind = "plain"
file = "chain.npz"
[[joint]]
kind = "friction"
name = "rub"
normal = { dof = 1 }
tangent = { dof = 0 }
normal_stiffness = "1 N/um"
tangential_stiffness = "0.1 N/um"
friction_coefficient = 0.5
preload = "10 N"
[[static_load]]
dof = 1
force = "10 N"
[[static_load]]
dof = 0
force = "20 N"
[[load]]
dof = 0
amplitude = "1 N"
[[sensor]]
name = "mass"
dof = 0
quantity = "velocity"
[harmonics]
highest = 3
[limits]
frequencies = ["20 Hz"]
[sweep]
from = "20 Hz"
to = "30 Hz"
levels = [1]
"""


@pytest.fixture
def home(at_home: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    # Drawing takes longer than these curves.
    monkeypatch.setattr("study.solve.run._list_results", lambda *_: {})
    np.savez(at_home / "chain.npz", M=np.eye(2), C=5 * np.eye(2), K=np.diag([1e5, 1e6]))
    (at_home / "my.toml").write_text(CASE)
    return at_home


@pytest.mark.parametrize("level", ["1", "1e12"])
def test_a_motion_that_no_structure_makes_is_warned_of(
    home: Path, capfd: pytest.CaptureFixture[str], level: str
) -> None:
    """A velocity counts by its displacement."""
    (home / "my.toml").write_text(CASE.replace("levels = [1]", f"levels = [{level}]"))
    assert main(["solve", "my.toml", "--out", "out", "--quiet"]) == 0
    told = capfd.readouterr().err
    assert ("mass moves by" in told and "check levels, loads and units" in told) == (level == "1e12")


@pytest.mark.parametrize(
    "table",
    [
        'kind = "friction"\nname = "two"\nnormal = { dof = 1 }\ntangent = { dof = 0 }\nnormal_stiffness = "1 N/um"\n'
        'tangential_stiffness = "1 N/um"\nfriction_coefficient = MU\n',
        'name = "two"\nnormal = { dof = 1 }\ntangent = { dof = 0 }\nnormal_stiffness = "1 N/um"\n'
        'tangential_stiffness = "1 N/um"\nfriction_coefficient = [MU]\n',
    ],
    ids=["joint", "line"],
)
def test_a_friction_coefficient_that_is_a_percentage_without_its_sign_is_refused(home: Path, table: str) -> None:
    head = "[[joint]]\n" if table.startswith("kind") else "[[line]]\n"
    (home / "my.toml").write_text(CASE + head + table.replace("MU", "40"))
    with pytest.raises(CaseError, match=r"friction_coefficient.*40 is beyond that of any two solids .* in percent"):
        read_case(home / "my.toml")
    (home / "my.toml").write_text(CASE + head + table.replace("MU", '"40 %"'))
    assert sorted(joint.friction_coefficient for joint in joints(home)) == [0.4, 0.5]


def joints(home: Path) -> tuple:
    system: JointedSystem = read_case(home / "my.toml").model.system
    return tuple(system.joints)


def search_of(home: Path, line: str) -> LimitSearch:
    (home / "my.toml").write_text(CASE.replace("[limits]\n", f"[limits]\n{line}\n"))
    opened = open_case(home / "my.toml")
    case = opened.case
    return make_limit_search(case, case.limits, case.sweep, make_vibrating_model(read_case(opened)))


def test_the_box_of_limits_lies_about_rest_or_unmoved_or_given_sliders(home: Path) -> None:
    """Under 20 N the contact slips at 5 N, so that the spring of 1e5 N/m gives 150 um and the slider follows."""
    at_rest = search_of(home, "").nominal
    assert at_rest is not None
    # Of the 150 um the contact's spring of 1e5 N/m holds 50 um.
    assert at_rest[0] == pytest.approx(1e-4, rel=1e-6)
    for line, expected in (
        ('nominal = "stuck"', 0.0),
        ('nominal = ["-7 um"]', -7e-6),
        ('nominal = "rest"', at_rest[0]),
    ):
        nominal = search_of(home, line).nominal
        assert nominal is not None
        assert nominal[0] == pytest.approx(expected, abs=1e-12)
    with pytest.raises(CaseError, match="nominal has 2 values for 1 sliders: give one for each of rub"):
        search_of(home, 'nominal = ["1 um", "2 um"]')
    with pytest.raises(CaseError, match="nominal"):
        search_of(home, 'nominal = "free"')
