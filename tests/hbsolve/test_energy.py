"""Energy of a steady vibration: what goes in comes out, and closed loss factors."""

import numpy as np
import pytest

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.continuation_parameter import JointPath
from hbsolve.energy import energy_balance
from hbsolve.steady_state import steady_state
from reduction.jointed_system import (
    CubicSpring,
    ElasticStop,
    Friction,
    FrictionContact,
    HertzContact,
    JenkinsElement,
    Joint,
    JointedSystem,
    Play,
    QuadraticDamper,
    along,
    between,
)

ONE = np.ones(1)


def oscillator(*joints: Joint, damping: float = 0.0, force: float = 1.0, static: float = 0.0) -> JointedSystem:
    return JointedSystem(
        mass=[[1.0]],
        damping=[[damping]],
        stiffness=[[1.0]],
        joints=joints,
        static_load=[static],
        harmonic_force=[[0.0], [force]],
    )


@pytest.mark.parametrize("zeta", [1e-3, 0.05])
@pytest.mark.parametrize("static", [0.0, 30.0])
def test_a_viscous_oscillator_at_resonance_loses_twice_its_damping_ratio(zeta: float, static: float) -> None:
    balance = HarmonicBalance(system=oscillator(damping=2 * zeta, static=static), n_harmonic=2)
    energy = energy_balance(balance, steady_state(balance, 1.0))
    A = 1 / (2 * zeta)
    np.testing.assert_allclose(energy.loss_factor, 2 * zeta, rtol=1e-9)  # the receptance's round-off
    np.testing.assert_allclose(energy.stored, A**2 / 2, rtol=1e-9)
    np.testing.assert_allclose([energy.input_work, energy.linear_dissipation], np.pi * A, rtol=1e-9)
    assert energy.joint_dissipation.size == 0


@pytest.mark.parametrize("level", [0.5, 1.0, 2.0])
def test_input_work_is_dissipated(level: float) -> None:
    n = 4
    stiffness = 100 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    force = np.zeros((3, n), dtype=complex)
    force[1, 3], force[2, 1] = 3.0 - 1.0j, 0.5j
    system = JointedSystem(
        mass=np.eye(n),
        damping=np.diag([0.1, 0.9, 0.2, 0.5]),
        stiffness=stiffness,
        joints=[
            FrictionContact(
                name="pad",
                normal=along(n, {0: 1.0}),
                tangents=np.vstack([along(n, {2: 1.0}), along(n, {3: 0.8, 1: 0.6})]),
                normal_stiffness=40.0,
                tangential_stiffness=30.0,
                friction_coefficient=0.4,
                preload=0.8,
                friction=Friction.COULOMB,
            ),
            JenkinsElement(name="slider", direction=between(n, 3, 2), tangential_stiffness=30.0, limit_force=0.4),
            CubicSpring(name="cubic", direction=along(n, {0: 1.0}), stiffness=200.0),
            ElasticStop(name="stop", direction=along(n, {3: 1.0}), stiffness=80.0, gap=0.02),
            QuadraticDamper(name="drag", direction=along(n, {2: 1.0}), damping=0.5),
        ],
        static_load=along(n, {0: 0.3}),
        harmonic_force=force,
    )
    balance = HarmonicBalance(system=system, n_harmonic=6, level=level)
    energy = energy_balance(balance, steady_state(balance, 9.0))
    pad, slider, cubic, stop, drag = energy.joint_dissipation
    assert min(pad, slider, drag) > 1e-3 * energy.input_work
    assert max(abs(cubic), abs(stop)) < 1e-7 * energy.input_work  # elastic: their loops close
    # Each harmonic that works is in balance, so the energies agree as well as the residual is solved: 1e-9.
    np.testing.assert_allclose(energy.dissipated, energy.input_work, rtol=1e-7)
    assert energy.dissipated == pytest.approx(energy.joint_dissipation.sum() + energy.linear_dissipation)


@pytest.mark.parametrize("share", [1.3, 3.0])
def test_a_slipping_jenkins_element_has_its_closed_energies(share: float) -> None:
    kt, limit, omega = 3.0, 0.7, 1.6
    A = share * limit / kt
    jenkins = JenkinsElement(name="j", direction=ONE, tangential_stiffness=kt, limit_force=limit)
    # The force that holds one harmonic of this amplitude: the linear part plus that of the loop.
    samples = np.arange(8192) * 2 * np.pi / 8192
    back = np.clip(kt * A * (np.cos(samples[:4096]) - 1) + limit, -limit, limit)
    loop = np.r_[back, -back]
    first = 2 * np.mean(loop * np.exp(-1j * samples))
    force = abs((1 - omega**2) * A + first)
    balance = HarmonicBalance(system=oscillator(jenkins, force=force), n_harmonic=2, n_sample=2048)
    state = steady_state(balance, omega)
    energy = energy_balance(balance, state)
    np.testing.assert_allclose(state.amplitude(0), A, rtol=1e-5)
    np.testing.assert_allclose(energy.joint_dissipation, [4 * limit * (A - limit / kt)], rtol=1e-4)
    # Most is stored where the structure turns, with the spring at its limit.
    stored = A**2 / 2 + limit**2 / (2 * kt)
    np.testing.assert_allclose(energy.stored, stored, rtol=1e-5)  # the turn lies between two instants
    np.testing.assert_allclose(energy.loss_factor, 4 * limit * (A - limit / kt) / (2 * np.pi * stored), rtol=1e-4)


