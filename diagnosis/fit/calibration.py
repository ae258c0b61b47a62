r"""Calibration of parameters: generalised least squares with priors and bounds, by Levenberg and Marquardt's method.

.. math:: \chi^2 = |S^{-1/2} (y - \varphi(\theta))|^2 + \sum_j ((\theta_j - \theta_{0j}) / \sigma_j)^2

The Jacobian follows from the implicit function theorem. As long as steps achieve the predicted gain, it is only updated
by Broyden's formula: the features are nearly linear in the parameters, and a Jacobian costs three predictions. A
parameter is fixed at a bound that a step would cross.

References
----------
Nocedal and Wright, Numerical Optimization (2006), sections 10.3 and 11.1.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any, Protocol

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.special import chdtri

from correlation.model import Model
from diagnosis.fit.fit_parameter import Unknowns, Values
from hbsolve.errors import ModelError

Vector = Float[NDArray[np.float64], " m"]
Matrix = Float[NDArray[np.float64], "m p"]

#: Gain of chi^2 that matters (1 is a standard deviation).
MIN_GAIN = 0.3
#: Marquardt's factor: initial value, decrease after a success, increase after a failure, and least value before an
#: increase (smaller values do not change a step). In 566 fits to six rigs these needed 19 % fewer predictions than 8
#: and 1e-4, and reached the same chi^2; a failed step did not compute the Jacobian again then.
FIRST_DAMPING, LESS, MORE, LEAST_DAMPING = 1e-3, 0.1, 30.0, 1e-3
#: Steps after which a fit above its ceiling is abandoned: chi^2 falls within few of Marquardt's steps or not at all.
STEPS_TO_FALL = 6
#: Shares of the way from the neutral values to a start; the first one with a prediction is used, else the neutral ones.
START_SHARES = (1.0, 0.5, 0.25)
#: Share of the expected gain below which the Jacobian is computed again.
MIN_AGREEMENT = 0.5
#: Probability that the parameters of a complete model are this far from their prior centres: that of three standard
#: deviations of a single parameter [-].
CHANCE_BEYOND_PRIORS = 0.0027


@dataclass(frozen=True, kw_only=True)
class Search:
    """Limits of the fits to one kind of data.

    Parameters
    ----------
    steps, failures
        Largest numbers of steps, and of failed steps in a row; those that fail with an updated Jacobian do not count
        [-].
    gain, share
        A fit ends if the expected gain of a step is below this gain plus this share of chi^2 [-].
    updated
        Whether the Jacobian is updated while steps achieve the predicted gain.
    """

    steps: int = 30
    failures: int = 3
    gain: float = MIN_GAIN
    share: float = 0.0
    updated: bool = True

    def enough(self, chi2: float) -> float:
        """Gain below which a fit ends."""
        return self.gain + self.share * chi2


class Ending(Enum):
    """Jacobian that a fit ends with."""

    QUICK = "quick"
    """Any, including an updated one."""
    CONFIRMED = "confirmed"
    """Computed at the final values, unless the fit runs out of steps."""
    EXACT = "exact"
    """Computed at the final values in any case."""


class Data(Protocol):
    """Measurements of one kind to compare a model with; predictions are steady states, or time series with starts."""

    @property
    def search(self) -> Search:
        """Limits of fits to it."""
        ...

    def predict(self, model: Model, nearby: Any = None, starts: Values | None = None) -> Any:
        """Prediction of a model, continued from a prediction nearby, with the initial values of the data.

        Raises
        ------
        ModelError
            The model has no prediction, for example because it diverges.
        """
        ...

    def residual(self, prediction: Any) -> Vector:
        """Measured less predicted in standard deviations, shape (m,)."""
        ...

    def has_prediction(self, prediction: Any) -> NDArray[np.bool_]:
        """Mask of the numbers that have a prediction, shape (m,)."""
        ...

    def slopes(self, unknowns: Unknowns, values: Values, model: Model, prediction: Any, first: int = 0) -> Matrix:
        """Derivatives of the predictions in these units, from value number `first` on, shape (m, p - first)."""
        ...

    def covariance(self, residual: Vector, jacobian: Matrix, size: Values) -> Float[NDArray[np.float64], "p p"]:
        """Covariance of the values of a fit, shape (p, p)."""
        ...


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """A fitted model.

    Parameters
    ----------
    unknowns
        Parameters of the fit.
    values
        Their values, shape (p,).
    covariance
        Covariance of the values, shape (p, p); `diagnosis.threshold.parametric_bootstrap` and
        `diagnosis.fit.finer_model` widen it.
    chi2
        chi^2 with the contribution of the priors [-].
    model, prediction
        Model with these values, and its prediction.
    residual
        Whitened residual with the rows of the priors below, shape (m + p,) [-].
    jacobian
        Jacobian of -residual, shape (m + p, p); at `values` if the fit ends `EXACT`, else it may be an updated one.
    """

    unknowns: Unknowns
    values: Values
    covariance: Float[NDArray[np.float64], "p p"]
    chi2: float
    model: Model
    prediction: Any
    residual: Vector
    jacobian: Matrix

    @property
    def starts(self) -> Values:
        """Values of the starts of the data, shape (n_start,)."""
        return self.values[: self.unknowns.n_start]

    @property
    def deviation(self) -> Values:
        """Standard deviation of each value, shape (p,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def n_number(self) -> int:
        """Numbers compared [-]."""
        return len(self.residual) - len(self.values)

    @property
    def is_beyond_priors(self) -> bool:
        """Whether values are further from their prior centres than chance explains."""
        residuals, n_prior = self.unknowns.prior_residuals(self.values), int(np.isfinite(self.unknowns.prior).sum())
        return bool(residuals @ residuals > chdtri(max(n_prior, 1), CHANCE_BEYOND_PRIORS))

    def reweigh(self, change: Callable[[Matrix], Matrix]) -> Matrix:
        """Jacobian with another covariance, shape (m + p, p): the rows of the data change, those of priors do not."""
        return np.concatenate([change(self.jacobian[: self.n_number]), self.jacobian[self.n_number :]])

    def with_model(self, comparison: Data, model: Model, prediction: Any) -> "Fit":
        """The same with another model and its prediction; priors do not contribute to its chi^2."""
        residual = comparison.residual(prediction)
        whole = np.concatenate([residual, np.zeros(len(self.values))])
        return replace(self, model=model, prediction=prediction, chi2=float(residual @ residual), residual=whole)


def calibrate(
    comparison: Data,
    unknowns: Unknowns,
    start: Values,
    nearby: Any = None,
    report: Callable[[float], None] | None = None,
    *,
    slopes: Matrix | None = None,
    ending: Ending = Ending.CONFIRMED,
    ceiling: float = np.inf,
) -> Fit:
    """Minimise chi^2 from a start.

    Parameters
    ----------
    comparison
        Data.
    unknowns
        Parameters.
    start
        Start values, shape (p,).
    nearby
        Prediction nearby.
    report
        Called with chi^2 after each step.
    slopes
        Jacobian near the start, shape (m + p, p); computed by default.
    ending
        Jacobian that the fit ends with.
    ceiling
        chi^2 above which a fit is abandoned after `STEPS_TO_FALL` steps.

    Raises
    ------
    ModelError
        Not even the model with neutral values has a prediction.
    """
    begin = _start(comparison, unknowns, unknowns.clipped(np.array(start, dtype=np.float64)), nearby)
    return _minimise(comparison, unknowns, begin, report, slopes=slopes, ending=ending, ceiling=ceiling)


def recalibrate(comparison: Data, fit: Fit, *, slopes: Matrix | None = None, ending: Ending = Ending.CONFIRMED) -> Fit:
    """Minimise chi^2 with other weights of the same points, starting from a fit and its prediction.

    Parameters
    ----------
    comparison
        Data.
    fit
        The fit.
    slopes, ending
        As for `calibrate`.
    """
    residual = _compute_residual(comparison, fit.unknowns, fit.values, fit.prediction)
    begin = _Evaluation(
        values=fit.values, model=fit.model, prediction=fit.prediction, residual=residual,
        chi2=float(residual @ residual),
    )  # fmt: skip
    return _minimise(comparison, fit.unknowns, begin, None, slopes=slopes, ending=ending, ceiling=np.inf)


def compute_chi2(comparison: Data, unknowns: Unknowns, values: Values, nearby: Any) -> float:
    """chi^2 of given values, from a prediction nearby; infinite where their model has no prediction."""
    try:
        return _evaluate(comparison, unknowns, values, nearby).chi2
    except ModelError:
        return float("inf")


def _minimise(
    comparison: Data,
    unknowns: Unknowns,
    here: "_Evaluation",
    report: Callable[[float], None] | None,
    *,
    slopes: Matrix | None,
    ending: Ending,
    ceiling: float,
) -> Fit:
    """Levenberg-Marquardt iteration; parameters as for `calibrate`."""
    size, damping, steps, failures, search = unknowns.size, FIRST_DAMPING, 0, 0, comparison.search
    jacobian = _compute_jacobian(comparison, unknowns, here) if slopes is None else slopes
    fresh = slopes is None
    while steps < search.steps:
        if steps >= STEPS_TO_FALL and here.chi2 > ceiling:
            break
        trial, expected = _step(unknowns, here, jacobian, damping)
        enough = search.enough(here.chi2)
        there = _try_values(comparison, unknowns, trial, here) if expected >= enough else here
        gained = _compute_gain(comparison, here, there)
        # A step may fail because its Jacobian was given or updated: a computed one is tried before a shorter step. A
        # minimum is confirmed by a computed one as well.
        failed = expected >= enough and gained <= 0
        if not fresh and (failed or (gained < enough and ending is not Ending.QUICK)):
            jacobian, fresh = _compute_jacobian(comparison, unknowns, here), True
            continue
        if expected < enough:
            break
        steps += 1
        if gained > 0:
            agreed = search.updated and gained > MIN_AGREEMENT * expected
            jacobian = (
                _update_jacobian(jacobian, here, there, size)
                if agreed
                else _compute_jacobian(comparison, unknowns, there)
            )
            here, damping, failures, fresh = there, damping * LESS, 0, not agreed
            if report is not None:
                report(here.chi2)
        else:
            damping, failures = max(damping, LEAST_DAMPING) * MORE, failures + 1
            if failures > search.failures:
                break
    if ending is Ending.EXACT and not fresh:
        jacobian = _compute_jacobian(comparison, unknowns, here)
    return Fit(
        unknowns=unknowns, values=here.values, chi2=here.chi2, model=here.model,
        covariance=unknowns.limited(comparison.covariance(here.residual, jacobian, size)),
        prediction=here.prediction, residual=here.residual, jacobian=jacobian,
    )  # fmt: skip


def invert_curvature(jacobian: Matrix, size: Values) -> Float[NDArray[np.float64], "p p"]:
    """Inverse of the curvature of chi^2 / 2, J^T J, shape (p, p).

    Eigenvalues of the curvature are limited from below by round-off, so that unidentifiable directions have a very
    large variance.

    Parameters
    ----------
    jacobian
        J, shape (m, p).
    size
        Typical size of each parameter, shape (p,).
    """
    norm = np.linalg.norm(jacobian, axis=0)
    scale = np.where(norm > 0, 1 / np.where(norm > 0, norm, 1.0), size)
    scaled = jacobian * scale
    values, vectors = np.linalg.eigh(scaled.T @ scaled)
    least = len(scale) * np.finfo(float).eps * values.max(initial=1.0)
    return np.asarray((vectors / np.maximum(values, least)) @ vectors.T * np.outer(scale, scale))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Evaluation:
    values: Values
    model: Model
    prediction: Any
    residual: Vector
    chi2: float


def _evaluate(comparison: Data, unknowns: Unknowns, values: Values, nearby: Any) -> _Evaluation:
    model = unknowns.compose(values)
    prediction = comparison.predict(model, nearby, values[: unknowns.n_start])
    residual = _compute_residual(comparison, unknowns, values, prediction)
    return _Evaluation(
        values=values, model=model, prediction=prediction, residual=residual, chi2=float(residual @ residual)
    )


def _compute_residual(comparison: Data, unknowns: Unknowns, values: Values, prediction: Any) -> Vector:
    """Whitened differences of the data, and of the priors, shape (m + p,)."""
    return np.concatenate([comparison.residual(prediction), -unknowns.prior_residuals(values)])


def _start(comparison: Data, unknowns: Unknowns, values: Values, nearby: Any) -> _Evaluation:
    """As `_evaluate`, nearer to the neutral values if the model of the start has no prediction."""
    for share in START_SHARES:
        try:
            return _evaluate(comparison, unknowns, unknowns.vanishing + share * (values - unknowns.vanishing), nearby)
        except ModelError:
            continue
    return _evaluate(comparison, unknowns, unknowns.vanishing, nearby)


def _try_values(comparison: Data, unknowns: Unknowns, values: Values, here: _Evaluation) -> _Evaluation:
    """As `_evaluate`; chi^2 is infinite if the model has no prediction, so that the step is rejected."""
    try:
        return _evaluate(comparison, unknowns, values, here.prediction)
    except ModelError:
        return replace(here, chi2=np.inf)


def _compute_gain(comparison: Data, here: _Evaluation, there: _Evaluation) -> float:
    """Fall of chi^2; a number that loses its prediction contributes no fall, since a lost state is no better fit."""
    if there is here or np.isinf(there.chi2):
        return here.chi2 - there.chi2
    lost = comparison.has_prediction(here.prediction) & ~comparison.has_prediction(there.prediction)
    before, after = (item.residual[: len(lost)][lost] ** 2 for item in (here, there))
    return float(here.chi2 - there.chi2 - np.maximum(before - after, 0.0).sum())


def _step(unknowns: Unknowns, here: _Evaluation, jacobian: Matrix, damping: float) -> tuple[Values, float]:
    """Values after a Levenberg-Marquardt step, and the expected fall of chi^2.

    Parameters that would cross a bound stop there; the step of the others is optimal under this constraint.
    """
    size, (lower, upper) = unknowns.size, np.array(unknowns.bounds).reshape(-1, 2).T
    gradient, curvature = jacobian.T @ here.residual * size, jacobian.T @ jacobian * np.outer(size, size)
    free = _find_free_parameters(unknowns, here.values, gradient)
    moved = np.zeros(len(size))
    while free.any():
        reduced = curvature[np.ix_(free, free)]
        right_side = gradient[free] - curvature[np.ix_(free, ~free)] @ moved[~free]
        moved[free] = np.linalg.solve(reduced + damping * np.diag(np.diag(reduced) + 1e-12), right_side)
        trial = here.values + moved * size
        beyond = free & ((trial < lower) | (trial > upper))
        if not beyond.any():
            break
        moved[beyond] = (np.clip(trial, lower, upper) - here.values)[beyond] / size[beyond]
        free &= ~beyond
    trial = unknowns.clipped(here.values + moved * size)
    return trial, float(2 * gradient @ moved - moved @ curvature @ moved)


def _update_jacobian(jacobian: Matrix, here: _Evaluation, there: _Evaluation, size: Values) -> Matrix:
    """Broyden's update: the least change of the Jacobian that explains the last step."""
    moved = there.values - here.values
    along = moved / size
    missed = here.residual - there.residual - jacobian @ moved
    return np.asarray(jacobian + np.outer(missed, along / size) / (along @ along))


def _compute_jacobian(comparison: Data, unknowns: Unknowns, here: _Evaluation) -> Matrix:
    slopes = comparison.slopes(unknowns, here.values, here.model, here.prediction)
    return np.concatenate([slopes, np.diag(1 / unknowns.prior)])


def _find_free_parameters(unknowns: Unknowns, values: Values, gradient: Values) -> NDArray[np.bool_]:
    """Mask of the parameters that the gradient (of -chi^2 / 2) does not fix at a bound."""
    lower, upper = np.array(unknowns.bounds).reshape(-1, 2).T
    return np.asarray(~(((values <= lower) & (gradient < 0)) | ((values >= upper) & (gradient > 0))))
