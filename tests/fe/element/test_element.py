"""What every table of shape functions must satisfy, whichever element it describes."""

from itertools import product
from math import factorial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from fe.element import HEX8, HEX20, TET10, Element
from fe.quadrature import gauss_hexahedron, gauss_tetrahedron

# Sums of at most twenty products of numbers near one.
ROUND_OFF = 1e-14


def inside(seed: int, n: int = 5) -> NDArray[np.float64]:
    """Points of the cube around every reference cell: polynomials need not stay inside theirs."""
    return np.random.default_rng(seed).uniform(-1, 1, (n, 3))


def monomials(degree: int) -> list[tuple[int, int, int]]:
    return [(i, j, k) for i, j, k in product(range(degree + 1), repeat=3) if i + j + k <= degree]


def power(points: NDArray[np.float64], exponents: tuple[int, int, int]) -> NDArray[np.float64]:
    return np.asarray((points ** np.array(exponents)).prod(axis=-1))


def test_each_shape_function_is_one_at_its_node_and_zero_at_the_others(element: Element) -> None:
    np.testing.assert_allclose(element.shape(element.nodes), np.eye(element.n_node), atol=ROUND_OFF)


@given(seed=st.integers(0, 2**32 - 1))
def test_shape_functions_sum_to_one_and_their_gradients_to_zero(element: Element, seed: int) -> None:
    points = inside(seed)
    np.testing.assert_allclose(element.shape(points).sum(axis=1), 1, atol=ROUND_OFF)
    np.testing.assert_allclose(element.gradient(points).sum(axis=1), 0, atol=ROUND_OFF)


@given(seed=st.integers(0, 2**32 - 1))
def test_polynomials_of_the_stated_degree_are_interpolated_exactly(element: Element, seed: int) -> None:
    points = inside(seed)
    for exponents in monomials(element.degree):
        interpolated = element.shape(points) @ power(element.nodes, exponents)
        np.testing.assert_allclose(interpolated, power(points, exponents), atol=ROUND_OFF, err_msg=str(exponents))


def test_the_stated_degree_is_the_highest_that_is_complete(element: Element) -> None:
    points = inside(1)
    errors = [
        np.abs(element.shape(points) @ power(element.nodes, exponents) - power(points, exponents)).max()
        for exponents in monomials(element.degree + 1)
    ]
    assert max(errors) > 0.01  # a monomial that is not in the space is missed by something of its own size


@given(seed=st.integers(0, 2**32 - 1))
def test_gradients_are_the_derivatives_of_the_shape_functions(element: Element, seed: int) -> None:
    points = inside(seed)
    step = 1e-30  # a complex step has no difference to lose digits in, so it may be as small as one likes
    for axis in range(3):
        derivative = np.imag(element.shape(points + 1j * step * np.eye(3)[axis])) / step
        np.testing.assert_allclose(element.gradient(points)[..., axis], derivative, atol=ROUND_OFF)


def test_each_face_is_flat_and_its_normal_points_out_of_the_reference_cell(element: Element) -> None:
    for face in element.faces:
        corners = element.nodes[[node for node in face if node < element.n_corner]]
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[1])
        np.testing.assert_allclose((element.nodes[list(face)] - corners[0]) @ normal, 0, atol=ROUND_OFF)
        others = np.delete(element.nodes, face, axis=0)
        assert ((others - corners[0]) @ normal < 0).all()


def test_faces_close_the_cell_each_edge_run_once_in_each_sense(element: Element) -> None:
    edges = []
    for face in element.faces:
        corners = [node for node in face if node < element.n_corner]
        edges += [(corners[k], corners[(k + 1) % len(corners)]) for k in range(len(corners))]
    assert len(set(edges)) == len(edges)
    assert {(b, a) for a, b in edges} == set(edges)
    assert {node for face in element.faces for node in face} == set(range(element.n_node))


def test_midside_nodes_of_a_face_follow_its_corners_in_the_same_order(element: Element) -> None:
    for face in element.faces:
        corners = [node for node in face if node < element.n_corner]
        midsides = list(face[len(corners) :])
        for k, midside in enumerate(midsides):
            middle = element.nodes[[corners[k], corners[(k + 1) % len(corners)]]].mean(axis=0)
            np.testing.assert_array_equal(element.nodes[midside], middle)


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_gauss_points_integrate_to_degree_2n_minus_1_in_each_direction_and_no_further(n: int) -> None:
    points, weights = gauss_hexahedron(n)
    for exponents in product(range(2 * n), repeat=3):
        exact = np.prod([0 if e % 2 else 2 / (e + 1) for e in exponents])
        np.testing.assert_allclose(weights @ power(points, exponents), exact, atol=100 * ROUND_OFF)
    assert abs(weights @ power(points, (2 * n, 0, 0)) - 8 / (2 * n + 1)) > 1e-3


def test_gauss_points_run_along_x_fastest() -> None:
    points, _ = gauss_hexahedron(3)
    np.testing.assert_array_equal(points.reshape(3, 3, 3, 3)[0, 0, :, 0], np.polynomial.legendre.leggauss(3)[0])
    np.testing.assert_array_equal(points.reshape(3, 3, 3, 3)[:, 0, 0, 2], np.polynomial.legendre.leggauss(3)[0])


def tetrahedron_integral(exponents: tuple[int, int, int]) -> float:
    """Of x^i y^j z^k over the reference tetrahedron: i! j! k! / (i + j + k + 3)!."""
    return float(np.prod([factorial(e) for e in exponents])) / factorial(sum(exponents) + 3)


def test_four_points_integrate_to_degree_2_on_the_tetrahedron_and_no_further() -> None:
    points, weights = gauss_tetrahedron()
    for exponents in monomials(2):
        assert weights @ power(points, exponents) == pytest.approx(tetrahedron_integral(exponents), rel=100 * ROUND_OFF)
    assert abs(weights @ power(points, (3, 0, 0)) - tetrahedron_integral((3, 0, 0))) > 1e-4


def test_the_rule_of_the_tetrahedron_integrates_the_stiffness_of_a_straight_cell_exactly() -> None:
    # Products of two derivatives of quadratics; the ten points of a rule of degree 4 are not needed to know them.
    points, weights = TET10.rule
    gradient = TET10.gradient(points)
    result = np.einsum("qai,qbj,q->aibj", gradient, gradient, weights)
    # The same by monomials: derivatives are linear, so their values at origin and unit points hold them.
    at = TET10.gradient(np.vstack([np.zeros(3), np.eye(3)]))
    terms = np.stack([at[0], *(at[k] - at[0] for k in (1, 2, 3))])
    exponents = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    moments = np.array(
        [[tetrahedron_integral(tuple(np.add(first, second).tolist())) for second in exponents] for first in exponents]
    )
    expected = np.einsum("pai,qbj,pq->aibj", terms, terms, moments)
    np.testing.assert_allclose(result, expected, atol=100 * ROUND_OFF)


@pytest.mark.parametrize("element", [HEX8, HEX20], ids=lambda element: element.name)
def test_the_rule_of_a_brick_integrates_its_mass_exactly_on_an_affine_cell(element: Element) -> None:
    def mass(points: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
        shape = element.shape(points)
        return np.asarray((shape * weights[:, None]).T @ shape)

    # Six points a direction are exact to degree 11: more than any product of two shape functions here.
    np.testing.assert_allclose(mass(*element.rule), mass(*gauss_hexahedron(6)), atol=100 * ROUND_OFF)
