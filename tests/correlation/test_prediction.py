"""Predictions are what the solver says at a point, and their derivatives what differences of predictions say."""

from collections.abc import Callable
from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from correlation import model_solver
from correlation.feature.vector import FeatureVector
from correlation.model import Model
from correlation.model_solver import ModelSolver, Tangent
from correlation.prediction import Prediction, Predictor
from hbsolve.balance import HarmonicBalance
from hbsolve.contact_motion import contact_motion
from hbsolve.errors import NoSteadyState
from hbsolve.model_rates import MatrixParameter, ModelParameter
from hbsolve.steady_state import steady_state

NOTHING = ModelParameter()


@pytest.fixture(scope="module")
def predicted(small: Model, paper: ModuleType) -> Prediction:
    return Predictor(points=paper.make_points(small)).predict(small)


def test_predictions_are_what_the_solver_says(small: Model, predicted: Prediction) -> None:
    points = predicted.points
    frequency, level = 25.0, 3.0
    balance = HarmonicBalance(system=small.system, n_harmonic=small.n_harmonic, n_sample=small.n_sample, level=level)
    omega = 2 * np.pi * frequency
    state = steady_state(balance, omega)
    motions = contact_motion(balance, state)
    assert any(np.ravel(motion.share)[0] < 1 for motion in motions), "some contacts slip: all of the model is asked"
    wave = np.exp(-2j * np.pi * np.arange(motions[0].force.shape[1]) / motions[0].force.shape[1])
    left = sum(motion.force for motion in motions[:2])
    expected = {
        ("tip", 1): state.coefficients[1, 2],
        ("tip", 3): state.coefficients[3, 2],
        ("root", 1): -1.02 * omega**2 * state.coefficients[1, 0],
        ("left_T", 1): 2 * np.mean(left[0] * wave),
        ("left_N", 1): 1.5 * 2 * np.mean(left[1] * wave),
        ("left_N", 0): 1.5 * np.mean(left[1]),
    }
    here = ~points.free & (points.level == level) & (points.frequency == frequency)
    assert here.sum() == len(expected)
    for row in np.flatnonzero(here):
        name = (str(points.sensor[row]), int(points.harmonic[row]))
        # Newton stops at 1e-9 of the motion; forces of stiff contacts, and of a third harmonic, are a few times worse.
        assert predicted.value[row] == pytest.approx(expected[name], rel=1e-6), name


def test_without_contacts_the_receptance_is_predicted(small: Model, predicted: Prediction) -> None:
    points, system = predicted.points, small.system
    for row in np.flatnonzero(points.free):
        omega = 2 * np.pi * points.frequency[row]
        dynamic = system.stiffness - omega**2 * system.mass + 1j * omega * system.damping
        motion = np.linalg.solve(dynamic, points.level[row] * np.array([0.0, 0.0, 1.0, 0.0]))
        exact = motion[2] if points.sensor[row] == "tip" else -1.02 * omega**2 * motion[0]
        # Direct: round-off of a modal sum.
        assert predicted.value[row] == pytest.approx(exact, rel=1e-10)


def test_a_prediction_nearby_as_a_start_changes_nothing(small: Model, predicted: Prediction) -> None:
    changed = small.with_system(damping=1.02 * small.system.damping)
    predictor = Predictor(points=predicted.points)
    fresh, started = predictor.predict(changed), predictor.predict(changed, predicted)
    # Both stop at Newton's 1e-9 of the motion; third harmonics are 1e-2 of it.
    size = np.abs(fresh.value)
    by_sensor = np.array([size[predicted.points.sensor == name].max() for name in predicted.points.sensor])
    assert (np.abs(started.value - fresh.value) < 1e-7 * by_sensor).all()


def test_a_shift_reads_at_the_true_frequency(small: Model, predicted: Prediction) -> None:
    shift = 3e-3
    points = predicted.points
    where = points.free
    moved = Predictor(points=points).predict(small.with_frequency_shift("jointed", shift))
    labels = points.where(~where)
    object.__setattr__(labels, "frequency", labels.frequency * (1 + shift))
    exact = Predictor(points=labels).predict(small)
    np.testing.assert_array_equal(moved.value[where], predicted.value[where])
    # The same states, found from other starts: Newton's 1e-9 of the motion, of which a third harmonic is 1e-2.
    stuck = np.abs(exact.value) < 1e-12
    np.testing.assert_allclose(moved.value[~where][~stuck], exact.value[~stuck], rtol=1e-6, atol=0)


