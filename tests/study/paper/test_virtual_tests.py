"""Instruments of the virtual tests."""

from math import radians

import numpy as np

from reduction.load_cell import compute_decoupler_contact
from study.paper.virtual_tests import TestPoints, _with_cells

POINTS = TestPoints(
    levels=(1.0,), shares=(1.0,), free_level=1.0, free_shares=(1.0,), n_repeat=1, theta=radians(8.53),
    alpha=radians(45), laser_angle=0.0, cell_error=0.0, frequency_error=0.0, seed=1,
)  # fmt: skip


def test_exact_cells_and_eq_1_give_back_the_contact_forces() -> None:
    T, N = np.array([3.0, -5.0 + 1j]), np.array([27.5, 0.4j])
    result = compute_decoupler_contact(*_with_cells((T, N), np.ones(2), POINTS), POINTS.theta, POINTS.alpha)
    # Round-off of two rotations.
    np.testing.assert_allclose(result, (T, N), rtol=1e-12, atol=1e-12)


def test_a_gain_of_both_cells_is_one_of_both_forces() -> None:
    T, N = np.array([3.0]), np.array([27.5])
    result = compute_decoupler_contact(*_with_cells((T, N), np.full(2, 1.01), POINTS), POINTS.theta, POINTS.alpha)
    np.testing.assert_allclose(result, (1.01 * T, 1.01 * N), rtol=1e-12)
