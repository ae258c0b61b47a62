"""Motions with one kind of joint whose exact answer is known."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from hbsolve.joint_law.registry import FORCES
from reduction.joint_law.registry import LAWS
from reduction.jointed_system import (
    CubicSpring,
    ElasticStop,
    Friction,
    FrictionContact,
    JenkinsElement,
    Joint,
    JointedSystem,
    QuadraticDamper,
    along,
)
from tests.hbsolve import test_laws
from transient.integrate import Motion, integrate
from transient.joint_law.registry import TRANSIENT_LAWS
from transient.state import TransientState
from transient.steady import steady_motion

Vector = NDArray[np.float64]


def final(motion: Motion) -> Vector:
    return np.concatenate([motion.final.displacement, motion.final.velocity, motion.final.slider])


def at(displacement: list[float], velocity: list[float], slider: list[float] | None = None) -> TransientState:
    return TransientState(
        displacement=np.array(displacement), velocity=np.array(velocity), slider=np.array(slider or [])
    )


def errors(
    system: JointedSystem, omega: float, n_period: int, start: TransientState, exact: Vector, steps: list[int]
) -> Vector:
    return np.array([np.abs(final(integrate(system, omega, n_period, n, start)) - exact).max() for n in steps])


@pytest.mark.parametrize("joint", ["cubic", "damper"])
def test_smooth_joints_converge_with_order_two_to_an_independent_integrator(joint: str) -> None:
    omega = 1.2
    joints = {
        "cubic": CubicSpring(name="c", direction=np.array([1.0, -1.0]), stiffness=0.8),
        "damper": QuadraticDamper(name="d", direction=np.array([1.0, -1.0]), damping=0.8),
    }
    stiffness, damping = np.array([[2.0, -1.0], [-1.0, 2.0]]), 0.05 * np.eye(2)
    force = np.array([[0, 0], [1.0, 0.5j]])
    system = JointedSystem(
        mass=np.eye(2), damping=damping, stiffness=stiffness, joints=[joints[joint]], harmonic_force=force
    )

    def rate(t: float, y: Vector) -> Vector:
        q, v = y[:2], y[2:]
        u, s = q[0] - q[1], v[0] - v[1]
        f = 0.8 * u**3 if joint == "cubic" else 0.8 * abs(s) * s
        load = (force[1] * np.exp(1j * omega * t)).real
        return np.concatenate([v, load - damping @ v - stiffness @ q - np.array([1.0, -1.0]) * f])

    start = at([0.5, -0.2], [0.0, 0.3])
    end = 2 * np.pi / omega * 2
    exact = solve_ivp(rate, (0, end), [0.5, -0.2, 0.0, 0.3], rtol=1e-12, atol=1e-13, method="DOP853").y[:, -1]
    error = errors(system, omega, 2, start, exact, [64, 128, 256])
    assert error[2] < 3e-4
    # Order 2: each halving divides the error by 4, within the next power of the step.
    np.testing.assert_allclose(error[:-1] / error[1:], 4.0, rtol=0.1)


def forces_of(joint: Joint, steps: int) -> Vector:
    """Of a hard vibration from rest, at 128 instants of the second period."""
    motion = integrate(test_laws.vibrating(joint), test_laws.OMEGA, 2, steps, keep=1)
    return np.asarray(motion.force[0, :: steps // 128])


@pytest.mark.parametrize("law", [item.name for item in TRANSIENT_LAWS if item.instant is not None] + ["from outside"])
def test_histories_of_forces_that_depend_on_the_velocity_converge_with_order_two(law: str) -> None:
    if law == "from outside":
        file = Path(__file__).parents[1] / "extension" / "polynomial_damper.py"
        (outside,) = LAWS.load(file)
        joint = outside.build("joint", {"direction": np.ones(1)}, {"cubic": 0.5, "quintic": 1.0})
    else:
        variants = [entry for kind in LAWS for entry in test_laws.variants(kind)]
        joint = next(entry for entry in variants if entry.force_law == law)
    exact = forces_of(joint, 8192)
    coarse, fine = (np.abs(forces_of(joint, steps) - exact).max() for steps in (128, 1024))
    if law == "from outside":
        LAWS.forget(file)
    assert coarse < 0.01 * np.abs(exact).max()  # half a step of velocity is 2.5 % of its amplitude
    # Order 2: 64, less 1 / 64 for the reference; kinks of a law and their place between instants take some.
    assert coarse / fine > 40


def test_every_law_that_reads_the_velocity_has_its_force_at_an_instant() -> None:
    at_instants = {item.name for item in TRANSIENT_LAWS if item.instant is not None}
    assert at_instants == {item.name for item in FORCES if item.uses_velocity}


def test_a_ball_bouncing_on_an_elastic_stop_returns_to_its_apex() -> None:
    # Flight with gravity g from the height v^2 / 2g, contact p = g/w^2 (1 - cos w t) + v/w sin w t, and back.
    g, v, w, gap = 2.0, 1.5, 30.0, 0.1
    contact = (np.pi + 2 * np.arctan(g / (v * w))) / w
    period = 2 * v / g + contact
    system = JointedSystem(
        mass=np.eye(1),
        damping=np.zeros((1, 1)),
        stiffness=np.zeros((1, 1)),
        static_load=np.array([g]),
        joints=[ElasticStop(name="stop", direction=np.ones(1), stiffness=w**2, gap=gap)],
    )
    apex = at([gap - v**2 / (2 * g)], [0.0])
    error = errors(system, 2 * np.pi / period, 5, apex, final_of(apex), [1000, 2000, 4000])
    # Order 2: 16 for two halvings; kinks move within their steps, which scatters it.
    assert error[2] < 3e-4
    assert 10 < error[0] / error[2] < 26


def final_of(state: TransientState) -> Vector:
    return np.concatenate([state.displacement, state.velocity, state.slider])


def test_springs_and_stops_keep_the_energy_in_every_step() -> None:
    # The mean force of a step does exactly the work of the law, even where a step is as long as the contact.
    stiffness = np.array([[2.0, -1.0], [-1.0, 1.5]])
    system = JointedSystem(
        mass=np.diag([1.0, 2.0]),
        damping=np.zeros((2, 2)),
        stiffness=stiffness,
        joints=[
            ElasticStop(name="stop", direction=np.array([1.0, 0.0]), stiffness=500.0, gap=0.2),
            CubicSpring(name="cubic", direction=np.array([1.0, -1.0]), stiffness=3.0),
        ],
    )
    rows = {"a": np.array([1.0, 0.0]), "b": np.array([0.0, 1.0])}
    motion = integrate(system, 1.0, 50, 40, at([-1.0, 0.7], [0.0, 0.5]), outputs=rows)
    q, v = np.array(list(motion.output_displacement.values())), np.array(list(motion.output_velocity.values()))
    energy = (
        0.5 * np.array([1.0, 2.0]) @ v**2
        + 0.5 * np.einsum("it,ij,jt->t", q, stiffness, q)
        + 250.0 * np.maximum(q[0] - 0.2, 0) ** 2
        + 0.75 * (q[0] - q[1]) ** 4
    )
    # 2,000 steps, each solved to 1e-13 of the positions.
    np.testing.assert_allclose(energy, energy[0], rtol=1e-9)


def test_loop_area_equals_the_closed_form() -> None:
    # A slow, stiff drive prescribes the displacement: 4 mu N (A - mu N / kt) each cycle.
    stiff, kt, limit, amplitude = 1e5, 3.0, 1.2, 1.0
    system = JointedSystem(
        mass=np.eye(1),
        damping=np.array([[100.0]]),
        stiffness=np.array([[stiff]]),
        joints=[JenkinsElement(name="j", direction=np.ones(1), tangential_stiffness=kt, limit_force=limit)],
        harmonic_force=np.array([[0], [stiff * amplitude]]),
    )
    motion = integrate(system, 0.01, 3, 4096, keep=1)
    u, force = motion.displacement[0], motion.force[0]
    area = abs(np.sum(0.5 * (force + np.roll(force, -1)) * (np.roll(u, -1) - u)))
    reached = 0.5 * np.ptp(u)
    # Straight lines between 4,096 samples cut the corners by about the square of the step.
    assert area == pytest.approx(4 * limit * (reached - limit / kt), rel=1e-5)
    # The joint takes limit / stiff of the drive.
    assert reached == pytest.approx(amplitude, rel=2e-5)


def circular(friction: Friction) -> JointedSystem:
    """A mass driven in a circle on a table that presses against it with 2 N."""
    return JointedSystem(
        mass=np.eye(3),
        damping=np.diag([0.1, 0.1, 0.5]),
        stiffness=np.diag([1.0, 1.0, 3.0]),
        joints=[
            FrictionContact(
                name="table",
                tangents=np.eye(3)[:2],
                normal=np.eye(3)[2],
                normal_stiffness=5.0,
                tangential_stiffness=4.0,
                friction_coefficient=0.5,
                preload=2.0,
                friction=friction,
            )
        ],
        # The static load balances the preload, so that N stays 2 N.
        static_load=np.array([0.0, 0.0, 2.0]),
        harmonic_force=np.array([[0, 0, 0], [3.0, -3.0j, 0.0]]),
    )


def test_circular_sliding_equals_the_closed_form() -> None:
    # T = mu N i w/|w| opposes the sliding i Omega w: |F| = |D (|w| + i mu N / kt) + i mu N|, q = w + T / kt.
    omega, limit, kt = 1.5, 1.0, 4.0
    D = 1.0 - omega**2 + 0.1j * omega
    size = brentq(lambda w: abs(D * (w + 1j * limit / kt) + 1j * limit) - 3.0, 1e-3, 100.0, xtol=1e-14)
    steady = steady_motion(circular(Friction.COULOMB), omega, tolerance=1e-8, step_tolerance=1e-6, steps_per_period=512)
    assert steady.periodic
    force = steady.force[:2]
    np.testing.assert_allclose(np.hypot(*force), limit, rtol=1e-9)
    # Second order, 1,024 steps or more a period.
    np.testing.assert_allclose(np.hypot(*steady.slider), size, rtol=1e-5)
    np.testing.assert_allclose(np.hypot(*steady.displacement[:2]), np.hypot(size, limit / kt), rtol=1e-5)
    sliding = (np.roll(steady.slider, -1, axis=1) - np.roll(steady.slider, 1, axis=1)) / 2
    cosine = np.sum(force * sliding, axis=0) / np.hypot(*force) / np.hypot(*sliding)
    np.testing.assert_allclose(cosine, 1.0, atol=1e-5)


def test_uncoupled_tangents_have_a_limit_each() -> None:
    steady = steady_motion(circular(Friction.UNCOUPLED), 1.5)
    assert np.abs(steady.force[:2]).max(axis=1) == pytest.approx([1.0, 1.0], rel=1e-9)
    assert np.hypot(*steady.force[:2]).max() > 1.2


def hopping(friction: Friction = Friction.COULOMB) -> JointedSystem:
    """A chain of six masses with contacts that slip, open and close at once, and a gap."""
    n = 6
    stiffness = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    force = np.zeros((2, n), dtype=complex)
    force[1, 0], force[1, 4] = 1.0, 0.5j
    return JointedSystem(
        mass=np.eye(n),
        damping=0.05 * stiffness,
        stiffness=stiffness,
        joints=[
            FrictionContact(
                name="plane",
                tangents=np.array([along(n, {0: 1}), along(n, {2: 1})]),
                normal=along(n, {1: 1}),
                normal_stiffness=3.0,
                tangential_stiffness=2.0,
                friction_coefficient=0.5,
                preload=0.3,
                friction=friction,
            ),
            FrictionContact(
                name="line",
                tangents=along(n, {5: 1, 3: -1}),
                normal=along(n, {4: 1}),
                normal_stiffness=3.0,
                tangential_stiffness=2.0,
                friction_coefficient=0.5,
                gap=0.05,
            ),
        ],
        harmonic_force=force,
        static_load=along(n, {1: 0.3, 4: 0.1}),
    )


@pytest.mark.parametrize("friction", list(Friction))
def test_order_two_survives_slip_touch_down_and_lift_off(friction: Friction) -> None:
    system = hopping(friction)
    reference = final(integrate(system, 1.1, 3, 8192))
    error = [np.abs(final(integrate(system, 1.1, 3, n)) - reference).max() for n in (128, 256, 512, 1024)]
    # Kinks move within their steps, which scatters the factor 4 of each halving: 64 over three of them.
    assert 30 < error[0] / error[-1] < 130


def test_a_contact_in_flight_carries_no_friction_and_its_slider_follows() -> None:
    motion = integrate(hopping(), 1.1, 5, 256)
    normal, open_ = motion.force[2], motion.force[2] == 0
    assert 0.05 < open_.mean() < 0.95
    assert not motion.force[:2, open_].any()
    # Displacements of the record and of the integration sum the same modes in another order.
    np.testing.assert_allclose(motion.slider[:2, open_], motion.displacement[:2, open_], atol=1e-12)
    # Coulomb's limit, to the round-off of a square root.
    assert (np.hypot(*motion.force[:2]) <= 0.5 * normal * (1 + 1e-12)).all()


def test_input_work_equals_dissipation_over_a_steady_period() -> None:
    system, omega = hopping(), 1.1
    steady = steady_motion(
        system, omega, acceleration=10, tolerance=1e-8, steps_per_period=1024, max_steps_per_period=2048
    )
    assert steady.periodic
    n, rows = steady.steps_per_period, {str(i): row for i, row in enumerate(np.eye(6))}
    motion = integrate(system, omega, 1, n, steady.start, outputs=rows)
    step = 2 * np.pi / omega / n
    v = np.array(list(motion.output_velocity.values()))
    load = (system.dynamic[1][:, None] * np.exp(1j * omega * motion.time)).real
    work = np.sum(load * v) * step
    viscous = np.einsum("it,ij,jt->", v, system.damping, v) * step
    friction = np.sum(motion.force * motion.velocity) * step
    # Sums over 2,048 samples of a motion with kinks.
    assert work == pytest.approx(viscous + friction, rel=1e-4)
    assert friction > 0.02 * work
