"""A hardening structure with two states at one frequency: measured in closed form, diagnosed with a linear model."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.random_oscillators import Oscillator
from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.feature.observation import find_sweep_directions, split_held_out
from correlation.metric.jump_error import find_other_branch
from correlation.model import Dof, Model, Sensor
from correlation.noise.nuisance import Budget
from diagnosis.decision.verdict import Finding
from diagnosis.diagnose import Diagnosis, diagnose
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from diagnosis.fit.weighting import Measured
from reduction.jointed_system import JointedSystem
from tests.slow import slow

TRUTH = Oscillator(kind="hardening", frequency=50.0, damping=0.005, strength=0.05)
OMEGA = 2 * np.pi * 50.0
#: 3/4 k3 A^2 of a cubic spring is the element of the oscillator.
CUBIC = TRUTH.strength * OMEGA**2 / 0.75
LEVELS, GRID, NOISE = (0.3, 0.6, 0.9), np.linspace(48.5, 53.5, 21), 0.005
#: The model is softer than the structure, and less damped.
MODULUS, DAMPING = 0.995, 0.9


def make_model() -> Model:
    system = JointedSystem(
        mass=[[1.0]], damping=[[DAMPING * 2 * TRUTH.damping * OMEGA]], stiffness=[[MODULUS * OMEGA**2]], joints=[],
        static_load=np.zeros(1), harmonic_force=np.array([[0.0], [1.0]]),
    )  # fmt: skip
    row = np.ones(1)
    return Model(
        system=system, sensors=(Sensor(name="tip", row=row),), places={"tip": row}, n_harmonic=3,
        dofs=(Dof(body="beam", node=0, direction="z"),),
    )  # fmt: skip


def make_campaign() -> Campaign:
    """Two repeats of sweeps up and down; the highest level is held out."""
    random, columns = np.random.default_rng(2), []
    force = 0.01 * OMEGA**2
    for repeat in (1, 2):
        for level in LEVELS:
            for way in (1, -1):
                value = TRUTH.sweep(level * force, GRID, way)[::way]
                real, imaginary = random.standard_normal((2, len(GRID)))
                value = value * (1 + NOISE * (real + 1j * imaginary))
                n = len(GRID)
                columns.append((np.full(n, repeat), np.full(n, way), np.full(n, level * force), GRID[::way], value))
    repeat, sweep, level, frequency, value = (np.concatenate(item) for item in zip(*columns, strict=True))
    k = len(value)
    zero = np.zeros(k, dtype=int)
    return Campaign(
        title="hardening", folder=Path("hardening"), sensors=(MeasuredSensor(name="tip", quantity="displacement"),),
        tests=(Test(name="with"),), held_out=HeldOut(levels=(LEVELS[-1] * force,)),
        measurement=Measurement(
            test=zero, order=np.arange(k), repeat=repeat, sweep=sweep, level=level, frequency=frequency, sensor=zero,
            harmonic=zero + 1, value=value,
        ),
    )  # fmt: skip


@pytest.fixture(scope="module")
def found() -> Diagnosis[Arrangement]:
    model = make_model()
    return diagnose(make_campaign(), model, list_calibration_parameters(model), Budget(model=1e-3))


@slow
def test_the_cubic_is_named_with_its_strength(found: Diagnosis[Arrangement]) -> None:
    assert found.verdict.finding is Finding.MISSING
    (best,) = found.verdict.effects
    assert best.name == "cubic at tip"
    # Noise of 0.5 % in some 40 readings of either level; the model has the harmonics that the closed form lacks.
    assert best.strength == pytest.approx(CUBIC, rel=0.03)
    zeta, modulus = best.fit.values[:2]
    assert zeta * np.sqrt(MODULUS) == pytest.approx(np.sqrt(MODULUS) / DAMPING, rel=0.03)
    assert modulus == pytest.approx(1 / MODULUS, rel=1e-3)


@slow
def test_the_held_out_level_is_predicted_with_its_jumps(found: Diagnosis[Arrangement]) -> None:
    (best,) = found.verdict.effects
    # Of the error that is left, some is a point or two between a measured and a predicted jump.
    assert best.held_out_error < 0.1 < found.baseline.held_out_error


def test_points_on_the_other_branch_are_found() -> None:
    """A linear model has one state, which is not that of the upper branch."""
    campaign, model = make_campaign(), make_model()
    sweeps = find_sweep_directions(campaign)
    side = Measured.prepare(split_held_out(campaign)[1], sweeps)
    points, prediction = side.features.points, side.predictor.predict(model)
    other = find_other_branch(side.observed, prediction, sweeps)
    ratio = np.abs(np.log(np.abs(prediction.value / side.observed.value)))
    # At the ends of the grid both are nearly linear; between the folds one of the sweeps is a factor of five away.
    assert not other[(points.frequency < 49) | (points.frequency > 53)].any()
    assert other[(points.sweep == 1) & (ratio > np.log(4))].all()
    assert other.any()
