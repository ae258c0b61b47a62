"""The backbone of a model: against the closed forms of one degree of freedom."""

from collections.abc import Callable

import numpy as np
import pytest

from correlation.data_type.backbone import predict_backbone
from correlation.errors import CampaignError
from correlation.model import Model
from reduction.joint_law.cubic_spring import CubicSpring
from reduction.joint_law.jenkins import JenkinsElement

MASS, STIFFNESS, RATIO = 1.3, 5e5, 0.004


def test_a_linear_oscillator_has_its_own_frequency_and_damping(oscillator: Callable[..., Model]) -> None:
    frequency, damping = predict_backbone(oscillator(), "tip", 90.0, np.array([1e-6, 1e-4, 1e-2]))
    assert frequency == pytest.approx(np.sqrt(STIFFNESS / MASS) / (2 * np.pi), rel=1e-7)
    assert damping == pytest.approx(RATIO, rel=1e-6)


def test_a_duffing_oscillator_follows_its_backbone(oscillator: Callable[..., Model], cubic: CubicSpring) -> None:
    amplitude = np.geomspace(2e-5, 5e-4, 5)
    frequency, damping = predict_backbone(oscillator(cubic), "tip", 98.0, amplitude)
    # With q = 3 k3 A^2 / (4 k) the exact backbone leaves that of one harmonic by q^2 / 24 or so: here 2e-4 at most.
    one_harmonic = np.sqrt((STIFFNESS + 0.75 * cubic.stiffness * amplitude**2) / MASS) / (2 * np.pi)
    assert frequency == pytest.approx(one_harmonic, rel=3e-4)
    # Viscous damping: zeta = c / (2 m omega).
    expected = RATIO * np.sqrt(STIFFNESS / MASS) / (2 * np.pi * one_harmonic)
    assert damping == pytest.approx(expected, rel=3e-3)


def test_a_jenkins_oscillator_follows_its_describing_function(
    oscillator: Callable[..., Model], jenkins: JenkinsElement
) -> None:
    amplitude = np.array([2e-5, 6e-5, 1e-4, 3e-4, 1e-3])
    frequency, damping = predict_backbone(oscillator(jenkins), "tip", 108.0, amplitude)
    kt, limit = jenkins.tangential_stiffness, jenkins.limit_force
    slip = np.minimum(limit / (kt * amplitude), 1.0)
    # First harmonic of the force of a bilinear hysteresis under a sine (Caughey 1960).
    theta = np.arccos(1 - 2 * slip)
    stiffness = STIFFNESS + kt / np.pi * (theta - np.sin(2 * theta) / 2)
    work = 4 * limit * np.maximum(amplitude - limit / kt, 0.0)
    omega = np.sqrt(stiffness / MASS)
    # The motion is not quite a sine: higher harmonics change its frequency by some 1e-4, damping by some 1e-2.
    assert frequency == pytest.approx(omega / (2 * np.pi), rel=3e-4)
    viscous = RATIO * np.sqrt(STIFFNESS / MASS) / omega
    assert damping == pytest.approx(viscous + work / (2 * np.pi * MASS * omega**2 * amplitude**2), rel=0.02)


def test_amplitudes_are_those_of_the_sensor(oscillator: Callable[..., Model], jenkins: JenkinsElement) -> None:
    model, displacement = oscillator(jenkins), np.array([3e-4])
    frequency, damping = predict_backbone(model, "tip", 108.0, displacement)
    acceleration = (2 * np.pi * frequency) ** 2 * displacement
    again = predict_backbone(model, "accelerometer", 108.0, acceleration)
    # The curve is interpolated between levels a quarter apart.
    assert again[0] == pytest.approx(frequency, rel=1e-4)
    assert again[1] == pytest.approx(damping, rel=1e-2)


def test_a_sensor_that_there_is_not_is_named(oscillator: Callable[..., Model]) -> None:
    with pytest.raises(CampaignError, match='"top"'):
        predict_backbone(oscillator(), "top", 98.0, np.array([1e-5]))


def test_a_mode_that_the_model_lacks_has_no_backbone(oscillator: Callable[..., Model]) -> None:
    frequency, damping = predict_backbone(oscillator(), "tip", 300.0, np.array([1e-5]))
    assert np.isnan(frequency).all()
    assert np.isnan(damping).all()
