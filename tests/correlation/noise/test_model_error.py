"""Model error: its density against that of the dense covariance, and sizes found where they are known."""

import numpy as np
import pytest
import scipy.stats
from numpy.typing import NDArray

from correlation.noise.covariance import Whitening
from correlation.noise.error_density import ErrorSizeDensity, estimate_error_size
from correlation.noise.error_patterns import ErrorPatterns
from correlation.noise.error_size import ErrorSize, compute_prior

N, PARTS = 240, 12
USUAL = ErrorSize(2e-4, 0.02, 1e-3, 1e-3)


@pytest.fixture(scope="module")
def patterns() -> ErrorPatterns:
    random = np.random.default_rng(1)
    return ErrorPatterns(
        frequency=30 * random.standard_normal((N, 4)),
        damping=random.standard_normal((N, 4)),
        reading=random.uniform(1, 3, N),
        part=random.permutation(np.arange(N) % PARTS),
        shape=random.standard_normal((N, 6)),
    )


@pytest.fixture(scope="module")
def whitening() -> Whitening:
    random = np.random.default_rng(2)
    return Whitening(deviation=random.uniform(1e-3, 2e-3, N), modes=1e-3 * random.standard_normal((N, 3)))


def covariance(whitening: Whitening, patterns: ErrorPatterns, size: ErrorSize) -> NDArray[np.float64]:
    """C, written out."""
    assert whitening.modes is not None
    frequency, damping = size.frequency * patterns.frequency, size.damping * patterns.damping
    own = size.reading * patterns.reading
    together = np.outer(own, own) * (patterns.part[:, None] == patterns.part)
    modes = np.column_stack([whitening.modes, frequency, damping, size.shape * patterns.shape])
    return np.asarray(modes @ modes.T + np.diag(whitening.deviation**2 + own**2) + together)


@pytest.mark.parametrize("size", [ErrorSize(), ErrorSize(1e-4, 3e-3, 2e-3, 4e-3), ErrorSize(reading=0.1)])
def test_density_is_that_of_the_normal_distribution(
    whitening: Whitening, patterns: ErrorPatterns, size: ErrorSize
) -> None:
    dense = covariance(whitening, patterns, size)
    difference = np.random.default_rng(3).multivariate_normal(np.zeros(N), dense)
    exact = -2 * scipy.stats.multivariate_normal(np.zeros(N), dense).logpdf(difference) - N * np.log(2 * np.pi)
    result = ErrorSizeDensity(whitening, patterns, USUAL, difference)(size)
    # Round-off of a condition number of 1e5.
    assert result - compute_prior(size, USUAL) == pytest.approx(exact, rel=1e-9)
    wide = patterns.widen(whitening, size)
    assert wide.log_determinant == pytest.approx(np.linalg.slogdet(dense)[1], rel=1e-9)
    assert wide(difference) @ wide(difference) == pytest.approx(difference @ np.linalg.solve(dense, difference))
    np.testing.assert_allclose(wide.unwhiten(wide(difference)), difference, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    "size", [ErrorSize(frequency=1e-3), ErrorSize(damping=0.1), ErrorSize(reading=0.02), ErrorSize(shape=0.02)]
)
def test_an_error_is_found_in_its_size(whitening: Whitening, patterns: ErrorPatterns, size: ErrorSize) -> None:
    dense = covariance(whitening, patterns, size)
    random = np.random.default_rng(4)
    result = [
        estimate_error_size(whitening, patterns, USUAL, random.multivariate_normal(np.zeros(N), dense))
        for _ in range(20)
    ]
    for name in ("frequency", "damping", "reading", "shape"):
        true = getattr(size, name)
        # Four columns tell a size to 35 %, twelve parts and 240 numbers far better: 20 draws to a tenth in the median.
        assert np.median([getattr(item, name) for item in result]) == pytest.approx(true, rel=0.35, abs=2e-4)


def test_noise_alone_is_no_error(whitening: Whitening, patterns: ErrorPatterns) -> None:
    dense = covariance(whitening, patterns, ErrorSize())
    random = np.random.default_rng(5)
    result = [
        estimate_error_size(whitening, patterns, USUAL, random.multivariate_normal(np.zeros(N), dense))
        for _ in range(30)
    ]
    # Expected are 5 % or fewer of 30: more than 5 come once in 300 times at 5 %.
    assert sum(item != ErrorSize() for item in result) <= 5
