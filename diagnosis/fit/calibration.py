r"""Fitting numbers of a model: generalised least squares with priors and bounds, by Levenberg and Marquardt.

.. math:: \chi^2 = |S^{-1/2} (y - \varphi(\theta))|^2 + \sum_j ((\theta_j - \theta_{0j}) / \sigma_j)^2

The Jacobian is that of the implicit function theorem, and Broyden's update of it while the steps go as it says: the
features are nearly linear in what is fitted, and a Jacobian costs three predictions. A number at a bound that would
leave it is held there.

References
----------
Nocedal and Wright, Numerical Optimization (2006), sections 10.3 and 11.1.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model
from correlation.prediction import Prediction
from diagnosis.fit.comparison import Comparison, Vector
from diagnosis.fit.unknowns import Unknowns, Values
from hbsolve.errors import ModelError

#: Steps at most; it ends when a step is expected to gain less of chi^2 than matters (1 is a standard deviation).
MOST_STEPS, ENOUGH = 30, 0.3
#: Marquardt's factor at first, its decrease after a success, its increase after a failure, and failures in a row.
FIRST_DAMPING, LESS, MORE, MOST_FAILURES = 1e-3, 0.1, 8.0, 5
#: Shares of the way from no effect to a start, of which the first is taken that something holds.
NEARER = (1.0, 0.5, 0.25, 0.0)
#: Share of the expected gain below which the Jacobian is made anew.
AGREED = 0.5


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """A fitted model.

    Parameters
    ----------
    unknowns
        What was fitted.
    values
        Shape (p,).
    covariance
        Of the values, from the curvature of chi^2, shape (p, p); wider once `threshold.parametric_bootstrap` and
        `diagnosis.fit.finer_model` have seen to it.
    chi2
        With the priors' share.
    model, prediction
        There.
    residual
        Whitened, with the priors' rows below, shape (m + p,).
    jacobian
        Of -residual, shape (m + p, p); an update of an earlier one unless the fit was asked to be exact.
    """

    unknowns: Unknowns
    values: Values
    covariance: Float[NDArray[np.float64], "p p"]
    chi2: float
    model: Model
    prediction: Prediction
    residual: Vector
    jacobian: Float[NDArray[np.float64], "m p"]

    @property
    def deviation(self) -> Values:
        """Standard deviation of each value."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def n_number(self) -> int:
        """Numbers compared [-]."""
        return len(self.residual) - len(self.values)


def calibrate(
    comparison: Comparison,
    unknowns: Unknowns,
    start: Values,
    before: Prediction | None = None,
    report: Callable[[float], None] | None = None,
    *,
    slopes: Float[NDArray[np.float64], "m p"] | None = None,
    exact: bool = False,
    quick: bool = False,
) -> Fit:
    """Minimise chi^2 from a start.

    Parameters
    ----------
    comparison
        With what.
    unknowns
        Which numbers.
    start
        Shape (p,).
    before
        A prediction nearby.
    report
        Called with chi^2 after each step.
    slopes
        Jacobian near the start, shape (m + p, p); computed by default.
    exact
        Whether the Jacobian must be that of the end.
    quick
        Whether an updated Jacobian may say that there is nothing more to gain.
    """
    size, damping, failures = unknowns.size, FIRST_DAMPING, 0
    here = _start(comparison, unknowns, unknowns.clipped(np.array(start, dtype=np.float64)), before)
    jacobian = _jacobian(comparison, unknowns, here) if slopes is None else slopes
    fresh = slopes is None
    for _ in range(MOST_STEPS):
        trial, expected = _step(unknowns, here, jacobian, damping)
        there = _trial(comparison, unknowns, trial, here) if expected >= ENOUGH else here
        gained = here.chi2 - there.chi2
        if gained < ENOUGH and not fresh and not quick:
            # Only the Jacobian of here may say that there is nothing to gain.
            jacobian, fresh = _jacobian(comparison, unknowns, here), True
            continue
        if expected < ENOUGH:
            break
        if gained > 0:
            agreed = gained > AGREED * expected
            jacobian = _updated(jacobian, here, there, size) if agreed else _jacobian(comparison, unknowns, there)
            here, damping, failures, fresh = there, damping * LESS, 0, not agreed
            if report is not None:
                report(here.chi2)
        else:
            damping, failures = max(damping, 1e-4) * MORE, failures + 1
            if failures > MOST_FAILURES:
                break
    if exact and not fresh:
        jacobian = _jacobian(comparison, unknowns, here)
    return Fit(
        unknowns=unknowns, values=here.values, covariance=inverse(jacobian, size), chi2=here.chi2, model=here.model,
        prediction=here.prediction, residual=here.residual, jacobian=jacobian,
    )  # fmt: skip


