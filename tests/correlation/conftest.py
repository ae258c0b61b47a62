"""A small jointed structure that is tested on paper: exact predictions, known noise, known jitter."""

import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.model import Dof, LineSensor, Model, Sensor, StructurePart
from correlation.prediction import Points, Predictor
from reduction.jointed_system import FrictionContact, JointedSystem, along

#: Two masses that move in z and x, degrees of freedom 2 n and 2 n + 1.
N = 4
LEVELS = (0.3, 3.0)  # N: the contacts stick, and slip
#: Six frequencies around the first resonance of either configuration [Hz].
GRID = {False: (22.0, 23.5, 25.0, 26.5, 28.0, 29.5), True: (18.8, 19.6, 20.2, 20.6, 21.2, 22.2)}
#: Relative noise of real and imaginary part, and its floor as a share of the sensor's largest fundamental.
NOISE, FLOOR = 1e-3, 0.02


def contacts(name: str, side: float) -> list[FrictionContact]:
    """Two contacts of a line, between the masses (0) and (1)."""
    result = []
    for number, where in enumerate((0.4, 0.9)):
        z, x = along(N, {0: 1 - where, 2: where}), along(N, {1: 1 - where, 3: where})
        result.append(
            FrictionContact(
                name=f"{name} {number}",
                normal=side * (0.3 * z + 0.8 * x),
                tangents=0.9 * z,
                normal_stiffness=1e4,
                tangential_stiffness=5e3,
                friction_coefficient=0.4,
                preload=4.0,
            )
        )
    return result


def make_small() -> Model:
    mass = np.diag([1.0, 1.0, 0.8, 0.8])
    z = np.array([[7e4, -3e4], [-3e4, 3e4]])
    stiffness = np.zeros((N, N))
    stiffness[np.ix_([0, 2], [0, 2])] = z
    stiffness[np.ix_([1, 3], [1, 3])] = 30 * z
    joints = [*contacts("left", 1.0), *contacts("right", -1.0)]
    force = np.zeros((2, N))
    force[1, 2] = 1.0
    return Model(
        system=JointedSystem(
            mass=mass,
            damping=4 * mass + 1e-5 * stiffness,
            stiffness=stiffness,
            joints=joints,
            static_load=sum(joint.preload * joint.normal for joint in joints),
            harmonic_force=force,
        ),
        sensors=(
            Sensor(name="tip", row=along(N, {2: 1.0})),
            Sensor(name="root", row=along(N, {0: 1.0}), quantity="acceleration", gain=1.02),
            LineSensor(name="left_T", line="left", component="tangential"),
            LineSensor(name="left_N", line="left", component="normal", gain=1.5),
        ),
        parts=(StructurePart(name="beam", mass=mass, stiffness=stiffness),),
        dofs=tuple(Dof(body="beam", node=node, direction=axis) for node in range(2) for axis in ("z", "x")),
        lines={side: (f"{side} 0", f"{side} 1") for side in ("left", "right")},
        places={"root z": along(N, {0: 1.0}), "tip z": along(N, {2: 1.0})},
        n_harmonic=4,
        n_sample=64,
    )


def make_points(model: Model) -> Points:
    """Fundamentals of all sensors, the third harmonic of the tip with contacts, the mean normal force."""
    rows = []
    for free, grid in GRID.items():
        for level in LEVELS:
            for frequency in grid:
                rows += [(free, level, frequency, name, 1) for name in ("tip", "root")]
                if not free:
                    rows += [(free, level, frequency, name, 1) for name in ("left_T", "left_N")]
                    rows += [(free, level, frequency, "tip", 3), (free, level, frequency, "left_N", 0)]
    free, level, frequency, sensor, harmonic = zip(*rows, strict=True)
    return Points(
        free=np.array(free), level=np.array(level), frequency=np.array(frequency), sensor=np.array(sensor),
        harmonic=np.array(harmonic),
    )  # fmt: skip


def make_deviation(points: Points, value: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Standard deviation of real and imaginary part of a single reading, shape (k,)."""
    floor = np.empty(len(points))
    for name in np.unique(points.sensor):
        of = points.sensor == name
        floor[of] = FLOOR * np.abs(value[of & (points.harmonic == 1)]).max()
    return np.asarray(NOISE * np.hypot(np.abs(value), floor))


def make_campaign(
    truth: Model, *, jitter: float = 0.0, seed: int = 1, n_repeat: int = 4, held: tuple[int, ...] = (4,)
) -> Campaign:
    """Repeats of a structure: noise of each reading, and frequencies off by `jitter` from repeat to repeat."""
    generator, points, before = np.random.default_rng(seed), make_points(truth), None
    columns, sensors = [], [sensor.name for sensor in truth.sensors]
    for repeat in range(1, n_repeat + 1):
        model = truth
        for configuration in ("jointed", "free"):
            model = model.with_frequency_shift(configuration, jitter * float(generator.standard_normal()))
        before = Predictor(points=points).predict(model, before)
        deviation = make_deviation(points, before.value)
        real, imaginary = generator.standard_normal((2, len(points)))
        value = before.value + deviation * np.where(points.harmonic > 0, real + 1j * imaginary, real)
        sensor = np.array([sensors.index(name) for name in points.sensor])
        columns.append((points.free, np.full(len(points), repeat), points.level, points.frequency, sensor, value))
    free, number, level, frequency, sensor, value = (np.concatenate(item) for item in zip(*columns, strict=True))
    k = len(value)
    return Campaign(
        title="small",
        folder=Path("small"),
        sensors=tuple(
            MeasuredSensor(name=item.name, quantity=item.quantity)
            if isinstance(item, Sensor)
            else MeasuredSensor(name=item.name, quantity="contact force", line=item.line, component=item.component)
            for item in truth.sensors
        ),
        tests=(Test(name="with"), Test(name="without", configuration="free")),
        measurement=Measurement(
            test=free.astype(int), order=np.arange(k), repeat=number, sweep=np.ones(k, dtype=int), level=level,
            frequency=frequency, sensor=sensor, harmonic=np.tile(points.harmonic, n_repeat), value=value,
        ),
        held_out=HeldOut(repeats=held),
    )  # fmt: skip


@pytest.fixture(scope="session")
def small() -> Model:
    return make_small()


@pytest.fixture(scope="session")
def paper() -> ModuleType:
    """This file, with what makes points and campaigns."""
    return sys.modules[__name__]
