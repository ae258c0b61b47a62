"""What finds a steady state where Newton's method from one start does not, on oscillators whose states are known."""

import tracemalloc
from typing import Any

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

import hbsolve.steady_state
from hbsolve.balance import HarmonicBalance
from hbsolve.condensed import Condensed
from hbsolve.continuation.response import frequency_response
from hbsolve.continuation.stop_reason import StopReason
from hbsolve.errors import BalanceError, NoSteadyState
from hbsolve.solution import solve_at
from hbsolve.state import SteadyState, make_initial_sliders
from hbsolve.steady_state import along_an_arc, from_many_starts, solve_from_other_starts, steady_state
from reduction.jointed_system import (
    CubicSpring,
    ElasticStop,
    FrictionContact,
    HertzContact,
    IwanJoint,
    JenkinsElement,
    Joint,
    JointedSystem,
)

ONE = np.ones(1)
DAMPING, CUBIC, FORCE = 0.05, 0.2, 0.3
#: Where the Duffing oscillator has three states, and where it has one on the upper branch.
THREE, ONE_HIGH = 1.5, 1.0


def duffing() -> HarmonicBalance:
    system = JointedSystem(
        mass=[[1.0]],
        damping=[[DAMPING]],
        stiffness=[[1.0]],
        joints=[CubicSpring(name="cubic", direction=ONE, stiffness=CUBIC)],
        harmonic_force=[[0.0], [FORCE]],
    )
    return HarmonicBalance(system=system, n_harmonic=2)


def amplitudes(omega: float) -> NDArray[np.float64]:
    """Of one harmonic, ascending: roots of ((1 - Omega^2 + 3/4 g z)^2 + (c Omega)^2) z = F^2 over z = A^2."""
    z = Polynomial([0, 1])
    roots = (((1 - omega**2 + 0.75 * CUBIC * z) ** 2 + (DAMPING * omega) ** 2) * z - FORCE**2).roots()
    return np.sqrt(np.sort(roots[np.abs(roots.imag) < 1e-9].real))


def none(balance: HarmonicBalance) -> object:
    return make_initial_sliders(balance, None, multiplier=False)


def test_an_arc_from_another_frequency_stays_on_its_branch() -> None:
    balance = duffing()
    low, _, high = amplitudes(THREE)
    before = steady_state(balance, ONE_HIGH)
    np.testing.assert_allclose(before.amplitude(0), amplitudes(ONE_HIGH), rtol=1e-7)
    reached = along_an_arc(balance, THREE, before, none(balance))  # type: ignore[arg-type]
    assert reached is not None
    assert (reached.angular_frequency, reached.level) == (THREE, 1.0)
    assert reached.residual_norm < 1e-9
    np.testing.assert_allclose(reached.amplitude(0), high, rtol=1e-7)  # |R| < 1e-9 of a fifteenth of it, near a fold
    # From above, along the lower branch.
    before = steady_state(balance, 2.5)
    reached = along_an_arc(balance, THREE, before, none(balance))  # type: ignore[arg-type]
    assert reached is not None
    np.testing.assert_allclose(reached.amplitude(0), low, rtol=1e-7)


@pytest.mark.parametrize("omega", [0.7, ONE_HIGH, THREE, 2.5])
def test_an_arc_from_a_low_level_ends_at_the_lowest_state(omega: float) -> None:
    balance = duffing()
    other = steady_state(balance.at_level(0.5), 0.9)
    for before in (None, other):  # a state of another level is no start
        reached = along_an_arc(balance, omega, before, none(balance))  # type: ignore[arg-type]
        assert reached is not None
        np.testing.assert_allclose(reached.amplitude(0), amplitudes(omega)[0], rtol=1e-7)


def test_no_arc_leads_to_a_force_of_zero_or_beyond_its_points(monkeypatch: pytest.MonkeyPatch) -> None:
    balance = duffing()
    assert along_an_arc(balance.at_level(0.0), 1.0, None, none(balance)) is None  # type: ignore[arg-type]
    monkeypatch.setattr(hbsolve.steady_state, "ARC_POINTS", 2)
    assert along_an_arc(balance, THREE, None, none(balance)) is None  # type: ignore[arg-type]


