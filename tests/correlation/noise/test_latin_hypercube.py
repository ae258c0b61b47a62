import numpy as np
import pytest
from scipy.stats import qmc

from correlation.noise.latin_hypercube import compute_centred_discrepancy, draw_latin_hypercube


@pytest.mark.parametrize(("n", "d"), [(1, 3), (5, 1), (4, 6), (16, 6), (16, 40)])
def test_each_step_of_each_direction_holds_one_point(n: int, d: int) -> None:
    steps = np.floor(draw_latin_hypercube(n, d, seed=3) * n)
    np.testing.assert_array_equal(np.sort(steps, axis=0), np.tile(np.arange(n)[:, None], d))


def test_the_discrepancy_is_that_of_scipy() -> None:
    points = np.random.default_rng(1).random((16, 6))
    # The same sums in another order.
    assert compute_centred_discrepancy(points) == pytest.approx(qmc.discrepancy(points), rel=1e-12)


@pytest.mark.parametrize(("n", "d"), [(4, 6), (16, 6)])
def test_the_points_are_those_of_scipy(n: int, d: int) -> None:
    expected = qmc.LatinHypercube(d, optimization="random-cd", rng=1).random(n)
    np.testing.assert_array_equal(draw_latin_hypercube(n, d, seed=1), expected)


def test_swaps_make_points_more_even_than_chance_does() -> None:
    chance = [compute_centred_discrepancy(qmc.LatinHypercube(6, rng=seed).random(16)) for seed in range(20)]
    assert compute_centred_discrepancy(draw_latin_hypercube(16, 6, seed=1)) < min(chance)
