"""Supports hold what they say, and whatever they leave free is named."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from fe.assembly import assemble
from fe.boundary import MOTIONS, GroundedSpring, Support, make_rigid_motions, supported_system
from fe.damping import RayleighDamping, rayleigh_damping
from fe.element import HEX8, HEX20
from fe.errors import MeshError, SupportError
from fe.material import STEEL
from fe.mesh import Mesh
from fe.modal import modes
from fe.system import LinearSystem
from geometry.errors import InputError

BoxMesher = Callable[..., Mesh]
SIZE = (0.3, 0.2, 0.1)


def held(
    mesh: Mesh, supports: list[Support] | None = None, springs: list[GroundedSpring] | None = None
) -> LinearSystem:
    return supported_system(mesh, *assemble(mesh, STEEL), supports or [], springs or [])


def nodes_at(mesh: Mesh, *places: tuple[float, float, float]) -> NDArray[np.int64]:
    """The nodes at these places, in parts of the box."""
    size = mesh.points.max(axis=0)
    return np.array([np.linalg.norm(mesh.points - np.array(place) * size, axis=1).argmin() for place in places])


def all_but(mesh: Mesh, motion: int) -> list[Support]:
    """Supports that leave exactly one rigid motion of a box, by statics."""
    a, b, c = motion % 3, (motion + 1) % 3, (motion + 2) % 3
    corner, along_b, along_c = np.zeros(3), np.eye(3)[b], np.eye(3)[c]
    if motion < 3:
        # Translation along a: two directions held at three corners, so that nothing can turn.
        points = nodes_at(mesh, tuple(corner), tuple(along_b), tuple(along_c))
        return [Support(nodes=points, directions=(b, c)), Support(nodes=nodes_at(mesh, *np.eye(3)), directions=(b, c))]
    # Rotation about a: the edge along a is held, as in a hinge.
    return [Support(nodes=nodes_at(mesh, (0, 0, 0), tuple(np.eye(3)[a])))]


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6], ids=["micrometre", "metre", "megametre"])
@pytest.mark.parametrize("motion", range(6), ids=MOTIONS)
def test_a_single_motion_left_free_is_named_and_only_that(box: BoxMesher, motion: int, scale: float) -> None:
    mesh = box(HEX8, counts=(3, 2, 2), size=tuple(scale * side for side in SIZE))
    with pytest.raises(SupportError, match=rf"leave the body free in {MOTIONS[motion]}: fix more nodes or add") as no:
        held(mesh, all_but(mesh, motion))
    assert str(no.value).count("about") + str(no.value).count("along") == 1


def test_without_supports_all_six_motions_are_named(box: BoxMesher) -> None:
    with pytest.raises(SupportError, match=r"the body free in " + ", ".join(MOTIONS) + ": fix nodes"):
        held(box(HEX8))


def test_a_pinned_node_leaves_three_rotations_and_a_line_of_nodes_one(box: BoxMesher) -> None:
    mesh = box(HEX20, size=SIZE)
    with pytest.raises(SupportError, match="free in rotation about x, rotation about y, rotation about z:"):
        held(mesh, [Support(nodes=nodes_at(mesh, (1, 1, 0)))])
    line = np.flatnonzero(np.linalg.norm(mesh.points[:, 1:] - [SIZE[1], 0], axis=1) < 1e-9)
    assert len(line) == 7  # an edge of three quadratic cells, far from the centroid
    with pytest.raises(SupportError, match="free in rotation about x:"):
        held(mesh, [Support(nodes=line)])


def test_a_motion_about_a_skew_line_is_named_by_its_largest_part(box: BoxMesher) -> None:
    mesh = box(HEX8, size=SIZE)
    with pytest.raises(SupportError, match="free in a motion that is mostly rotation about x:"):
        held(mesh, [Support(nodes=nodes_at(mesh, (0, 0, 0), (1, 0.2, 0.1)))])


@given(seed=st.integers(0, 2**32 - 1))
def test_three_nodes_off_one_line_hold_a_body(box: BoxMesher, seed: int) -> None:
    mesh = box(HEX8, counts=(2, 2, 2), size=SIZE)
    a, b, c = nodes = np.random.default_rng(seed).choice(mesh.n_node, 3, replace=False)
    area = np.linalg.norm(np.cross(*(mesh.points[[b, c]] - mesh.points[a])))
    if area < 1e-6:
        with pytest.raises(SupportError, match="rotation"):
            held(mesh, [Support(nodes=nodes)])
    else:
        assert held(mesh, [Support(nodes=nodes)]).n_dof == 3 * mesh.n_node - 9


def two_bodies(box: BoxMesher) -> Mesh:
    one = box(HEX8, size=SIZE)
    points = np.concatenate([one.points, one.points + np.array([1, 0, 0])])
    cells = one.cells["hexahedron"]
    return Mesh(points=points, cells={"hexahedron": np.concatenate([cells, cells + one.n_node])})


def test_each_of_two_bodies_needs_its_own_support(box: BoxMesher) -> None:
    mesh = two_bodies(box)
    half = mesh.n_node // 2
    first = Support(nodes=nodes_at(mesh, (0, 0, 0), (0, 1, 0), (0, 0, 1)))
    with pytest.raises(SupportError, match=rf"leave body 2 of 2 \({half} nodes\) free in translation along x"):
        held(mesh, [first])
    assert held(mesh, [first, Support(nodes=first.nodes + half)]).n_dof == 3 * mesh.n_node - 18


@pytest.mark.parametrize("exponents", [(-3, -3, -3), (12, 12, 12), (-3, 4, 12)], ids=str)
def test_grounded_springs_of_any_stiffness_hold_a_body(box: BoxMesher, exponents: tuple[int, int, int]) -> None:
    mesh = box(HEX8, size=SIZE)
    x, y, z = (10.0**exponent for exponent in exponents)
    spring = GroundedSpring(nodes=nodes_at(mesh, (0, 0, 0), (1, 0, 0), (0, 1, 0)), stiffness=(x, y, z))
    system = held(mesh, springs=[spring])
    assert system.n_dof == 3 * mesh.n_node
    added = system.stiffness.diagonal() - assemble(mesh, STEEL)[1].diagonal()
    # The soft ones are below the last digit of the steel they stand on.
    digit = np.spacing(system.stiffness.diagonal().max())
    np.testing.assert_allclose(added.reshape(-1, 3)[spring.nodes], [[x, y, z]] * 3, rtol=1e-12, atol=digit)


def test_a_body_on_springs_rocks_as_a_rigid_one(box: BoxMesher) -> None:
    mesh = box(HEX8, counts=(2, 2, 2), size=SIZE)
    corners = nodes_at(mesh, *[(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    k = 1e4
    result = modes(held(mesh, springs=[GroundedSpring(nodes=corners, stiffness=(k, k, k))]), 6).angular_frequency
    mass = STEEL.density * np.prod(SIZE)
    # Eight springs at the corners: 8 k / m, and 8 k (b^2 + c^2) / 4 over m (b^2 + c^2) / 12, about any axis.
    expected = np.sqrt(8 * k / mass * np.array([1, 1, 1, 3, 3, 3]))
    # The body is 1e5 times as stiff as its springs and gives way by as much.
    np.testing.assert_allclose(result, expected, rtol=1e-4)


def test_springs_that_act_in_one_direction_leave_the_others(box: BoxMesher) -> None:
    mesh = box(HEX8, size=SIZE)
    spring = GroundedSpring(nodes=mesh.nodes("z0"), stiffness=(0.0, 0.0, 1e6))
    with pytest.raises(SupportError, match="free in translation along x, translation along y, rotation about z:"):
        held(mesh, springs=[spring])


def test_two_springs_on_one_node_add(box: BoxMesher) -> None:
    mesh = box(HEX8, size=SIZE)
    spring = GroundedSpring(nodes=mesh.nodes("x0"), stiffness=(1e12, 1e12, 1e12))
    once, twice = held(mesh, springs=[spring]), held(mesh, springs=[spring, spring])
    difference = (twice.stiffness - once.stiffness).diagonal().reshape(-1, 3)
    np.testing.assert_allclose(difference[spring.nodes], 1e12, rtol=1e-12)
    assert not np.delete(difference, spring.nodes, axis=0).any()


def test_fixed_degrees_of_freedom_leave_rows_columns_and_names_of_the_rest(box: BoxMesher) -> None:
    mesh = box(HEX8, size=SIZE)
    wall, other = mesh.nodes("x0"), mesh.nodes("x1")
    system = held(mesh, [Support(nodes=wall), Support(nodes=other, directions=(1,))])
    assert not np.isin(3 * wall, system.free).any()
    assert not np.isin(3 * other + 1, system.free).any()
    assert system.n_dof == 3 * mesh.n_node - 3 * len(wall) - len(other)
    mass, stiffness = assemble(mesh, STEEL)
    assert abs(system.stiffness - stiffness[system.free][:, system.free]).max() == 0
    assert abs(system.mass - mass[system.free][:, system.free]).max() == 0
    rows = system.rows(other, (0, 1))
    np.testing.assert_array_equal(rows[1::2], -1)
    np.testing.assert_array_equal(system.free[rows[::2]], 3 * other)
    np.testing.assert_array_equal(system.rows(wall), -1)
    field = system.on_mesh(np.arange(1.0, system.n_dof + 1)[:, None])
    assert field.shape == (mesh.n_node, 3, 1)
    assert not field[wall].any()
    assert not field[other, 1].any()
    np.testing.assert_array_equal(field.ravel()[system.free], np.arange(1.0, system.n_dof + 1))


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_rigid_motions_are_independent_and_of_one_magnitude_at_any_scale(box: BoxMesher, scale: float) -> None:
    mesh = box(HEX20, size=tuple(scale * side for side in SIZE))
    motions = make_rigid_motions(mesh.points)
    largest = np.linalg.norm(motions, axis=1).max(axis=0)
    # A rotation moves no node by more than a translation, and none of a stout box by less than half as much.
    assert (largest <= 1 + 1e-15).all()
    assert (largest > 0.5).all()
    assert np.linalg.matrix_rank(motions.reshape(-1, 6)) == 6


def test_rayleigh_damping_has_the_given_ratio_where_it_is_smallest() -> None:
    damping = rayleigh_damping(0.002, 122.25)
    omega = 2 * np.pi * 122.25
    assert damping.damping_ratio(omega) == pytest.approx(0.002, rel=1e-14)
    for factor in (0.3, 0.9, 1.1, 4.0):
        expected = 0.002 * (factor + 1 / factor) / 2
        assert damping.damping_ratio(factor * omega) == pytest.approx(expected, rel=1e-14)


def test_modes_are_damped_by_the_closed_form(box: BoxMesher) -> None:
    mesh = box(HEX8, size=SIZE)
    damping = RayleighDamping(mass_factor=3.0, stiffness_factor=2e-7)
    system = supported_system(mesh, *assemble(mesh, STEEL), [Support(nodes=mesh.nodes("x0"))], damping=damping)
    result = modes(system, 8)
    expected = [damping.damping_ratio(omega) for omega in result.angular_frequency]
    # Modal damping is a quotient of sums whose terms cancel by the condition of the stiffness, about 1e4.
    np.testing.assert_allclose(result.damping_ratio, expected, rtol=1e-11)
    assert not held(mesh, [Support(nodes=mesh.nodes("x0"))]).damping.nnz


@pytest.mark.parametrize("ratio", [-0.1, 1.0, float("nan")])
def test_a_damping_ratio_out_of_range_is_refused(ratio: float) -> None:
    with pytest.raises(InputError, match=rf"damping_ratio = {ratio:g} must lie in \[0, 1\)"):
        rayleigh_damping(ratio, 100.0)


@pytest.mark.parametrize("frequency", [0.0, -5.0, float("nan")])
def test_a_frequency_that_is_not_positive_is_refused(frequency: float) -> None:
    with pytest.raises(InputError, match=rf"frequency = {frequency:g} Hz must be positive"):
        rayleigh_damping(0.01, frequency)


@pytest.mark.parametrize("bad", [-1.0, float("inf"), float("nan")])
def test_a_spring_that_pulls_the_wrong_way_or_has_no_number_is_refused(bad: float) -> None:
    with pytest.raises(SupportError, match=rf"grounded spring stiffness \(1.0, {bad}, 1.0\) N/m must be finite"):
        GroundedSpring(nodes=np.array([0]), stiffness=(1.0, bad, 1.0))


@pytest.mark.parametrize("directions", [(3,), (-1,), ()], ids=str)
def test_a_direction_that_does_not_exist_is_refused(directions: tuple[int, ...]) -> None:
    with pytest.raises(SupportError, match=r"support directions \(.*\) must be some of 0, 1 and 2"):
        Support(nodes=np.array([0]), directions=directions)


def test_supports_that_name_nothing_are_refused(box: BoxMesher) -> None:
    mesh = box(HEX8, size=SIZE)
    with pytest.raises(SupportError, match="a support fixes no node"):
        held(mesh, [Support(nodes=np.array([], dtype=np.int64))])
    with pytest.raises(SupportError, match="names node 64, but the mesh has the nodes 0 to 63"):
        held(mesh, [Support(nodes=np.array([3, 64]))])
    with pytest.raises(SupportError, match="names node -1, but"):
        held(mesh, springs=[GroundedSpring(nodes=np.array([-1]), stiffness=(1.0, 1.0, 1.0))])
    with pytest.raises(MeshError, match='no node set or face set "clamp": it has x0, x1, y0, y1, z0, z1'):
        mesh.nodes("clamp")


def test_supports_that_hold_everything_are_refused(box: BoxMesher) -> None:
    mesh = box(HEX8)
    with pytest.raises(SupportError, match="fix every degree of freedom"):
        held(mesh, [Support(nodes=np.arange(mesh.n_node))])


def test_a_node_of_no_cell_is_named_unless_it_is_held(box: BoxMesher) -> None:
    mesh = box(HEX8, size=SIZE)
    mesh = replace(mesh, points=np.vstack([mesh.points, [5, 5, 5]]))
    with pytest.raises(SupportError, match="node 64 belongs to no cell and is not fixed: remove it"):
        held(mesh, [Support(nodes=mesh.nodes("x0"))])
    assert held(mesh, [Support(nodes=np.append(mesh.nodes("x0"), 64))]).n_dof == 3 * 48