def test_preloads_store_no_energy_of_the_vibration() -> None:
    """A stuck, closed contact is two springs; its mean load does not count."""
    kn, kt = 5.0, 3.0
    contact = FrictionContact(
        name="held",
        normal=ONE,
        tangents=ONE,
        normal_stiffness=kn,
        tangential_stiffness=kt,
        friction_coefficient=1.0,
        preload=100.0,
    )
    balance = HarmonicBalance(system=oscillator(contact, damping=0.1, static=2.0), n_harmonic=3)
    state = steady_state(balance, 2.0)
    energy = energy_balance(balance, state)
    np.testing.assert_allclose(energy.stored, (1 + kn + kt) * state.amplitude(0) ** 2 / 2, rtol=1e-3)  # peak sampled
    np.testing.assert_allclose(energy.joint_dissipation, 0, atol=1e-9)
    np.testing.assert_allclose(energy.input_work, energy.linear_dissipation, rtol=1e-9)


def test_a_cubic_spring_under_a_static_load_stores_what_its_tangent_does() -> None:
    k, mean, amplitude = 2.0, 1.5, 1e-3
    # Of the static load that holds the mean, and of a force that moves the linearised oscillator that far.
    force = (1 + 3 * k * mean**2 - 0.7**2) * amplitude
    system = oscillator(CubicSpring(name="cubic", direction=ONE, stiffness=k), force=force, static=mean + k * mean**3)
    balance = HarmonicBalance(system=system, n_harmonic=4)
    state = steady_state(balance, 0.7)
    stored = (1 + 3 * k * mean**2) * state.amplitude(0) ** 2 / 2
    # Of third order in the amplitude over the mean, 7e-4.
    np.testing.assert_allclose(energy_balance(balance, state).stored, stored, rtol=2e-3)


def test_a_spring_changed_along_a_branch_stores_as_a_system_made_with_it() -> None:
    made = [JenkinsElement(name="slider", direction=ONE, tangential_stiffness=kt, limit_force=0.5) for kt in (0.5, 2.0)]
    before, after = (HarmonicBalance(system=oscillator(item, force=2.0), n_harmonic=6) for item in made)
    path = JointPath(balance=before, angular_frequency=0.7, joint="slider", parameter="tangential_stiffness")
    changed, _ = path.at(2.0)
    energies = [energy_balance(item, steady_state(item, 0.7)).stored for item in (changed, after)]
    np.testing.assert_allclose(energies[0], energies[1], rtol=1e-7)  # both to a residual of 1e-9


def test_a_quadratic_damper_takes_eight_thirds_of_the_cube() -> None:
    c, omega = 0.3, 1.2
    drag = QuadraticDamper(name="d", direction=ONE, damping=c)
    balance = HarmonicBalance(system=oscillator(drag), n_harmonic=2, n_sample=2048)
    state = steady_state(balance, omega)
    energy = energy_balance(balance, state)
    np.testing.assert_allclose(energy.joint_dissipation, [8 / 3 * c * omega**2 * state.amplitude(0) ** 3], rtol=1e-5)
    np.testing.assert_allclose(energy.input_work, energy.dissipated, rtol=1e-5)  # chords of 2 pi / n


def test_one_spring_has_one_loss_factor_however_it_is_written() -> None:
    """A spring beyond a gap on either side: as play, as two stops, as contacts of Hertz or without friction."""
    k, gap = 2.0, 0.3
    sides = (("up", ONE), ("down", -ONE))
    written = (
        [Play(name="play", direction=ONE, stiffness=k, gap=gap)],
        [ElasticStop(name=name, direction=side, stiffness=k, gap=gap) for name, side in sides],
        [
            HertzContact(name=name, direction=side, stiffness=k, reference=1.0, exponent=1.0, gap=gap)
            for name, side in sides
        ],
        [
            FrictionContact(
                name=name, normal=side, tangents=ONE, normal_stiffness=k, tangential_stiffness=1.0,
                friction_coefficient=0.0, gap=gap,
            )
            for name, side in sides
        ],
    )  # fmt: skip
    energies = []
    for joints in written:
        balance = HarmonicBalance(system=oscillator(*joints, damping=0.05), n_harmonic=8, n_sample=1024)
        energies.append(energy_balance(balance, steady_state(balance, 1.3)))
    for energy in energies[1:]:
        assert energy.stored == pytest.approx(energies[0].stored, rel=1e-6)
        assert energy.loss_factor == pytest.approx(energies[0].loss_factor, rel=1e-6)
