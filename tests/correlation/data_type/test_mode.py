"""Measured modes: paired with those of the model by shape or by frequency."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.read_campaign import read_campaign
from correlation.data_type.mode import MeasuredMode, compute_mode_features, predict_mode
from correlation.errors import CampaignError
from correlation.model import Model, Sensor
from reduction.joint_law.jenkins import JenkinsElement
from reduction.jointed_system import JointedSystem


def make_chain() -> Model:
    """Two equal masses between three equal springs: 1 and sqrt(3) times sqrt(k / m), shapes (1, 1) and (1, -1)."""
    stiffness = 4e4 * np.array([[2.0, -1.0], [-1.0, 2.0]])
    system = JointedSystem(
        mass=np.eye(2), damping=1e-4 * stiffness, stiffness=stiffness, joints=[], static_load=np.zeros(2),
        harmonic_force=np.array([[0, 0], [1.0, 0]]),
    )  # fmt: skip
    sensors = tuple(Sensor(name=name, row=row) for name, row in zip(("a", "b"), np.eye(2), strict=True))
    return Model(system=system, sensors=sensors, n_harmonic=2)


def make_mode(frequency: float, **more: object) -> MeasuredMode:
    given = {"name": "m", "configuration": "jointed", "frequency_deviation": 0.01, "damping": 0.01,
             "damping_deviation": 0.001} | more  # fmt: skip
    return MeasuredMode(frequency=frequency, **given)  # type: ignore[arg-type]


@pytest.mark.parametrize(("number", "frequency"), [(1.0, 200.0), (np.sqrt(3), 200.0 * np.sqrt(3))])
def test_the_nearest_mode_has_its_closed_frequency_and_damping(number: float, frequency: float) -> None:
    predicted = predict_mode(make_chain(), make_mode(1.02 * frequency / (2 * np.pi)))
    assert predicted[0] == pytest.approx(frequency / (2 * np.pi))
    # zeta = beta omega / 2 of stiffness-proportional damping.
    assert predicted[1] == pytest.approx(1e-4 * frequency / 2)


def test_a_shape_decides_against_the_nearer_frequency() -> None:
    between = 1.4 * 200 / (2 * np.pi)
    lower, upper = 200 / (2 * np.pi), 200 * np.sqrt(3) / (2 * np.pi)
    for shape, expected in (([1.0, 0.9], lower), ([1.0, -0.8], upper)):
        mode = make_mode(between, sensors=("a", "b"), shape=np.array(shape))
        assert predict_mode(make_chain(), mode)[0] == pytest.approx(expected)


def test_a_mode_far_from_all_has_no_partner() -> None:
    assert np.isnan(predict_mode(make_chain(), make_mode(500.0))).all()


def test_contacts_of_a_jointed_test_are_stuck(oscillator: Callable[..., Model], jenkins: JenkinsElement) -> None:
    model = oscillator(jenkins)
    expected = np.sqrt((5e5 + jenkins.tangential_stiffness) / 1.3) / (2 * np.pi)
    assert predict_mode(model, make_mode(105.0))[0] == pytest.approx(expected)


def test_an_unknown_sensor_of_a_shape_is_named() -> None:
    with pytest.raises(CampaignError, match='"c"'):
        predict_mode(make_chain(), make_mode(35.0, sensors=("a", "c"), shape=np.ones(2)))


MANIFEST = """schema = 1
[[sensor]]
name = "tip"
quantity = "displacement"
direction = "z"
place = "tip"
[[mode]]
name = "first"
configuration = "free"
frequency = "122.25 Hz"
damping = "0.2 %"
"""


def test_modes_alone_make_a_campaign(tmp_path: Path) -> None:
    alone = "schema = 1\n[[mode]]" + MANIFEST.split("[[mode]]")[1]
    (tmp_path / "campaign.toml").write_text(alone, encoding="utf-8")
    (mode,) = read_campaign(tmp_path).data
    features = compute_mode_features(mode)
    assert features.value == pytest.approx([122.25, 0.002])
    assert (features.deviation > 0).all()
    assert features.unit == ("Hz", "-")


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('frequency = "122.25 N"', ["mode[1].frequency", "122.25 N"]),
        ('frequency = "-3 Hz"', ["mode[1].frequency", "above zero"]),
        ('damping = "2 Hz"', ["mode[1].damping"]),
        ('damping = "-0.2 %"', ["mode[1].damping", "above zero"]),
        ('frequency_deviation = "0 Hz"', ["mode[1].frequency_deviation", "above zero"]),
        ('damping_deviation = "-0.1 %"', ["mode[1].damping_deviation", "above zero"]),
        ("shape = { tip = 1.0 }", ["mode[1].shape"]),
        ("shape = { top = 1.0, tip = 2.0 }", ["mode[1].shape", '"top"']),
        ('colour = "red"', ["mode[1].colour"]),
    ],
)
def test_a_mistake_is_one_sentence_with_its_key(tmp_path: Path, line: str, words: list[str]) -> None:
    key = line.split(" = ")[0]
    lines = [text for text in MANIFEST.splitlines() if not text.startswith(f"{key} =")]
    (tmp_path / "campaign.toml").write_text("\n".join([*lines, line]), encoding="utf-8")
    with pytest.raises(CampaignError) as caught:
        read_campaign(tmp_path)
    for word in words:
        assert word in str(caught.value)
