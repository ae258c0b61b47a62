r"""Fitting numbers of a model to time records: output error, least squares, by Levenberg and Marquardt.

The model runs freely from its start; nothing that was measured but the force goes into it. What is left is coloured
(the model's own error, most of all), so that deviations are estimated from blocks of the record:

.. math:: \operatorname{cov} = H^{-1} \Big(\sum_b g_b g_b^T\Big) H^{-1}, \qquad H = J^T J, \quad g_b = J_b^T r_b

References
----------
Nocedal and Wright, Numerical Optimization (2006), section 10.3.
Cameron and Miller, Journal of Human Resources 50 (2015) 317, eq 11.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.model import Model
from diagnosis.fit.unknowns import Unknowns, Values
from diagnosis.record.comparison import Matrix, RecordComparison, Vector

#: Steps at most; it ends when a step is expected to gain, or gains, less than this share of the squared error.
MOST_STEPS, ENOUGH = 40, 1e-7
#: Marquardt's factor at first, its decrease after a success, its increase after a failure, and failures in a row.
FIRST_DAMPING, LESS, MORE, MOST_FAILURES = 1e-3, 0.1, 8.0, 12
#: Step of the differences of matrices and joint parameters, relative to the size of each number.
STEP = 1e-4


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordFit:
    """A fitted model.

    Parameters
    ----------
    unknowns
        What was fitted.
    values
        Shape (p,).
    covariance
        Of the values, from blocks, shape (p, p).
    starts
        Where ring-downs start, shape (n_start,).
    model
        There.
    residual
        Of all records, relative to each sensor's root mean square, shape (m,).
    jacobian
        Rates of the predictions with the values and the starts, shape (m, p + n_start).
    """

    unknowns: Unknowns
    values: Values
    covariance: Float[NDArray[np.float64], "p p"]
    starts: Vector
    model: Model
    residual: Vector
    jacobian: Matrix

    @property
    def deviation(self) -> Values:
        """Standard deviation of each value."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))


def fit_records(
    comparison: RecordComparison,
    unknowns: Unknowns,
    start: Values,
    starts: Vector | None = None,
    report: Callable[[float], None] | None = None,
) -> RecordFit:
    """Minimise the squared error from a start.

    Parameters
    ----------
    comparison
        With what.
    unknowns
        Which numbers; their priors are not used, as a record outweighs them.
    start
        Shape (p,).
    starts
        Where ring-downs start, shape (n_start,); rest by default.
    report
        Called with the mean squared error after each step.

    Raises
    ------
    CampaignError
        A start that runs away.
    """
    p = len(start)
    size = np.concatenate([unknowns.size, np.ones(comparison.n_start)])
    lower, upper = np.array([*unknowns.bounds, *[(-np.inf, np.inf)] * comparison.n_start]).reshape(-1, 2).T
    begin = np.zeros(comparison.n_start) if starts is None else starts
    here = np.clip(np.concatenate([np.asarray(start, dtype=np.float64), begin]), lower, upper)
    residual = comparison.residual(unknowns.compose(here[:p]), here[p:])
    if residual is None:
        raise CampaignError(
            "the model runs away where the fit starts: its values there are "
            + ", ".join(f"{name} {value:.4g}" for name, value in zip(unknowns.names, here[:p], strict=True))
        )
    jacobian = record_jacobian(comparison, unknowns, here[:p], here[p:])
    damping, failures = FIRST_DAMPING, 0
    for _ in range(MOST_STEPS if len(here) else 0):
        error = float(residual @ residual)
        gradient, curvature = jacobian.T @ residual * size, jacobian.T @ jacobian * np.outer(size, size)
        free = ~(((here <= lower) & (gradient < 0)) | ((here >= upper) & (gradient > 0))) & (np.diag(curvature) > 0)
        if not free.any():
            break
        step, reduced = np.zeros(len(here)), curvature[np.ix_(free, free)]
        step[free] = np.linalg.lstsq(reduced + damping * np.diag(np.diag(reduced)), gradient[free], rcond=1e-14)[0]
        trial = np.clip(here + step * size, lower, upper)
        moved = (trial - here) / size
        if float(2 * gradient @ moved - moved @ curvature @ moved) < ENOUGH * error:
            break
        there = comparison.residual(unknowns.compose(trial[:p]), trial[p:])
        if there is not None and there @ there < error:
            gained = error - float(there @ there)
            here, residual, damping, failures = trial, there, damping * LESS, 0
            jacobian = record_jacobian(comparison, unknowns, here[:p], here[p:])
            if report is not None:
                report(float(there @ there) / len(there))
            if gained < ENOUGH * error:
                break
        else:
            damping, failures = max(damping, 1e-4) * MORE, failures + 1
            if failures > MOST_FAILURES:
                break
    return RecordFit(
        unknowns=unknowns, values=here[:p], covariance=_covariance(comparison, jacobian, residual)[:p, :p],
        starts=here[p:], model=unknowns.compose(here[:p]), residual=residual, jacobian=jacobian,
    )  # fmt: skip


def record_jacobian(
    comparison: RecordComparison, unknowns: Unknowns, values: Values, starts: Vector, first: int = 0
) -> Matrix:
    """Rates with the values from a number on, and with the starts, shape (m, p - first + n_start)."""
    pairs = []
    for number, ((lower, upper), size) in enumerate(zip(unknowns.bounds, unknowns.size, strict=True)):
        if number < first:
            continue
        low, high = np.array(values), np.array(values)
        low[number] = np.clip(values[number] - STEP * size, lower, upper)
        high[number] = np.clip(values[number] + STEP * size, lower, upper)
        pairs.append((unknowns.compose(low), unknowns.compose(high), float(high[number] - low[number])))
    return comparison.slopes(unknowns.compose(values), starts, pairs)


def _covariance(comparison: RecordComparison, jacobian: Matrix, residual: Vector) -> Float[NDArray[np.float64], "p p"]:
    scale = np.linalg.norm(jacobian, axis=0)
    scaled = jacobian / np.where(scale > 0, scale, 1.0)
    block = comparison.block
    scores = np.zeros((int(block.max()) + 1, scaled.shape[1]))
    np.add.at(scores, block, scaled * residual[:, None])
    inverse = np.linalg.pinv(scaled.T @ scaled, hermitian=True)
    few = len(scores) / (len(scores) - 1)
    covariance = few * inverse @ (scores.T @ scores) @ inverse
    return np.asarray(covariance / np.outer(*[np.where(scale > 0, scale, 1.0)] * 2))
