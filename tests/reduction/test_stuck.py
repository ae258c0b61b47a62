"""Stiffness with stuck contacts, and damping by its first mode, against eigenvectors of a general solver."""

import numpy as np
import pytest
import scipy.linalg
from numpy.typing import NDArray

from geometry.errors import InputError
from reduction.errors import JointError
from reduction.jointed_system import CubicSpring, ElasticStop, FrictionContact, JenkinsElement, Joint
from reduction.stuck import stuck_damping, stuck_stiffness

Array = NDArray[np.float64]


def contact(normal: Array, tangents: Array) -> FrictionContact:
    return FrictionContact(
        name="contact", normal=normal, tangents=tangents, normal_stiffness=3.0, tangential_stiffness=2.0,
        friction_coefficient=0.5,
    )  # fmt: skip


def random_structure(seed: int, n: int = 5) -> tuple[Array, Array, Array]:
    rng = np.random.default_rng(seed)
    a, b = rng.standard_normal((2, n, n))
    mass, stiffness = a @ a.T + n * np.eye(n), b @ b.T
    return mass, stiffness, stuck_stiffness(stiffness, [contact(rng.standard_normal(n), rng.standard_normal((2, n)))])


def first_mode(mass: Array, stuck: Array, number: int = 0) -> tuple[float, Array]:
    lambda_, shapes = scipy.linalg.eigh(stuck, mass)
    return float(np.sqrt(lambda_[number])), shapes[:, number]


def test_contacts_and_sliders_are_springs_and_others_nothing() -> None:
    rng = np.random.default_rng(1)
    n, t, u, s, d = rng.standard_normal((5, 4))
    joints: list[Joint] = [
        contact(n, np.array([t, u])),
        JenkinsElement(name="slider", direction=s, tangential_stiffness=7.0, limit_force=0.0),
        CubicSpring(name="cubic", direction=d, stiffness=1e9),
        ElasticStop(name="stop", direction=d, stiffness=1e9, gap=-1.0),
    ]
    bare = np.diag([1.0, 2.0, 3.0, 0.0])
    before = bare.copy()
    stuck = stuck_stiffness(bare, joints)
    for q in rng.standard_normal((4, 4)):
        energy = 3 * (n @ q) ** 2 + 2 * (t @ q) ** 2 + 2 * (u @ q) ** 2 + 7 * (s @ q) ** 2
        np.testing.assert_allclose(q @ stuck @ q - q @ before @ q, energy, rtol=1e-12)
    np.testing.assert_array_equal(bare, before)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("ratio", [0.0, 0.002, 0.3])
def test_the_first_stuck_mode_has_the_ratio_that_was_asked(seed: int, ratio: float) -> None:
    mass, stiffness, stuck = random_structure(seed)
    omega, shape = first_mode(mass, stuck)
    damping = stuck_damping(mass, stiffness, stuck, ratio)
    np.testing.assert_allclose(shape @ damping @ shape, 2 * ratio * omega, rtol=1e-9)


def test_springs_of_contacts_are_no_part_of_it() -> None:
    mass, stiffness, stuck = random_structure(7)
    damping = stuck_damping(mass, stiffness, stuck, 0.01)
    omega, shape = first_mode(mass, stuck)
    # What contacts have of the mode's stiffness, the mass takes.
    contacts = 1 - shape @ stiffness @ shape / omega**2
    assert contacts > 0.01
    expected = 0.01 * omega * (1 + contacts) * mass + 0.01 / omega * stiffness
    # As good as the frequency from the inverse.
    np.testing.assert_allclose(damping, expected, atol=1e-9 * np.abs(damping).max())


def test_without_contacts_it_is_half_from_mass_and_half_from_stiffness() -> None:
    mass, stiffness, _ = random_structure(3)
    omega, _shape = first_mode(mass, stiffness)
    expected = 0.02 * omega * mass + 0.02 / omega * stiffness
    np.testing.assert_allclose(stuck_damping(mass, stiffness, stiffness, 0.02), expected, rtol=1e-8)


