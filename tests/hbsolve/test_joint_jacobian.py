"""The derivatives of every joint law are exact: against central differences of the force itself."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from hbsolve.aft import InitialSliders, JointForces, joint_forces
from hbsolve.joint_arrays import make_joint_table
from hbsolve.joint_law.registry import JACOBIAN, PARAMETERS, SEPARATED, SLIP, STICK
from hbsolve.sampling import Sampling, sampling
from reduction.jointed_system import (
    CubicSpring,
    ElasticStop,
    Friction,
    FrictionContact,
    JenkinsElement,
    Joint,
    QuadraticDamper,
)

N_HARMONIC, N_SAMPLE, OMEGA = 4, 128, 1.7
#: Step of the differences and the relative error allowed: round-off over the step is 1e-10, the next term of Taylor's
#: series 1e-13; a force is piecewise smooth, and no fixed motion below has a kink within a step of any instant.
STEP, TOLERANCE = 1e-6, 1e-6


def contact(n_tangent: int, friction: Friction = Friction.UNCOUPLED, gap: float = 0.1) -> FrictionContact:
    rows = np.eye(n_tangent + 1)
    return FrictionContact(
        name="contact",
        normal=rows[-1],
        tangents=rows[:-1],
        normal_stiffness=2.0,
        tangential_stiffness=1.1,
        friction_coefficient=0.4,
        preload=0.3,
        gap=gap,
        friction=friction,
    )


ONE = np.ones(1)
LAWS: dict[str, Joint] = {
    "one tangent": contact(1),
    "interference": contact(1, gap=-0.2),
    "two tangents": contact(2),
    "Coulomb": contact(2, Friction.COULOMB),
    "Jenkins": JenkinsElement(name="slider", direction=ONE, tangential_stiffness=1.3, limit_force=0.3),
    "cubic": CubicSpring(name="cubic", direction=ONE, stiffness=0.7),
    "stop": ElasticStop(name="stop", direction=ONE, stiffness=3.0, gap=0.2),
    "compressed stop": ElasticStop(name="stop", direction=ONE, stiffness=3.0, gap=-0.2),
    "quadratic damper": QuadraticDamper(name="drag", direction=ONE, damping=0.3),
}
SLIDING = [name for name, joint in LAWS.items() if isinstance(joint, FrictionContact | JenkinsElement)]
#: Amplitude of the tangents, and mean and amplitude of the normal (or only) direction.
MOTIONS = {
    "stuck": (0.03, 0.5, 0.05),
    "stick and slip": (0.4, 0.6, 0.15),
    "with lift-off": (0.4, 0.1, 0.3),
    "mostly apart": (0.5, -0.4, 0.35),
    "violent": (2.0, 0.0, 1.5),
}

#: Contacts whose tangents do not move yet: each instant without load lets them go.
WITHOUT_SLIDING = {"bouncing": (0.0, 0.1, 0.3), "apart": (0.0, -1.0, 0.1)}


def motion_of(joint: Joint, kind: str, seed: int) -> NDArray[np.float64]:
    tangent, mean, normal = (MOTIONS | WITHOUT_SLIDING)[kind]
    d, nh = len(joint.directions), 2 * N_HARMONIC - 1
    x = np.random.default_rng(seed).normal(size=(d, nh)) / np.sqrt(nh)
    x[:-1] *= tangent
    x[-1] *= tangent if isinstance(joint, JenkinsElement) else normal
    x[-1, 0] += mean
    return x


def start_of(joint: Joint, by_multiplier: int, seed: int) -> InitialSliders:
    """Sliders off the middle, near enough to the motion that a stuck contact stays on them."""
    count = int(make_joint_table([joint]).slider[-1])
    share = np.random.default_rng(seed + 100).uniform(0.2, 0.7, count) * [1, -1][:count]
    return InitialSliders(share if by_multiplier else 0.1 * share, np.full(count, by_multiplier))


def central(evaluate: Callable[[NDArray[np.float64]], JointForces], at: NDArray[np.float64]) -> NDArray[np.float64]:
    """d coefficients / d at, the axes of `at` last."""
    columns = []
    for index in np.ndindex(at.shape):
        step = np.zeros_like(at)
        step[index] = STEP
        columns.append((evaluate(at + step).coefficients - evaluate(at - step).coefficients) / (2 * STEP))
    return np.stack(columns, axis=-1).reshape(*columns[0].shape, *at.shape)


def check(exact: NDArray[np.float64], differences: NDArray[np.float64]) -> None:
    scale = max(1.0, float(np.abs(differences).max(initial=0.0)))
    np.testing.assert_allclose(exact, differences, rtol=0, atol=TOLERANCE * scale)


@pytest.mark.parametrize("by_multiplier", [0, 1], ids=["positions", "multipliers"])
@pytest.mark.parametrize("kind", MOTIONS)
@pytest.mark.parametrize("law", LAWS)
def test_derivatives_equal_central_differences(law: str, kind: str, by_multiplier: int) -> None:
    check_derivatives(LAWS[law], kind, by_multiplier)


@pytest.mark.parametrize("by_multiplier", [0, 1], ids=["positions", "multipliers"])
@pytest.mark.parametrize("kind", WITHOUT_SLIDING)
@pytest.mark.parametrize("law", [name for name, joint in LAWS.items() if isinstance(joint, FrictionContact)])
def test_derivatives_equal_central_differences_before_a_contact_slides(law: str, kind: str, by_multiplier: int) -> None:
    check_derivatives(LAWS[law], kind, by_multiplier)


def check_derivatives(joint: Joint, kind: str, by_multiplier: int) -> None:
    table, samples = make_joint_table([joint]), sampling(N_HARMONIC, N_SAMPLE)
    for seed in range(3):
        x, start = motion_of(joint, kind, seed), start_of(joint, by_multiplier, seed)
        exact = joint_forces(x, OMEGA, table, start, samples, PARAMETERS)
        d, nh = x.shape
        jacobian = exact.jacobian.reshape(d, nh, 3, nh)
        check(jacobian[:, :, :d], central(lambda y, s=start: evaluate(y, table, s, samples), x))
        assert not jacobian[:, :, d:].any()
        check(
            np.moveaxis(exact.by_parameter[:, :d], 0, -1),
            central(lambda v, y=x, s=start: evaluate(y, table._replace(value=v), s, samples), table.value),
        )
        check(
            exact.by_frequency,
            central(lambda w, y=x, s=start: evaluate(y, table, s, samples, w[0]), np.array([OMEGA]))[..., 0],
        )
        if len(start.value):
            check(
                np.moveaxis(exact.by_start[:, :d], 0, -1),
                central(
                    lambda v, y=x, s=start: evaluate(y, table, InitialSliders(v, s.by_multiplier), samples), start.value
                ),
            )


def evaluate(
    x: NDArray[np.float64], table: object, start: InitialSliders, samples: Sampling, omega: float = OMEGA
) -> JointForces:
    forces: JointForces = joint_forces(x, omega, table, start, samples, 0)
    return forces


@pytest.mark.parametrize("law", LAWS)
def test_the_jacobian_is_exact_for_any_linear_reference(law: str) -> None:
    """As along a branch over a contact stiffness: the reference stays where the branch began."""
    joint, samples = LAWS[law], sampling(N_HARMONIC, N_SAMPLE)
    table = make_joint_table([joint])
    table = table._replace(reference=0.8 * table.reference)
    for kind in MOTIONS:
        x, start = motion_of(joint, kind, 0), start_of(joint, 0, 0)
        d, nh = x.shape
        exact = joint_forces(x, OMEGA, table, start, samples, PARAMETERS)
        differences = central(lambda y, s=start: evaluate(y, table, s, samples), x)
        check(exact.jacobian.reshape(d, nh, 3, nh)[:, :, :d], differences)
        for item, rows in enumerate(exact.active):
            assert np.abs(differences[item, rows:]).max(initial=0.0) < TOLERANCE


@pytest.mark.parametrize("law", LAWS)
def test_rows_that_are_not_active_are_zero_and_fewer_wants_give_the_same(law: str) -> None:
    joint = LAWS[law]
    table, samples = make_joint_table([joint]), sampling(N_HARMONIC, N_SAMPLE)
    for kind in MOTIONS:
        x, start = motion_of(joint, kind, 0), start_of(joint, 1, 0)
        force, jacobian, everything = (joint_forces(x, OMEGA, table, start, samples, want) for want in (0, 1, 2))
        for d, rows in enumerate(jacobian.active):
            # Where all instants are open, the closed spring less all of them leaves round-off.
            assert np.abs(jacobian.jacobian[d, rows:]).max(initial=0.0) < 1e-13
        np.testing.assert_array_equal(jacobian.jacobian, everything.jacobian)
        np.testing.assert_array_equal(force.coefficients, everything.coefficients)


@pytest.mark.parametrize("by_multiplier", [0, 1], ids=["positions", "multipliers"])
@pytest.mark.parametrize("law", SLIDING)
def test_the_start_matters_where_a_contact_sticks_and_is_forgotten_where_it_slips(law: str, by_multiplier: int) -> None:
    joint = LAWS[law]
    table, samples = make_joint_table([joint]), sampling(N_HARMONIC, N_SAMPLE)
    start = start_of(joint, by_multiplier, 0)
    # A mean far from the sliders would slip at once under positions; the tangents swing about zero.
    x = motion_of(joint, "stuck", 0)
    x[: max(len(x) - 1, 1), 0] = 0.0
    stuck = joint_forces(x, OMEGA, table, start, samples, PARAMETERS)
    assert (stuck.status[0] == STICK).all()
    for s in range(len(start.value)):
        assert abs(stuck.by_start[s, s, 0]) > 0.1  # k_t = 1.1 or 1.3, or mu N about 0.3
        assert np.abs(stuck.by_start[s, :, 1:]).max() < 1e-12  # a constant force: round-off of the sums alone
    if joint.directions.shape[0] < 3 or joint is LAWS["two tangents"]:
        moving = joint_forces(motion_of(joint, "violent", 0), OMEGA, table, start, samples, PARAMETERS)
        assert not moving.by_start.any()


@pytest.mark.parametrize("law", ["one tangent", "Jenkins"])
def test_a_slider_that_was_dragged_to_rest_gives_no_harmonics(law: str) -> None:
    """It touches its limit at one instant of each period: the force and its derivative are those of a stuck contact."""
    joint = LAWS[law]
    table, samples = make_joint_table([joint]), sampling(N_HARMONIC, N_SAMPLE)
    x = motion_of(joint, "stuck", 0)
    x[0, 0] = 1.0
    forces = joint_forces(x, OMEGA, table, start_of(joint, 0, 0), samples, JACOBIAN)
    assert (forces.slider[0] != start_of(joint, 0, 0).value[0]).all()
    assert forces.coefficients[0, 0] != 0.0
    assert not forces.coefficients[0, 1:].any()
    assert forces.active[0] == 1
    assert not forces.jacobian[0, 1:].any()
    assert forces.jacobian[0, 0].any()


def test_the_motions_hold_all_three_states() -> None:
    samples = sampling(N_HARMONIC, N_SAMPLE)
    for law in ("one tangent", "two tangents", "Coulomb"):
        joint, seen = LAWS[law], np.zeros(3, dtype=np.int64)
        for kind in MOTIONS:
            forces = evaluate(motion_of(joint, kind, 0), make_joint_table([joint]), start_of(joint, 0, 0), samples)
            seen += np.bincount(forces.status[0], minlength=3)
        assert seen[[STICK, SLIP, SEPARATED]].min() > 50, (law, seen)
