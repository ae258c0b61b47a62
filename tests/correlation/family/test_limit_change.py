"""Limits at other forces and preloads: of a contact that sticks in closed form, of one that slips by integration."""

import numpy as np

from benchmarks.family_coverage import STEPS_PER_PERIOD, frequencies, random_model
from correlation.family.limit_reading import LimitReadings, LimitStates, make_reading_objective, read_limits
from correlation.model import LineSensor, Model
from correlation.noise.nuisance import Budget
from hbsolve.balance import HarmonicBalance
from hbsolve.limits.problem import LimitCurve
from hbsolve.limits.response_limits import limit_problem
from hbsolve.limits.slider_bounds import make_slider_box
from hbsolve.steady_state import steady_state
from reduction.jointed_system import FrictionContact, JointedSystem
from transient.virtual_bench.sweep import VirtualSweepTest

EXACT = Budget(frequency=0.0, compliance=0.0, shares=0.0)
SPAN = 0.03

#: A mass on springs along x and y, pressed along y and rubbed along x.
MASS, STIFFNESS, DAMPING, LEVEL = 1.0, 1e6, 10.0, 2.0
KN, KT, MU, PRELOAD = 1e6, 2e6, 0.4, 20.0
OMEGA = np.array([600.0, 1100.0])


def rubbed_mass(static_load: list[float] | None = None) -> Model:
    contact = FrictionContact(
        name="a 0", normal=[0.0, 1.0], normal_stiffness=KN, preload=PRELOAD, tangents=[[1.0, 0.0]],
        tangential_stiffness=KT, friction_coefficient=MU,
    )  # fmt: skip
    system = JointedSystem(
        mass=MASS * np.eye(2), damping=DAMPING * np.eye(2), stiffness=STIFFNESS * np.eye(2), joints=[contact],
        harmonic_force=[[0.0, 0.0], [1.0, 0.0]], static_load=static_load,
    )  # fmt: skip
    sensor = LineSensor(name="T", line="a", component="tangential")
    return Model(system=system, sensors=(sensor,), lines={"a": ("a 0",)}, n_harmonic=4)


def room(force: float, more_normal: float) -> np.ndarray:
    """Static friction force that a contact which sticks has room for: mu N less what vibrates [N]."""
    normal = PRELOAD * STIFFNESS / (STIFFNESS + KN) + more_normal
    receptance = 1 / (STIFFNESS + KT - OMEGA**2 * MASS + 1j * OMEGA * DAMPING)
    return MU * normal - KT * np.abs(receptance) * force


def read_rubbed_mass() -> LimitReadings:
    model = rubbed_mass()
    balance = HarmonicBalance(system=model.system, n_harmonic=model.n_harmonic)
    box = make_slider_box(balance, balance.at(float(OMEGA[0])))
    problem = limit_problem(
        balance, make_reading_objective(model, model.sensors[0], 0), nominal=box.middle, reach=10 * box.static
    )
    motion, slider = [], []
    for sign in (-1, 1):
        # A slider that starts far away is dragged along as far as the contact sticks: the spring is left tight.
        dragged = [
            steady_state(balance.at_level(LEVEL), omega, slider=-sign * 10 * box.static).periodic_slider
            for omega in OMEGA
        ]
        motion.append(
            [
                steady_state(balance.at_level(LEVEL), omega, slider=w).motion
                for omega, w in zip(OMEGA, dragged, strict=True)
            ]
        )
        slider.append(dragged)
    states = LimitStates(sensor="T", harmonic=0, motion=np.array(motion), slider=np.array(slider))
    curve = LimitCurve(problem=problem, level=LEVEL, angular_frequency=OMEGA)
    (readings,) = read_limits(curve, model, EXACT, [states], force_span=SPAN, preload_span=SPAN)
    return readings


def test_a_contact_at_the_edge_of_slip_has_more_room_with_less_force_and_with_more_preload() -> None:
    readings = read_rubbed_mass()
    # A slider is searched for with 128 samples: 1 - cos(pi / 128) of what vibrates.
    tolerance = {"atol": 3e-4 * MU * PRELOAD}
    sides = np.array([[-1.0], [1.0]])
    np.testing.assert_allclose(readings.value, sides * room(LEVEL, 0.0), **tolerance)
    assert readings.by_force is not None
    for number, sign in enumerate((-1, -0.5, 0.5, 1)):
        forced, pressed = readings.by_force.value[number], readings.by_preload[0].value[number]
        np.testing.assert_allclose(forced, sides * room(LEVEL * np.exp(sign * SPAN), 0.0), **tolerance)
        more = (np.exp(sign * SPAN) - 1) * PRELOAD
        np.testing.assert_allclose(pressed, sides * room(LEVEL, more), **tolerance)
    # The changes are many times that.
    assert (np.abs(readings.by_force.value - readings.value) > 1e-3 * MU * PRELOAD).all()


def test_a_static_force_in_full_slip_at_another_force_is_that_of_integration_in_time() -> None:
    """With the harmonics of the search it would be 17 % off with less force."""
    model, level, span = random_model(14804), 0.3, 0.054
    assert model is not None
    balance = HarmonicBalance(system=model.system, n_harmonic=model.n_harmonic, n_sample=model.n_sample)
    (near, tangential, _) = model.sensors
    frequency = frequencies(model)[-1:]
    omega = 2 * np.pi * frequency
    result = np.array([steady_state(balance.at_level(level), item).motion for item in omega])
    problem = limit_problem(balance, make_reading_objective(model, tangential, 0), reach=1e-5)
    states = LimitStates(
        sensor=tangential.name, harmonic=0, motion=np.array([result, result]), slider=np.zeros((2, 1, 1))
    )
    curve = LimitCurve(problem=problem, level=level, angular_frequency=omega)
    (readings,) = read_limits(curve, model, EXACT, [states], force_span=span)
    assert readings.by_force is not None
    bench = VirtualSweepTest(model.system, {"near": near.row}, 2 * STEPS_PER_PERIOD)
    for number, sign in ((0, -1), (-1, 1)):
        # The bench's usual tolerance leaves several per cent of a static force.
        force = bench.sweep(frequency.tolist(), level * float(np.exp(sign * span)), tolerance=1e-6).force[0, 0, 0].real
        assert abs(force / readings.value[0, 0] - 1) > 0.1
        np.testing.assert_allclose(readings.by_force.value[number, :, 0], force, rtol=0.01)


def test_limits_of_a_contact_that_is_open_at_rest_are_read_at_other_preloads() -> None:
    """It is pulled off by more than it is pressed, whatever the preload, and reads no force."""
    model = rubbed_mass(static_load=[0.0, -2 * PRELOAD])
    balance = HarmonicBalance(system=model.system, n_harmonic=model.n_harmonic)
    free = [steady_state(balance.at_level(LEVEL), omega) for omega in OMEGA]
    motion, slider = np.array([state.motion for state in free]), np.array([state.initial_slider for state in free])
    problem = limit_problem(balance, make_reading_objective(model, model.sensors[0], 0), reach=1e-5)
    states = LimitStates(sensor="T", harmonic=0, motion=np.array([motion] * 2), slider=np.array([slider] * 2))
    curve = LimitCurve(problem=problem, level=LEVEL, angular_frequency=OMEGA)
    (readings,) = read_limits(curve, model, EXACT, [states], preload_span=SPAN)
    for value in (readings.value, readings.by_preload[0].value):
        np.testing.assert_allclose(value, 0.0, atol=1e-12 * PRELOAD)
