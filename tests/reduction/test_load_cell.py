"""Contact forces from load cells, against their equations as written and a damper at rest in its grooves."""

import numpy as np
import pytest

from reduction.jointed_system import FrictionContact
from reduction.load_cell import (
    LineReaction,
    compute_blade_contact,
    compute_decoupler_contact,
    contact_covariance,
    contact_jacobian,
)
from reduction.static_contact import static_state

THETA, ALPHA = np.deg2rad(8.53), np.deg2rad(45.0)


@pytest.mark.parametrize("seed", range(6))
def test_both_are_the_solutions_of_their_two_equations(seed: int) -> None:
    rng = np.random.default_rng(seed)
    theta, alpha = rng.uniform(0.01, 1.5, 2)
    r3, r4, weight = rng.standard_normal(3) * 30
    c, s = np.cos(theta), np.sin(theta)
    arms = [(r3 + r4) * np.cos(alpha), (r3 - r4) * np.sin(alpha)]
    T, N = np.linalg.solve([[c, s], [-s, c]], arms)
    result = compute_decoupler_contact(r3, r4, theta, alpha)
    # Round-off of forces of 100 N.
    np.testing.assert_allclose([result.tangential, result.normal], [T, N], atol=1e-12)
    expected = np.linalg.solve([[c, s], [-s, c]], [T * c + N * s, weight + T * s - N * c])
    beyond = compute_blade_contact(result, weight, theta)
    np.testing.assert_allclose([beyond.tangential, beyond.normal], expected, atol=1e-12)


def test_arms_that_balance_known_contact_forces_give_them_back() -> None:
    # Histories, and harmonics as complex numbers.
    rng = np.random.default_rng(1)
    T, N = rng.standard_normal((2, 50)) + 1j * rng.standard_normal((2, 50))
    along, up = T * np.cos(THETA) + N * np.sin(THETA), N * np.cos(THETA) - T * np.sin(THETA)
    # R_3 cos + R_4 cos = along, R_3 sin - R_4 sin = up.
    r3, r4 = np.linalg.solve([[np.cos(ALPHA), np.cos(ALPHA)], [np.sin(ALPHA), -np.sin(ALPHA)]], np.array([along, up]))
    result = compute_decoupler_contact(r3, r4, THETA, ALPHA)
    np.testing.assert_allclose(result.tangential, T, atol=1e-14)
    np.testing.assert_allclose(result.normal, N, atol=1e-14)


def test_seen_from_the_blade_the_decoupler_comes_back() -> None:
    # The balance of the damper does not know which of its sides is which.
    there = LineReaction(tangential=np.array([3.0, -2.0]), normal=np.array([30.0, 25.0]))
    back = compute_blade_contact(compute_blade_contact(there, 54.9, THETA), 54.9, THETA)
    np.testing.assert_allclose(np.array(back), np.array(there), atol=1e-13)


def test_without_friction_each_side_has_half_of_the_weight_over_the_cosine() -> None:
    half = 54.9 / 2 / np.cos(THETA)
    beyond = compute_blade_contact(LineReaction(np.array(0.0), np.array(half)), 54.9, THETA)
    np.testing.assert_allclose(beyond.normal, half, rtol=1e-14)
    np.testing.assert_allclose(beyond.tangential, 0, atol=1e-14)


@pytest.mark.parametrize("softer", [1.0, 0.2, 7.0])
def test_a_rigid_damper_at_rest_in_its_grooves_obeys_them(softer: float) -> None:
    # Coordinates: along the damper towards the blade, and up. The groove of the de-coupler lies behind, the blade's in
    # front; each normal points out of the damper, each tangent is square to it and down.
    c, s = np.cos(THETA), np.sin(THETA)
    sides = {"decoupler": (np.array([s, c]), np.array([c, -s])), "blade": (np.array([-s, c]), np.array([-c, -s]))}
    contacts = [
        FrictionContact(
            name=name,
            normal=normal,
            tangents=tangent,
            normal_stiffness=8e6 * k,
            tangential_stiffness=5e6 * k,
            friction_coefficient=0.5,
        )
        for (name, (normal, tangent)), k in zip(sides.items(), (1.0, softer), strict=True)
    ]
    weight = 54.9
    rest = static_state(np.zeros((2, 2)), contacts, np.array([0.0, weight]))
    T, N = [float(item[0]) for item in rest.tangential], rest.normal
    assert T[0] < -0.1  # friction has its part
    beyond = compute_blade_contact(LineReaction(np.array(T[0]), np.array(N[0])), weight, THETA)
    np.testing.assert_allclose([beyond.tangential, beyond.normal], [T[1], N[1]], rtol=1e-11)


@pytest.mark.parametrize("weight", [None, 55.0])
def test_derivatives_are_those_of_differences(weight: float | None) -> None:
    at, step = np.array([22.0, -15.0, THETA, ALPHA, 55.0]), 1e-6

    def line(values: np.ndarray) -> np.ndarray:
        own = compute_decoupler_contact(*values[:4])
        return np.array(own if weight is None else compute_blade_contact(own, values[4], values[2]))

    differences = np.array([(line(at + step * one) - line(at - step * one)) / (2 * step) for one in np.eye(5)]).T
    # Central differences of forces of 30 N with a step of 1e-6.
    np.testing.assert_allclose(contact_jacobian(22.0, -15.0, THETA, ALPHA, weight), differences, atol=1e-7)


def test_equal_and_independent_cells_leave_forces_as_uncertain_as_themselves_at_45_degrees() -> None:
    jacobian = contact_jacobian(30.0, -12.0, THETA, ALPHA)
    # Sum and difference over the root of two, and a rotation: an orthogonal matrix.
    np.testing.assert_allclose(contact_covariance(jacobian, 0.04 * np.eye(2)), 0.04 * np.eye(2), atol=1e-15)
    # A wrong taper turns the force: T errs by N and N by T.
    own = compute_decoupler_contact(30.0, -12.0, THETA, ALPHA)
    wrong = contact_covariance(jacobian, np.zeros((2, 2)), theta=0.01)
    expected = 1e-4 * np.array(
        [[own.normal**2, -own.tangential * own.normal], [-own.tangential * own.normal, own.tangential**2]]
    )
    np.testing.assert_allclose(wrong, expected, rtol=1e-12)
    # A gain that both cells share is a gain of both forces.
    both = np.outer([0.30, -0.12], [0.30, -0.12])
    np.testing.assert_allclose(contact_covariance(jacobian, both), 1e-4 * np.outer(own, own), rtol=1e-12)
