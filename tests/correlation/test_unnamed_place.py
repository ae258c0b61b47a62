"""Displacements that no place follows, by the names under which effects act there."""

from dataclasses import replace

import numpy as np
import pytest

from correlation.model import Dof, Model
from correlation.unnamed_place import list_unnamed_places
from reduction.jointed_system import along


def test_a_described_displacement_is_named_by_its_node(small: Model) -> None:
    result = list_unnamed_places(small)
    assert list(result) == ["node 0 x", "node 1 x"]
    np.testing.assert_array_equal(result["node 1 x"], along(4, {3: 1.0}))
    two = replace(small, dofs=(*small.dofs[:3], Dof(body="stand", node=5, direction="y")))
    assert list(list_unnamed_places(two)) == ["beam node 0 x", "stand node 5 y"]


def test_a_place_with_a_factor_is_one_and_a_combination_is_none(small: Model) -> None:
    places = {"tip z": along(4, {2: -2.0}), "between": along(4, {0: 0.5, 2: 0.5})}
    assert list(list_unnamed_places(replace(small, places=places))) == ["node 0 z", "node 0 x", "node 1 x"]


def test_rotations_are_left_out(small: Model) -> None:
    turned = replace(small, dofs=(*small.dofs[:3], Dof(body="beam", node=1, direction="ry")))
    assert list(list_unnamed_places(turned)) == ["node 0 x"]


@pytest.mark.parametrize(("mass", "stiffness", "expected"), [
    (np.diag([1.0, 2.0]), np.array([[2.0, -1.0], [-1.0, 1.0]]), ["dof 0", "dof 1"]),  # lumped masses
    (np.eye(2), np.diag([4.0, 9.0]), []),  # modes
    (np.array([[2.0, 0.3], [0.3, 1.0]]), np.diag([4.0, 9.0]), []),  # a reduced model
])  # fmt: skip
def test_undescribed_coordinates_are_points_of_lumped_masses_alone(
    small: Model, mass: np.ndarray, stiffness: np.ndarray, expected: list[str]
) -> None:
    system = replace(
        small.system, mass=mass, damping=0.01 * stiffness, stiffness=stiffness, joints=(), static_load=np.zeros(2),
        harmonic_force=np.array([[0.0, 0.0], [0.0, 1.0]]),
    )  # fmt: skip
    assert list(list_unnamed_places(Model(system=system, sensors=(), parts=(), n_harmonic=2, n_sample=16))) == expected
