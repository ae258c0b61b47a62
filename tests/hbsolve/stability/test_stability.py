"""Floquet multipliers against closed forms, and against differences of the integration in time over one period."""

from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from hbsolve.balance import HarmonicBalance
from hbsolve.errors import BalanceError
from hbsolve.stability.stability import Stability, stability
from hbsolve.state import SteadyState
from hbsolve.steady_state import steady_state
from reduction.joint_law.function_law import joint_law
from reduction.joint_law.registry import LAWS, LawParameter
from reduction.jointed_system import (
    BoucWenJoint,
    CubicSpring,
    DampedStop,
    ElasticStop,
    Friction,
    FrictionContact,
    FrictionEllipse,
    HertzContact,
    IwanJoint,
    JenkinsChain,
    JenkinsElement,
    Joint,
    JointedSystem,
    LuGreFriction,
    PiecewiseDamper,
    PiecewiseSpring,
    Play,
    PolynomialSpring,
    PowerSpring,
    QuadraticDamper,
    SmoothFriction,
    ValanisJoint,
    ViscousDamper,
)
from tests.slow import slow
from transient.state import start_from
from transient.stepper import Stepper

Array = NDArray[np.float64]
#: Of a multiplier: contacts change their states between the instants of the balance, 4096 per period.
AGREEMENT = 1e-3
#: Steps per period of the differences, and while a stable motion of the balance becomes that of the integration.
STEPS, COARSE = 16384, 1024
#: Periods of the latter.
SETTLE = 100


@joint_law(
    kind="van der pol",
    parameters=[LawParameter(name="strength", unit="N s/m", meaning="c", typical=1.0, positive=True)],
    typical_displacement=1.0,
    n_state=0,
    stuck_stiffness=lambda *_: 0.0,
    energy=None,
)
def van_der_pol(u: float, velocity: float, state: tuple[float, ...], parameters: tuple[float, ...]) -> float:
    """Damping that feeds small motions."""
    return parameters[0] * (u * u - 1) * velocity


@joint_law(
    kind="slow slider",
    parameters=[LawParameter(name="stiffness", unit="N/m", meaning="k", typical=1.0, positive=True)],
    typical_displacement=1.0,
    n_state=1,
    stuck_stiffness=lambda stiffness: stiffness,
    energy=None,
)
def slow_slider(
    u: float, velocity: float, state: tuple[float, ...], parameters: tuple[float, ...]
) -> tuple[float, tuple[float]]:
    """A spring whose end follows when it is stretched by more than 0.2 m."""
    stretch = u - state[0]
    if stretch > 0.2:
        return parameters[0] * 0.2, (u - 0.2,)
    if stretch < -0.2:
        return -parameters[0] * 0.2, (u + 0.2,)
    return parameters[0] * stretch, (state[0],)


# Stored results depend on laws from outside: tests of other files do without these.
LAWS.forget(Path(__file__))


def chain(n_mass: int, *joints: Joint, damping: float = 0.05, load: float = 0.5, static: float = 0.0) -> JointedSystem:
    """Masses of 1 kg with two motions each; the last one is driven along both."""
    line = 2 * np.eye(n_mass) - np.eye(n_mass, k=1) - np.eye(n_mass, k=-1)
    stiffness = np.kron(line, np.diag([1.0, 1.6])) + 0.2 * np.kron(np.eye(n_mass), [[0, 1], [1, 0]])
    force = np.zeros((2, 2 * n_mass), dtype=np.complex128)
    force[1, -2:] = load, 0.4j * load
    pressed = np.zeros(2 * n_mass)
    pressed[1] = static
    mass = np.eye(2 * n_mass)
    return JointedSystem(
        mass=mass, damping=damping * (mass + 0.3 * stiffness), stiffness=stiffness, joints=list(joints),
        static_load=pressed, harmonic_force=force,
    )  # fmt: skip


def row(n_mass: int, number: int = 0) -> Array:
    return np.eye(2 * n_mass)[number]


def rub(n_mass: int, friction: Friction = Friction.UNCOUPLED, n_tangent: int = 1, **values: float) -> FrictionContact:
    tangents = np.eye(2 * n_mass)[[0, 2][:n_tangent]]
    numbers = {"normal_stiffness": 1.0, "tangential_stiffness": 0.8, "friction_coefficient": 0.4, "preload": 0.4}
    return FrictionContact(
        name="rub", normal=row(n_mass, 1), tangents=tangents, friction=friction, **(numbers | values)
    )


