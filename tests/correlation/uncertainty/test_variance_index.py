"""Variance-based indices against closed forms and against SciPy's."""

import numpy as np
from scipy.stats import sobol_indices

from correlation.uncertainty.distribution import Normal, Uniform
from correlation.uncertainty.variance_index import compute_variance_indices, make_saltelli_design

A, B = 7.0, 0.1


def ishigami(x: np.ndarray) -> np.ndarray:
    return np.sin(x[:, 0]) + A * np.sin(x[:, 1]) ** 2 + B * x[:, 2] ** 4 * np.sin(x[:, 0])


def test_indices_of_the_ishigami_function_have_their_closed_form() -> None:
    design = make_saltelli_design(4096, 3, seed=1)
    uniform = Uniform(lower=-np.pi, upper=np.pi)
    result = compute_variance_indices(ishigami(uniform.quantile(design.points)), 3)
    first = [0.5 * (1 + B * np.pi**4 / 5) ** 2, A**2 / 8, 0.0]
    total = [first[0] + 8 * B**2 * np.pi**8 / 225, first[1], 8 * B**2 * np.pi**8 / 225]
    variance = 0.5 + A**2 / 8 + B * np.pi**4 / 5 + B**2 * np.pi**8 / 18
    # Random points would leave 1 / sqrt(4096) times the spread of a product of order one; Sobol points leave less.
    np.testing.assert_allclose(result.first, np.array(first) / variance, atol=0.016)
    np.testing.assert_allclose(result.total, np.array(total) / variance, atol=0.016)
    for value, interval in ((first, result.first_interval), (total, result.total_interval)):
        assert (interval[0] <= np.array(value) / variance + 0.01).all()
        assert (interval[1] >= np.array(value) / variance - 0.01).all()


def test_indices_of_a_sum_are_the_shares_of_its_variances_and_large_means_cost_no_digits() -> None:
    design, slopes = make_saltelli_design(2048, 3, seed=3), np.array([3.0, -2.0, 0.5])
    values = Normal(mean=0.0, deviation=1.0).quantile(design.points) @ slopes
    share = slopes**2 / np.sum(slopes**2)
    result = compute_variance_indices(values, 3)
    # As above with fewer points.
    np.testing.assert_allclose(result.first, share, atol=0.02)
    np.testing.assert_allclose(result.total, share, atol=0.02)
    # 1e6 takes six of sixteen digits from the differences.
    np.testing.assert_allclose(compute_variance_indices(1e6 + values, 3).first, result.first, atol=1e-8)


def test_the_estimates_are_those_of_scipy_and_lost_draws_are_left_out() -> None:
    n, d = 64, 3
    design = make_saltelli_design(n, d, seed=5)
    values = ishigami(Uniform(lower=-np.pi, upper=np.pi).quantile(design.points))
    a, b, *ab = values.reshape(d + 2, n)
    expected = sobol_indices(
        func={"f_A": a[None], "f_B": b[None], "f_AB": np.array(ab)[:, None]}, n=n, method="saltelli_2010"
    )
    result = compute_variance_indices(values, d)
    # The same sums in another order.
    np.testing.assert_allclose(result.first, np.ravel(expected.first_order), rtol=1e-10)
    np.testing.assert_allclose(result.total, np.ravel(expected.total_order), rtol=1e-10)
    lost = values.copy()
    lost[[5, 2 * n + 9]] = np.nan
    kept = np.delete(np.arange(n), [5, 9])
    rest = compute_variance_indices(values.reshape(d + 2, n)[:, kept].ravel(), d)
    assert compute_variance_indices(lost, d).n_draw == n - 2
    np.testing.assert_array_equal(compute_variance_indices(lost, d).first, rest.first)


def test_a_quantity_that_does_not_vary_has_no_indices() -> None:
    result = compute_variance_indices(np.full(5 * 16, 3.0), 3)
    assert np.isnan([*result.first, *result.total, *result.first_interval.ravel()]).all()


def test_a_column_of_a_mixed_set_is_from_b_and_the_others_from_a() -> None:
    design = make_saltelli_design(8, 2, seed=2)
    np.testing.assert_array_equal(design.ab[1], np.column_stack([design.a[:, 0], design.b[:, 1]]))
    np.testing.assert_array_equal(design.points, np.concatenate([design.a, design.b, *design.ab]))
    assert ((design.points > 0) & (design.points < 1)).all()