@pytest.mark.parametrize("given", [False, True])
def test_a_motion_from_many_starts_is_a_state(given: bool) -> None:
    balance = duffing()
    condensed = balance.at(THREE)
    x = np.array([[0.0, 3.0, 0.1]]) if given else None
    result = from_many_starts(balance, condensed, x, none(balance))  # type: ignore[arg-type]
    assert result is not None
    motion = result.motion
    assert result.residual_norm < 1e-9
    assert 0 < result.iterations <= hbsolve.steady_state.ITERATIONS
    amplitude = np.hypot(*motion[0, 1:])
    assert np.abs(amplitudes(THREE) / amplitude - 1).min() < 1e-7
    again = from_many_starts(balance, condensed, x, none(balance))  # type: ignore[arg-type]
    assert again is not None
    np.testing.assert_array_equal(again.motion, motion)  # the seed is fixed


def test_sliders_of_the_states_found_are_those_given() -> None:
    """A stuck slider at w pulls the mean to kt w / (k + kt)."""
    slider = JenkinsElement(name="slider", direction=ONE, tangential_stiffness=0.5, limit_force=1.0)
    system = JointedSystem(
        mass=[[1.0]], damping=[[0.05]], stiffness=[[1.0]], joints=[slider], harmonic_force=[[0.0], [0.05]]
    )
    balance = HarmonicBalance(system=system, n_harmonic=3)
    sliders = make_initial_sliders(balance, [0.6], multiplier=False)
    result = from_many_starts(balance, balance.at(0.9), None, sliders)
    reached = along_an_arc(balance, 0.9, None, sliders)
    assert result is not None
    assert reached is not None
    for mean in (result.motion[0, 0], reached.coefficients[0, 0].real):
        np.testing.assert_allclose(mean, 0.5 * 0.6 / 1.5, atol=1e-8)  # residual, of a motion of 0.1


def test_a_steady_state_is_found_by_few_starts_by_an_arc_and_by_many_starts(monkeypatch: pytest.MonkeyPatch) -> None:
    balance = duffing()
    before = steady_state(balance, ONE_HIGH)
    low, _, high = amplitudes(THREE)
    tried = []

    def fails(asked: HarmonicBalance, condensed: Condensed, *given: Any) -> SteadyState:
        if condensed.angular_frequency != THREE or asked.level != balance.level:
            return solve_at(asked, condensed, *given)  # where an arc begins
        tried.append("Newton")
        raise NoSteadyState("Newton's method wandered")

    def no_start(balance: HarmonicBalance, condensed: Condensed, *given: Any, failed: int = 0) -> None:
        tried.append("many" if failed else "few")

    monkeypatch.setattr(hbsolve.steady_state, "solve_at", fails)
    state = steady_state(balance, THREE)
    assert state.residual_norm < 1e-9
    assert np.abs(amplitudes(THREE) / state.amplitude(0) - 1).min() < 1e-7
    monkeypatch.setattr(hbsolve.steady_state, "from_many_starts", no_start)
    tried.clear()
    np.testing.assert_allclose(steady_state(balance, THREE, start=before).amplitude(0), high, rtol=1e-7)
    np.testing.assert_allclose(steady_state(balance, THREE).amplitude(0), low, rtol=1e-7)
    assert tried == ["Newton", "few"] * 2
    monkeypatch.setattr(hbsolve.steady_state, "ARC_POINTS", 2)
    with pytest.raises(NoSteadyState, match="Newton's method wandered; start from"):
        steady_state(balance, THREE, start=before)
    assert tried == ["Newton", "few"] * 3 + ["many"]


def test_no_start_is_tried_twice_and_they_are_the_same_as_many_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    balance, tried = duffing(), list[bytes]()
    condensed = balance.at(THREE)

    def fails(balance: HarmonicBalance, condensed: Condensed, linear: object, start: Any, *given: object) -> Any:
        tried.append(start.tobytes())
        return start, np.inf, 0

    monkeypatch.setattr(hbsolve.steady_state, "newton_at", fails)
    monkeypatch.setattr(hbsolve.steady_state, "along_an_arc", lambda *_: None)
    assert solve_from_other_starts(balance, condensed, None, none(balance)) is None
    first = tried.copy()
    tried.clear()
    assert from_many_starts(balance, condensed, None, none(balance)) is None
    assert first == tried
    assert len(set(tried)) == len(tried) > hbsolve.steady_state.FEW_STARTS