def inverse(jacobian: Float[NDArray[np.float64], "m p"], size: Values) -> Float[NDArray[np.float64], "p p"]:
    """Of the curvature of chi^2 / 2, in which numbers count as multiples of what matters of each."""
    curvature = jacobian.T @ jacobian * np.outer(size, size)
    return np.asarray(np.linalg.pinv(curvature, hermitian=True) * np.outer(size, size))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Evaluation:
    values: Values
    model: Model
    prediction: Prediction
    residual: Vector
    chi2: float


def _evaluate(comparison: Comparison, unknowns: Unknowns, values: Values, before: Prediction | None) -> _Evaluation:
    model = unknowns.compose(values)
    prediction = comparison.predict(model, before)
    centre = unknowns.vanishing if unknowns.centre is None else unknowns.centre
    away = (centre - values) / unknowns.prior
    residual = np.concatenate([comparison.residual(prediction), away])
    return _Evaluation(
        values=values, model=model, prediction=prediction, residual=residual, chi2=float(residual @ residual)
    )


def _start(comparison: Comparison, unknowns: Unknowns, values: Values, before: Prediction | None) -> _Evaluation:
    """As `_evaluate`, nearer to no effect at all where nothing holds the model of the start."""
    for share in NEARER[:-1]:
        try:
            return _evaluate(comparison, unknowns, unknowns.vanishing + share * (values - unknowns.vanishing), before)
        except ModelError:
            continue
    return _evaluate(comparison, unknowns, unknowns.vanishing, before)


def _trial(comparison: Comparison, unknowns: Unknowns, values: Values, here: _Evaluation) -> _Evaluation:
    """As `_evaluate`; infinitely bad where nothing holds the model, so that the fit turns back."""
    try:
        return _evaluate(comparison, unknowns, values, here.prediction)
    except ModelError:
        return replace(here, chi2=np.inf)


def _step(
    unknowns: Unknowns, here: _Evaluation, jacobian: Float[NDArray[np.float64], "m p"], damping: float
) -> tuple[Values, float]:
    """Where Levenberg and Marquardt go, and by how much chi^2 should fall.

    Numbers that would pass a bound stop there, and the others go where that is best for them.
    """
    size, (lower, upper) = unknowns.size, np.array(unknowns.bounds).reshape(-1, 2).T
    gradient, curvature = jacobian.T @ here.residual * size, jacobian.T @ jacobian * np.outer(size, size)
    free = _free(unknowns, here.values, gradient)
    moved = np.zeros(len(size))
    while free.any():
        reduced = curvature[np.ix_(free, free)]
        pull = gradient[free] - curvature[np.ix_(free, ~free)] @ moved[~free]
        moved[free] = np.linalg.solve(reduced + damping * np.diag(np.diag(reduced) + 1e-12), pull)
        trial = here.values + moved * size
        beyond = free & ((trial < lower) | (trial > upper))
        if not beyond.any():
            break
        moved[beyond] = (np.clip(trial, lower, upper) - here.values)[beyond] / size[beyond]
        free &= ~beyond
    trial = unknowns.clipped(here.values + moved * size)
    return trial, float(2 * gradient @ moved - moved @ curvature @ moved)


def _updated(
    jacobian: Float[NDArray[np.float64], "m p"], here: _Evaluation, there: _Evaluation, size: Values
) -> Float[NDArray[np.float64], "m p"]:
    """Broyden's least change that explains the step made."""
    moved = there.values - here.values
    along = moved / size
    missed = here.residual - there.residual - jacobian @ moved
    return np.asarray(jacobian + np.outer(missed, along / size) / (along @ along))


def _jacobian(comparison: Comparison, unknowns: Unknowns, here: _Evaluation) -> Float[NDArray[np.float64], "m p"]:
    slopes = comparison.slopes(unknowns, here.values, here.model, here.prediction)
    return np.concatenate([slopes, np.diag(1 / unknowns.prior)])


def _free(unknowns: Unknowns, values: Values, gradient: Values) -> NDArray[np.bool_]:
    """Numbers that are not held at a bound by the gradient (of -chi^2 / 2)."""
    lower, upper = np.array(unknowns.bounds).reshape(-1, 2).T
    return np.asarray(~(((values <= lower) & (gradient < 0)) | ((values >= upper) & (gradient > 0))))
