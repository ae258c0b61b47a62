"""A chain of three masses whose campaign hides a law at the second one."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.model import Model, Sensor
from correlation.noise.nuisance import Budget
from correlation.prediction import Points, Predictor
from diagnosis.fit.arrangement import Arrangement, arrange
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from reduction.jointed_system import Joint, JointedSystem, Play

PLACES = {f"m{number}": np.eye(3)[number] for number in range(3)}
SECOND = PLACES["m1"]
LEVELS, FREQUENCIES, NOISE = (0.08, 0.2, 0.3, 0.4), np.linspace(12.0, 13.6, 13), 2e-3
#: Clearance [m] and stiffness [N/m] of the play, about half of the largest motion and 5 % of the modal stiffness.
CLEARANCE, STIFF = 4e-4, 2e3


def make_chain() -> Model:
    spring = 4e4
    stiffness = spring * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    force = np.zeros((2, 3))
    force[1, 2] = 1.0
    system = JointedSystem(mass=1.2 * np.eye(3), damping=2.5e-4 * stiffness, stiffness=stiffness, harmonic_force=force)
    sensors = tuple(Sensor(name=f"at {name}", row=row) for name, row in PLACES.items())
    return Model(system=system, places=PLACES, sensors=sensors)


def measure(model: Model, joints: Sequence[Joint], harmonics: Sequence[int]) -> Campaign:
    """Two noisy repeats of a model with further joints; the last but one level is held out."""
    sensors = [item.name for item in model.sensors]
    grid = np.array(np.meshgrid(LEVELS, FREQUENCIES, range(3), harmonics, indexing="ij")).reshape(4, -1)
    points = Points(
        free=np.zeros(grid.shape[1], dtype=bool), level=grid[0], frequency=grid[1],
        sensor=np.array(sensors)[grid[2].astype(int)], harmonic=grid[3].astype(int),
    )  # fmt: skip
    made = model.with_system(joints=[*model.system.joints, *joints])
    value = Predictor(points=points, sweeps=(1,)).predict(made).value
    random, n = np.random.default_rng(7), grid.shape[1]
    floor = NOISE * np.abs(value[grid[3] == 1]).min()
    repeats = []
    for _ in range(2):
        error = random.standard_normal((4, n)) / np.sqrt(2)
        repeats.append(value * (1 + NOISE * (error[0] + 1j * error[1])) + floor * (error[2] + 1j * error[3]))
    twice = np.tile(grid, 2)
    return Campaign(
        title="chain", folder=Path(), tests=(Test(name="stepped"),),
        sensors=tuple(MeasuredSensor(name=name, quantity="displacement", place=name[3:]) for name in sensors),
        measurement=Measurement(
            test=np.zeros(2 * n), order=np.arange(2 * n), repeat=np.repeat([1, 2], n), sweep=np.ones(2 * n),
            level=twice[0], frequency=twice[1], sensor=twice[2], harmonic=twice[3], value=np.concatenate(repeats),
        ),
        held_out=HeldOut(levels=(0.3,)),
    )  # fmt: skip


def arranged(joints: Sequence[Joint], harmonics: Sequence[int]) -> Arrangement:
    model = make_chain()
    calibration = list_calibration_parameters(model, deviation={"E": 0.005})
    budget = Budget(frequency=1e-4, compliance=0.0, shares=0.0)
    return arrange(measure(model, joints, harmonics), model, calibration, budget)


def play() -> list[Joint]:
    return [Play(name="hidden", direction=SECOND, stiffness=STIFF, gap=CLEARANCE)]
