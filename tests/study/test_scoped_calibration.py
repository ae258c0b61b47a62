"""Numbers of one joint are calibrated where a case accepts them, and stand in the case by their names."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.campaign.write_campaign import write_campaign
from correlation.prediction import Points, Predictor
from study import cli
from study.case.setup import read_case
from study.diagnose.add import undo

TRUE = {"lap.limit_force": 1.25, "lap.tangential_stiffness": 0.93}
LEVELS, FREQUENCIES, REPEATS, NOISE = (0.3, 1.0, 2.0, 4.0), np.linspace(43.0, 50.0, 15), 3, 0.003
CASE = """schema = 2
[structure]
kind = "plain"
file = "two.npz"
[structure.damping]
ratio = "0.5 %"
[[joint]]
kind = "iwan4"
name = "lap"
dof = 0
other = 1
tangential_stiffness = "0.3 N/um"
limit_force = "20 N"
exponent = -0.4
ratio = 0.5
[[load]]
dof = 1
[[sensor]]
name = "tip"
dof = 1
[sweep]
from = "43 Hz"
to = "50 Hz"
[numerical_error]
model = 0
frequency = 0
[accepted]
E = 0
"""
ACCEPTED = '"lap.limit_force" = "30 %"\n"lap.tangential_stiffness" = "20 %"\n'


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    np.savez(tmp_path / "two.npz", mass=np.eye(2), stiffness=np.array([[3e5, -1e5], [-1e5, 1e5]]))
    (tmp_path / "lap.toml").write_text(CASE + ACCEPTED, encoding="utf-8")
    model = read_case(tmp_path / "lap.toml").model
    joint = model.system.joints[0]
    true = model.with_joints({"lap": {key[4:]: factor * getattr(joint, key[4:]) for key, factor in TRUE.items()}})
    level, frequency = (item.ravel() for item in np.meshgrid(LEVELS, FREQUENCIES, indexing="ij"))
    n, one = len(level), np.ones(len(level), dtype=int)
    points = Points(free=one == 0, level=level, frequency=frequency, sensor=np.array(["tip"] * n), harmonic=one)
    exact = Predictor(points=points).predict(true).value
    real, imaginary = np.random.default_rng(0).standard_normal((2, REPEATS, n))
    write_campaign(
        Campaign(
            title="A bolted joint",
            folder=tmp_path,
            sensors=(MeasuredSensor(name="tip", quantity="displacement", direction="x", place="tip"),),
            tests=(Test(name="stepped"),),
            measurement=Measurement(
                test=np.tile(0 * one, REPEATS),
                order=np.arange(1, n * REPEATS + 1),
                repeat=np.repeat(np.arange(1, REPEATS + 1), n),
                sweep=np.tile(one, REPEATS),
                level=np.tile(level, REPEATS),
                frequency=np.tile(frequency, REPEATS),
                sensor=np.tile(0 * one, REPEATS),
                harmonic=np.tile(one, REPEATS),
                value=(exact + NOISE * np.abs(exact) * (real + 1j * imaginary)).ravel(),
            ),
            held_out=HeldOut(repeats=(3,)),
        ),
        tmp_path / "campaign",
    )
    return tmp_path


def test_limit_and_stiffness_of_an_iwan_joint_are_found_and_written(folder: Path) -> None:
    before = (folder / "lap.toml").read_bytes()
    assert cli.main(["calibrate", "lap.toml", "campaign", "--quiet"]) == 0
    result = tomllib.loads((folder / "lap.toml").read_text(encoding="utf-8"))["calibrated"]
    for name, factor in TRUE.items():
        assert result[name] == pytest.approx(factor, rel=0.01)
    joint = read_case(folder / "lap.toml").model.system.joints[0]
    assert joint.limit_force == pytest.approx(20.0 * result["lap.limit_force"])  # type: ignore[attr-defined]
    undo(folder / "lap.toml")
    assert (folder / "lap.toml").read_bytes() == before


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('"lap.limit_forc" = 0.2', "give one of tangential_stiffness, limit_force, exponent, ratio"),
        ('"lab.limit_force" = 0.2', "there are lap, all"),
        ("lap.limit_force = 0.2", '"lap.limit_force"'),
        ("zetta = 0.2", 'did you mean "zeta"?'),
        ('"lap.limit_force" = -0.1', "greater than or equal to 0"),
    ],
)
def test_what_cannot_be_calibrated_is_refused_in_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], line: str, words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    np.savez(tmp_path / "two.npz", mass=np.eye(2), stiffness=np.array([[3e5, -1e5], [-1e5, 1e5]]))
    (tmp_path / "lap.toml").write_text(CASE + line + "\n", encoding="utf-8")
    assert cli.main(["solve", "lap.toml"]) == 2
    assert words in capfd.readouterr().err
