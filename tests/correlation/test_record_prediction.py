"""Integration of a model over a time record: exact solutions, an independent integrator, convergence, rates."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from correlation.campaign.time_record import TimeRecord
from correlation.errors import CampaignError
from correlation.model import Model, Sensor
from correlation.time_record.prediction import (
    IntegrationInput,
    estimate_numerical_error,
    predict_rates,
    predict_record,
    prepare_drive,
)
from geometry.errors import InputError
from reduction.jointed_system import (
    CubicSpring,
    ElasticStop,
    FrictionContact,
    JenkinsElement,
    Joint,
    JointedSystem,
    QuadraticDamper,
    along,
)
from tests.slow import slow

M = np.diag([1.0, 0.5])
K = np.array([[5e4, -2e4], [-2e4, 2e4]])  # resonances at 20.3 and 43.2 Hz
C = 2e-4 * K
RATE = 256.0  # Hz
EXCITER, TIP = along(2, {0: 1.0}), along(2, {1: 1.0})
CUBIC = CubicSpring(name="cubic", direction=TIP, stiffness=5e8)
AIR = QuadraticDamper(name="air", direction=EXCITER, damping=30.0)
STOP = ElasticStop(name="stop", direction=TIP - EXCITER, stiffness=5e3, gap=4e-4)


def model(*joints: Joint, static: float = 0.0) -> Model:
    system = JointedSystem(
        mass=M, damping=C, stiffness=K, joints=joints, static_load=np.array([0.0, static]),
        harmonic_force=np.array([[0.0, 0.0], [1.0, 0.0]]),
    )  # fmt: skip
    sensors = (
        Sensor(name="tip", row=TIP, gain=2.0),
        Sensor(name="speed", row=EXCITER, quantity="velocity"),
        Sensor(name="shock", row=TIP, quantity="acceleration", gain=-0.1),
    )
    return Model(system=system, sensors=sensors, places={"exciter": EXCITER, "tip": TIP})


def multisine(t: NDArray[np.float64] | float) -> NDArray[np.float64]:
    """Smooth from its start on: twelve sines that grow from nothing."""
    frequency = np.arange(5.0, 65.0, 5.0)
    phase = 2.39996 * np.arange(12) ** 2
    grown = 1 - np.exp(-((np.asarray(t) / 0.2) ** 4))
    return np.asarray(4.0 * grown * np.sin(2 * np.pi * np.multiply.outer(np.asarray(t), frequency) + phase).sum(-1))


def record(force: Callable[[NDArray[np.float64]], NDArray[np.float64]], n: int = 400) -> TimeRecord:
    time = np.arange(n) / RATE
    values = np.vstack([force(time), np.ones((3, n))])
    return TimeRecord(
        name="run", time=time, channels=("force", "tip", "speed", "shock"), units=("N", "m", "m/s", "m/s^2"),
        values=values, force="force",
    )  # fmt: skip


def integrated(test_model: Model, time: NDArray[np.float64], start: NDArray[np.float64]) -> NDArray[np.float64]:
    """What the sensors read, by an explicit Runge-Kutta method of order 8."""
    system = test_model.system

    def acceleration(t: float, x: NDArray[np.float64]) -> NDArray[np.float64]:
        q, v = x[:2], x[2:]
        force = system.dynamic[1].real * multisine(t) + system.static - C @ v - K @ q
        for joint in system.joints:
            row = joint.directions[0]
            if isinstance(joint, CubicSpring):
                force = force - row * joint.stiffness * (row @ q) ** 3
            elif isinstance(joint, QuadraticDamper):
                force = force - row * joint.damping * abs(row @ v) * (row @ v)
            elif isinstance(joint, ElasticStop):
                force = force - row * joint.stiffness * max(row @ q - joint.gap, 0.0)
        return np.asarray(np.linalg.solve(M, force))

    result = solve_ivp(
        lambda t, x: np.concatenate([x[2:], acceleration(t, x)]), (time[0], time[-1]), start, "DOP853", time,
        rtol=1e-10, atol=1e-13,
    )  # fmt: skip
    shock = [acceleration(t, x)[1] for t, x in zip(time, result.y.T, strict=True)]
    return np.stack([2.0 * result.y[1], result.y[2], -0.1 * np.array(shock)])


def errors(found: NDArray[np.float64], exact: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.linalg.norm(found - exact, axis=1) / np.linalg.norm(exact, axis=1))


def predicted(
    test_model: Model, driven: IntegrationInput, start: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    result = predict_record(test_model, driven, start)
    assert result is not None
    return result


def test_a_force_that_rises_evenly_is_answered_exactly() -> None:
    # One degree of freedom under f = a t from rest: u = a/k (t - 2 zeta/w + decaying part).
    m, c, k, a = 2.0, 40.0, 5e4, 7.0
    w, zeta = np.sqrt(k / m), c / (2 * np.sqrt(k * m))
    system = JointedSystem(mass=[[m]], damping=[[c]], stiffness=[[k]], harmonic_force=[[0.0], [1.0]])
    one = Model(system=system, sensors=(Sensor(name="u", row=np.ones(1)),))
    t = np.arange(300) / 50.0  # one step is more than a period: the exponential does not mind
    run = TimeRecord(name="ramp", time=t, channels=("f", "u"), units=("N", "m"), values=np.stack([a * t, t]), force="f")
    damped = w * np.sqrt(1 - zeta**2)
    decay = np.exp(-zeta * w * t)
    passing = 2 * zeta / w * np.cos(damped * t) + (2 * zeta**2 - 1) / damped * np.sin(damped * t)
    exact = a / k * (t - 2 * zeta / w + decay * passing)
    # Round-off of the exponential alone.
    np.testing.assert_allclose(predicted(one, prepare_drive(run, steps=1))[0], exact, atol=1e-12 * exact.max())


@pytest.mark.parametrize(
    ("joints", "tolerance"),
    [
        ((), 1e-4),
        pytest.param((CUBIC,), 4e-3, marks=slow),
        pytest.param((AIR,), 4e-3, marks=slow),
        ((CUBIC, AIR), 4e-3),
        ((STOP,), 4e-3),
    ],
    ids=["linear", "cubic", "air", "both", "stop"],
)
def test_the_integration_agrees_with_an_independent_integrator(joints: tuple[Joint, ...], tolerance: float) -> None:
    # 8 steps a sample are 47 a period of the second resonance: second order leaves (2 pi / 47)^2 / 12 = 1.5e-3 of the
    # joints' forces, and 9 times that of their third harmonics; the record's own force is right to the 1e-4 of its
    # interpolation.
    bench, run = model(*joints, static=0.5), record(multisine)
    exact = integrated(bench, run.time, np.zeros(4))
    inner = slice(0, -40)  # the force is not known beyond the record's end
    result = predicted(bench, prepare_drive(run))
    assert (errors(result[:, inner], exact[:, inner]) < tolerance).all()
    if joints:  # and the joints matter
        assert (
            errors(predicted(model(static=0.5), prepare_drive(run))[:, inner], exact[:, inner]).min() > 10 * tolerance
        )


def test_the_error_falls_with_the_square_of_the_step() -> None:
    bench, run = model(CUBIC, AIR), record(multisine)
    exact = integrated(bench, run.time, np.zeros(4))
    inner = slice(0, -40)
    result = [
        errors(predicted(bench, prepare_drive(run, steps=n))[:, inner], exact[:, inner]).max() for n in (4, 8, 16)
    ]
    order = np.log2(np.array(result[:-1]) / np.array(result[1:]))
    # The coarsest steps are 24 a period of the second resonance, where the next order still shows.
    np.testing.assert_allclose(order, 2.0, atol=0.15)
    # What the model says of its own error is that error, less the share of the finer steps.
    assert estimate_numerical_error(bench, prepare_drive(run, steps=4)) == pytest.approx(0.75 * result[0], rel=0.4)


def test_a_ring_down_starts_where_it_is_told() -> None:
    start = np.array([1e-3, -2e-3, 0.1, 0.0])
    run = record(np.zeros_like)
    silent = replace(run, channels=run.channels[1:], units=run.units[1:], values=run.values[1:], force=None)
    bench = model(CUBIC, AIR)
    still = bench.with_system(harmonic_force=np.zeros((2, 2)))
    # As above; accelerations at the start hold the cubic force in full.
    assert (errors(predicted(bench, prepare_drive(silent), start), integrated(still, run.time, start)) < 4e-3).all()


def test_rates_are_the_slopes_of_the_prediction() -> None:
    run = record(multisine)
    driven = prepare_drive(run, run_in=0.1)
    start = np.array([1e-4, 0.0, 0.0, 0.01])

    def bench(p: NDArray[np.float64]) -> Model:
        changed = model(
            replace(CUBIC, stiffness=p[0]), replace(AIR, damping=p[1]), replace(STOP, stiffness=p[2], gap=p[3])
        )
        return changed.with_system(mass=M + p[4] * np.outer(TIP, TIP), damping=p[5] * C).with_sensor("shock", gain=p[6])

    here = np.array([5e8, 30.0, 5e3, 4e-4, 0.01, 1.1, -0.1])

    def pair(number: int, size: float) -> tuple[Model, Model, float]:
        step = np.zeros(7)
        step[number] = size * max(abs(here[number]), 1e-3)
        return bench(here - step), bench(here + step), float(2 * step[number])

    basis = np.eye(4)[[1, 2]]
    rates = predict_rates(bench(here), driven, [pair(number, 1e-4) for number in range(7)], start, basis)
    for number in range(7):
        low, high, step = pair(number, 1e-5)
        slope = (predicted(high, driven, start) - predicted(low, driven, start)) / step
        # The integration is differentiated as it stands; a kink of the stop that moves past an instant is what is left.
        tolerance = 1e-3 if number == 3 else 1e-5
        assert np.linalg.norm(rates[number] - slope) < tolerance * np.linalg.norm(slope), number
    for rate, row, size in zip(rates[7:], basis, (1e-9, 1e-7), strict=True):
        ends = [predicted(bench(here), driven, start + side * size * row) for side in (1, -1)]
        slope = (ends[0] - ends[1]) / (2 * size)
        assert np.linalg.norm(rate - slope) < 1e-4 * np.linalg.norm(slope)


def test_a_model_that_runs_away_is_told_by_none() -> None:
    soft = model(replace(CUBIC, stiffness=-1e11))
    assert predict_record(soft, prepare_drive(record(multisine))) is None


def test_what_no_record_can_drive_is_refused() -> None:
    driven = prepare_drive(record(multisine))
    contact = FrictionContact(
        name="pad", normal=EXCITER, tangents=TIP, normal_stiffness=1e4, tangential_stiffness=1e4,
        friction_coefficient=0.5,
    )  # fmt: skip
    slider = JenkinsElement(name="slider", direction=TIP, tangential_stiffness=1e4, limit_force=1.0)
    for joint in (contact, slider):
        with pytest.raises(InputError, match=f'"{joint.name}" .*has sliders'):
            predict_record(model(joint), driven)
    with pytest.raises(InputError, match="harmonic 3"):
        predict_record(model().with_system(harmonic_force=np.array([[0, 0], [1, 0], [0, 0], [0, 1]])), driven)
    with pytest.raises(InputError, match="imaginary"):
        predict_record(model().with_system(harmonic_force=np.array([[0, 0], [1j, 0]])), driven)
    with pytest.raises(InputError, match="mass matrix"):
        predict_record(model().with_system(mass=np.diag([1.0, 0.0])), driven)
    with pytest.raises(InputError, match='no sensor "tip"'):
        predict_record(replace(model(), sensors=()), driven)


def test_a_record_without_what_it_needs_is_refused() -> None:
    run = record(multisine)
    with pytest.raises(CampaignError, match="run-in of 9 s"):
        prepare_drive(run, run_in=9.0)
    with pytest.raises(CampaignError, match="no channel but the force"):
        prepare_drive(run, sensors=())
    with pytest.raises(CampaignError, match='no channel "root"'):
        prepare_drive(run, sensors=("root",))
    with pytest.raises(CampaignError, match="0 steps"):
        prepare_drive(run, steps=0)
