"""Isolas of three published systems, and none where there are none."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.branch import ResponseBranch
from hbsolve.continuation.detached import _Search, detached_curves
from hbsolve.continuation.level_arc import follow_level
from hbsolve.continuation.response import frequency_response
from hbsolve.continuation.step import Continuation
from hbsolve.continuation.stop_reason import StopReason
from hbsolve.stability.branch_stability import branch_stability
from hbsolve.state import make_initial_sliders
from hbsolve.steady_state import steady_state
from reduction.joint_law.registry import LAWS
from reduction.jointed_system import CubicSpring, JenkinsElement, Joint, JointedSystem
from tests.slow import slow
from transient.state import start_from
from transient.steady import steady_motion

ONE = np.array([1.0])


#: A damper whose force is a polynomial of the velocity.
DAMPER = Path(__file__).parents[2] / "extension" / "polynomial_damper.py"


@pytest.fixture(scope="module", autouse=True)
def damper_law() -> Iterator[None]:
    LAWS.load(DAMPER)
    yield
    LAWS.forget(DAMPER)


def polynomial_damper(direction: np.ndarray, cubic: float, quintic: float) -> Joint:
    """f = cubic v^3 + quintic v^5."""
    return LAWS["polynomial damper"](name="damper", direction=direction, cubic=cubic, quintic=quintic)


def absorber() -> JointedSystem:
    """A Duffing oscillator with a tuned nonlinear absorber of 5 % of its mass.

    Habib, Detroux, Viguie and Kerschen, Mech. Syst. Signal Process. 52-53 (2015), tune it; Detroux, Habib, Masset and
    Kerschen, same journal 60-61 (2015), show its detached resonance.
    """
    e = 0.05
    k = 8 * e * (16 + 23 * e + 9 * e**2 + (4 + 2 * e) * np.sqrt(4 + 3 * e))
    k /= 3 * (1 + e) ** 2 * (64 + 80 * e + 27 * e**2)
    c = np.sqrt(k * e * (8 + 9 * e - 4 * np.sqrt(4 + 3 * e)) / (4 * (1 + e)))
    return JointedSystem(
        mass=np.diag([1.0, e]),
        damping=[[0.002 + c, -c], [-c, c]],
        stiffness=[[1 + k, -k], [-k, k]],
        joints=[
            CubicSpring(name="ground", direction=np.array([1.0, 0.0]), stiffness=1.0),
            CubicSpring(name="absorber", direction=np.array([1.0, -1.0]), stiffness=2 * e**2 / (1 + 4 * e)),
        ],
        harmonic_force=[[0, 0], [1.0, 0]],
    )


#: Of `chain`: stiffness, first modal damping, and cubic damping.
STIFFNESS, MODAL, CUBIC = 3.0, 0.03, -0.6


def chain() -> JointedSystem:
    """Two masses in a chain, the first with a cubic spring and a damper that feeds in at some velocities.

    Ponsioen, Pedergnana and Haller, Nonlinear Dyn. 98 (2019).
    """
    c = np.sqrt(3) * MODAL
    first = np.array([1.0, 0.0])
    return JointedSystem(
        mass=np.eye(2),
        damping=[[MODAL + c, -c], [-c, MODAL + c]],
        stiffness=[[2 * STIFFNESS, -STIFFNESS], [-STIFFNESS, 2 * STIFFNESS]],
        joints=[
            CubicSpring(name="spring", direction=first, stiffness=0.4),
            polynomial_damper(first, CUBIC, 1.2),
        ],
        harmonic_force=[[0, 0], [1.0, 0]],
    )


#: Of `oscillator`: linear, cubic and quintic damping.
DAMPING = (0.1, -0.3, 0.24)


def oscillator() -> JointedSystem:
    """A mass on a spring whose damping force has a maximum and a minimum over the velocity.

    Habib, Cirillo and Kerschen, Nonlinear Dyn. 93 (2018): an isola is born at the minimum and merges at the maximum.
    """
    damper = polynomial_damper(ONE, DAMPING[1], DAMPING[2])
    return JointedSystem(
        mass=[[1.0]], damping=[[DAMPING[0]]], stiffness=[[1.0]], joints=[damper], harmonic_force=[[0], [1.0]]
    )


def duffing(*joints: Joint) -> JointedSystem:
    """A mass on a spring with joints."""
    return JointedSystem(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], joints=list(joints), harmonic_force=[[0], [1.0]]
    )


SYSTEMS = {"absorber": (absorber, 0.5, 3.0), "chain": (chain, 1.5, 2.0), "oscillator": (oscillator, 0.5, 1.5)}


@cache
def found(name: str, level: float, n_harmonic: int = 6) -> tuple[ResponseBranch, tuple[ResponseBranch, ...]]:
    """The curve of a system at one level, and those detached from it."""
    system, first, last = SYSTEMS[name]
    balance = HarmonicBalance(system=system(), n_harmonic=n_harmonic, level=level)
    branch = frequency_response(balance, first, last)
    return branch, detached_curves(balance, branch, first, last)


@pytest.mark.parametrize("level", [0.13, 0.15, 0.17])
def test_the_absorber_has_one_isola_between_birth_and_merging(level: float) -> None:
    main, others = found("absorber", level)
    (isola,) = others
    assert isola.stop_reason is StopReason.ISOLA
    assert main.stop_reason is StopReason.REACHED
    # The isola lies above and to the right of both resonance peaks, which the absorber keeps low.
    assert isola.amplitude(0).min() > main.amplitude(0).max()
    assert isola.angular_frequency.min() > main.angular_frequency[main.amplitude(0).argmax()]
    assert isola.residual_norm.max() < 1e-8  # Newton's tolerance is 1e-9 of the linear motion; a point is solved to it


def test_the_isola_of_the_absorber_grows_from_a_fold_and_becomes_part_of_the_curve() -> None:
    assert found("absorber", 0.11)[1] == ()
    spans = [np.ptp(found("absorber", level)[1][0].angular_frequency) for level in (0.13, 0.15, 0.17)]
    assert spans[0] < spans[1] < spans[2]
    main, others = found("absorber", 0.19)
    assert others == ()
    # Once merged, the curve itself passes what was the isola.
    assert main.amplitude(0).max() > found("absorber", 0.17)[1][0].amplitude(0).max()


@pytest.mark.parametrize(("name", "level"), [("absorber", 0.15), ("chain", 0.006), ("oscillator", 0.02)])
def test_an_isola_closes_and_is_passed_once(name: str, level: float) -> None:
    (isola,) = found(name, level)[1]
    motion = isola.coefficients[:, 1, 0]
    np.testing.assert_array_equal(motion[0], motion[-1])
    # Once round: no motion is passed twice, so that it is as far from all others as half a step.
    apart = np.abs(motion[:-1, None] - motion[None, :-1]) + np.eye(len(motion) - 1)
    assert (apart.min(axis=1) > 1e-3 * np.abs(motion[:-1])).all()
    steps = np.abs(np.diff(motion))
    # A step changes the motion by 20 % at most (`LARGEST`), twice that if the step is bent.
    assert (steps < 0.4 * np.abs(motion[1:])).all()


@pytest.mark.parametrize(
    ("name", "level"),
    [pytest.param("absorber", 0.15, marks=slow), pytest.param("chain", 0.006, marks=slow), ("oscillator", 0.02)],
)
def test_time_integration_stays_on_the_stable_side_of_an_isola(name: str, level: float) -> None:
    (isola,) = found(name, level)[1]
    system = SYSTEMS[name][0]()
    stable = branch_stability(HarmonicBalance(system=system, n_harmonic=6, level=level), isola).is_stable
    places = np.flatnonzero(stable)
    assert 0 < len(places) < len(stable)
    at = int(places[isola.amplitude(0)[places].argmax()])
    omega = float(isola.angular_frequency[at])
    motion = steady_motion(system, omega, start_from(system, omega, isola.coefficients[at]), level)
    # The harmonics left out are below 1e-4 of the motion, and the integration's step error is 1e-5.
    assert abs(motion.coefficients(2)[1, 0]) == pytest.approx(isola.amplitude(0)[at], rel=1e-3)


def velocity_roots(level: float) -> np.ndarray:
    """Velocities at which the fundamental of the damping force of `oscillator` equals the load, ascending."""
    c1, c3, c5 = DAMPING
    roots = Polynomial([-level, c1, 0, 3 / 4 * c3, 0, 5 / 8 * c5]).roots()
    return np.sort(roots[(np.abs(roots.imag) < 1e-9) & (roots.real > 0)].real)


def test_the_isola_of_nonlinear_damping_has_the_extremes_of_the_closed_form() -> None:
    level, (c1, c3, c5) = 0.02, DAMPING
    # With one harmonic F^2 = ((1 - Omega^2) V / Omega)^2 + D(V)^2: V is extreme at Omega = 1, where D(V) = F.
    main, (isola,) = found("oscillator", level, n_harmonic=2)
    peak, lowest, highest = velocity_roots(level)
    speed = isola.amplitude(0, derivative=1)
    # Between points, at most 20 % of the motion apart, the extremes are missed by the curvature: below 1 %.
    assert [speed.min(), speed.max()] == pytest.approx([lowest, highest], rel=0.01)
    assert main.amplitude(0, derivative=1).max() == pytest.approx(peak, rel=0.01)
    v = np.linspace(lowest, highest, 2001)
    width = np.max(np.sqrt(np.maximum(level**2 - (c1 * v + 0.75 * c3 * v**3 + 0.625 * c5 * v**5) ** 2, 0)) / v)
    # (1 - Omega^2) / Omega = +- width, of which the points reach all but the same curvature.
    ends = [np.sqrt(1 + width**2 / 4) - width / 2, np.sqrt(1 + width**2 / 4) + width / 2]
    assert np.ptp(isola.angular_frequency) == pytest.approx(ends[1] - ends[0], rel=0.03)
    # Every point satisfies the closed form, to Newton's tolerance near resonance.
    omega, a = isola.angular_frequency, isola.amplitude(0)
    v = omega * a
    force = np.hypot((1 - omega**2) * a, c1 * v + 0.75 * c3 * v**3 + 0.625 * c5 * v**5)
    np.testing.assert_allclose(force, level, rtol=1e-7)


def test_the_isola_of_nonlinear_damping_lives_between_the_extremes_of_the_damping_force() -> None:
    c1, c3, c5 = DAMPING
    force = Polynomial([0, c1, 0, 3 / 4 * c3, 0, 5 / 8 * c5])
    merged, born = (force(v) for v in np.sort([x for x in force.deriv().roots().real if x > 0]))
    # 5 % beyond the ends, with one harmonic, for which they are exact.
    for level, count in ((0.95 * born, 0), (1.05 * born, 1), (0.95 * merged, 1), (1.05 * merged, 0)):
        assert len(found("oscillator", level, n_harmonic=2)[1]) == count


def test_the_isola_of_the_chain_merges_at_the_level_of_its_first_mode() -> None:
    # Of the first mode alone, x = a (1, 1) / sqrt(2): damping c1 a' + (CUBIC / 4) a'^3, whose fundamental is largest at
    # V^2 = -16 c1 / (9 CUBIC), with the value 2 c1 V / 3; the load on the mode is F / sqrt(2).
    merged = np.sqrt(2) * 2 / 3 * MODAL * np.sqrt(-16 * MODAL / (9 * CUBIC))
    # The second mode and the quintic term change it by less than 5 %.
    assert len(found("chain", 0.95 * merged)[1]) == 1
    main, others = found("chain", 1.05 * merged)
    assert others == ()
    assert main.amplitude(0).max() > found("chain", 0.95 * merged)[1][0].amplitude(0).min()


@pytest.mark.parametrize(
    ("joint", "levels"),
    [
        (CubicSpring(name="linear", direction=ONE, stiffness=0.0), (1.0,)),
        (CubicSpring(name="hardening", direction=ONE, stiffness=0.05), (0.05, 0.2)),
        (JenkinsElement(name="pad", direction=ONE, tangential_stiffness=0.5, limit_force=0.3), (0.05, 0.3, 3.0)),
    ],
    ids=lambda item: getattr(item, "name", ""),
)
def test_systems_without_isolas_get_none_for_the_price_of_few_curves(
    joint: Joint, levels: tuple[float, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    advance, count = Continuation.advance, 0

    def counted(self: Continuation, state: object) -> object:
        nonlocal count
        count += 1
        return advance(self, state)  # type: ignore[arg-type]

    for level in levels:
        balance = HarmonicBalance(system=duffing(joint), n_harmonic=6, level=level)
        branch = frequency_response(balance, 0.5, 1.5)
        monkeypatch.setattr(Continuation, "advance", counted)
        count = 0
        assert detached_curves(balance, branch, 0.5, 1.5) == ()
        monkeypatch.setattr(Continuation, "advance", advance)
        # A step of an arc over the level costs half of a point of the curve, whose errors are estimated as well.
        assert 0 < count < 4 * len(branch.frequency)


def test_a_branch_that_the_range_cuts_off_is_found_and_is_the_curve_from_the_other_end() -> None:
    spring = CubicSpring(name="hardening", direction=ONE, stiffness=0.05)
    balance = HarmonicBalance(system=duffing(spring), n_harmonic=6, level=1.0)
    up, down = frequency_response(balance, 0.5, 1.5), frequency_response(balance, 1.5, 0.5)
    assert up.amplitude(0)[-1] > 3 * down.amplitude(0)[0]  # the range ends between the folds
    (other,) = detached_curves(balance, up, 0.5, 1.5)
    assert other.stop_reason is StopReason.REACHED
    # Both ends lie at the end of the range: the lowest is where the curve from there begins.
    ends = other.amplitude(0)[[0, -1]]
    assert other.angular_frequency[[0, -1]] == pytest.approx([1.5, 1.5], rel=1e-12)
    assert ends.min() == pytest.approx(down.amplitude(0)[0], rel=1e-8)  # Newton's tolerance


def test_levels_that_vary_with_frequency_are_those_of_the_curve() -> None:
    balance = HarmonicBalance(system=oscillator(), n_harmonic=4, level=0.02)
    branch = frequency_response(balance, 0.5, 1.5, level_power=2)
    (isola,) = detached_curves(balance, branch, 0.5, 1.5, level_power=2)
    assert isola.stop_reason is StopReason.ISOLA
    np.testing.assert_allclose(isola.level, 0.02 * isola.angular_frequency**2, rtol=1e-12)


@pytest.mark.parametrize("level", [1.0, -1.0])
def test_an_arc_over_the_level_tells_its_folds_and_the_states_between_them(level: float) -> None:
    omega, cubic = 1.4, 0.05
    balance = HarmonicBalance(
        system=duffing(CubicSpring(name="hardening", direction=ONE, stiffness=cubic)), n_harmonic=2, level=level
    )
    arc = follow_level(balance, omega, make_initial_sliders(balance, None))
    # F^2 = A^2 ((1 - Omega^2 + 3/4 cubic A^2)^2 + (c Omega)^2), a cubic in A^2.
    square = Polynomial([0, (1 - omega**2) ** 2 + (0.1 * omega) ** 2, 1.5 * cubic * (1 - omega**2), 9 / 16 * cubic**2])
    turns = np.sqrt(square(np.sort(square.deriv().roots().real)))
    # The parabola through three points that lie 40 % of the motion apart.
    assert [*arc.highest, *arc.lowest] == pytest.approx(level * turns, rel=0.05)
    amplitudes = np.sqrt(np.sort((square - level**2).roots().real))
    assert [abs(state.coefficients[1, 0]) for state in arc.states] == pytest.approx(amplitudes, rel=1e-7)


def test_an_isola_between_the_first_frequencies_is_found_where_folds_come_near_the_level(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    hardening = CubicSpring(name="hardening", direction=ONE, stiffness=0.05)
    damper = polynomial_damper(ONE, DAMPING[1], DAMPING[2])
    balance = HarmonicBalance(system=duffing(hardening, damper), n_harmonic=6, level=0.02)
    branch = frequency_response(balance, 0.5, 1.5)
    (isola,) = detached_curves(balance, branch, 0.5, 1.5)
    assert isola.stop_reason is StopReason.ISOLA
    # Without closer looks there is none: it lies between the first frequencies.
    monkeypatch.setattr("hbsolve.continuation.detached.N_HALVED", 0)
    assert detached_curves(balance, branch, 0.5, 1.5) == ()


def test_a_negative_level_has_the_isolas_of_the_positive_one() -> None:
    """The load acts half a period later, and a structure of odd forces moves half a period later."""
    (isola,) = found("absorber", 0.15)[1]
    (other,) = found("absorber", -0.15)[1]
    assert other.stop_reason is StopReason.ISOLA
    np.testing.assert_allclose(other.angular_frequency, isola.angular_frequency, rtol=1e-6)
    # Points of both are solved to 1e-9, from other starts; the isola is bent where it is long.
    np.testing.assert_allclose(other.coefficients[:, 1], -isola.coefficients[:, 1], rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("cut", ["upward", "downward"])
def test_a_curve_that_ends_within_the_range_says_why_at_either_end(cut: str) -> None:
    hardening = CubicSpring(name="hardening", direction=ONE, stiffness=0.05)
    balance = HarmonicBalance(system=duffing(hardening), n_harmonic=2)
    state = steady_state(balance, 1.0)
    search = _Search(balance, 0.5, 1.5, None, 0, None)
    whole = search.curve_through(state)
    assert whole is not None
    assert whole.stop_reason is StopReason.REACHED
    setattr(search, cut, replace(getattr(search, cut), most_points=5))
    short = search.curve_through(state)
    assert short is not None
    assert short.stop_reason is StopReason.MOST_POINTS
