"""Steady states at measured motions, beside those under the given force and closed forms of one degree of freedom."""

from typing import Any

import numpy as np
import pytest
import scipy.optimize

from correlation.model import Model, Sensor
from correlation.prediction import Points, Predictor
from correlation.response_control import ControlledPredictor, Fold
from reduction.joint_law.cubic_spring import CubicSpring
from reduction.joint_law.jenkins import JenkinsElement
from reduction.joint_law.registry import Joint
from reduction.jointed_system import JointedSystem

MASS, STIFFNESS, RATIO = 1.3, 5e5, 0.004
DAMPING, CUBIC = 2 * RATIO * np.sqrt(STIFFNESS * MASS), 2e11


def oscillator(*joints: Joint, n_harmonic: int = 12) -> Model:
    system = JointedSystem(
        mass=[[MASS]], damping=[[DAMPING]], stiffness=[[STIFFNESS]], joints=joints, static_load=np.zeros(1),
        harmonic_force=np.array([[0], [1.0]]),
    )  # fmt: skip
    row = np.ones(1)
    sensors = (Sensor(name="tip", row=row), Sensor(name="accelerometer", row=row, quantity="acceleration"))
    return Model(system=system, sensors=sensors, places={"tip": row}, n_harmonic=n_harmonic)


def slider(stiffness: float = 1e5) -> JenkinsElement:
    return JenkinsElement(name="slider", direction=np.ones(1), tangential_stiffness=stiffness, limit_force=4.0)


CUBIC_SPRING = CubicSpring(name="cubic", direction=np.ones(1), stiffness=CUBIC)


def make_points(frequency: np.ndarray, force: float = 1.0, *, names: tuple[str, ...] = ("tip",)) -> Points:
    k = len(frequency) * len(names)
    return Points(
        free=np.zeros(k, dtype=bool), level=np.full(k, force), frequency=np.tile(frequency, len(names)),
        sensor=np.repeat(names, len(frequency)), harmonic=np.ones(k, dtype=np.int64),
    )  # fmt: skip


def control(points: Points, measured: np.ndarray, *folds: Fold) -> ControlledPredictor:
    motion = points.harmonic == 1
    return ControlledPredictor(points=points, measured=measured, motion=motion, folds=folds)


@pytest.mark.parametrize("joint", [CUBIC_SPRING, slider()], ids=["cubic", "jenkins"])
def test_a_model_that_moves_as_it_does_needs_its_own_force(joint: Joint) -> None:
    model = oscillator(joint)
    points = make_points(np.linspace(90, 115, 11), names=("tip", "accelerometer"))
    own = Predictor(points=points).predict(model).value
    held = control(points, own).predict(model)
    # Newton's method ends at 1e-9 of the linear motion.
    np.testing.assert_allclose(held.value, own, rtol=1e-7)


def test_readings_of_all_harmonics_and_contact_forces_agree(small: Model, paper: Any) -> None:
    """Friction, lift-off, static parts and two configurations."""
    points = paper.make_points(small)
    # The sliders of a state are those that the last one left.
    own = Predictor(points=points, sweeps=(1,)).predict(small).value
    motion = (points.harmonic == 1) & np.isin(points.sensor, ["tip", "root"])
    held = ControlledPredictor(points=points, measured=own, motion=motion).predict(small)
    assert np.isfinite(held.value).all()
    # Where contacts slip a state is known to the tolerance of Newton's method over its condition.
    np.testing.assert_allclose(held.value, own, rtol=1e-5, atol=1e-9 * np.abs(own).max())


def test_the_force_of_a_duffing_oscillator_is_its_describing_function() -> None:
    frequency, amplitude = np.array([95.0, 99.0, 104.0]), np.array([1e-4, 3e-4, 6e-4])
    points = make_points(frequency, force=2.0)
    value = control(points, amplitude.astype(complex)).predict(oscillator(CUBIC_SPRING, n_harmonic=2)).value
    omega = 2 * np.pi * frequency
    # One harmonic alone: F / X = k - m w^2 + 3/4 k3 A^2 + i c w.
    stiffness = STIFFNESS - MASS * omega**2 + 0.75 * CUBIC * amplitude**2 + 1j * DAMPING * omega
    np.testing.assert_allclose(points.force / value, stiffness, rtol=1e-8)


def test_states_between_the_folds_are_found() -> None:
    """Under a given force the middle branch is unstable; under response control it is one of many states."""
    model, point = oscillator(CUBIC_SPRING), make_points(np.array([105.0]), 2.0)
    amplitude = np.geomspace(5e-5, 1.2e-3, 40)
    value = np.array([control(point, np.array([a + 0j])).predict(model).value[0] for a in amplitude])
    needed = 2.0 * amplitude / np.abs(value)
    # Up, down and up again: an S.
    turns = np.flatnonzero(np.diff(np.sign(np.diff(needed))))
    assert len(turns) == 2


@pytest.mark.parametrize("leaves_upper", [True, False])
def test_folds_are_the_extrema_of_the_s_curve(*, leaves_upper: bool) -> None:
    omega = 2 * np.pi * 105.0

    def force(amplitude: float) -> float:
        return float(abs(STIFFNESS - MASS * omega**2 + 0.75 * CUBIC * amplitude**2 + 1j * DAMPING * omega) * amplitude)

    resonance = np.sqrt((MASS * omega**2 - STIFFNESS) / (0.75 * CUBIC))
    sign, bounds = (1, (0.8 * resonance, 1.2 * resonance)) if leaves_upper else (-1, (1e-6, 0.8 * resonance))
    exact = scipy.optimize.minimize_scalar(lambda a: sign * force(a), bounds=bounds, options={"xatol": 1e-12})
    fold = Fold(False, "tip", 105.0, 2.0, 0.4 * resonance, resonance, leaves_upper)
    points = make_points(np.array([105.0]), 2.0)
    result = control(points, np.array([1e-4 + 0j]), fold).predict(oscillator(CUBIC_SPRING, n_harmonic=2))
    # 48 amplitudes over a factor of ten, and a parabola through three of them: the upper fold is a sharp minimum.
    assert 2.0 * result.fold[0] == pytest.approx(sign * exact.fun, rel=0.02)


def test_a_linear_model_has_no_fold() -> None:
    fold = Fold(False, "tip", 105.0, 2.0, 1e-4, 4e-4, True)
    points = make_points(np.array([105.0]), 2.0)
    result = control(points, np.array([1e-4 + 0j]), fold).predict(oscillator())
    assert np.isnan(result.fold).all()


def test_a_prediction_nearby_saves_time_and_changes_nothing() -> None:
    points = make_points(np.linspace(95, 115, 9))
    measured = Predictor(points=points).predict(oscillator(slider())).value
    stiffer = oscillator(slider(1.1e5))
    held = control(points, measured)
    before = held.predict(oscillator(slider()))
    np.testing.assert_allclose(held.predict(stiffer, before).value, held.predict(stiffer).value, rtol=1e-7)