def monodromy_by_integration(system: JointedSystem, state: SteadyState, settle: int) -> Array:
    start = start_from(system, state.angular_frequency, state.coefficients, state.periodic_slider)
    for steps in (COARSE, STEPS):
        stepper = Stepper(system, state.angular_frequency, steps, start)
        for _ in range(settle if steps == COARSE else min(settle, 5)):
            stepper.advance()
        start = stepper.state
    place = stepper.vector.copy()
    by = np.empty((len(place), len(place)))
    size = 1e-5 * np.abs(place).max()
    for number in range(len(place)):
        ends = []
        for sign in (1, -1):
            moved = place.copy()
            moved[number] += sign * size
            stepper.vector = moved
            stepper.advance()
            ends.append(stepper.vector.copy())
        by[:, number] = (ends[0] - ends[1]) / (2 * size)
    return by


def largest_difference(result: Stability, expected: NDArray[np.complex128]) -> float:
    """Of the multipliers, each to its own one of the others; sliders that rest have the multiplier 1 in time."""
    apart = np.abs(result.multipliers[:, None] - expected)
    own, others = linear_sum_assignment(apart)
    assert len(own) == len(result.multipliers)
    np.testing.assert_allclose(np.delete(expected, others), 1, atol=1e-6)
    return float(apart[own, others].max())


SMOOTH = {
    "cubic": chain(1, CubicSpring(name="j", direction=row(1), stiffness=1.0)),
    "two cubics": chain(
        2,
        CubicSpring(name="j", direction=row(2), stiffness=2.0),
        CubicSpring(name="k", direction=row(2) - row(2, 2), stiffness=-0.05),
    ),
    "polynomial": chain(
        1, PolynomialSpring(name="j", direction=row(1), quadratic=0.3, cubic=0.5, quartic=0.1, quintic=0.2)
    ),
    "power": chain(2, PowerSpring(name="j", direction=row(2), stiffness=1.0, reference=1.0, exponent=2.5)),
    "quadratic damper": chain(1, QuadraticDamper(name="j", direction=row(1), damping=0.3)),
    "smooth friction": chain(1, SmoothFriction(name="j", direction=row(1), limit_force=0.1, velocity=0.2)),
    "van der Pol": chain(1, van_der_pol(name="j", direction=row(1), strength=0.3), damping=0.01, load=2.0),
    "damper": chain(3, ViscousDamper(name="j", direction=row(3, 2), damping=0.4)),
}
CONTACTS = {
    "stop": chain(1, ElasticStop(name="j", direction=row(1), stiffness=1.0, gap=0.1)),
    "play": chain(2, Play(name="j", direction=row(2), stiffness=1.0, gap=0.1)),
    "piecewise spring": chain(1, PiecewiseSpring(name="j", direction=row(1), width=0.1, stiffness=(0.0, 1.0))),
    "piecewise damper": chain(1, PiecewiseDamper(name="j", direction=row(1), width=0.1, damping=(0.1, 0.2))),
    "hertz": chain(1, HertzContact(name="j", direction=row(1), stiffness=1.0, reference=0.3, exponent=1.5, gap=0.0)),
    "jenkins": chain(2, JenkinsElement(name="j", direction=row(2), tangential_stiffness=1.0, limit_force=0.2)),
    "two jenkins": chain(
        2,
        JenkinsElement(name="j", direction=row(2), tangential_stiffness=1.0, limit_force=0.1),
        JenkinsElement(name="k", direction=row(2, 2) - row(2), tangential_stiffness=2.0, limit_force=0.1),
    ),
    "iwan": chain(
        1, IwanJoint(name="j", direction=row(1), tangential_stiffness=1.0, limit_force=0.2, exponent=-0.5, ratio=0.3)
    ),
    "chain of jenkins": chain(
        1,
        JenkinsChain(
            name="j", direction=row(1), tangential_stiffness=[0.7, 0.5], limit_force=[0.1, 0.2], stiffness=0.2
        ),
    ),
    "bouc-wen": chain(
        2, BoucWenJoint(name="j", direction=row(2), tangential_stiffness=1.0, limit_force=0.2, exponent=2.0, shape=0.7)
    ),
    "valanis": chain(
        1,
        ValanisJoint(
            name="j", direction=row(1), tangential_stiffness=1.0, limit_force=0.2, slip_stiffness=0.1, kappa=0.5
        ),
    ),
    "lugre": chain(
        1,
        LuGreFriction(
            name="j",
            direction=row(1),
            tangential_stiffness=1.0,
            limit_force=0.2,
            static_force=0.25,
            velocity=0.3,
            bristle_damping=0.2,
            damping=0.1,
        ),
    ),
    "damped stop": chain(1, DampedStop(name="j", direction=row(1), stiffness=1.0, damping=0.4, depth=0.2, gap=0.1)),
    "damped stops": chain(
        2, DampedStop(name="j", direction=row(2), stiffness=1.0, damping=0.4, depth=0.2, gap=0.1, sides="both")
    ),
    "elliptic limit": chain(
        2,
        FrictionEllipse(
            name="j",
            normal=row(2, 1),
            tangent=row(2),
            second_tangent=row(2, 2),
            normal_stiffness=1.0,
            tangential_stiffness=0.8,
            second_tangential_stiffness=0.6,
            friction_coefficient=0.4,
            second_friction_coefficient=0.25,
            preload=0.4,
        ),
        static=0.4,
    ),
    "contact": chain(1, rub(1), static=0.4),
    "contact that lifts off": chain(1, rub(1, preload=0.15), static=0.15),
    "contact that sticks": chain(1, rub(1, preload=4.0), static=4.0, load=0.2),
    "two uncoupled tangents": chain(2, rub(2, n_tangent=2), static=0.4),
    "two coupled tangents": chain(2, rub(2, Friction.COULOMB, n_tangent=2), static=0.4),
    "coupled, damped by the ground": chain(
        2, rub(2, Friction.COULOMB, n_tangent=2), ViscousDamper(name="k", direction=row(2, 3), damping=0.5), static=0.4
    ),
    "slow slider": chain(1, slow_slider(name="j", direction=row(1), stiffness=1.0)),
}
#: One of each kind of force: of the motion, of sliders alone and coupled, and of a history; a damper has a closed form.
USUAL = {"cubic", "stop", "jenkins", "bouc-wen", "contact that lifts off", "two coupled tangents"}


