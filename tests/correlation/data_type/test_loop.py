"""Loops: a Jenkins element under an imposed displacement against its closed form, and one in a vibrating structure."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from correlation.data_type.loop_prediction import predict_driven_loop, predict_imposed_loop, predict_loop
from correlation.data_type.measured_loop import ForceLoop, compute_loop_features
from correlation.errors import CampaignError
from correlation.model import Model, Sensor
from correlation.signal.loop import analyse_loop
from reduction.joint_law.friction_contact import FrictionContact
from reduction.joint_law.jenkins import JenkinsElement

STIFFNESS = 5e5
Make = Callable[..., Model]


def make_loop(jenkins: JenkinsElement, amplitude: float, *, place: str = "tip", offset: float = 0.0) -> ForceLoop:
    """Four quasi-static periods of the element in parallel with the spring."""
    displacement = offset + amplitude * np.cos(np.linspace(0, 8 * np.pi, 8001))
    slider, force = 0.0, []
    reach = jenkins.limit_force / jenkins.tangential_stiffness
    for x in displacement:
        slider = min(max(slider, x - reach), x + reach)
        force.append(STIFFNESS * x + jenkins.tangential_stiffness * (x - slider))
    return ForceLoop(
        name="loop", displacement=displacement, force=np.array(force), loops=analyse_loop(displacement, force),
        frequency=0.5, place=place,
    )  # fmt: skip


@pytest.mark.parametrize("ratio", [1.5, 4.0, 20.0])
def test_an_imposed_loop_has_the_work_and_stiffness_of_the_element(
    oscillator: Make, jenkins: JenkinsElement, ratio: float
) -> None:
    reach = jenkins.limit_force / jenkins.tangential_stiffness
    loop = make_loop(jenkins, ratio * reach)
    features = compute_loop_features(loop)
    work = 4 * jenkins.limit_force * (ratio - 1) * reach
    # 1000 samples a period: the corner of the loop is met to half a sample.
    assert features.value[0] == pytest.approx(work, rel=2e-3)
    predicted = predict_loop(oscillator(jenkins, n_harmonic=41), loop)
    # Forty harmonics round the corners of the loop.
    assert predicted[0] == pytest.approx(work, rel=5e-3)
    assert predicted[1] == pytest.approx(features.value[1], rel=0.01)
    assert features.unit == ("J", "N/m", "N")


def test_an_offset_of_the_displacement_moves_the_middle_of_the_force(oscillator: Make, jenkins: JenkinsElement) -> None:
    loop = make_loop(jenkins, 2e-4, offset=1e-4)
    predicted, measured = predict_loop(oscillator(jenkins, n_harmonic=41), loop), compute_loop_features(loop).value
    assert measured[2] == pytest.approx(STIFFNESS * 1e-4, rel=0.01)
    assert predicted[2] == pytest.approx(measured[2], rel=0.01)


def test_the_grip_imposes_the_displacement(oscillator: Make, jenkins: JenkinsElement) -> None:
    loop = make_loop(jenkins, 1e-4)
    curve = predict_imposed_loop(oscillator(jenkins), loop, loop.loops.plateaus[0])
    assert curve is not None
    # To the stiffness of the grip over that of the structure.
    assert np.ptp(curve[0]) / 2 == pytest.approx(1e-4, rel=1e-4)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_the_loop_of_a_line_resists_the_motion_that_its_sensor_reads(
    oscillator: Make, jenkins: JenkinsElement, way: float
) -> None:
    rub = FrictionContact(
        name="rub", normal=1e-6 * np.ones(1), tangents=np.ones(1), normal_stiffness=1.0, preload=10.0,
        tangential_stiffness=jenkins.tangential_stiffness, friction_coefficient=jenkins.limit_force / 10,
    )  # fmt: skip
    model = oscillator(rub, n_harmonic=41)
    sensor = Sensor(name="laser", row=way * np.ones(1))
    model = Model(**{**vars(model), "sensors": (sensor,), "lines": {"pad": ("rub",)}})
    amplitude = 3 * jenkins.limit_force / jenkins.tangential_stiffness
    loop = replace(make_loop(jenkins, amplitude), place=None, line="pad", sensor="laser", level=60.0, frequency=10.0)
    curve = predict_driven_loop(model, loop)
    assert curve is not None
    x, f = curve
    reach = jenkins.limit_force / jenkins.tangential_stiffness
    work = 4 * jenkins.limit_force * (np.ptp(x) / 2 - reach)
    # Forty harmonics round the corners of the loop.
    assert np.sum(f * np.roll(x, -1) - f * np.roll(x, 1)) / 2 == pytest.approx(work, rel=0.01)
    assert np.abs(f).max() == pytest.approx(jenkins.limit_force, rel=0.05)


def test_a_place_that_the_model_lacks_is_named(oscillator: Make, jenkins: JenkinsElement) -> None:
    with pytest.raises(CampaignError, match=r'"root".*tip'):
        predict_loop(oscillator(jenkins), make_loop(jenkins, 1e-4, place="root"))
