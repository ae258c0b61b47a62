"""Gains that nobody stated are found where the data tell them, and where they do not that is said."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign, Drive, HeldOut, MeasuredSensor, Measurement, Test
from correlation.feature.observation import take_training_part
from correlation.model import Model, Sensor
from correlation.noise.nuisance import Budget
from correlation.prediction import Points, Predictor
from diagnosis.fit.calibration import Ending, calibrate
from diagnosis.fit.fit_parameter import Unknowns
from diagnosis.fit.unknown_gain import SensorGains, describe_gain, find_gains
from diagnosis.fit.weighting import FEW_DRAWS, Measured, make_comparison
from hbsolve.errors import ModelError
from reduction.joint_law.cubic_spring import CubicSpring
from reduction.jointed_system import JointedSystem

NOISE, OMEGA = 2e-3, 2 * np.pi * 10.0
GRID, LEVELS = np.linspace(8.5, 12.5, 21), (0.3, 1.0)


def chain(cubic: float = 0.0) -> Model:
    """Two masses; the first has a cubic spring to the ground and carries the force."""
    stiffness = OMEGA**2 * np.array([[1.6, -0.6], [-0.6, 0.9]])
    joints = [CubicSpring(name="cubic", direction=np.array([1.0, 0.0]), stiffness=cubic * OMEGA**2)] if cubic else []
    force = np.zeros((2, 2))
    force[1, 0] = 1.0
    system = JointedSystem(
        mass=np.eye(2), damping=0.03 * OMEGA * np.eye(2), stiffness=stiffness, joints=joints, harmonic_force=force
    )
    sensors = tuple(Sensor(name=name, row=row) for name, row in zip(("root", "tip"), np.eye(2), strict=True))
    return Model(system=system, sensors=sensors, n_harmonic=2, n_sample=32)


def measured(model: Model, drive: float, tip: float, *, known: bool, seed: int = 1) -> Campaign:
    """Two levels of a drive [N per volt], a tip that reads in volts [V per metre], and a root in metres if known."""
    level = np.repeat(LEVELS, 2 * len(GRID))
    frequency = np.tile(np.repeat(GRID, 2), 2)
    number = np.tile([0, 1], len(level) // 2)
    k = len(level)
    points = Points(
        free=np.zeros(k, dtype=bool), level=level, frequency=frequency, sensor=np.array(["root", "tip"])[number],
        harmonic=np.ones(k, dtype=int),
    )  # fmt: skip
    driven = model.with_system(harmonic_force=drive * model.system.dynamic)
    exact = Predictor(points=points, sweeps=(1,)).predict(driven).value * np.where(number == 1, tip, 1.0)
    parts = NOISE * np.random.default_rng(seed).standard_normal((2, 3, k))
    sensors = (
        MeasuredSensor(name="root", quantity="displacement", direction="z", calibrated=known),
        MeasuredSensor(name="tip", quantity="displacement", direction="z", calibrated=False),
    )
    return Campaign(
        title="gain", folder=Path("gain"), sensors=sensors, tests=(Test(name="sine"),), held_out=HeldOut(),
        drive=Drive(unit="V", calibrated=False),
        measurement=Measurement(
            test=np.zeros(3 * k, dtype=int), order=np.arange(3 * k), repeat=np.repeat([1, 2, 3], k),
            sweep=np.ones(3 * k, dtype=int), level=np.tile(level, 3), frequency=np.tile(frequency, 3),
            sensor=np.tile(number, 3), harmonic=np.ones(3 * k, dtype=int),
            value=(exact * (1 + parts[0] + 1j * parts[1])).ravel(),
        ),
    )  # fmt: skip


def found(model: Model, campaign: Campaign) -> tuple[SensorGains, dict[str, tuple[float, float]]]:
    """Gains of the search, and after least squares with their deviations."""
    observed = take_training_part(campaign)
    gains = find_gains(model, campaign, observed, (1,))
    start = gains.apply(model)
    sides = Measured.prepare(observed, (1,))
    prediction = sides.predictor.predict(start)
    budget = Budget(frequency=1e-6, compliance=1e-6, shares=1e-6)
    comparison, _ = make_comparison(sides, start, prediction, budget, [], FEW_DRAWS, fitted=False)
    unknowns = Unknowns.from_effects(start, [(item, np.inf) for item in gains.parameters], ())
    fit = calibrate(comparison, unknowns, unknowns.vanishing, prediction, ending=Ending.EXACT)
    values = zip(gains.parameters, fit.values, fit.deviation, strict=True)
    return gains, {item.name: (item.start * a, item.start * b) for item, a, b in values}


@pytest.mark.parametrize(("cubic", "known"), [(0.5, True), (0.5, False), (0.0, True)])
def test_gains_that_the_data_tell_are_found(cubic: float, known: bool) -> None:
    # The force at which the cubic spring shows.
    model, drive, tip = chain(cubic), 1000.0, 3.7e4
    gains, values = found(model, measured(model, drive, tip, known=known))
    assert not gains.fixed
    exact = {"gain of drive": drive, "gain of tip": tip} | ({} if known else {"gain of root": 1.0})
    assert values.keys() == exact.keys()
    for name, (value, deviation) in values.items():
        assert deviation < 0.02 * exact[name]
        # Five standard deviations: one of some ten would leave them by chance in a million.
        assert abs(value - exact[name]) < 5 * deviation


@pytest.mark.parametrize("cubic", [0.0, 0.5])
def test_gains_of_drive_and_sensors_of_a_proportional_response_are_one(cubic: float) -> None:
    """Without a cubic spring, and with one whose share of the response is below the noise."""
    model, drive, tip = chain(cubic), 40.0, 3.7e4
    gains, values = found(model, measured(model, drive, tip, known=False))
    assert "[N per V] cannot be separated" in gains.fixed
    assert values.keys() == {"gain of tip", "gain of root"}
    for name, exact in (("gain of tip", drive * tip), ("gain of root", drive)):
        value, deviation = values[name]
        assert abs(value - exact) < 5 * deviation < 0.02 * exact


def test_a_calibrated_campaign_has_no_unknown_gain() -> None:
    campaign = measured(chain(), 1.0, 1.0, known=True)
    known = tuple(replace(sensor, calibrated=True) for sensor in campaign.sensors)
    gains = find_gains(chain(), replace(campaign, sensors=known, drive=Drive()), take_training_part(campaign), (1,))
    assert gains.parameters == ()
    assert gains.apply(chain()).sensors[0].gain == 1.0


@pytest.mark.parametrize("calibrated", [True, False])
def test_a_model_without_a_response_has_no_gains_and_says_so(calibrated: bool) -> None:
    campaign = measured(chain(), 1.0, 1.0, known=False)
    campaign = replace(campaign, drive=Drive(unit="V", calibrated=calibrated))
    massless = chain().with_system(mass=np.zeros((2, 2)))
    with pytest.raises(ModelError):
        find_gains(massless, campaign, take_training_part(campaign), (1,))


def test_a_gain_is_told_with_its_95_percent_interval() -> None:
    assert describe_gain("gain of tip", 1000.0, 50.0) == "gain of tip 1000 +- 98 (9.8 %)"
