"""Where a body lies between its contacts before its load presses it."""

import numpy as np
from numpy.typing import NDArray

from reduction.settled_gaps import compute_remaining_gaps

Array = NDArray[np.float64]


def groove(half_angle: float = np.deg2rad(8.53)) -> Array:
    """Approaches of two lines of seven stations, which rise towards each other, by the six motions of a body."""
    rows = []
    for side in (-1, 1):
        for y in np.linspace(6e-3, 18e-3, 7):
            normal = np.array([0.0, side * np.sin(half_angle), np.cos(half_angle)])
            rows.append(np.concatenate([normal, np.cross([0.0, side * y, 0.0], normal)]))
    return np.array(rows)


CROWNED = np.tile(2.5e-6 * np.linspace(-1, 1, 7) ** 2, 2)


def test_what_a_rigid_motion_of_the_body_absorbs_leaves_the_gaps_as_they_were() -> None:
    N = groove()
    alone = compute_remaining_gaps(N, CROWNED)
    # Round-off of gaps of 2.5 um beside a weight of 1e3.
    np.testing.assert_allclose(alone, CROWNED, atol=1e-12)
    for motion in ([0, 5e-6, 3e-6, 0, 0, 0], [0, 5e-5, 3e-6, 6e-3, 0, 0]):
        # Round-off of the gaps of up to 0.1 mm.
        np.testing.assert_allclose(compute_remaining_gaps(N, CROWNED + N @ motion), alone, atol=1e-11)


def test_no_place_without_overlap_has_smaller_gaps() -> None:
    N, random = groove(), np.random.default_rng(3)
    gaps = CROWNED + np.concatenate([np.linspace(0, 7e-5, 7), np.zeros(7)])
    left = compute_remaining_gaps(N, gaps)
    assert (left >= 0).all()
    place = np.linalg.lstsq(N, gaps - left, rcond=None)[0]
    # The gaps belong to a place of the body; non-negative least squares leave 1e-8 of the widest gap.
    np.testing.assert_allclose(N @ place, gaps - left, atol=1e-12)
    for size in (1e-6, 1e-8):
        step = size * random.normal(size=(4000, 6)) * [0, 1, 1, 80, 0, 0]
        after = gaps - (place + step) @ N.T
        possible = after[(after >= 0).all(axis=1)]
        assert not len(possible) or possible.sum(axis=1).min() >= left.sum() * (1 - 1e-6)


def test_a_line_that_is_tilted_alone_is_shared_by_both() -> None:
    tilt = np.concatenate([np.linspace(0, 4e-5, 7), np.zeros(7)])
    left = compute_remaining_gaps(groove(), tilt)
    # The body slides along the wedge and turns until both lines open by half the angle: one touching end each.
    np.testing.assert_allclose(left, np.tile(np.linspace(0, 2e-5, 7), 2), atol=1e-12)