@pytest.mark.parametrize("frequency", [0.9, pytest.param(1.5, marks=slow)])
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in USUAL else slow) for name in (SMOOTH | CONTACTS)]
)
def test_multipliers_are_those_of_the_integration_in_time(name: str, frequency: float) -> None:
    system = (SMOOTH | CONTACTS)[name]
    balance = HarmonicBalance(system=system, n_harmonic=22, n_sample=2048)
    state = steady_state(balance, frequency)
    result = stability(balance, state)
    settle = SETTLE if name in CONTACTS and result.is_stable else 0
    expected = np.linalg.eigvals(monodromy_by_integration(system, state, settle))
    assert largest_difference(result, expected) < AGREEMENT


@pytest.mark.parametrize("couples", [False, True])
def test_a_linear_structure_has_the_exponentials_of_its_poles(couples: bool) -> None:
    system = chain(3)
    damping = system.damping.copy()
    if couples:
        damping[0, 0] += 0.5
    system = JointedSystem(
        mass=system.mass, damping=damping, stiffness=system.stiffness, joints=[], harmonic_force=system.dynamic
    )
    balance = HarmonicBalance(system=system, n_harmonic=2)
    result = stability(balance, steady_state(balance, 1.3))
    first_order = np.block([[np.zeros((6, 6)), np.eye(6)], [-system.stiffness, -damping]])
    expected = np.exp(np.linalg.eigvals(first_order) * 2 * np.pi / 1.3)
    assert largest_difference(result, expected) < 1e-11  # round-off of 4096 steps
    assert result.is_stable


def test_damping_at_a_joint_is_that_of_the_structure() -> None:
    # The force of the damper is taken to be linear between instants: an error of second order in their distance.
    system = SMOOTH["damper"]
    balance = HarmonicBalance(system=system, n_harmonic=2)
    damping = system.damping + 0.4 * np.outer(row(3, 2), row(3, 2))
    first_order = np.block([[np.zeros((6, 6)), np.eye(6)], [-system.stiffness, -damping]])
    expected = np.exp(np.linalg.eigvals(first_order) * 2 * np.pi / 1.3)
    state = steady_state(balance, 1.3)
    errors = [largest_difference(stability(balance, state, n_sample=n), expected) for n in (128, 256)]
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.1)
    assert largest_difference(stability(balance, state), expected) < 1e-6


