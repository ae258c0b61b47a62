"""Gains that nobody stated, of a model that is close to the measurements and of one that is far from them."""

from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, Drive, HeldOut, MeasuredSensor, Measurement, Test
from correlation.feature.observation import take_training_part
from correlation.model import Model, Sensor
from correlation.noise.nuisance import Budget
from correlation.prediction import Points, Predictor
from diagnosis.fit.unknown_gain import find_gains
from diagnosis.fit.weighting import FEW_DRAWS, Measured, make_comparison
from reduction.jointed_system import JointedSystem
from study.compare.unknown_gain import SetGains

GAIN, GRID = 40.0, np.linspace(8.5, 12.5, 41)


def oscillator(frequency: float, ratio: float = 0.01) -> Model:
    omega = 2 * np.pi * frequency
    system = JointedSystem(
        mass=[[1.0]], damping=[[2 * ratio * omega]], stiffness=[[omega**2]], harmonic_force=np.array([[0.0], [1.0]])
    )
    return Model(system=system, sensors=(Sensor(name="tip", row=np.ones(1)),), n_harmonic=2, n_sample=32)


def predicted(model: Model) -> NDArray[np.complex128]:
    k = len(GRID)
    points = Points(
        free=np.zeros(k, dtype=bool), level=np.ones(k), frequency=GRID, sensor=np.array(["tip"] * k),
        harmonic=np.ones(k, dtype=int),
    )  # fmt: skip
    return Predictor(points=points, sweeps=(1,)).predict(model).value


def measured(specimen: Model) -> Campaign:
    """Amplitudes in volts without a phase, of five repeats with noise of 0.2 %."""
    k, exact = len(GRID), GAIN * np.abs(predicted(specimen))
    noise = 1 + 2e-3 * np.random.default_rng(4).standard_normal((5, k))
    return Campaign(
        title="gain", folder=Path("gain"), tests=(Test(name="sine"),), held_out=HeldOut(), drive=Drive(),
        sensors=(
            MeasuredSensor(name="tip", quantity="displacement", direction="z", calibrated=False, has_phase=False),
        ),
        measurement=Measurement(
            test=np.zeros(5 * k, dtype=int), order=np.arange(5 * k), repeat=np.repeat(np.arange(1, 6), k),
            sweep=np.ones(5 * k, dtype=int), level=np.ones(5 * k), frequency=np.tile(GRID, 5),
            sensor=np.zeros(5 * k, dtype=int), harmonic=np.ones(5 * k, dtype=int),
            value=(exact * noise).ravel().astype(complex),
        ),
    )  # fmt: skip


def refined(specimen: Model, model: Model) -> tuple[float, float]:
    """Gain and its deviation."""
    campaign = measured(specimen)
    observed = take_training_part(campaign)
    gains = find_gains(model, campaign, observed, (1,))
    start, sides = gains.apply(model), Measured.prepare(observed, (1,))
    budget = Budget(frequency=1e-6, compliance=1e-6, shares=1e-6)
    comparison, _ = make_comparison(sides, start, sides.predictor.predict(start), budget, [], FEW_DRAWS, fitted=False)
    _, (gain,) = SetGains(setup=Mock(), gains=gains).refine(start, comparison)
    return gain.factor, gain.deviation


def test_the_gain_of_a_close_model_is_that_of_least_squares() -> None:
    gain, deviation = refined(oscillator(10.0), oscillator(10.0))
    # Five standard deviations of a mean of 205 readings with 0.2 % each.
    assert gain == pytest.approx(GAIN, rel=5 * 2e-3 / np.sqrt(5 * len(GRID)))
    assert deviation < 0.01 * gain


def test_the_gain_of_a_far_model_is_that_of_the_typical_reading() -> None:
    """Beside a sharp peak that a well damped model has elsewhere, least squares make all other readings too large."""
    specimen, model = oscillator(10.0, 0.005), oscillator(10.25, 0.03)
    gain, deviation = refined(specimen, model)
    ratio = np.median(np.log(np.abs(predicted(specimen) / predicted(model))))
    # Of 41 readings with noise of 0.2 % in the mean of five, which moves the median by less.
    assert gain == pytest.approx(GAIN * np.exp(ratio), rel=2e-3)
    assert deviation > 0.1 * gain