def test_rigid_body_motion_of_the_stuck_structure_does_not_count() -> None:
    # Three masses in a row, free in space: the second and third stick together.
    mass = np.diag([1.0, 2.0, 3.0])
    stiffness = 5.0 * np.array([[1.0, -1, 0], [-1, 1, 0], [0, 0, 0]])
    stuck = stuck_stiffness(stiffness, [contact(np.array([0.0, 1, -1]), np.array([[0.0, 1, -1]]))])
    omega, shape = first_mode(mass, stuck, 1)
    assert omega > 0.5
    damping = stuck_damping(mass, stiffness, stuck, 0.05)
    np.testing.assert_allclose(shape @ damping @ shape, 2 * 0.05 * omega, rtol=1e-9)


def test_where_contacts_alone_hold_the_body_the_mass_damps_it() -> None:
    # Two masses on a stiff spring, each on the same contact spring: they move as one, their spring does not strain.
    mass, stiffness = np.eye(2), 1e4 * np.array([[1.0, -1], [-1, 1]])
    stuck = stuck_stiffness(stiffness, [contact(np.array([1.0, 0]), np.array([[1.0, 0]])),
                                        contact(np.array([0.0, 1]), np.array([[0.0, 1]]))])  # fmt: skip
    omega = np.sqrt(5.0)  # 3 + 2 N/m on each kilogram
    damping = stuck_damping(mass, stiffness, stuck, 0.01)
    together = np.ones(2) / np.sqrt(2)
    np.testing.assert_allclose(together @ damping @ together, 2 * 0.01 * omega, rtol=1e-9)
    assert np.isfinite(damping).all()
    # No stiffness at all is the same case.
    np.testing.assert_allclose(stuck_damping(mass, 0 * mass, 5 * mass, 0.01), 2 * 0.01 * omega * mass, rtol=1e-12)


def test_a_body_that_contacts_hold_almost_alone_does_not_overdamp_its_other_modes() -> None:
    # A stiff spring between the masses, a very soft one to the ground, and contacts of 5 N/m below each.
    mass, stiffness = np.eye(2), 1e4 * np.array([[1.0, -1], [-1, 1]]) + 1e-6 * np.eye(2)
    stuck = stiffness + 5 * np.eye(2)
    lambda_, shapes = scipy.linalg.eigh(stuck, mass)
    damping = stuck_damping(mass, stiffness, stuck, 0.01)
    ratio = np.einsum("rm,rs,sm->m", shapes, damping, shapes) / (2 * np.sqrt(lambda_))
    # Squared frequencies of 5 and 2e4: the first one keeps twelve digits.
    np.testing.assert_allclose(ratio[0], 0.01, rtol=1e-9)
    # Stiffness alone gives the second mode the ratio 0.01 / 2 times that of the frequencies, some 63.
    assert 0.3 < ratio[1] < 0.4


def test_the_mode_is_the_first_that_moves_along_a_given_row() -> None:
    mass, stiffness = np.diag([1.0, 2.0, 3.0]), np.diag([1.0, 8.0, 27.0])  # omega = 1, 2, 3 rad/s
    for row, number in (
        ([0.0, 0, 5], 2),
        ([0, 1, 1], 1),
        ([1, 1, 1], 0),
        ([1e-6, 1, 0], 1),
        ([5e-3, 1, 0], 0),
        ([0, 0, 0], 0),
    ):
        damping = stuck_damping(mass, stiffness, stiffness, 0.01, np.array(row, dtype=float))
        # Of a diagonal system the ratio of one mode is that of its own oscillator.
        own = damping[number, number] / (2 * mass[number, number] * (number + 1))
        np.testing.assert_allclose(own, 0.01, rtol=1e-12)
        others = np.delete(np.diag(damping) / (2 * np.diag(mass) * np.array([1, 2, 3])), number)
        assert (others > 0.0101).all()


def test_a_ratio_of_one_is_refused() -> None:
    mass, stiffness, stuck = random_structure(1)
    with pytest.raises(InputError, match=r"damping_ratio = 1 must lie in \[0, 1\)"):
        stuck_damping(mass, stiffness, stuck, 1.0)


def test_a_structure_without_an_elastic_mode_is_refused() -> None:
    with pytest.raises(JointError, match="with all contacts stuck no mode is elastic"):
        stuck_damping(np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)), 0.01)


@pytest.mark.filterwarnings("error")
def test_a_joint_whose_stiffness_is_beyond_all_numbers_is_refused() -> None:
    joint = JenkinsElement(name="wall", direction=[1e308], tangential_stiffness=1.0, limit_force=1.0)
    with pytest.raises(JointError, match='joint "wall" is too stiff'):
        stuck_stiffness(np.eye(1), [joint])
