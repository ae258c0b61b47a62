"""The disc that a stinger pushes: its resultant, the half-space, and what a node does in its place."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.special import jv

from fe.assembly import assemble
from fe.boundary import Support, supported_system
from fe.element import HEX20, TET10, Element
from fe.errors import MeshError
from fe.face_integral import find_outer_faces
from fe.material import STEEL
from fe.mesh import Mesh
from fe.mesher.block import Block, mesh_blocks
from fe.modal import modes
from fe.pressed_disc import find_disc_weights
from fe.sparse.solver import factorise
from fe.station_coordinates import add_mean_coordinate, make_node_coordinates

BoxMesher = Callable[..., Mesh]
UP = np.array([0.0, 0.0, 1.0])
SIZE = (1.0, 0.8, 0.6)
CENTRE, RADIUS = np.array([0.45, 0.37, SIZE[2]]), 0.25


def on_top(mesh: Mesh) -> NDArray[np.float64]:
    return find_disc_weights(mesh, find_outer_faces(mesh), CENTRE, UP, RADIUS)


def test_the_weights_sum_to_one_about_the_centre_and_stay_on_the_face(element: Element, box: BoxMesher) -> None:
    mesh = box(element, counts=(4, 4, 3), size=SIZE, distortion=0.2)
    weights = on_top(mesh)
    assert weights.sum() == pytest.approx(1, abs=1e-14)
    np.testing.assert_allclose(weights @ mesh.points, CENTRE, atol=1e-14)
    assert np.isin(np.flatnonzero(weights), mesh.nodes("z1")).all()


@pytest.mark.parametrize("element", [HEX20, TET10], ids=lambda element: element.name)
def test_the_mean_of_a_square_is_that_of_the_pressure(element: Element, box: BoxMesher) -> None:
    mesh = box(element, counts=(8, 8, 2), size=SIZE)
    about = mesh.points - CENTRE
    # 2 / (pi a^2) times the integral of (1 - r^2 / a^2) x^2 is a^2 / 6; the rim crosses the points of quadrature.
    assert on_top(mesh) @ about[:, 0] ** 2 == pytest.approx(RADIUS**2 / 6, rel=0.02)
    assert on_top(mesh) @ (about[:, 0] * about[:, 1]) == pytest.approx(0, abs=0.02 * RADIUS**2)


def graded(n: int) -> Mesh:
    """A block of 2 x 2 x 1 in n x n x n / 2 bricks, fine about the middle of its top."""

    def fine(u: NDArray[np.float64]) -> NDArray[np.float64]:
        return 0.06 * u + 0.94 * u**3

    block = Block(
        shape=lambda u, v, w: (fine(2 * u - 1), fine(2 * v - 1), -fine(1 - w)),
        counts=(n, n, n // 2),
        faces={"w0": "bottom"},
    )
    return mesh_blocks([block], HEX20)


@cache
def graded_block(n: int) -> tuple[Mesh, NDArray[np.intp], Callable[[NDArray[np.float64]], NDArray[np.float64]]]:
    """Its mesh, its free degrees of freedom, and the displacements under forces on them."""
    mesh = graded(n)
    system = supported_system(mesh, *assemble(mesh, STEEL), [Support(nodes=mesh.nodes("bottom"))])
    return mesh, system.free, factorise(system.stiffness).solve


def compliance(n: int, weights: NDArray[np.float64]) -> float:
    """Mean displacement along z under a force of 1 N along z, both by the same weights [m/N]."""
    _, free, solve = graded_block(n)
    force = np.kron(weights, UP)[free]
    return float(force @ solve(force))


def test_a_half_space_gives_way_as_elasticity_says() -> None:
    mesh, radius = graded_block(12)[0], 0.1
    discs = [find_disc_weights(mesh, find_outer_faces(mesh), np.zeros(3), UP, a) for a in (radius, 2 * radius)]
    # The block's ends are far for both: what they add is the same but for the square of radius over size.
    result = np.subtract(*(compliance(12, weights) for weights in discs))
    # Hankel transforms: the surface under p(k) goes down by 2 (1 - nu^2) p(k) / (E k), p(k) = 4 J2(ka) / (pi (ka)^2).
    integral = quad(lambda s: jv(2, s) ** 2 / s**4, 0, np.inf)[0]
    own = 64 * (1 - STEEL.poisson**2) / (np.pi * STEEL.young) * integral
    assert result == pytest.approx(own / radius - own / (2 * radius), rel=0.02)


def test_a_disc_converges_where_a_node_gives_way_without_bound() -> None:
    def node(mesh: Mesh) -> NDArray[np.float64]:
        return np.eye(mesh.n_node)[np.linalg.norm(mesh.points, axis=1).argmin()]

    def disc(mesh: Mesh) -> NDArray[np.float64]:
        return find_disc_weights(mesh, find_outer_faces(mesh), np.zeros(3), UP, 0.2)

    by_node, by_disc = ([compliance(n, which(graded_block(n)[0])) for n in (8, 12)] for which in (node, disc))
    # Elements of two thirds of the size: the local part of a node's grows by a half.
    assert by_node[1] / by_node[0] > 1.4
    assert by_disc[1] / by_disc[0] == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize("element", [HEX20, TET10], ids=lambda element: element.name)
def test_as_a_coordinate_it_changes_no_frequency_and_carries_the_force(element: Element, box: BoxMesher) -> None:
    mesh = box(element, counts=(4, 4, 3), size=SIZE, distortion=0.2)
    mass, stiffness = assemble(mesh, STEEL)
    weights, support = on_top(mesh), [Support(nodes=mesh.nodes("x0"))]
    place = add_mean_coordinate(make_node_coordinates(mesh), "pushed", weights, fixed=["x0"])
    before = supported_system(mesh, mass, stiffness, support)
    after = supported_system(mesh, place.matrix(mass), place.matrix(stiffness), support)
    # The condition number of the stiffness, some 1e4, times round-off, squared by the two products.
    np.testing.assert_allclose(modes(after, 6).frequency, modes(before, 6).frequency, rtol=1e-9)
    (pivot,) = place.mesh.nodes("pushed")
    np.testing.assert_allclose(place.places[pivot], CENTRE, atol=1e-12)
    row = after.rows(np.array([pivot]))[2]
    own = factorise(after.stiffness).solve(np.eye(after.n_dof)[row])[row]
    spread = np.kron(weights, UP)[before.free]
    assert own == pytest.approx(spread @ factorise(before.stiffness).solve(spread), rel=1e-9)


def test_a_disc_beside_the_body_or_on_a_held_face_is_refused(box: BoxMesher) -> None:
    mesh = box(HEX20, counts=(4, 4, 3), size=SIZE)
    sentence = r"the disc of 250 mm radius about \(450, 370, 900\) mm is not on a flat face of the mesh, or cells there"
    with pytest.raises(MeshError, match=sentence):
        find_disc_weights(mesh, find_outer_faces(mesh), CENTRE + 0.3 * UP, UP, RADIUS)
    with pytest.raises(MeshError, match=r"the disc of 10 mm radius .* cells there are too large for it"):
        find_disc_weights(mesh, find_outer_faces(mesh), CENTRE, UP, 0.01)
    with pytest.raises(MeshError, match='no node can be moved to "pushed"'):
        add_mean_coordinate(make_node_coordinates(mesh), "pushed", on_top(mesh), fixed=["z1"])


def test_what_was_called_so_before_is_replaced_and_other_names_are_kept(box: BoxMesher) -> None:
    mesh = box(HEX20, counts=(4, 4, 3), size=SIZE)
    weights = on_top(mesh)
    largest = int(np.abs(weights).argmax())
    named = replace(mesh, node_sets={"pushed": np.array([0]), "sensor": np.array([largest])})
    sets = add_mean_coordinate(make_node_coordinates(named), "pushed", weights).mesh.node_sets
    assert sets["sensor"].tolist() == [largest]
    assert sets["pushed"].tolist() not in ([0], [largest])
