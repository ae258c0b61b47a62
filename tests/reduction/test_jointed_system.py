"""Rows, shapes and locked arrays of systems with joints."""

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

from reduction.jointed_system import (
    CubicSpring,
    ElasticStop,
    Friction,
    FrictionContact,
    JenkinsElement,
    JointedSystem,
    QuadraticDamper,
    along,
    between,
)


def contact(tangents: object) -> FrictionContact:
    return FrictionContact(
        name="rub",
        normal=along(3, {2: 1.0}),
        tangents=tangents,  # type: ignore[arg-type]
        normal_stiffness=2.0,
        tangential_stiffness=1.0,
        friction_coefficient=0.4,
    )


def test_rows_are_linear_combinations_of_degrees_of_freedom() -> None:
    np.testing.assert_array_equal(along(3, {0: 0.6, 2: -0.8}), [0.6, 0, -0.8])
    np.testing.assert_array_equal(between(3, 1), [0, 1, 0])
    np.testing.assert_array_equal(between(3, 1, 0), [-1, 1, 0])
    q = np.array([1.0, 4.0, 9.0])
    assert between(3, 2, 1) @ q == 5.0


def test_directions_are_the_tangents_and_then_the_normal() -> None:
    one, two = contact(between(3, 0)), contact([between(3, 0), between(3, 1)])
    assert one.tangents.shape == (1, 3)
    assert (one.directions.shape, two.directions.shape) == ((2, 3), (3, 3))
    np.testing.assert_array_equal(two.directions, np.eye(3))
    for joint in (
        JenkinsElement(name="j", direction=between(3, 0), tangential_stiffness=1.0, limit_force=0.0),
        CubicSpring(name="c", direction=between(3, 0), stiffness=-1.0),
        ElasticStop(name="s", direction=between(3, 0), stiffness=1.0, gap=-0.1),
        QuadraticDamper(name="d", direction=between(3, 0), damping=0.0),
    ):
        np.testing.assert_array_equal(joint.directions, [[1, 0, 0]])


def test_a_contact_is_closed_without_preload_and_uncoupled_by_default() -> None:
    joint = contact(between(3, 0))
    assert (joint.preload, joint.gap, joint.friction) == (0.0, 0.0, Friction.UNCOUPLED)


@pytest.mark.parametrize(
    ("preload", "gap", "force"), [(3.0, 0.0, 3.0), (3.0, 1.0, 1.0), (3.0, 2.0, 0.0), (0.0, -1.0, 2.0), (-1.0, 0.0, 0.0)]
)
def test_a_contact_rests_with_what_its_gap_leaves_of_its_preload(preload: float, gap: float, force: float) -> None:
    joint = replace(contact(between(3, 0)), preload=preload, gap=gap)
    assert joint.force_at_rest == force
    assert joint.limit_at_rest == 0.4 * force


def test_loads_are_zero_by_default() -> None:
    system = JointedSystem(mass=np.eye(3), damping=np.zeros((3, 3)), stiffness=np.eye(3))
    assert (system.n_dof, system.joints, system.dynamic.shape) == (3, (), (1, 3))
    assert not system.static.any()
    assert not system.dynamic.any()


def test_arrays_are_copied_and_read_only() -> None:
    mass, force, row = np.eye(3), np.zeros((2, 3), dtype=complex), between(3, 0)
    joint = contact(row)
    system = JointedSystem(
        mass=mass, damping=mass, stiffness=mass, joints=[joint], static_load=np.ones(3), harmonic_force=force
    )
    mass[0, 0], force[1, 0], row[0] = 7.0, 7.0, 7.0
    assert system.mass[0, 0] == system.damping[0, 0] == system.stiffness[0, 0] == 1.0
    assert not system.dynamic.any()
    assert joint.tangents[0, 0] == 1.0
    for locked in (
        system.mass,
        system.damping,
        system.stiffness,
        system.static,
        system.dynamic,
        joint.normal,
        joint.tangents,
    ):
        with pytest.raises(ValueError, match="read-only"):
            locked[...] = 0
    with pytest.raises(FrozenInstanceError):
        joint.gap = 1.0  # type: ignore[misc]
    assert isinstance(system.joints, tuple)


def test_a_changed_copy_keeps_the_rest() -> None:
    joint = contact([between(3, 0), between(3, 1)])
    stiff = replace(joint, tangential_stiffness=5.0)
    assert (stiff.tangential_stiffness, joint.tangential_stiffness) == (5.0, 1.0)
    np.testing.assert_array_equal(stiff.directions, joint.directions)