def test_many_harmonics_and_samples_take_memory_for_both_and_not_for_their_square() -> None:
    """Products of the basis at each instant would take 16,384 x 321 x 321 numbers, 13 GB."""
    slider = JenkinsElement(name="rub", direction=ONE, tangential_stiffness=1.0, limit_force=0.3)
    system = JointedSystem(
        mass=[[1.0]], damping=[[0.02]], stiffness=[[1.0]], joints=[slider], harmonic_force=[[0.0], [0.5]]
    )
    tracemalloc.start()
    state = steady_state(HarmonicBalance(system=system, n_harmonic=161, n_sample=16384), 1.3)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 1e9
    coarse = steady_state(HarmonicBalance(system=system, n_harmonic=41, n_sample=4096), 1.3)
    assert state.amplitude(0) == pytest.approx(coarse.amplitude(0), rel=1e-6)


@pytest.mark.parametrize("joint", ["friction", "jenkins", "iwan"])
def test_a_stiffer_spring_of_a_slider_changes_the_response_less_and_less(joint: str) -> None:
    """Springs that are rigid beside the structure must not lose what slips in the round-off of what sticks."""

    def amplitude(stiffness: float) -> float:
        row = np.array([1.0, 0.0])
        law = {
            "friction": lambda: FrictionContact(
                name="rub", tangents=row, normal=row[::-1], tangential_stiffness=stiffness, normal_stiffness=1.0,
                friction_coefficient=0.3, preload=0.4,
            ),
            "jenkins": lambda: JenkinsElement(
                name="rub", direction=row, tangential_stiffness=stiffness, limit_force=0.1
            ),
            "iwan": lambda: IwanJoint(
                name="rub", direction=row, tangential_stiffness=stiffness, limit_force=0.1, exponent=-0.5, ratio=0.2
            ),
        }[joint]()  # fmt: skip
        system = JointedSystem(
            mass=np.eye(2), damping=0.02 * np.eye(2), stiffness=[[2.0, -1.0], [-1.0, 2.0]], joints=[law],
            static_load=[0.0, 0.4 * (joint == "friction")], harmonic_force=[[0, 0], [0.5, 0.3]],
        )  # fmt: skip
        return steady_state(HarmonicBalance(system=system, n_harmonic=8), 1.3).amplitude(0)

    rigid = amplitude(1e6)
    # What a spring of 1e4 gives beside a structure of 2 N/m is 1e-4 of the motion, and one of 1e6 a hundredth of that.
    assert amplitude(1e4) == pytest.approx(rigid, rel=2e-3)
    for stiffness in (1e7, 1e8, 1e9):
        assert amplitude(stiffness) == pytest.approx(rigid, rel=1e-5)
    with pytest.raises(
        BalanceError, match=r'"rub" has a stiffness of 3e\+14 N/m.* 2e\+06 N/m are practically rigid there'
    ):
        amplitude(3e14)


def rubbing_pair(**load: object) -> JointedSystem:
    """Two masses, of which the second presses on the ground where the first rubs."""
    contact = FrictionContact(
        name="rub", tangents=[1.0, 0.0], normal=[0.0, 1.0], tangential_stiffness=2.0, normal_stiffness=3.0,
        friction_coefficient=0.4, preload=5.0,
    )  # fmt: skip
    return JointedSystem(
        mass=np.eye(2), damping=0.1 * np.eye(2), stiffness=[[3.0, -1.0], [-1.0, 2.0]], joints=[contact], **load
    )


def test_a_preload_without_any_load_pushes_the_structure_away_and_nothing_vibrates() -> None:
    """Its contact sticks, since 2 * 5/24 N along its tangent are less than 0.4 * 15/8 N: all is linear."""
    balance = HarmonicBalance(system=rubbing_pair(), n_harmonic=4)
    rest = np.linalg.solve([[5.0, -1.0], [-1.0, 5.0]], [0.0, -5.0])
    state = steady_state(balance, 1.3)
    np.testing.assert_allclose(state.coefficients[0], rest, rtol=1e-9)  # that of the residual
    assert not state.coefficients[1:].any()
    branch = frequency_response(balance, 0.5, 2.0)
    assert branch.stop_reason is StopReason.REACHED
    np.testing.assert_allclose(branch.coefficients[:, 0], np.tile(rest, (len(branch.frequency), 1)), rtol=1e-9)


