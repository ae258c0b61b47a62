"""A force spread over a patch, against statics and against the least-squares solution of its six equations."""

import numpy as np
import pytest
from numpy.typing import NDArray

from fe.distributed_load import distribute_load
from fe.errors import MeshError
from fe.mesh import Mesh

Array = NDArray[np.float64]


def cloud(points: Array) -> Mesh:
    return Mesh(points=points, cells={})


def moment(mesh: Mesh, nodal: Array, about: Array) -> Array:
    return np.asarray(np.cross(mesh.points - about, nodal).sum(axis=0))


def cross_matrix(r: Array) -> Array:
    return np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])


@pytest.mark.parametrize("seed", range(8))
def test_it_is_the_smallest_set_of_forces_with_that_resultant_and_moment(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mesh = cloud(rng.standard_normal((20, 3)))
    nodes = rng.permutation(20)[:7]
    force, point = rng.standard_normal(3), 5 * rng.standard_normal(3)  # the point lies off the body
    nodal = distribute_load(mesh, nodes, force, point)
    # Round-off of forces and arms of order 10.
    np.testing.assert_allclose(nodal.sum(axis=0), force, atol=1e-13)
    np.testing.assert_allclose(moment(mesh, nodal, point), 0, atol=1e-12)
    assert not np.delete(nodal, nodes, axis=0).any()
    six = np.hstack([np.vstack([np.eye(3), cross_matrix(mesh.points[node] - point)]) for node in nodes])
    smallest = np.linalg.lstsq(six, np.concatenate([force, np.zeros(3)]), rcond=None)[0]
    np.testing.assert_allclose(nodal[nodes].ravel(), smallest, atol=1e-12)


def test_an_evenly_spread_patch_carries_a_central_force_in_equal_parts() -> None:
    u, v = np.meshgrid(np.linspace(0, 3, 4), np.linspace(0, 2, 3))
    mesh = cloud(np.column_stack([u.ravel(), v.ravel(), np.full(12, 7.0)]))
    force = np.array([3.0, -5.0, 11.0])
    # The moment about the middle is zero anywhere on the line of the force.
    for away in (0.0, 4.0):
        nodal = distribute_load(mesh, np.arange(12), force, np.array([1.5, 1.0, 7.0]) + away * force)
        np.testing.assert_allclose(nodal, np.tile(force / 12, (12, 1)), atol=1e-14)


def test_a_couple_of_a_force_beside_two_rows_is_that_of_a_lever() -> None:
    # Rows at x = 0 and 2, a pull along z at x = 3: each row takes what a beam on two supports gives it.
    mesh = cloud(np.array([[0, 0, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0]], dtype=float))
    nodal = distribute_load(mesh, np.arange(4), np.array([0.0, 0.0, 8.0]), np.array([3.0, 0.5, 1.0]))
    np.testing.assert_allclose(nodal[:, 2], [-2, -2, 6, 6], atol=1e-13)
    np.testing.assert_allclose(nodal[:, :2], 0, atol=1e-13)


def test_a_narrow_patch_far_from_the_origin_still_takes_the_moment() -> None:
    places = np.array([[0, 0, 0], [1e-3, 1e-5, 0], [2e-3, -1e-5, 0], [3e-3, 0, 1e-5]])
    mesh = cloud(places + np.array([1.0, -2.0, 0.5]))
    force, point = np.array([0.0, 2.0, 30.0]), np.array([1.001, -1.99, 0.5])
    nodal = distribute_load(mesh, np.arange(4), force, point)
    # A moment of 0.3 N m on a width of 1e-5 m makes forces of 1e4 N, with round-off of 2e-12 N each; arms about the
    # mean place, not those about the origin, give the moment.
    np.testing.assert_allclose(nodal.sum(axis=0), force, atol=1e-10)
    np.testing.assert_allclose(moment(mesh, nodal, point), 0, atol=1e-11)


def test_a_node_given_twice_counts_once() -> None:
    mesh = cloud(np.random.default_rng(1).standard_normal((5, 3)))
    force, point = np.ones(3), np.zeros(3)
    nodal = distribute_load(mesh, np.array([0, 1, 2, 2]), force, point)
    np.testing.assert_allclose(nodal.sum(axis=0), force, atol=1e-13)
    np.testing.assert_array_equal(nodal, distribute_load(mesh, np.array([0, 1, 2]), force, point))


def test_no_nodes_are_refused() -> None:
    with pytest.raises(MeshError, match="the 0 nodes of a distributed load"):
        distribute_load(cloud(np.eye(3)), np.array([], dtype=np.int64), np.ones(3), np.zeros(3))


def test_nodes_on_a_straight_line_are_refused() -> None:
    direction = np.array([1.0, -2.0, 0.3])
    mesh = cloud(np.array([0.4, 1.0, 2.0]) + np.linspace(0, 1, 6)[:, None] * direction)
    for count in (1, 2, 6):
        with pytest.raises(MeshError, match=rf"the {count} nodes of a distributed load lie on one straight line"):
            distribute_load(mesh, np.arange(count), direction, np.zeros(3))


def test_a_patch_almost_on_a_straight_line_is_refused() -> None:
    # Widths of 0.7 um and 1.1 mm: a ratio of 6e-4. The narrow patch above has ten times that.
    mesh = cloud(np.array([[0, 0, 0], [1e-3, 1e-6, 0], [2e-3, -1e-6, 0], [3e-3, 0, 1e-6]]))
    with pytest.raises(MeshError, match="the 4 nodes of a distributed load lie on one straight line"):
        distribute_load(mesh, np.arange(4), np.ones(3), np.zeros(3))