def mass(model: Model, by: float) -> Model:
    return model.with_system(mass=model.system.mass + by * np.diag([0.0, 0.0, 1.0, 0.0]))


def friction(model: Model, by: float) -> Model:
    return model.with_joints({name: {"friction_coefficient": 0.4 + by} for name in model.lines["left"]})


def static_load(model: Model, by: float) -> Model:
    return model.with_system(static_load=model.system.static + by * np.array([1.0, 0.0, 0.0, 0.0]))


def gain(model: Model, by: float) -> Model:
    return model.with_sensor("root", gain=1.02 + by)


def shift(model: Model, by: float) -> Model:
    return model.with_frequency_shift("jointed", by).with_frequency_shift("free", by)


ADDED = ModelParameter(matrices=MatrixParameter(mass=np.diag([0.0, 0.0, 1.0, 0.0])))
ROUGHER = ModelParameter(joints={(f"left {number}", "friction_coefficient"): 1.0 for number in range(2)})
CASES = {
    "matrix": (mass, 1e-5, ADDED, ADDED, {}),
    "joint": (friction, 1e-5, ROUGHER, NOTHING, {}),
    "load": (static_load, 1e-4, ModelParameter(static_load=np.array([1.0, 0.0, 0.0, 0.0])), NOTHING, {}),
    "gain": (gain, 1e-2, NOTHING, NOTHING, {"root": 1.0}),
}


def shares(found: np.ndarray, exact: np.ndarray, prediction: Prediction) -> np.ndarray:
    """Differences as shares of the largest derivative of the sensor, harmonic, level and configuration."""
    points = prediction.points
    keys = list(zip(points.free, points.level, points.sensor, points.harmonic, strict=True))
    largest = dict.fromkeys(keys, 0.0)
    for key, value, read in zip(keys, exact, prediction.value, strict=True):
        # Where all sticks, nothing changes: a unit that changes less than 1e-3 of a reading changes nothing.
        largest[key] = max(largest[key], abs(value), 1e-3 * abs(read), 1e-10)
    return np.abs(found - exact) / np.array([largest[key] for key in keys])


def differences(change: Callable[[Model, float], Model], step: float, small: Model, at: Prediction):
    predictor = Predictor(points=at.points)
    ends = [predictor.predict(change(small, side * step), at).value for side in (-1, 1)]
    return (ends[1] - ends[0]) / (2 * step)


@pytest.mark.parametrize("name", CASES)
def test_derivatives_are_those_of_predictions(name: str, small: Model, predicted: Prediction) -> None:
    change, step, jointed, free, gains = CASES[name]
    tangent = Tangent(jointed=jointed, free=free, gain=gains)
    result = Predictor(points=predicted.points).derivatives(small, predicted, [tangent])[:, 0]
    exact = differences(change, step, small, predicted)
    # Newton's 1e-9 over the step is less, mostly, as it converges quadratically; no instant begins to slip within it.
    assert shares(result, exact, predicted).max() < 1e-5


@pytest.mark.parametrize("name", ["damping", "structural_damping"])
def test_derivatives_hold_with_damping_that_is_not_symmetric(name: str, small: Model, predicted: Prediction) -> None:
    """What a sensor sees of a load is then not what a load at the sensor moves."""
    turn = np.zeros((4, 4))
    # Forces of both as large as one another, [N s/m] and [N/m], at the points' 20 to 30 Hz.
    turn[0, 2] = turn[1, 3] = {"damping": 30.0, "structural_damping": 5e3}[name]
    before = getattr(small.system, name)
    spinning = small.with_system(**{name: (0 if before is None else before) + turn - turn.T})
    at = Predictor(points=predicted.points).predict(spinning)
    change, step, jointed, free, gains = CASES["matrix"]
    tangent = Tangent(jointed=jointed, free=free, gain=gains)
    result = Predictor(points=at.points).derivatives(spinning, at, [tangent])[:, 0]
    # As above.
    assert shares(result, differences(change, step, spinning, at), at).max() < 1e-5


def test_a_late_sensor_reads_with_its_phase_turned_back_by_each_harmonic(small: Model, predicted: Prediction) -> None:
    late = 2e-4
    points = predicted.points
    result = Predictor(points=points).predict(small.with_sensor("root", delay=late), predicted).value
    turn = np.exp(-2j * np.pi * points.frequency * points.harmonic * late)
    expected = predicted.value * np.where(points.sensor == "root", turn, 1.0)
    assert np.abs(turn - 1).max() > 0.01
    # The same states, read at a time earlier: round-off.
    np.testing.assert_allclose(result, expected, rtol=1e-12, atol=0)