def test_at_a_level_of_1e12_what_is_left_is_the_structure_that_slips() -> None:
    """A slider of a constant limit of 1 N is no force beside a load of 1e12 N."""
    joint = JenkinsElement(name="rub", direction=[1.0, 0.0], tangential_stiffness=2.0, limit_force=1.0)
    force = np.array([[0.0, 0.0], [1.0, 0.5]])
    mass, damping, stiffness = np.eye(2), 0.1 * np.eye(2), np.array([[3.0, -1.0], [-1.0, 2.0]])
    system = JointedSystem(
        mass=mass, damping=damping, stiffness=stiffness, joints=[joint], harmonic_force=force
    )  # fmt: skip
    state = steady_state(HarmonicBalance(system=system, n_harmonic=4, level=1e12), 1.3)
    slipping = np.linalg.solve(stiffness - 1.3**2 * mass + 1.3j * damping, 1e12 * force[1])
    np.testing.assert_allclose(state.coefficients[1], slipping, rtol=1e-8)  # ten times the residual's tolerance


def pressed_with_a_cubic_spring(preload: float, cubic: float, force: float) -> HarmonicBalance:
    """A mass that a preload of 1e4 N/m pushes against 5e4 N/m and a cubic spring, without a static load."""
    along, normal = np.eye(2)
    rub = FrictionContact(name="rub", tangents=along, normal=normal, tangential_stiffness=1e4, normal_stiffness=1e4,
                          friction_coefficient=0.3, preload=preload)  # fmt: skip
    system = JointedSystem(mass=np.eye(2), damping=2 * np.eye(2), stiffness=np.diag([1e4, 5e4]),
                           joints=[rub, CubicSpring(name="cubic", direction=normal, stiffness=cubic)],
                           harmonic_force=[[0, 0], [force, force]])  # fmt: skip
    return HarmonicBalance(system=system, n_harmonic=4)


@pytest.mark.parametrize("force", [1e-5, 1e-7, 1e-9])
def test_a_tiny_force_beside_a_preload_vibrates_about_the_pressed_place(force: float) -> None:
    """The preload moves the joint by 1.3 cm, the force by 1e-10 to 1e-14 m: 1e-9 of that is below round-off."""
    state = steady_state(pressed_with_a_cubic_spring(1000.0, 1e8, force), 100.0)
    roots = Polynomial([1000.0, 6e4, 0.0, 1e8]).roots()
    rest = float(roots[np.abs(roots.imag) < 1e-9].real[0])
    exact = force / (6e4 + 3e8 * rest**2 - 100.0**2 + 2j * 100.0)
    # Round-off of 1.3 cm is 3e-18 m.
    assert state.coefficients[0, 1].real == pytest.approx(rest, rel=1e-12)
    assert abs(state.coefficients[1, 1] - exact) < 3e-18
    assert state.iterations < 10


@pytest.mark.parametrize("force", [1e-6, 1e-8])
def test_a_tiny_force_between_stops_that_cancel_moves_as_at_a_larger_one(force: float) -> None:
    """The stops push with 1e5 N each against one another; the mass moves by 2e-13 m and less."""

    def per_force(given: float) -> complex:
        stops: list[Joint] = [
            ElasticStop(name="left", direction=ONE, stiffness=1e6, gap=-0.1),
            ElasticStop(name="right", direction=-ONE, stiffness=3.1e6, gap=-0.1 / 3.1),
            HertzContact(name="up", direction=ONE, stiffness=1e6, reference=0.1, exponent=1.5, gap=-0.0123),
            HertzContact(name="down", direction=-ONE, stiffness=1e6, reference=0.1, exponent=1.5, gap=-0.0123),
        ]
        system = JointedSystem(mass=[[1.0]], damping=[[1.0]], stiffness=[[1e5]], joints=stops,
                               harmonic_force=[[0], [given]])  # fmt: skip
        return complex(steady_state(HarmonicBalance(system=system, n_harmonic=5), 100.0).coefficients[1, 0]) / given

    # Round-off of 1e5 N, 1e-11 N, is 0.1 % of 1e-8 N.
    assert per_force(force) == pytest.approx(per_force(1e-3), rel=1e-11 / force)


def test_a_small_rest_under_a_preload_alone_is_found() -> None:
    """Newton's method may not end at 1e-9 m where all motions are 1e-11 m."""
    balance = pressed_with_a_cubic_spring(1e-6, 1e26, 1.0).at_level(0.0)
    # 1e-6 N + 6e4 N/m u + 1e26 N/m^3 u^3 = 0 with u = 1e-11 m v.
    roots = Polynomial([1.0, 0.6, 0.0, 0.1]).roots()
    rest = 1e-11 * float(roots[np.abs(roots.imag) < 1e-9].real[0])
    assert steady_state(balance, 100.0).coefficients[0, 1].real == pytest.approx(rest, rel=1e-9)
