"""Forces over one straight path against the same law followed in tiny increments."""

from math import hypot

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reduction.jointed_system import Friction, FrictionContact, JointedSystem
from transient.joint_arrays import make_joint_table
from transient.joint_forces import joint_forces
from transient.joint_law.straight_path import closed_part, slide, slide_coupled

unit = st.floats(-1.0, 1.0)
limit = st.floats(0.05, 2.0)
N_PART = 20_000

# The reference takes 20,000 implicit parts, each of first order.
PARTS = 1e-3


@settings(max_examples=40, deadline=None)
@given(start=unit, increment=st.floats(-5.0, 5.0), first=limit, last=st.floats(0.0, 2.0))
def test_slide_equals_stick_and_clip_in_tiny_increments(
    start: float, increment: float, first: float, last: float
) -> None:
    force = start * first
    end, mean = slide(force, increment, first, last)
    total = 0.0
    for limit_now in np.linspace(first, last, N_PART + 1)[1:]:
        new = min(max(force + increment / N_PART, -limit_now), limit_now)
        total += 0.5 * (force + new) / N_PART
        force = new
    assert abs(end - force) <= PARTS
    assert abs(mean - total) <= PARTS


@settings(max_examples=40, deadline=None)
@given(x=unit, y=unit, dx=st.floats(-4.0, 4.0), dy=st.floats(-4.0, 4.0), first=limit, last=limit)
def test_coupled_slide_equals_radial_return_in_tiny_increments(
    x: float, y: float, dx: float, dy: float, first: float, last: float
) -> None:
    force = first * np.array([x, y]) / max(1.0, np.hypot(x, y))
    ex, ey, _, _ = slide_coupled(force[0], force[1], dx, dy, first, last)
    fx, fy = force.tolist()
    for limit_now in np.linspace(first, last, N_PART + 1)[1:].tolist():
        fx, fy = fx + dx / N_PART, fy + dy / N_PART
        share = min(1.0, limit_now / max(hypot(fx, fy), 1e-300))
        fx, fy = share * fx, share * fy
    assert np.hypot(ex - fx, ey - fy) <= PARTS * max(1.0, np.hypot(dx, dy))


def test_one_moving_tangent_of_two_slides_like_one_alone() -> None:
    end, _ = slide(0.3, 2.0, 1.0, 0.7)
    ex, ey, _, _ = slide_coupled(0.3, 0.0, 2.0, 0.0, 1.0, 0.7)
    assert (ex, ey) == (end, 0.0)


@pytest.mark.parametrize("force", [-3.0, -1.0, 0.3, 3.0])
@pytest.mark.parametrize("path", [1.0, -1.0, 2.9])
@pytest.mark.parametrize("last", [1e-200, 1.0, 3.0, 5.0])
def test_along_one_line_two_tangents_slide_like_one_alone(force: float, path: float, last: float) -> None:
    end, mean = slide(force, path, 3.0, last)
    # Round-off of a few operations; across the line nothing moves.
    assert slide_coupled(force, 0.0, path, 0.0, 3.0, last) == pytest.approx((end, 0.0, mean, 0.0), abs=1e-14)
    assert slide_coupled(0.0, force, 0.0, path, 3.0, last) == pytest.approx((0.0, end, 0.0, mean), abs=1e-14)


def test_a_force_that_opposes_the_sliding_to_the_last_digits_stays_on_its_limit() -> None:
    for y in (1e-8, 1e-12, 1e-300):
        ex, ey, _, _ = slide_coupled(-3.0, y, 1.0, 0.0, 3.0, 1.0)
        assert ex == pytest.approx(-1.0, abs=1e-7)  # it turns by 1.5 y
        assert ey == pytest.approx(0.0, abs=1e-7)


def test_without_friction_there_is_no_friction_force() -> None:
    assert slide(0.0, 2.0, 0.0, 0.0) == (0.0, 0.0)
    assert slide_coupled(0.0, 0.0, 2.0, 1.0, 0.0, 0.0) == (0.0, 0.0, 0.0, 0.0)


def test_the_closed_part_is_cut_at_the_zero() -> None:
    assert closed_part(-1.0, 3.0) == (0.25, 1.0)
    assert closed_part(3.0, -1.0) == (0.0, 0.75)
    assert closed_part(1.0, 2.0) == (0.0, 1.0)
    first, last = closed_part(-1.0, -2.0)
    assert first == last


@pytest.mark.parametrize("friction", list(Friction))
def test_a_contact_that_closes_within_the_step_sticks_where_it_touched_down(friction: Friction) -> None:
    # Closed over the last quarter: N ends at 10 N, T at kt times the last quarter of the way, far below mu N.
    contact = FrictionContact(
        name="c",
        tangents=np.eye(3)[:2],
        normal=np.eye(3)[2],
        normal_stiffness=10.0,
        tangential_stiffness=2.0,
        friction_coefficient=5.0,
        gap=2.0,
        friction=friction,
    )
    zero = np.zeros((3, 3))
    packed = make_joint_table(JointedSystem(mass=np.eye(3), damping=zero, stiffness=zero, joints=[contact])).packed
    before, after = np.array([1.0, -1.0, -1.0]), np.array([5.0, 1.0, 3.0])
    mean, end, slider = np.zeros(3), np.zeros(3), np.zeros(2)
    joint_forces(packed, before, after, before[:2].copy(), 1.0, mean, end, slider)
    np.testing.assert_allclose(slider, [4.0, 0.5], rtol=1e-15)
    np.testing.assert_allclose(end, [2.0, 1.0, 10.0], rtol=1e-15)
    # Linear over a quarter of the step: an eighth of the end values.
    np.testing.assert_allclose(mean, end / 8, rtol=1e-15)
