"""Micro-slip, hysteresis, damped stops and elliptic friction against closed forms in a prescribed motion."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.optimize import brentq

from hbsolve.joint_law import bouc_wen, lugre, valanis
from hbsolve.joint_law.registry import SLIP, STICK
from reduction.jointed_system import (
    BoucWenJoint,
    DampedStop,
    Friction,
    FrictionContact,
    FrictionEllipse,
    JenkinsChain,
    JenkinsElement,
    Joint,
    LuGreFriction,
    ValanisJoint,
)
from tests.hbsolve.test_contact_laws import OMEGA, ONE, ROUND_OFF, Prescribed, cosine, random_motion

Array = NDArray[np.float64]
N_SAMPLE = 4096
#: Of a loop: its corners lie between instants, (2 pi / n)^2.
CORNERS = 3e-6


def loop_area(joint: Joint, amplitude: float, n_sample: int = N_SAMPLE) -> float:
    """Work of a cycle of u = A cos, in which only the sine of the force works."""
    first = Prescribed(joint, cosine(amplitude, 2), n_sample=n_sample).coefficients[1, 0]
    return float(np.pi * amplitude * first.imag)


# ---- chain of Jenkins elements

SPRINGS, LIMITS, BESIDE = np.array([3.0, 1.2, 0.7]), np.array([0.3, 0.5, 0.6]), 0.4
CHAIN = JenkinsChain(
    name="c", direction=ONE, tangential_stiffness=tuple(SPRINGS), limit_force=tuple(LIMITS), stiffness=BESIDE
)


@pytest.mark.parametrize("multiplier", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_a_chain_is_its_elements_and_its_spring(seed: int, multiplier: bool) -> None:
    motion, start = random_motion(1, seed), [0.1, -0.2, 0.05]
    chain = Prescribed(CHAIN, motion, start=start, multiplier=multiplier)
    force = BESIDE * chain.u
    for number, own in enumerate(start):
        element = JenkinsElement(
            name="j", direction=ONE, tangential_stiffness=SPRINGS[number], limit_force=LIMITS[number]
        )
        alone = Prescribed(element, motion, start=[own], multiplier=multiplier)
        force += alone.force
        np.testing.assert_allclose(chain.slider[number], alone.slider[0], atol=ROUND_OFF)
    np.testing.assert_allclose(chain.force, force, atol=ROUND_OFF)


@pytest.mark.parametrize("amplitude", [0.05, 0.3, 0.6, 2.0])
def test_the_loop_of_a_chain_is_the_sum_of_the_parallelograms(amplitude: float) -> None:
    area = 4 * np.sum(LIMITS * np.maximum(amplitude - LIMITS / SPRINGS, 0))
    assert loop_area(CHAIN, amplitude) == pytest.approx(area, rel=CORNERS, abs=ROUND_OFF)


def test_numbers_of_a_chain_have_names_of_their_own() -> None:
    assert CHAIN.parameter_names[1:4] == ("tangential_stiffness[1]", "tangential_stiffness[2]", "limit_force[0]")
    changed = CHAIN.with_values({"limit_force[1]": 0.9, "stiffness": 0.0})
    assert (changed.limit_force, changed.stiffness) == ((0.3, 0.9, 0.6), 0.0)
    assert replace(CHAIN, tangential_stiffness=2, limit_force=1).parameter_values == (2.0, 1.0, BESIDE)  # type: ignore[arg-type]


# ---- smooth hysteresis

K, K_SLIP, LIMIT = 3.0, 0.5, 0.8
REACH = LIMIT / (K - K_SLIP)
#: Motions over z_y: micro-slip to gross slip.
SHARES = [0.3, 1.0, 5.0]


def bouc(exponent: float, shape: float) -> BoucWenJoint:
    return BoucWenJoint(
        name="b", direction=ONE, tangential_stiffness=K, slip_stiffness=K_SLIP, limit_force=LIMIT, exponent=exponent,
        shape=shape,
    )  # fmt: skip


def valanis_joint(kappa: float) -> ValanisJoint:
    return ValanisJoint(
        name="v", direction=ONE, tangential_stiffness=K, slip_stiffness=K_SLIP, limit_force=LIMIT, kappa=kappa
    )


def expected_area(length: Callable[[float], float], work: Callable[[float], float], share: float) -> float:
    """Of a loop between r = -a and a of r = z / z_y: `length` of one branch over z_y and `work` of it, by a."""
    a = brentq(lambda a: length(a) - 2 * share, 1e-12, 1 - 1e-15, xtol=1e-16)
    return 2 * LIMIT * REACH * work(a)


#: Branches in closed form: dr/dx = 1 + (2 beta - 1) |r|^n before r = 0, 1 - r^n from there on.
BOUC_WEN = {
    (1.0, 0.5): (lambda a: a - np.log(1 - a), lambda a: -(a**2) / 2 - a - np.log(1 - a)),
    (2.0, 0.5): (lambda a: a + np.arctanh(a), lambda a: -(a**2) / 2 - np.log(1 - a**2) / 2),
    (2.0, 1.0): (lambda a: np.arctan(a) + np.arctanh(a), lambda a: -np.log(1 - a**4) / 2),
}


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize(("exponent", "shape"), list(BOUC_WEN))
def test_the_loop_of_bouc_and_wen_has_its_closed_area(exponent: float, shape: float, share: float) -> None:
    expected = expected_area(*BOUC_WEN[exponent, shape], share)
    assert loop_area(bouc(exponent, shape), share * REACH) == pytest.approx(expected, rel=CORNERS)


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("kappa", [0.0, 0.6, 0.99])
def test_the_loop_of_valanis_has_its_closed_area(kappa: float, share: float) -> None:
    a = kappa * (K - K_SLIP) / (K - kappa * K_SLIP)

    # dx = (1 - a r) / (1 - r) dr from -r to r = tanh t.
    t = brentq(lambda t: 2 * a * np.tanh(t) + 2 * (1 - a) * t - 2 * share, 0, 1e4, xtol=1e-16)
    expected = 2 * LIMIT * REACH * 2 * (1 - a) * (t - np.tanh(t))
    # A sharp knee is narrower than the distance of instants.
    assert loop_area(valanis_joint(kappa), share * REACH) == pytest.approx(expected, rel=CORNERS, abs=1e-7)


def test_a_sharp_knee_is_that_of_a_jenkins_element() -> None:
    chain = JenkinsChain(
        name="c", direction=ONE, tangential_stiffness=(K - K_SLIP,), limit_force=(LIMIT,), stiffness=K_SLIP
    )
    motion = random_motion(1, 4)
    sharp = Prescribed(chain, motion, n_sample=1024).force
    # The knees are rounded over 1 / n and 1 - kappa of z_y.
    for joint, rounded in ((bouc(200.0, 0.5), 0.01), (valanis_joint(1 - 1e-4), 0.001)):
        difference = Prescribed(joint, motion, n_sample=1024).force - sharp
        assert np.abs(difference).max() < rounded * LIMIT


@pytest.mark.parametrize("joint", [bouc(2.0, 0.7), valanis_joint(0.5)], ids=["bouc-wen", "valanis"])
def test_hysteresis_is_a_spring_at_first_and_its_cycle_does_not_depend_on_the_start(joint: Joint) -> None:
    tiny = Prescribed(joint, cosine(1e-9, 2))
    np.testing.assert_allclose(tiny.force, K * tiny.u, rtol=0, atol=1e-8 * K * 1e-9)  # u / z_y is 3e-9
    assert (tiny.status[0] == STICK).all()
    motion = random_motion(1, 2, mean=0.3)
    one, other = Prescribed(joint, motion), Prescribed(joint, motion, start=[0.9 * REACH])
    np.testing.assert_allclose(one.slider, other.slider, atol=1e-11)  # settled to 1e-13 of a period's change
    assert np.abs(one.u - one.slider).max() < REACH
    assert {STICK, SLIP} <= set(one.status[0])


@pytest.mark.parametrize(
    "joint", [bouc(1.0, 0.5), bouc(2.0, 1.0), valanis_joint(0.9)], ids=["linear", "square", "valanis"]
)
def test_after_any_length_of_path_the_force_is_at_its_limit(joint: Joint) -> None:
    p = Prescribed(joint, cosine(1e6 * REACH, 2), n_sample=64)
    moves = p.u[0] - np.roll(p.u[0], 1)
    far = np.abs(moves) > 100 * REACH
    # Round-off of the displacement, which is a million times as large.
    np.testing.assert_allclose((p.force - K_SLIP * p.u)[0, far], LIMIT * np.sign(moves[far]), rtol=1e-8)
    assert far.sum() > 50


def test_a_cycle_that_forgets_slowly_is_found_all_the_same() -> None:
    """In a small motion about a mean the static stretch relaxes by 1e-4 a period, at last to a mean force of zero."""
    joint = replace(bouc(2.0, 0.5), slip_stiffness=0.0)
    motion = cosine(0.01 * REACH, 2)
    motion[0] = 0.5
    p = Prescribed(joint, motion, n_sample=512)
    assert abs(p.coefficients[0, 0]) < 1e-6 * LIMIT  # the state of the middle of the loop, to the corners of it


# ---- friction by bristles

LUGRE = LuGreFriction(
    name="l", direction=ONE, tangential_stiffness=3.0, limit_force=0.5, static_force=0.5, velocity=1.0
)


@pytest.mark.parametrize("share", SHARES)
def test_bristles_under_a_constant_limit_are_the_exponential_of_dahl(share: float) -> None:
    reach = 0.5 / 3.0
    # dr/dx = 1 - r, that of Valanis for kappa = 0.
    a = np.tanh(share)
    assert loop_area(LUGRE, share * reach) == pytest.approx(2 * 0.5 * reach * 2 * (share - a), rel=CORNERS)


def test_stiff_bristles_have_the_force_of_the_velocity() -> None:
    static, v_s, sigma_2, A = 0.8, 1.3, 0.2, 1.1
    stiff = replace(LUGRE, tangential_stiffness=1e5, static_force=static, velocity=v_s, damping=sigma_2)

    def power(angle: float) -> float:
        v = OMEGA * A * abs(np.sin(angle))
        return float(v * (0.5 + (static - 0.5) * np.exp(-((v / v_s) ** 2)) + sigma_2 * v) / OMEGA)

    work = 4 * quad(power, 0, np.pi / 2)[0]
    # The bristles turn over within 1e-5 m, of 4.4 m of path.
    assert loop_area(stiff, A, n_sample=8192) == pytest.approx(work, rel=2e-5)


def test_at_rest_bristles_are_a_spring_and_a_dashpot() -> None:
    sigma_1, sigma_2, A = 0.3, 0.2, 1e-9
    joint = replace(LUGRE, bristle_damping=sigma_1, damping=sigma_2)
    f = Prescribed(joint, cosine(A, 2)).coefficients[1, 0]
    assert f == pytest.approx((3.0 + 1j * OMEGA * (sigma_1 + sigma_2)) * A, rel=1e-7)  # z / reach is 1e-8


# ---- stops with damping


@pytest.mark.parametrize("gap", [0.0, 0.4, -0.3])
def test_the_damped_stop_takes_the_work_of_its_growing_dashpot(gap: float) -> None:
    k, c, depth, A = 3.0, 0.4, 2.0, 1.1
    stop = DampedStop(name="s", direction=ONE, stiffness=k, damping=c, depth=depth, gap=gap)
    half = np.arccos(gap / A)
    cubed, wedge = 2 / 3 * A * np.sin(half) ** 3, gap * (half - np.sin(half) * np.cos(half))
    work = c / depth * OMEGA * A**2 * (cubed - wedge)
    assert loop_area(stop, A) == pytest.approx(work, rel=1e-6)  # a kink of the power between instants
    if gap >= 0:
        both = replace(stop, sides="both")
        assert loop_area(both, A) == pytest.approx(2 * work, rel=1e-6)
        odd = Prescribed(both, cosine(A, 5)).force[0]
        np.testing.assert_allclose(np.roll(odd, 128), -odd, atol=ROUND_OFF)


def test_a_damped_stop_never_pulls_and_begins_at_no_force() -> None:
    stop = DampedStop(name="s", direction=ONE, stiffness=3.0, damping=9.0, depth=0.01, gap=0.2)
    p = Prescribed(stop, cosine(1.0, 2), n_sample=N_SAMPLE)
    force, inside = p.force[0], p.u[0] > 0.2
    assert force.min() == 0.0
    assert (force[inside] == 0.0).any()  # it is released before the surfaces part
    # Within an instant, 2 pi / n of OMEGA, the indentation grows by 3e-3 of the depth of 1e-2 at most.
    touch = int(np.flatnonzero(inside & ~np.roll(inside, 1))[0])
    assert 0 <= force[touch] < 0.4 * force.max()
    np.testing.assert_allclose(
        Prescribed(replace(stop, damping=0.0), cosine(1.0, 2)).force,
        3.0 * np.maximum(Prescribed(stop, cosine(1.0, 2)).u - 0.2, 0),
        atol=ROUND_OFF,
    )


# ---- elliptic limit


def ellipse(**changes: float) -> FrictionEllipse:
    numbers = {
        "normal_stiffness": 2.0, "tangential_stiffness": 1.1, "second_tangential_stiffness": 0.7,
        "friction_coefficient": 0.4, "second_friction_coefficient": 0.25, "preload": 0.3, "gap": 0.1,
    }  # fmt: skip
    normal, one, other = np.eye(3)[[2, 0, 1]]
    return FrictionEllipse(name="e", normal=normal, tangent=one, second_tangent=other, **(numbers | changes))


@pytest.mark.parametrize("seed", range(4))
def test_the_tangential_force_stays_in_the_ellipse(seed: int) -> None:
    p = Prescribed(ellipse(), random_motion(3, seed))
    share = np.hypot(p.force[0] / 0.4, p.force[1] / 0.25)
    assert (share <= p.force[2] + ROUND_OFF).all()
    slips = p.status[0] == SLIP
    assert slips.any()
    np.testing.assert_allclose(share[slips], p.force[2, slips], atol=ROUND_OFF)
    stretch = np.array([[1.1], [0.7]]) * (p.u[:2] - p.slider)
    np.testing.assert_allclose(p.force[:2], stretch, atol=ROUND_OFF)


@pytest.mark.parametrize("multiplier", [False, True])
def test_equal_axes_are_the_isotropic_contact(multiplier: bool) -> None:
    motion, start = random_motion(3, 1), [0.1, -0.2]
    even = ellipse(second_tangential_stiffness=1.1, second_friction_coefficient=0.4)
    rows = np.eye(3)
    contact = FrictionContact(
        name="c", normal=rows[2], tangents=rows[:2], normal_stiffness=2.0, tangential_stiffness=1.1,
        friction_coefficient=0.4, preload=0.3, gap=0.1, friction=Friction.COULOMB,
    )  # fmt: skip
    one, other = (Prescribed(joint, motion, start=start, multiplier=multiplier) for joint in (even, contact))
    np.testing.assert_allclose(one.force, other.force, atol=ROUND_OFF)
    np.testing.assert_allclose(one.slider, other.slider, atol=ROUND_OFF)


def test_along_one_tangent_the_ellipse_is_its_own_axis() -> None:
    motion = random_motion(3, 2)
    for tangent, stiffness, friction in ((0, 1.1, 0.4), (1, 0.7, 0.25)):
        straight = motion.copy()
        straight[1 - tangent] = 0
        rows = np.eye(2)
        contact = FrictionContact(
            name="c", normal=rows[1], tangents=rows[:1], normal_stiffness=2.0, tangential_stiffness=stiffness,
            friction_coefficient=friction, preload=0.3, gap=0.1,
        )  # fmt: skip
        alone = Prescribed(contact, straight[[tangent, 2]]).force
        both = Prescribed(ellipse(), straight).force
        np.testing.assert_allclose(both[[tangent, 2]], alone, atol=1e-10)  # settled to 1e-11
        np.testing.assert_array_equal(both[1 - tangent], 0)


def test_on_an_elliptic_path_the_slider_follows_a_smaller_ellipse_and_takes_a_closed_work() -> None:
    """A circle in the stretched tangent, on which the spring of length r is tangent to the circle of the slider."""
    N, R, k, k_2, mu, mu_2 = 1.0, 1.0, 1.1, 0.7, 0.4, 0.25
    c, r = k_2 * mu / (k * mu_2), mu * N / k
    joint = ellipse(preload=N, gap=0.0)
    p = Prescribed(joint, [[0, R, 0], [0, 0, R / c], [0, 0, 0]], n_sample=2048)
    inner = np.sqrt(R**2 - r**2)
    np.testing.assert_allclose(np.hypot(p.slider[0], c * p.slider[1]), inner, rtol=1e-5)  # polygons: (2 pi / n)^2
    # In both tangents the force times the motion: k_1 r sin of one, k_2 r sin / c^2 of the other.
    turn = np.array([p.coefficients[1, 0], p.coefficients[1, 1]])
    work = np.pi * (R * turn[0].imag + R / c * turn[1].real)
    expected = np.pi * R * r * inner / R * (k + k_2 / c**2)
    assert work == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("equal", ["stiffness", "ratio"])
def test_sliding_is_opposed_by_friction_or_normal_to_the_ellipse(equal: str) -> None:
    mu, mu_2, k = 0.4, 0.25, 1.1
    k_2 = k if equal == "stiffness" else k * (mu_2 / mu) ** 2
    joint = ellipse(second_tangential_stiffness=k_2, preload=1.0, gap=0.0)
    c = k_2 * mu / (k * mu_2)
    p = Prescribed(joint, [[0, 1.0, 0], [0, 0, 1.0 / c], [0, 0, 0]], n_sample=2048)
    sliding = np.roll(p.slider, -1, axis=1) - np.roll(p.slider, 1, axis=1)
    way = p.force[:2] if equal == "stiffness" else p.force[:2] / np.array([[mu**2], [mu_2**2]])
    along = (way * sliding).sum(axis=0) / (np.hypot(*way) * np.hypot(*sliding))
    np.testing.assert_allclose(along, 1, atol=1e-4)  # between two instants


# ---- derivatives of a step, written out

#: Weights of the central difference of sixth order.
SIXTH = {-3: -1 / 60, -2: 3 / 20, -1: -3 / 4, 1: 3 / 4, 2: -3 / 20, 3: 1 / 60}


@pytest.mark.parametrize(
    ("law", "state", "parameters"),
    [
        (bouc_wen, [0.1], [3.0, 0.5, 0.8, 3.0, 0.7]),
        (bouc_wen, [-0.2], [3.0, 0.5, 0.8, 2.0, 0.5]),
        (valanis, [0.1], [3.0, 0.5, 0.8, 0.6]),
        (valanis, [-0.3], [3.0, 0.5, 0.8, 0.9]),
        (lugre, [0.1, 0.3], [3.0, 0.5, 0.8, 0.9, 0.2, 0.1]),
        (lugre, [-0.1, 0.2], [3.0, 0.5, 0.8, 0.9, 0.2, 0.1]),
    ],
)
@pytest.mark.parametrize("ends", [(0.0, 0.07), (0.5, 0.2), (-0.4, 1.3)])
def test_slopes_of_a_step_are_those_of_differences_of_sixth_order(
    law: object, state: Sequence[float], parameters: Sequence[float], ends: tuple[float, float]
) -> None:
    s, point = len(state), np.array([ends[1], 0.7, ends[0], *state, *parameters])

    def at(x: Array) -> tuple[Array, Array]:
        value, slope = np.zeros(1 + s), np.zeros((1 + s, len(x)))
        law.step(x[2], x[0], x[1], x[3 : 3 + s].copy(), x[3 + s :].copy(), value, slope)  # type: ignore[attr-defined]
        return value, slope

    _, exact = at(point)
    for column in range(len(point)):
        step = 2e-3 * max(abs(point[column]), 0.1)
        unit = np.eye(len(point))[column]
        difference = sum(weight * at(point + k * step * unit)[0] for k, weight in SIXTH.items()) / step
        # Of the sixth power of the step, and round-off over it.
        np.testing.assert_allclose(exact[:, column], difference, rtol=1e-9, atol=1e-11)
