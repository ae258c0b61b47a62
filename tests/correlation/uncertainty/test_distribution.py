"""Distributions have the moments that they are given by."""

import numpy as np
import pytest
from scipy import stats

from correlation.uncertainty.distribution import Distribution, Lognormal, Normal, Uniform

#: Middles of so many equal shares: sums over them are integrals over the quantiles.
SHARE = (np.arange(1_000_000) + 0.5) / 1_000_000


@pytest.mark.parametrize(
    "distribution",
    [Normal(mean=-3.0, deviation=0.5), Lognormal(mean=2.0, deviation=0.8), Uniform(lower=-1.0, upper=5.0)],
)
def test_quantiles_have_the_mean_and_the_standard_deviation(distribution: Distribution) -> None:
    values = distribution.quantile(SHARE)
    # The middles miss the tails of a millionth share.
    assert np.mean(values) == pytest.approx(distribution.mean, rel=1e-5)
    assert np.std(values) == pytest.approx(distribution.deviation, rel=1e-4)
    assert (np.diff(values) > 0).all()


def test_quantiles_are_those_of_scipy() -> None:
    share = np.array([0.05, 0.5, 0.95])
    sigma = np.sqrt(np.log(1 + 0.16))
    expected = stats.lognorm(s=sigma, scale=2 / np.sqrt(1.16)).ppf(share)
    # Two ways of the same formula, up to round-off.
    np.testing.assert_allclose(Lognormal(mean=2.0, deviation=0.8).quantile(share), expected, rtol=1e-12)
    np.testing.assert_allclose(
        Normal(mean=1.0, deviation=0.1).quantile(share), stats.norm(1.0, 0.1).ppf(share), rtol=1e-12
    )
