r"""Linear Gaussian model whose prior variances, one per group of coefficients, maximise the evidence.

.. math:: y = \Phi c + \sigma e, \quad c_i \sim N(0, s_{g(i)}^2), \quad
          -2 \ln p(y) = \frac{|y - \Phi c|^2}{\sigma^2} + m \ln \sigma^2 + \sum_i \frac{c_i^2}{s^2_{g(i)}} + \ln |A|
          + \sum_i \ln s^2_{g(i)}, \qquad A = \frac{\Phi^T \Phi}{\sigma^2} + S^{-2}

c is the most probable vector, under the bound c_i >= 0 where it applies; coefficients at the bound are excluded from
the sums. ln s_g has a normal prior about ln F, with F the largest fundamental of the force: groups that the data do not
determine may be as large as those that they do. The most probable sizes follow from

.. math:: \sum_{i \in g} \frac{c_i^2}{s_g^2} = \gamma_g + \frac{\ln(s_g / F)}{\tau^2}

with gamma the number of well-determined coefficients of the group. sigma follows from the residual, and is at least
that of noise.

References
----------
MacKay, Bayesian interpolation, Neural Computation 4 (1992). Lawson and Hanson, Solving least squares problems (1974).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from numpy.typing import NDArray
from scipy.optimize import nnls

Vector = Float[NDArray[np.float64], " b"]

#: Largest number of iterations of the sizes, and relative change that ends them [-].
ROUNDS, SETTLED = 60, 1e-3
#: Prior standard deviation of the logarithm of a size [-]: a factor of 4.
SPREAD = 1.4
#: Smallest and largest size over the largest fundamental of the force [-].
SMALLEST, LARGEST = 1e-3, 4.0
#: Initial sizes over the size of a force that explains all data by the best determined functions. Small initial sizes
#: may lead to the fixed point zero, large ones to solutions in which functions cancel each other [-].
STARTS = (1.0, 100.0)
#: Largest step of the logarithm of a size [-].
STEP = 1.0
#: Number of well-determined coefficients above which a group counts as determined by the data [-].
MIN_DETERMINED = 0.5


@dataclass(frozen=True, kw_only=True, eq=False)
class Posterior:
    """Posterior of the coefficients.

    Parameters
    ----------
    mean
        Most probable coefficients, shape (b,).
    covariance
        Covariance of the coefficients without the bound c_i >= 0, shape (b, b).
    size
        Prior standard deviation of each coefficient, shape (b,).
    noise
        sigma: scatter over that of noise [-].
    cost
        -2 ln p(y), up to a constant of the data [-].
    is_seen
        Mask of the groups that the data determine, shape (g,).
    """

    mean: Vector
    covariance: Float[NDArray[np.float64], "b b"]
    size: Vector
    noise: float
    cost: float
    is_seen: Bool[NDArray[np.bool_], " g"]


def compute_posterior(
    changes: Float[NDArray[np.float64], "m b"],
    residual: Float[NDArray[np.float64], " m"],
    group: Int[NDArray[np.int64], " b"],
    is_positive: Bool[NDArray[np.bool_], " b"],
    fundamental: Complex[NDArray[np.complex128], "s b"],
    n_free: int,
    least_noise: float,
) -> Posterior:
    """Compute the posterior of the coefficients, their prior sizes and the evidence.

    Parameters
    ----------
    changes
        Phi: whitened change by each coefficient, shape (m, b).
    residual
        y in standard deviations, shape (m,).
    group
        Number of the group of each coefficient, shape (b,).
    is_positive
        Mask of coefficients that must not be negative, shape (b,).
    fundamental
        Fundamental of the force by each coefficient in each state, shape (s, b) [-].
    n_free
        Number of data less the number of other fitted parameters [-].
    least_noise
        Least sigma [-].
    """
    result = [
        _compute_posterior_from(start, changes, residual, group, is_positive, fundamental, n_free, least_noise)
        for start in STARTS
    ]
    return min(result, key=lambda item: item.cost)


def _compute_posterior_from(
    start: float,
    changes: Float[NDArray[np.float64], "m b"],
    residual: Float[NDArray[np.float64], " m"],
    group: Int[NDArray[np.int64], " b"],
    is_positive: Bool[NDArray[np.bool_], " b"],
    fundamental: Complex[NDArray[np.complex128], "s b"],
    n_free: int,
    least_noise: float,
) -> Posterior:
    """The same from one initial size."""
    gram, moment, total = changes.T @ changes, changes.T @ residual, float(residual @ residual)
    n_group = int(group.max()) + 1
    begin = float(np.sqrt(max(total, 1.0) / max(np.trace(gram), 1e-300)))
    unit = start * begin
    log_size, noise = np.full(n_group, np.log(unit)), max(least_noise, float(np.sqrt(total / max(n_free, 1))))
    for _ in range(ROUNDS):
        size = np.exp(log_size)[group]
        mean, active = _find_most_probable(gram, moment, size, noise, is_positive)
        left = max(total - 2 * moment @ mean + mean @ gram @ mean, 0.0)
        inverse = _compute_covariance(gram, size, noise, active)
        determined = np.bincount(group, np.where(active, 1 - np.diag(inverse) / size**2, 0.0), n_group)
        squares = np.bincount(group, (mean / size) ** 2, n_group)
        unit = max(float(np.abs(fundamental @ mean).max()), 1e-3 * begin)
        off = (log_size - np.log(unit)) / SPREAD**2
        # Newton's step for squares e^(-2 x) - determined - off - x / SPREAD^2 = 0.
        step = (squares - determined - off) / (2 * squares + 1 / SPREAD**2)
        step = np.clip(step, -STEP, STEP)
        sigma = max(least_noise, float(np.sqrt(left / max(n_free - determined.sum(), 1.0))))
        change = max(np.abs(step).max(), abs(np.log(sigma / noise)))
        log_size, noise = np.clip(log_size + step, np.log(SMALLEST * unit), np.log(LARGEST * unit)), sigma
        if change < SETTLED:
            break
    size = np.exp(log_size)[group]
    mean, active = _find_most_probable(gram, moment, size, noise, is_positive)
    cost = _compute_cost(gram, moment, total, size, noise, mean, active, n_free)
    cost += float(np.sum(((log_size - np.log(unit)) / SPREAD) ** 2))
    covariance = _compute_covariance(gram, size, noise, np.ones_like(active))
    determined = np.bincount(group, 1 - np.diag(covariance) / size**2, n_group)
    return Posterior(
        mean=mean, covariance=covariance, size=size, noise=noise, cost=cost, is_seen=determined > MIN_DETERMINED
    )


def _find_most_probable(
    gram: NDArray[np.float64], moment: Vector, size: Vector, noise: float, is_positive: NDArray[np.bool_]
) -> tuple[Vector, NDArray[np.bool_]]:
    """Coefficients, and mask of those that are not at the bound zero.

    Unbounded coefficients are eliminated, which leaves a small non-negative least-squares problem.
    """
    curvature = gram * np.outer(size, size) / noise**2 + np.eye(len(size))
    right_side, free = moment * size / noise**2, ~is_positive
    z, shared = np.zeros(len(size)), curvature[np.ix_(free, is_positive)]
    solved = np.linalg.solve(curvature[np.ix_(free, free)], np.column_stack([shared, right_side[free]]))
    if is_positive.any():
        factor = np.linalg.cholesky(curvature[np.ix_(is_positive, is_positive)] - shared.T @ solved[:, :-1])
        z[is_positive], _ = nnls(factor.T, np.linalg.solve(factor, right_side[is_positive] - shared.T @ solved[:, -1]))
    z[free] = solved[:, -1] - solved[:, :-1] @ z[is_positive]
    return z * size, free | (z > 0)


def _compute_covariance(
    gram: NDArray[np.float64], size: Vector, noise: float, active: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Inverse of the curvature of the active coefficients, zero elsewhere."""
    result, scale = np.zeros_like(gram), size[active]
    scaled = gram[np.ix_(active, active)] * np.outer(scale, scale) / noise**2 + np.eye(int(active.sum()))
    result[np.ix_(active, active)] = np.linalg.inv(scaled) * np.outer(scale, scale)
    return result


def compute_null_cost(residual: Float[NDArray[np.float64], " m"], n_free: int, least_noise: float) -> float:
    """-2 ln p(y) without any coefficients [-]."""
    total = float(residual @ residual)
    variance = max(least_noise**2, total / max(n_free, 1))
    return float(total / variance + n_free * np.log(variance))


def _compute_cost(
    gram: NDArray[np.float64], moment: Vector, total: float, size: Vector, noise: float, mean: Vector,
    active: NDArray[np.bool_], n_free: int,
) -> float:  # fmt: skip
    left = total - 2 * moment @ mean + mean @ gram @ mean
    scale = size[active]
    scaled = gram[np.ix_(active, active)] * np.outer(scale, scale) / noise**2 + np.eye(int(active.sum()))
    prior = (mean**2 / size**2).sum() + np.linalg.slogdet(scaled)[1]
    return float(left / noise**2 + n_free * np.log(noise**2) + prior)
