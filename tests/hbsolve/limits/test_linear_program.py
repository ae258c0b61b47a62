"""The small linear programme against a library's."""

import numpy as np
import pytest
import scipy.optimize

from hbsolve.limits.linear_program import best_step


@pytest.mark.parametrize("seed", range(20))
def test_the_step_is_as_good_as_that_of_highs(seed: int) -> None:
    random = np.random.default_rng(seed)
    n = int(random.integers(1, 30))
    A, c = random.normal(size=(2 * n, n)), random.normal(size=n)
    # Bounds that hold from the start are the rule: sliders at the end of their interval.
    b = random.uniform(0, 1, 2 * n) * (random.random(2 * n) < 0.7)
    lower, upper = random.uniform(0, 1, (2, n)) * (random.random((2, n)) < 0.9)
    step = best_step(c, A, b, lower, upper)
    bounds = np.column_stack([-lower, upper])
    best = scipy.optimize.linprog(-c, A_ub=A, b_ub=b, bounds=bounds, method="highs")
    # Round-off of some 60 exchanges of numbers of order one.
    assert c @ step == pytest.approx(-best.fun, abs=1e-9)
    assert (A @ step <= b + 1e-9).all()
    assert ((-lower <= step) & (step <= upper)).all()
