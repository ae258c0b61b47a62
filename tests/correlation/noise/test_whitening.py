"""Whitening is the inverse square root of the covariance."""

import numpy as np
import pytest
import scipy.sparse

from correlation.errors import CampaignError
from correlation.noise.covariance import Whitening

M = 12
DRAW = np.random.default_rng(4)
DEVIATION = DRAW.uniform(0.1, 30.0, M)
#: Far larger than the noise, alike, and far smaller; more of them than needed to be independent.
MODES = DRAW.standard_normal((M, 5)) * np.array([300.0, 1.0, 1.0, 1e-3, 0.0])
MODES[:, 2] = MODES[:, 1] + 1e-8
S = np.diag(DEVIATION**2) + MODES @ MODES.T


def test_it_turns_the_covariance_into_one() -> None:
    whiten = Whitening(deviation=DEVIATION, modes=MODES)
    root = whiten(np.eye(M))
    # Round-off grows with the condition number of S, some 1e5.
    np.testing.assert_allclose(root @ S @ root.T, np.eye(M), rtol=0, atol=1e-10)
    difference = DRAW.standard_normal(M)
    chi2 = difference @ np.linalg.solve(S, difference)
    assert whiten(difference) @ whiten(difference) == pytest.approx(chi2, rel=1e-9)


def test_one_and_several_differences_agree() -> None:
    whiten = Whitening(deviation=DEVIATION, modes=MODES)
    several = DRAW.standard_normal((M, 3))
    # Sums in another order.
    np.testing.assert_allclose(whiten(several), np.column_stack([whiten(item) for item in several.T]), rtol=1e-11)


def test_without_modes_it_divides() -> None:
    whiten = Whitening(deviation=DEVIATION)
    np.testing.assert_allclose(whiten(DEVIATION), np.ones(M), rtol=1e-15)


@pytest.mark.parametrize("wrong", [0.0, -1.0, np.nan, np.inf])
def test_a_deviation_must_be_positive_and_finite(wrong: float) -> None:
    with pytest.raises(CampaignError, match="repeat the test"):
        Whitening(deviation=np.array([1.0, wrong]))


def test_what_the_modes_explain_is_their_share_of_the_covariance() -> None:
    """The mean of the modes' part, given the sum with the noise: M M^T S^-1 d."""
    differences = np.random.default_rng(8).standard_normal((M, 3)) * DEVIATION[:, None]
    result = Whitening(deviation=DEVIATION, modes=MODES).explained(differences)
    exact = MODES @ MODES.T @ np.linalg.solve(S, differences)
    # Round-off grows with the condition number of S, some 1e5.
    np.testing.assert_allclose(result, exact, rtol=0, atol=1e-9 * np.abs(exact).max())
    assert not Whitening(deviation=DEVIATION).explained(differences).any()


def test_more_modes_come_after_those_that_there_are() -> None:
    more = Whitening(deviation=DEVIATION, modes=MODES[:, :3]).with_modes(MODES[:, 3:])
    assert more.modes is not None
    np.testing.assert_array_equal(more.modes, MODES)
    np.testing.assert_array_equal(Whitening(deviation=DEVIATION).with_modes(MODES).modes, MODES)


#: An error of each of two parts of the numbers; the rest has none.
PARTS = np.zeros((M, 2))
PARTS[:4, 0], PARTS[6:9, 1] = 50.0, DRAW.uniform(1.0, 9.0, 3)


@pytest.mark.parametrize("modes", [MODES, None])
def test_errors_of_parts_are_modes_that_are_sparse(modes: np.ndarray | None) -> None:
    whiten = Whitening(deviation=DEVIATION, modes=modes, parts=scipy.sparse.csr_array(PARTS))
    dense = PARTS if modes is None else np.column_stack([modes, PARTS])
    whole, difference = np.diag(DEVIATION**2) + dense @ dense.T, DRAW.standard_normal((M, 3))
    # Round-off of a condition number of some 1e5, as above.
    np.testing.assert_allclose(whiten(np.eye(M)).T @ whiten(np.eye(M)) @ whole, np.eye(M), rtol=0, atol=1e-9)
    np.testing.assert_allclose(whiten.unwhiten(whiten(difference)), difference, rtol=0, atol=1e-10)
    exact = dense @ dense.T @ np.linalg.solve(whole, difference)
    np.testing.assert_allclose(whiten.explained(difference), exact, rtol=0, atol=1e-9 * np.abs(exact).max())
    assert whiten.log_determinant == pytest.approx(np.linalg.slogdet(whole)[1], rel=1e-9)
    np.testing.assert_allclose(whiten.total_deviation, np.sqrt(np.diag(whole)), rtol=1e-12)
    few = np.array([2, 7, 3])
    shared = whiten.shared(few)
    np.testing.assert_allclose(shared @ shared.T, (dense @ dense.T)[np.ix_(few, few)], rtol=1e-12)
