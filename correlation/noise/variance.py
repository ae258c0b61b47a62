r"""Noise from few repeats: a variance that follows the amplitude, pooled over points, and shrunk towards each point.

The scatter of a point with d degrees of freedom is :math:`s^2 \sim v\,\chi^2_d / d`. Over the points of one sensor
:math:`v = a^2 |X|^2 + b^2` is fitted by maximum likelihood, with the ratios :math:`s^2 / v` clipped at a high quantile,
so that a few points of unusual friction history do not dominate. The remaining spread of :math:`\log s^2` is due to
true differences between points: their variances scatter about the fit as a scaled inverse :math:`\chi^2` with
:math:`d_0` degrees of freedom, and the expected variance of a point is

.. math:: \frac{d_0 v_0 + d s^2}{d_0 + d - 2} .

For a point with an even larger scatter, :math:`d_0` is set to its least value.

References
----------
G. K. Smyth, Linear models and empirical Bayes methods for assessing differential expression in microarray experiments,
Stat. Appl. Genet. Mol. Biol. 3 (2004), article 3, section 6.2 (the moments of :math:`\log s^2`).
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.special import chdtri, digamma, fdtrc, gammainc, polygamma

Column = Float[NDArray[np.float64], " k"]

#: Probability that a true variance does not exceed its estimate with the margin: a few repeats may agree by chance,
#: without a more accurate mean [-].
CAUTION = 0.8
#: Upper tail probability at which ratios of scatter to variance are clipped [-].
CUT = 0.05
#: Share of tables in which, by chance, a point is taken for one whose scatter the fit does not describe [-].
OWN = 0.01
#: Largest number of iterations of the fit; each reduces the error by a factor of about three [-].
ITERATIONS = 40
#: Least and largest degrees of freedom of the fit: variances are finite above 2, and 1e4 is practically certain.
LEAST_DEGREES, MOST_DEGREES = 3.0, 1e4
#: Least noise of a channel over its largest amplitude (double precision written with few digits) [-].
EXACT = 1e-9


def compute_margin(freedom: int) -> float:
    """Factor on a variance that was estimated with some degrees of freedom, for `CAUTION` [-]."""
    freedom = max(freedom, 1)
    return float(freedom / chdtri(freedom, CAUTION))


def pool_variance(amplitude: Column, scatter: Column, dof: Column) -> Column:
    """Variance of one value, of its real or imaginary part, at each point of one sensor and harmonic.

    Parameters
    ----------
    amplitude
        |X| of the means, shape (k,).
    scatter
        s^2, squared residuals over their degrees of freedom, shape (k,) [its unit squared].
    dof
        Degrees of freedom of s^2, 0 for a point measured once, shape (k,); not all zero.

    Returns
    -------
    Variance, positive, shape (k,) [its unit squared].
    """
    floor = (EXACT * max(float(amplitude.max()), np.finfo(np.float64).tiny ** 0.25)) ** 2
    seen = dof > 0
    own = np.maximum(scatter, floor)
    squared = amplitude**2
    a2, b2 = fit_variance_law(squared[seen], own[seen], dof[seen])
    trend = np.maximum(a2 * squared + b2, floor)
    degrees, scale = _fit_prior(np.log(own[seen] / trend[seen]), dof[seen])
    prior = trend * scale
    # A scatter that occurs by chance in less than one of a hundred tables is not described by the fit.
    chance = fdtrc(np.maximum(dof, 1.0), degrees, own / prior)
    prior_degrees = np.where((dof > 0) & (chance * len(dof) < OWN), LEAST_DEGREES, degrees)
    variance: Column = (prior_degrees * prior + dof * own) / (prior_degrees + dof - 2.0)
    return np.maximum(variance, floor)


def fit_variance_law(squared: Column, scatter: Column, dof: Column) -> tuple[float, float]:
    r"""a^2 and b^2 of :math:`v = a^2 |X|^2 + b^2`.

    Fisher scoring of the likelihood of scaled :math:`\chi^2`, whose equations
    :math:`\sum d\,(s^2 - v)\,\partial v / v^2 = 0` use the scatter clipped at a quantile and scaled to keep its mean.

    Parameters
    ----------
    squared
        |X|^2, shape (k,).
    scatter
        s^2, positive, shape (k,).
    dof
        Degrees of freedom, positive, shape (k,).
    """
    limit = chdtri(dof, CUT) / dof
    # Mean of a clipped chi^2_d / d: P(d/2 + 1, d c / 2) + c CUT.
    kept = gammainc(dof / 2 + 1, dof * limit / 2) + limit * CUT
    top = float(squared.max())
    columns = np.stack([squared / top if top > 0 else np.zeros_like(squared), np.ones_like(squared)])
    variance = np.full_like(scatter, float(np.median(scatter)))
    share = np.zeros(2)
    for _ in range(ITERATIONS):
        cut = np.minimum(scatter, limit * variance) / kept
        share = fit_two_shares(columns, cut, dof / variance**2)
        # At least a millionth of the largest; a smaller variance would have all the weight.
        before, variance = variance, share @ columns
        variance = np.maximum(variance, 1e-6 * variance.max())
        if (np.abs(before - variance) <= 1e-4 * variance).all():
            break
    return (float(share[0] / top) if top > 0 else 0.0), float(share[1])


def estimate_design_effect(effect: Column, squares: Column, dof: Column) -> float:
    """Design effect: number of values of one repeat that count as one; 1 if the errors of its sweeps are independent.

    Parameters
    ----------
    effect
        Squares of residuals summed over the sweeps of each repeat, summed over repeats, shape (k,).
    squares
        Squared residuals summed, shape (k,).
    dof
        Degrees of freedom, shape (k,).

    Returns
    -------
    Mean of the ratio over the points, which is insensitive to single outliers; at least 1.
    """
    seen = (dof > 0) & (squares > 0)
    if not seen.any():
        return 1.0
    ratio = np.average(effect[seen] / squares[seen], weights=dof[seen])
    return float(max(ratio, 1.0))


def fit_two_shares(columns: Float[NDArray[np.float64], "2 k"], target: Column, weight: Column) -> Column:
    """Non-negative shares of two columns by weighted least squares, shape (2,).

    Parameters
    ----------
    columns
        Columns, shape (2, k).
    target, weight
        Target of the sum of the columns, and weights, shape (k,).
    """
    normal = (columns * weight) @ columns.T
    right = (columns * weight) @ target
    determinant = normal[0, 0] * normal[1, 1] - normal[0, 1] ** 2
    if determinant > 1e-12 * normal[0, 0] * normal[1, 1]:
        both = np.array(
            [
                normal[1, 1] * right[0] - normal[0, 1] * right[1],
                normal[0, 0] * right[1] - normal[0, 1] * right[0],
            ]
        )
        both /= determinant
        if (both >= 0).all():
            return both
    alone = np.where(np.diag(normal) > 0, right / np.maximum(np.diag(normal), np.finfo(np.float64).tiny), 0.0)
    gain = alone * right  # reduction of the sum of squares by each column alone
    best = int(np.argmax(gain))
    return np.where(np.arange(2) == best, alone, 0.0)


def _fit_prior(log_ratio: Column, dof: Column) -> tuple[float, float]:
    r"""Degrees of freedom d_0 of the fit, and the correction factor of its :math:`v` (Smyth 2004, 6.2)."""
    centred = log_ratio - digamma(dof / 2) + np.log(dof / 2)
    mean = float(centred.mean())
    if len(centred) < 3:
        return MOST_DEGREES, 1.0
    excess = float(centred.var(ddof=1) - polygamma(1, dof / 2).mean())
    degrees = 2 * _invert_trigamma(excess) if excess > 0 else MOST_DEGREES
    degrees = float(np.clip(degrees, LEAST_DEGREES, MOST_DEGREES))
    return degrees, float(np.exp(mean + digamma(degrees / 2) - np.log(degrees / 2)))


def _invert_trigamma(value: float) -> float:
    """Solve trigamma(x) = value > 0, by Newton's method on 1 / trigamma, which is convex (Smyth 2004, appendix)."""
    x = 0.5 + 1 / value
    for _ in range(50):
        trigamma = float(polygamma(1, x))
        step = trigamma * (1 - trigamma / value) / float(polygamma(2, x))
        x += step
        if -step / x < 1e-8:
            break
    return x
