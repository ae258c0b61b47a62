"""A shaken base: relative motion under the inertia load, beside equations of the absolute motion."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from correlation.model import Model, Sensor
from correlation.prediction import Points, Predictor
from reduction.joint_law.cubic_spring import CubicSpring
from reduction.jointed_system import JointedSystem

MASS = np.diag([2.0, 1.0])
#: Springs and dashpots from the base to mass 0 and on to mass 1 [N/m, N s/m].
SPRING, DASHPOT = (4e4, 1e4), (30.0, 8.0)
STIFFNESS, DAMPING = (np.array([[a + b, -b], [-b, b]]) for a, b in (SPRING, DASHPOT))
QUANTITIES = ("displacement", "velocity", "acceleration")


def shaken(cubic: float = 0.0) -> Model:
    joints = [CubicSpring(name="cubic", direction=np.array([1.0, 0.0]), stiffness=cubic)] if cubic else []
    force = np.zeros((2, 2))
    force[1] = -MASS @ np.ones(2)
    system = JointedSystem(mass=MASS, damping=DAMPING, stiffness=STIFFNESS, joints=joints, harmonic_force=force)
    sensors = [Sensor(name=name, row=np.array([0.0, 1.0]), quantity=name) for name in QUANTITIES]
    sensors.append(Sensor(name="gauge", row=np.array([0.0, 1.0]), relative=True))
    return Model(system=system, sensors=tuple(sensors), base_acceleration=np.ones(2), n_harmonic=8, n_sample=128)


def readings(model: Model, frequency: np.ndarray, level: float, sweeps: tuple[int, ...] = ()) -> np.ndarray:
    names = [*QUANTITIES, "gauge"]
    k = len(frequency)
    points = Points(
        free=np.zeros(4 * k, dtype=bool), level=np.full(4 * k, level), frequency=np.tile(frequency, 4),
        sensor=np.repeat(names, k), harmonic=np.ones(4 * k, dtype=int),
    )  # fmt: skip
    return Predictor(points=points, sweeps=sweeps).predict(model).value.reshape(4, k)


def absolute(mass: np.ndarray, frequency: float, level: float) -> complex:
    """Absolute displacement of mass 1 whose base moves by -a / omega^2."""
    omega = 2 * np.pi * frequency
    base = -level / omega**2
    dynamic = STIFFNESS - omega**2 * mass + 1j * omega * DAMPING
    push = np.array([SPRING[0] + 1j * omega * DASHPOT[0], 0.0]) * base
    return complex(np.linalg.solve(dynamic, push)[1])


def test_linear_readings_are_those_of_the_absolute_equations() -> None:
    frequency, level = np.linspace(8.0, 40.0, 9), 3.0
    result = readings(shaken(), frequency, level)
    for number, at in enumerate(frequency):
        omega, x = 2 * np.pi * at, absolute(MASS, at, level)
        expected = [x, 1j * omega * x, -(omega**2) * x, x + level / omega**2]
        # Round-off of two small systems.
        np.testing.assert_allclose(result[:, number], expected, rtol=1e-9)


def test_a_nonlinear_structure_on_a_base_is_that_of_time_integration() -> None:
    """The absolute motion of both masses under the motion of the base, integrated to its steady state."""
    cubic, level, at = 3e10, 3.0, 16.0
    omega = 2 * np.pi * at
    period = 1 / at

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        base, speed = -level / omega**2 * np.cos(omega * t), level / omega * np.sin(omega * t)
        push = np.array([SPRING[0] * base + DASHPOT[0] * speed - cubic * (y[0] - base) ** 3, 0.0])
        return np.concatenate([y[2:], np.linalg.solve(MASS, push - STIFFNESS @ y[:2] - DAMPING @ y[2:])])

    times = np.linspace(80 * period, 81 * period, 257)[:-1]
    result = solve_ivp(rate, (0, 81 * period), np.zeros(4), t_eval=times, rtol=1e-9, atol=1e-12)
    x = 2 * np.mean(result.y[1] * np.exp(-1j * omega * times))
    found = readings(shaken(cubic), np.array([at]), level)[0, 0]
    linear = readings(shaken(), np.array([at]), level)[0, 0]
    assert abs(linear - x) > 0.02 * abs(x)
    # Seven harmonics leave 1e-5, and so does what is left of the start after eighty periods.
    assert found == pytest.approx(x, rel=1e-4)


def test_states_and_tracks_read_alike() -> None:
    """Of a sweep the states are read one by one and all together."""
    frequency = np.linspace(10.0, 30.0, 12)
    model = shaken(1e9)
    points = Points(
        free=np.zeros(12, dtype=bool), level=np.full(12, 3.0), frequency=frequency,
        sensor=np.full(12, "acceleration"), harmonic=np.ones(12, dtype=int),
    )  # fmt: skip
    predictor = Predictor(points=points, sweeps=(1,))
    prediction = predictor.predict(model)
    solver = predictor._solver(model, False)
    one = [
        solver.read(prediction.states[False, 3.0, at], np.array(["acceleration"]), np.array([1]))[0] for at in frequency
    ]
    np.testing.assert_allclose(prediction.value, one, rtol=1e-9)


def test_more_mass_is_more_inertia_load() -> None:
    heavier = MASS + np.diag([0.0, 0.4])
    result = readings(shaken().with_system(mass=heavier), np.array([12.0]), 3.0)[0, 0]
    assert result == pytest.approx(absolute(heavier, 12.0, 3.0), rel=1e-9)


def test_a_stronger_drive_shakes_and_reads_more() -> None:
    frequency = np.array([9.0, 21.0])
    doubled = readings(shaken().with_drive(2.0), frequency, 3.0)
    np.testing.assert_allclose(doubled, readings(shaken(), frequency, 6.0), rtol=1e-12)
    assert replace(shaken(), base_acceleration=None).with_drive(2.0).base_acceleration is None


def test_each_harmonic_of_a_base_is_read_with_its_own_motion() -> None:
    """The second harmonic of a linear structure is the absolute equation at twice the frequency."""
    second, level, frequency = 0.4 * np.exp(-0.8j), 3.0, np.linspace(8.0, 20.0, 5)
    accelerations = np.outer([0, 1, second], np.ones(2))
    model = replace(shaken().with_system(harmonic_force=-accelerations @ MASS), base_acceleration=accelerations)
    names, k = [*QUANTITIES, "gauge"], len(frequency)
    points = Points(
        free=np.zeros(4 * k, dtype=bool), level=np.full(4 * k, level), frequency=np.tile(frequency, 4),
        sensor=np.repeat(names, k), harmonic=np.full(4 * k, 2),
    )  # fmt: skip
    for sweeps in ((), (1,)):
        result = Predictor(points=points, sweeps=sweeps).predict(model).value.reshape(4, k)
        for number, at in enumerate(frequency):
            omega, x = 4 * np.pi * at, absolute(MASS, 2 * at, level) * second
            expected = [x, 1j * omega * x, -(omega**2) * x, x + level * second / omega**2]
            # Round-off of two small systems.
            np.testing.assert_allclose(result[:, number], expected, rtol=1e-9)


def test_another_mass_has_another_inertia_in_every_harmonic() -> None:
    accelerations = np.outer([0, 1, 0.4j], np.ones(2))
    model = replace(shaken().with_system(harmonic_force=-accelerations @ MASS), base_acceleration=accelerations)
    heavier = model.with_system(mass=MASS + np.diag([0.0, 0.5]))
    np.testing.assert_allclose(heavier.system.dynamic, -accelerations @ (MASS + np.diag([0.0, 0.5])))
