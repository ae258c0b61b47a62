"""Micro-slip and hysteresis against closed forms in a prescribed motion."""

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
