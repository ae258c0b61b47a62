r"""Metrics of a predicted band for repeated tests: coverage, tightness, and interval score.

Repeats of a test with friction differ by more than noise; the prediction is a band from a lower value :math:`l` to an
upper value :math:`u`, not a line. A sufficiently wide band covers every test, but a narrow one at the right place is
better: the interval score combines both, and its expectation is smallest for the band between the true quantiles.

References
----------
T. Gneiting and A. E. Raftery, Strictly proper scoring rules, prediction, and estimation, Journal of the American
Statistical Association 102 (2007), eq. 43.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.errors import CampaignError

Real = NDArray[np.float64]
Points = Float[Real, " p"]
Tests = Float[Real, "n p"]


def coverage(measured: Tests, lower: Points, upper: Points) -> float:
    """Share of measured points inside the band, including its ends [-]; 1 is perfect for limits.

    Parameters
    ----------
    measured
        n repeats at p points, shape (n, p); NaN where a repeat has no value.
    lower, upper
        Ends of the band, shape (p,), in the same unit.

    Raises
    ------
    CampaignError
        No measured point, inconsistent shapes, or a band whose ends are missing or in the wrong order.
    """
    values, low, high = _check_band(measured, lower, upper)
    there = np.isfinite(values)
    return float(((low <= values) & (values <= high))[there].mean())


def tightness(measured: Tests, lower: Points, upper: Points) -> Points:
    """Width of the band over the spread of the tests, its range over the repeats, at each point, shape (p,) [-].

    1 means a band as wide as the measured range; infinite if the repeats agree but the band has a width; NaN with fewer
    than two repeats, or if both widths are zero. Few repeats underestimate the spread: compare bands with one another
    rather than with 1.

    Parameters
    ----------
    measured, lower, upper
        As `coverage`.

    Raises
    ------
    CampaignError
        As `coverage`.
    """
    values, low, high = _check_band(measured, lower, upper)
    there = np.isfinite(values)
    spread = np.max(values, axis=0, initial=-np.inf, where=there) - np.min(values, axis=0, initial=np.inf, where=there)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = (high - low) / spread
    return np.where(there.sum(axis=0) > 1, ratio, np.nan)


def interval_score(measured: Tests, lower: Points, upper: Points, alpha: float) -> Tests:
    r"""The interval score of each measured point, shape (n, p) [unit of the points]; smaller is better.

    .. math:: S_\alpha(l, u; x) = (u - l) + \frac{2}{\alpha} (l - x)_+ + \frac{2}{\alpha} (x - u)_+

    Parameters
    ----------
    measured, lower, upper
        As `coverage`; the score is NaN where a repeat has no value.
    alpha
        The band is intended to cover the central share 1 - alpha of the tests, in (0, 1); small for limits that hardly
        any test may exceed. A point outside costs 2 / alpha times its distance.

    Raises
    ------
    CampaignError
        As `coverage`, or an alpha outside (0, 1).
    """
    if not 0 < alpha < 1:
        raise CampaignError(f"alpha = {alpha:g} must lie between 0 and 1: 0.05 scores a band that holds 95 % of tests")
    values, low, high = _check_band(measured, lower, upper)
    outside = np.maximum(low - values, 0.0) + np.maximum(values - high, 0.0)
    return np.asarray((high - low) + 2 / alpha * outside)


def _check_band(measured: Tests, lower: Points, upper: Points) -> tuple[Tests, Points, Points]:
    values, low, high = (np.asarray(item, dtype=np.float64) for item in (measured, lower, upper))
    if values.ndim != 2 or low.shape != (values.shape[1],) or high.shape != low.shape:
        raise CampaignError(
            f"measured has shape {values.shape}, lower {low.shape} and upper {high.shape}: give (n, p), (p,) and (p,), "
            "n repeats at p points"
        )
    if not np.isfinite(values).any():
        raise CampaignError("no point of the band was measured: give at least one finite value")
    if not (low <= high).all():
        at = int(np.flatnonzero(~(low <= high))[0])
        raise CampaignError(
            f"the band goes from {low[at]:g} to {high[at]:g} at point {at}: give a lower end and an upper one that is "
            "not below it"
        )
    return values, low, high
