"""Derivatives of the wave of a decaying mode, against differences."""

import numpy as np
import pytest

from correlation.signal.slow_flow import SlowFlow, fit_slow_flows


@pytest.mark.parametrize(("breaks", "degree"), [(np.linspace(-3, 0, 5), 2), (np.array([-3.0, 0.0]), 0)])
def test_slopes_of_a_wave_are_those_of_differences(breaks: np.ndarray, degree: int) -> None:
    random, step = np.random.default_rng(1), 1 / 2000
    count = len(breaks) + degree - 1 if degree else 1
    rates = np.log(2.0) + 0.2 * random.standard_normal(count)
    coefficients = np.concatenate([[-0.1, 0.3], rates, 700 + 5 * random.standard_normal(count)])
    flow = SlowFlow(breaks=breaks, degree=degree, coefficients=coefficients, n_sample=4000, harmonics=())
    result = flow.linearise(coefficients, step)[1]
    for number, unit in enumerate([1e-6, 1e-6, *[1e-6] * count, *[1e-3] * count]):
        moved = np.eye(len(coefficients))[number] * unit
        above, below = (flow.linearise(coefficients + way * moved, step)[0].real for way in (1, -1))
        difference = (above - below) / (2 * unit)
        # A sample that passes a point of the flow within the step sees another straight line; all points move with the
        # start, by which the derivative is that of the curve and not of its chords.
        share = 2e-2 if number == 0 else 2e-3
        np.testing.assert_allclose(result[:, number], difference, atol=share * np.abs(difference).max())


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("unit", [1.0, 2.0**15, 2.0**31])
def test_a_mode_that_the_samples_do_not_show_has_a_finite_variance_in_counts_too(unit: float) -> None:
    """Its slopes squared are about e^-700, near the smallest number that a float holds."""
    samples = unit * np.random.default_rng(0).standard_normal(400)
    hidden = np.array([-348.0, 0.0, np.log(2.0), 700.0])
    flow = SlowFlow(breaks=np.array([-350.0, -348.0]), degree=0, coefficients=hidden, n_sample=400, harmonics=())
    fit = fit_slow_flows(samples, 1 / 2000, [flow])
    assert np.isfinite(fit.covariance[0]).all()
    # Ignorance in any unit: far beyond the logarithms and radians that are fitted.
    assert np.diag(fit.covariance[0]).max() > 1e6
