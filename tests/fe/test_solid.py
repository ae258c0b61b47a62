"""What the stiffness and mass of one solid cell must satisfy, however it is distorted."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from fe.boundary import make_rigid_motions
from fe.element import HEX8, Element
from fe.errors import InvertedCell, MeshError
from fe.material import STEEL, Material
from fe.solid import compute_element_blocks, jacobian
from tests.fe.cell_matrices import element_matrices


@dataclass(frozen=True, kw_only=True)
class Shape:
    """A random cell: size [m], how far corners and midsides stray, in parts of half a side."""

    seed: int
    scale: float
    aspect: float
    corner: float
    midside: float

    def points(self, element: Element) -> NDArray[np.float64]:
        generator = np.random.default_rng(self.seed)
        corners = HEX8.nodes + self.corner * generator.uniform(-1, 1, HEX8.nodes.shape)
        nodes = HEX8.shape(element.nodes) @ corners
        # The edges of the reference tetrahedron are half as long as those of the cube.
        midside = self.midside if element.n_corner == 8 else self.midside / 2
        nodes[element.n_corner :] += midside * generator.uniform(-1, 1, nodes[element.n_corner :].shape)
        return np.asarray(self.scale * nodes * [1, self.aspect, 1 / self.aspect])


shapes = st.builds(
    Shape,
    seed=st.integers(0, 2**32 - 1),
    scale=st.sampled_from([1e-6, 1e-3, 1.0, 1e3]),
    aspect=st.floats(0.3, 3),
    corner=st.floats(0, 0.25),
    midside=st.floats(0, 0.15),
)


def matrices(
    element: Element, points: NDArray[np.float64], material: Material = STEEL
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    constants = (np.array([value]) for value in (material.lame, material.shear, material.density))
    try:
        stiffness, mass = element_matrices(element, points[None], *constants)
    except InvertedCell:
        assume(False)
    return stiffness[0], mass[0]


@given(shape=shapes)
def test_a_cell_has_six_motions_without_strain_energy_and_no_more(element: Element, shape: Shape) -> None:
    points = shape.points(element)
    stiffness, _ = matrices(element, points)
    largest = np.linalg.eigvalsh(stiffness)[-1]
    motions = make_rigid_motions(points).reshape(-1, 6)
    # Sixty terms of the size of the largest eigenvalue cancel in each entry.
    np.testing.assert_allclose(stiffness @ motions, 0, atol=1e-12 * largest)
    eigenvalues = np.linalg.eigvalsh(stiffness) / largest
    assert np.abs(eigenvalues[:6]).max() < 1e-12
    # The softest true deformation of a brick of sides 1 : 3 : 9 stores 1e-4 of the stiffest, of a wedge of half that
    # width 1e-6: hourglass modes have round-off.
    assert eigenvalues[6] > 1e-8


@given(shape=shapes)
def test_stiffness_and_mass_are_symmetric_to_the_last_bit(element: Element, shape: Shape) -> None:
    stiffness, mass = matrices(element, shape.points(element))
    np.testing.assert_array_equal(stiffness, stiffness.T)
    np.testing.assert_array_equal(mass, mass.T)


@given(shape=shapes)
def test_mass_has_no_negative_motion_and_as_many_positive_ones_as_nodes_or_points(
    element: Element, shape: Shape
) -> None:
    _, mass = matrices(element, shape.points(element))
    eigenvalues = np.linalg.eigvalsh(mass)[::-1]
    # The four points of the tetrahedron see four of its ten motions; cells around it see the others.
    rank = min(element.n_node, len(element.rule[1]))
    # A condition number of some thousand is the serendipity element's own; singular would be 1e-16.
    assert eigenvalues[rank - 1] > 1e-6 * eigenvalues[0]
    np.testing.assert_allclose(eigenvalues[rank:], 0, atol=1e-14 * eigenvalues[0])


@given(shape=shapes, angle=st.floats(-3, 3))
def test_a_turned_and_moved_cell_has_the_turned_stiffness(element: Element, shape: Shape, angle: float) -> None:
    points = shape.points(element)
    c, s = np.cos(angle), np.sin(angle)
    rotation = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, s, c], [0, -c, s]])
    stiffness, mass = matrices(element, points)
    turned_stiffness, turned_mass = matrices(element, points @ rotation.T + 3 * shape.scale)
    turn = np.kron(np.eye(element.n_node), rotation)
    # The shift costs the coordinates a digit, the inverse of a stretched Jacobian another.
    scale = np.abs(stiffness).max()
    np.testing.assert_allclose(turned_stiffness, turn @ stiffness @ turn.T, atol=1e-11 * scale)
    np.testing.assert_allclose(turned_mass, mass, atol=1e-12 * np.abs(mass).max())


@given(shape=shapes, poisson=st.floats(-0.5, 0.45))
def test_stiffness_is_the_integral_of_strain_elasticity_strain(element: Element, shape: Shape, poisson: float) -> None:
    material = Material(young=2.0, poisson=poisson, density=1.0)
    points = shape.points(element)
    stiffness, _ = matrices(element, points, material)
    at, weights = element.rule
    determinant, gradient = jacobian(element, points[None], at)
    expected = np.zeros_like(stiffness)
    for weight, volume, slope in zip(weights, determinant[0], gradient[0], strict=True):
        # Rows xx, yy, zz, xy, yz, zx of engineering strain, as every textbook has them.
        B = np.zeros((6, 3 * element.n_node))
        for row, (i, j) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))):
            B[row, i::3] = slope[:, j]
            if i != j:
                B[row, j::3] = slope[:, i]
        expected += weight * volume * B.T @ material.elasticity() @ B
    np.testing.assert_allclose(stiffness, expected, atol=1e-13 * np.abs(expected).max())


def test_the_stiffness_of_a_cell_in_uniaxial_strain_is_the_closed_form(element: Element) -> None:
    a, b, c = 0.2, 0.3, 0.5
    points = (element.nodes + 1) / 2 * [a, b, c]
    stiffness, mass = matrices(element, points)
    stretch = np.zeros((element.n_node, 3))
    stretch[:, 0] = points[:, 0] / a
    energy = stretch.ravel() @ stiffness @ stretch.ravel() / 2
    # A tetrahedron between three edges is a sixth of the brick on them; half as long, an eighth of that.
    volume = a * b * c / 8 * element.rule[1].sum()
    # Strain 1/a in that volume against the constrained modulus lambda + 2 mu; round-off of sixty terms.
    assert energy == pytest.approx((STEEL.lame + 2 * STEEL.shear) / a**2 * volume / 2, rel=1e-13)
    assert mass.sum() == pytest.approx(STEEL.density * volume, rel=1e-13)


def test_gradients_in_space_are_exact_for_a_linear_field(element: Element) -> None:
    points = Shape(seed=5, scale=0.02, aspect=1.5, corner=0.2, midside=0.1).points(element)
    slope = np.array([3.0, -2.0, 0.5])
    _, gradient = jacobian(element, points[None], element.rule[0])
    np.testing.assert_allclose(
        np.einsum("qai,a->qi", gradient[0], points @ slope), np.tile(slope, (len(gradient[0]), 1)), rtol=1e-12
    )


def test_an_inverted_cell_is_refused_by_element_and_number(element: Element) -> None:
    good = (element.nodes + 1) / 2
    one = np.ones(3)
    cells = np.stack([good, good, good * [1, 1, -1]])
    with pytest.raises(InvertedCell, match=rf"{element.name} cell 2 is inverted or collapsed \(det J -0\.125"):
        element_matrices(element, cells, one, one, one)
    with pytest.raises(InvertedCell, match=f"{element.name} cell 907 is inverted"):
        compute_element_blocks(element, cells, one, one, one, np.array([905, 906, 907]))


def test_a_flat_cell_and_a_missing_coordinate_are_refused(element: Element) -> None:
    one = np.ones(1)
    with pytest.raises(InvertedCell, match=r"cell 0 is inverted or collapsed \(det J 0 "):
        element_matrices(element, (element.nodes * [1, 1, 0])[None], one, one, one)
    missing = element.nodes.copy()
    missing[3, 1] = np.nan
    with pytest.raises(MeshError, match="cell 0 has a node with coordinates that are not finite"):
        element_matrices(element, missing[None], one, one, one)
