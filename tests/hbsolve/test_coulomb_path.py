"""Coupled Coulomb friction: exact along straight paths, and so of second order in the samples."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

from hbsolve.aft import InitialSliders, JointForces, joint_forces
from hbsolve.balance import HarmonicBalance
from hbsolve.contact_motion import contact_motion
from hbsolve.joint_arrays import make_joint_table
from hbsolve.joint_law import coulomb
from hbsolve.joint_law.registry import FORCE, PARAMETERS, SLIP, STICK, LawOutput
from hbsolve.sampling import sampling
from hbsolve.state import SteadyState
from hbsolve.steady_state import steady_state
from hbsolve.truncation import truncation
from reduction.jointed_system import Friction, FrictionContact, JointedSystem
from transient.steady import steady_motion

Array = NDArray[np.float64]
KT, KN, MU = 1.1, 2.0, 0.4
#: The iteration ends when a period moves the slider by less than 1e-11 of its motion.
SETTLED = 1e-10


def along(path: Array) -> tuple[Array, NDArray[np.int64]]:
    """Tangential force (2, n) [N] and status (n,) of a contact whose samples are the points of a closed path (3, n)."""
    n = path.shape[1]
    out = LawOutput(
        np.zeros((3, n)), np.zeros((3, 3, 9)), np.zeros(3, np.int64), np.zeros((5, 3, n)), np.zeros((2, 3, n)),
        np.zeros((3, n)), np.zeros((2, n)), np.zeros((2, n), np.int64), np.zeros(1, np.int64),
    )  # fmt: skip
    parameters, none = np.array([KT, KN, MU, 0.0, 0.0]), np.zeros(2, np.int64)
    samples = sampling(2, n)
    coulomb.force(
        path, np.zeros_like(path), 1.0, np.zeros(3), parameters, np.zeros(2), none, samples, FORCE, out
    )  # fmt: skip
    return out.force[:2], out.status[0]


def subdivided(path: Array, parts: int) -> Array:
    """The same closed path with points between its corners."""
    share = np.arange(parts) / parts
    onward = np.roll(path, -1, axis=1) - path
    points: Array = (path[:, :, None] + onward[:, :, None] * share).reshape(3, -1)
    return points


@pytest.mark.parametrize("side", [1.0, 2.0, 5.0])
@pytest.mark.parametrize("parts", [1, 3])
def test_round_a_square_four_samples_are_enough(side: float, parts: int) -> None:
    """The spring lags behind each side by delta. Past a corner it slackens, and is taut again at the mirrored angle
    after 2 r sin(delta) of the side; a tractrix leads over the rest of it to the same delta."""
    N = 1.5
    r = MU * N / KT

    def unclosed(delta: float) -> float:
        slid = side - 2 * r * np.sin(delta)
        return float(np.tan(delta / 2) - np.exp(-slid / r) * np.tan(np.pi / 4 - delta / 2))

    delta = brentq(unclosed, 0.0, np.pi / 4, xtol=1e-14)
    corners = np.array([[0.0, 1.0, 1.0, 0.0], [0.0, 0.0, 1.0, 1.0], np.zeros(4)]) * side
    corners[2] = N / KN
    force, status = along(subdivided(corners, parts))
    # At corner 1 the side along the first tangent ends, and the spring still points below it.
    expected = MU * N * np.array([np.cos(delta), -np.sin(delta)])
    np.testing.assert_allclose(force[:, parts], expected, atol=SETTLED)
    assert (status[::parts] == SLIP).all()


@pytest.mark.parametrize("seed", range(12))
def test_points_on_straight_paths_change_nothing(seed: int) -> None:
    """With a limit that varies linearly, down to zero at one corner; stick, slip and its onset between the samples."""
    random = np.random.default_rng(seed)
    path = random.normal(size=(3, 12)) * [[0.5], [0.4], [0.0]]
    path[2] = random.uniform(0.0, 0.9, 12)
    path[2, 5] = 0.0
    coarse, _ = along(path)
    fine, status = along(subdivided(path, 7))
    np.testing.assert_allclose(coarse, fine[:, ::7], atol=SETTLED)
    assert min(np.count_nonzero(status == STICK), np.count_nonzero(status == SLIP)) > 5


@pytest.mark.parametrize("seed", range(12))
def test_a_cycle_that_settles_slowly_is_where_many_periods_lead(seed: int) -> None:
    """A path 300 times round is one long period, which is iterated; a spring that hardly slips turns little in each.

    Some cycles slip, some only stick.
    """
    random = np.random.default_rng([seed, 1])
    angle = 2 * np.pi * np.arange(24) / 24
    N = 1.5 + 0.3 * random.uniform() * np.cos(angle + random.uniform(0, 6))
    radius = MU * N.min() / KT
    path = np.array([np.cos(angle), random.uniform(0.0, 0.6) * np.sin(angle + 1.0), N / KN])
    path[:2] *= radius * random.uniform(1.05, 1.3)
    path[:2] += [[radius], [0.3 * radius]]
    once, status = along(path)
    many, _ = along(np.tile(path, 300))
    assert np.count_nonzero(status == SLIP) < 20
    np.testing.assert_allclose(once, many[:, -24:], atol=SETTLED)


@pytest.mark.parametrize("seed", range(40))
def test_a_contact_that_sticks_after_a_start_beyond_its_limit_is_derived_through_that_slip(seed: int) -> None:
    """Its spring ends on the limit, where round-off decides whether it slips in each period."""
    random = np.random.default_rng([seed, 2])
    contact = replace(pad(0.4), preload=1.0)
    x = np.zeros((3, 5))
    x[0, :2], x[1, 0], x[2, 3] = [0.7, 0.1], random.uniform(-0.3, 0.3), random.choice([0.0, 0.2])
    begin = random.uniform(-0.2, 0.2, 2)

    def forces(x: Array, begin: Array, want: int) -> JointForces:
        start = InitialSliders(begin, np.zeros(2, np.int64))
        result: JointForces = joint_forces(x, 1.0, make_joint_table([contact]), start, sampling(3, 64), want)
        return result

    exact, step = forces(x, begin, PARAMETERS), 1e-6
    for number in range(2):
        shift = step * np.eye(2)[number]
        high, low = (forces(x, begin + sign * shift, FORCE).coefficients for sign in (1, -1))
        np.testing.assert_allclose(exact.by_start[number], (high - low) / (2 * step), atol=1e-6)
    for b in (0, 1):
        moved = np.zeros_like(x)
        moved[0, b] = step
        high, low = (forces(x + sign * moved, begin, FORCE).coefficients for sign in (1, -1))
        np.testing.assert_allclose(exact.jacobian[:, :, b], (high - low) / (2 * step), atol=1e-6)


def test_the_error_of_a_prescribed_motion_falls_by_four_with_twice_the_samples() -> None:
    contact = pad(0.3)
    x = np.array([[0.0, 1.0, 0.0, 0.0, 0.1], [0.0, 0.2, 0.7, 0.1, 0.0], [0.8, 0.1, 0.15, 0.0, 0.05]])

    def force(n_sample: int) -> Array:
        start = InitialSliders(np.zeros(2), np.zeros(2, np.int64))
        forces = joint_forces(x, 1.0, make_joint_table([contact]), start, sampling(3, n_sample), FORCE)
        assert (forces.status[0] == SLIP).all()
        coefficients: Array = forces.coefficients[:2]
        return coefficients

    exact = force(16384)
    errors = [np.linalg.norm(force(n) - exact) for n in (64, 128, 256, 512)]
    # h^2 (1 + O(h^2)); the reference itself is off by (512 / 16384)^2 of the last.
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 4, rtol=0.02)


# ---- a contact that slips all the time, near resonance


def pad(friction_coefficient: float) -> FrictionContact:
    return FrictionContact(
        name="pad", normal=np.array([0.0, 0.0, 1.0]), tangents=np.eye(3)[:2], normal_stiffness=2.0,
        tangential_stiffness=1.0, friction_coefficient=friction_coefficient, preload=0.0, friction=Friction.COULOMB,
    )  # fmt: skip


def slipping() -> JointedSystem:
    force = np.zeros((2, 3), dtype=complex)
    force[1] = [0.3, 0.24j, 0.1]
    return JointedSystem(
        mass=np.eye(3), damping=0.05 * np.eye(3), stiffness=np.diag([1.0, 1.1, 0.8]), joints=[pad(0.3)],
        static_load=np.array([0.0, 0.0, 0.8]), harmonic_force=force,
    )  # fmt: skip


OMEGA, HIGHEST = 1.05, 8


def solved(n_sample: int = 0) -> tuple[HarmonicBalance, SteadyState]:
    balance = HarmonicBalance(system=slipping(), n_harmonic=HIGHEST + 1, n_sample=n_sample)
    return balance, steady_state(balance, OMEGA)


def relative(value: NDArray[np.complex128], exact: NDArray[np.complex128]) -> float:
    return float(np.linalg.norm(value - exact) / np.linalg.norm(exact))


def test_with_the_samples_chosen_by_default_a_contact_that_always_slips_is_right() -> None:
    balance, state = solved()
    (motion,) = contact_motion(balance, state)
    assert (motion.status == SLIP).all()
    _, fine = solved(8192)
    error = relative(state.coefficients[1], fine.coefficients[1])
    assert error < 5e-4  # 2.4e-4 at 256; radial return had 8e-3
    witness = steady_motion(slipping(), OMEGA, tolerance=1e-7, steps_per_period=2048, max_steps_per_period=2048)
    integrated = witness.coefficients(2)[1]
    assert relative(state.coefficients[1], integrated) < 5e-4
    assert relative(fine.coefficients[1], integrated) < 5e-5  # its steps, 64 times finer in h^2, and harmonics above 8


def test_the_error_of_a_contact_that_always_slips_falls_by_four_and_is_known() -> None:
    _, fine = solved(8192)
    errors = []
    for n_sample in (64, 128, 256, 512):
        balance, state = solved(n_sample)
        errors.append(relative(state.displacement[1], fine.displacement[1]))
        # What three quarters of the error change is one Newton step: the square of some thousandths is left.
        np.testing.assert_allclose(4 / 3 * truncation(balance, state).samples, errors[-1], rtol=0.03)
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 4, rtol=0.05)  # the reference: (512 / 8192)^2


@pytest.mark.parametrize("friction", list(Friction))
def test_a_contact_that_moves_along_one_line_agrees_with_time_integration(friction: Friction) -> None:
    """Its force opposes the sliding to the last digit where the load falls faster than the spring is stretched."""
    contact = replace(pad(0.56), normal_stiffness=1.4, tangential_stiffness=1.25, preload=0.32, friction=friction)
    force = np.zeros((2, 3), dtype=complex)
    force[1] = [0.72, 0.0, 1.89 * np.exp(0.42j)]
    system = JointedSystem(
        mass=np.eye(3), damping=0.1 * np.eye(3), stiffness=np.diag([1.0, 1.3, 1.6]), joints=[contact],
        static_load=np.array([0.0, 0.0, 0.32]), harmonic_force=force,
    )  # fmt: skip
    steady = steady_motion(system, 0.695, tolerance=1e-7, steps_per_period=1024, max_steps_per_period=1024)
    state = steady_state(HarmonicBalance(system=system, n_harmonic=40, n_sample=2048), 0.695)
    amplitude = np.abs(state.coefficients[1]).max()
    # Harmonics above 39 of an impact, 2,048 samples of a contact that closes between two: the largest is 6e-5.
    np.testing.assert_allclose(steady.coefficients(3), state.coefficients[:3], rtol=0, atol=3e-4 * amplitude)
    assert not state.coefficients[:, 1].any()