def test_the_product_of_the_multipliers_is_what_damping_takes_from_the_phase_space() -> None:
    """Liouville: the trace of the damping, whatever the springs do."""
    system = SMOOTH["two cubics"]
    balance = HarmonicBalance(system=system, n_harmonic=12)
    result = stability(balance, steady_state(balance, 0.9))
    taken = np.exp(-np.trace(system.damping) * 2 * np.pi / 0.9)
    assert abs(np.prod(result.multipliers[:8])) == pytest.approx(taken, rel=1e-6)


def test_exponents_lie_within_half_the_excitation() -> None:
    balance = HarmonicBalance(system=chain(2), n_harmonic=2)
    result = stability(balance, steady_state(balance, 0.7))
    assert np.abs(result.exponents.imag).max() <= 0.35 + 1e-12
    np.testing.assert_allclose(np.exp(result.exponents * 2 * np.pi / 0.7), result.multipliers)


def test_negative_damping_is_unstable() -> None:
    balance = HarmonicBalance(
        system=chain(1, van_der_pol(name="j", direction=row(1), strength=0.3), damping=0.01, load=0.05), n_harmonic=6
    )
    state = steady_state(balance, 0.5)
    assert stability(balance, state).n_unstable == 2


def test_bad_input_is_one_sentence() -> None:
    balance = HarmonicBalance(system=chain(1), n_harmonic=2)
    state = steady_state(balance, 0.7)
    with pytest.raises(BalanceError, match="the state has coefficients of shape"):
        stability(HarmonicBalance(system=chain(2), n_harmonic=2), state)
    with pytest.raises(BalanceError, match="n_sample"):
        stability(balance, state, n_sample=3)


def test_an_exponential_of_the_state_matrix_is_the_monodromy_of_constant_coefficients() -> None:
    """A contact that stays closed and sticks is a spring."""
    system = CONTACTS["contact that sticks"]
    balance = HarmonicBalance(system=system, n_harmonic=4)
    result = stability(balance, steady_state(balance, 0.9))
    stuck = system.stiffness + 0.8 * np.outer(row(1), row(1)) + np.outer(row(1, 1), row(1, 1))
    first_order = np.block([[np.zeros((2, 2)), np.eye(2)], [-stuck, -system.damping]])
    expected = np.linalg.eigvals(scipy.linalg.expm(first_order * 2 * np.pi / 0.9))
    assert len(result.multipliers) == 4
    assert largest_difference(result, expected) < 1e-11


def test_a_slider_that_was_dragged_and_then_sticks_is_a_spring() -> None:
    """A static load drags it from rest to its limit, which it touches once per period afterwards to the last digit."""
    for static in np.linspace(0.5, 2.0, 12):
        slider = JenkinsElement(name="j", direction=row(1), tangential_stiffness=1.0, limit_force=0.2)
        system = chain(1, slider, load=0.02, static=static)
        pushed = JointedSystem(
            mass=system.mass, damping=system.damping, stiffness=system.stiffness, joints=[slider],
            static_load=[static, 0.0], harmonic_force=system.dynamic,
        )  # fmt: skip
        balance = HarmonicBalance(system=pushed, n_harmonic=6)
        result = stability(balance, steady_state(balance, 0.9))
        stuck = system.stiffness + np.outer(row(1), row(1))
        first_order = np.block([[np.zeros((2, 2)), np.eye(2)], [-stuck, -system.damping]])
        expected = np.exp(np.linalg.eigvals(first_order) * 2 * np.pi / 0.9)
        assert len(result.multipliers) == 4
        assert largest_difference(result, expected) < 1e-11


def test_a_joint_that_is_stiffer_than_the_linear_reference_is_refused() -> None:
    slider = JenkinsElement(name="j", direction=row(1), tangential_stiffness=1e8, limit_force=0.2)
    balance = HarmonicBalance(system=chain(1, slider, load=0.02), n_harmonic=6)
    with pytest.raises(BalanceError, match=r'joint "j" has a stiffness of 1e\+08 N/m, which is too stiff'):
        stability(balance, steady_state(balance, 0.9))