@pytest.mark.parametrize("offset", [0.0, 2e-4])
def test_derivatives_of_a_delay_are_those_of_predictions(offset: float, small: Model, paper: ModuleType) -> None:
    from diagnosis.fit.tangent import differentiate

    def delayed(model: Model, by: float) -> Model:
        return model.with_sensor("root", delay=offset + by).with_frequency_shift("jointed", by)

    (tangent,) = differentiate(
        lambda values: delayed(small, float(values[0])), np.zeros(1), np.array([1e-5]), [(-1e-3, 1e-3)]
    )
    predictor = Predictor(points=paper.make_points(small))
    at = predictor.predict(delayed(small, 0.0))
    result = predictor.derivatives(delayed(small, 0.0), at, [tangent])[:, 0]
    # As above.
    assert shares(result, differences(delayed, 1e-5, small, at), at).max() < 1e-5


@pytest.mark.parametrize("offset", [0.0, 0.02])
def test_derivatives_of_a_shift_are_those_of_predictions(offset: float, small: Model, paper: ModuleType) -> None:
    from diagnosis.fit.tangent import differentiate

    (tangent,) = differentiate(
        lambda values: shift(small, float(values[0])), np.array([offset]), np.array([1e-3]), [(-0.1, 0.1)]
    )
    moved = shift(small, offset)
    predictor = Predictor(points=paper.make_points(small))
    at = predictor.predict(moved)
    result = predictor.derivatives(moved, at, [tangent])[:, 0]
    exact = differences(shift, 1e-5, moved, at)
    # As above; the accelerometer's reading also grows with the square of the frequency.
    assert shares(result, exact, at).max() < 1e-5


def test_a_steady_state_that_is_not_found_is_no_number(small: Model, paper: ModuleType) -> None:
    points = paper.make_points(small)
    lost = Prediction(points=points, value=np.full(len(points), np.nan, dtype=complex), states={})
    tangent = Tangent(jointed=ADDED, free=ADDED, gain={})
    assert np.isnan(Predictor(points=points).derivatives(small, lost, [tangent])).all()


def test_a_missing_state_ends_a_prediction_that_needs_all(
    small: Model, paper: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    points = paper.make_points(small)
    monkeypatch.setattr(model_solver, "follow", lambda number, *_: number)  # Newton's method fails at each state
    monkeypatch.setattr(ModelSolver, "solve", lambda *_: None)
    assert np.isnan(Predictor(points=points).predict(small).value[~points.free]).all()
    with pytest.raises(NoSteadyState, match=r"no steady state at [\d.]+ N and [\d.]+ Hz"):
        Predictor(points=points, needs_all=True).predict(small)


@pytest.mark.parametrize("sweeps", [(), (1, -1)])
def test_a_measured_force_is_predicted_at_that_force(small: Model, paper: ModuleType, sweeps: tuple[int, ...]) -> None:
    points = paper.make_points(small)
    at_level = Predictor(points=points, sweeps=sweeps).predict(small)
    # The same forces, called by another level.
    renamed = replace(points, level=0.7 * points.level, force=points.level)
    at_force = Predictor(points=renamed, sweeps=sweeps).predict(small)
    assert np.array_equal(np.isnan(at_force.value), np.isnan(at_level.value))
    there = np.isfinite(at_level.value)
    assert at_force.value[there] == pytest.approx(at_level.value[there], rel=1e-12)
    stiffer = ModelParameter(matrices=MatrixParameter(stiffness=small.system.stiffness))
    tangents = [Tangent(jointed=stiffer, free=NOTHING, gain={})]
    slopes = [Predictor(points=p, sweeps=sweeps).derivatives(small, q, tangents)
              for p, q in ((points, at_level), (renamed, at_force))]  # fmt: skip
    assert slopes[1][there] == pytest.approx(slopes[0][there], rel=1e-9)
    features = [FeatureVector.choose(p, at_level.value, np.char.find(p.sensor, "left") < 0) for p in (points, renamed)]
    assert features[1].of_values(at_level.value) == pytest.approx(features[0].of_values(at_level.value), nan_ok=True)
