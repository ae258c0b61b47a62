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
from typing import Any, Protocol

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model
from diagnosis.fit.unknowns import Unknowns, Values
from hbsolve.errors import ModelError

Vector = Float[NDArray[np.float64], " m"]
Matrix = Float[NDArray[np.float64], "m p"]

#: Gain of chi^2 that matters (1 is a standard deviation).
ENOUGH = 0.3
#: Marquardt's factor at first, its decrease after a success, and its increase after a failure.
FIRST_DAMPING, LESS, MORE = 1e-3, 0.1, 8.0
#: Shares of the way from no effect to a start, of which the first is taken whose model says something.
NEARER = (1.0, 0.5, 0.25, 0.0)
#: Share of the expected gain below which the Jacobian is made anew.
AGREED = 0.5


@dataclass(frozen=True, kw_only=True)
class Search:
    """How far the fits to one kind of data go.

    Parameters
    ----------
    steps, failures
        Steps at most, and failures in a row [-].
    gain, share
        A fit ends when a step is expected to gain less of chi^2 than this, and this share of it [-].
    updated
        Whether an update of the Jacobian serves while the steps go as it says.
    """

    steps: int = 30
    failures: int = 5
    gain: float = ENOUGH
    share: float = 0.0
    updated: bool = True

    def enough(self, chi2: float) -> float:
        """Gain below which a fit ends."""
        return self.gain + self.share * chi2


class Data(Protocol):
    """Measurements of one kind, which a model can be compared with.

    What `predict` gives is the data's own: steady states, or time series and where they start.
    """

    @property
    def search(self) -> Search:
        """How far fits to it go."""
        ...

    def predict(self, model: Model, before: Any = None, starts: Values | None = None) -> Any:
        """What a model says, from a prediction nearby, and from where the data start.

        Raises
        ------
        ModelError
            It says nothing, such as one that runs away.
        """
        ...

    def residual(self, prediction: Any) -> Vector:
        """Measured less predicted, in units of what is to be expected of each number, shape (m,)."""
        ...

    def has_prediction(self, prediction: Any) -> NDArray[np.bool_]:
        """Which numbers have a prediction, shape (m,)."""
        ...

    def slopes(self, unknowns: Unknowns, values: Values, model: Model, prediction: Any, first: int = 0) -> Matrix:
        """Rates of the predictions in these units with the values from number `first` on, shape (m, p - first)."""
        ...

    def covariance(self, residual: Vector, jacobian: Matrix, size: Values) -> Float[NDArray[np.float64], "p p"]:
        """Of the values of a fit, shape (p, p)."""
        ...


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
        Of the values, as the data tell it, shape (p, p); wider once `threshold.parametric_bootstrap` and
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
    prediction: Any
    residual: Vector
    jacobian: Matrix

    @property
    def starts(self) -> Values:
        """The values that say how the data begin, shape (n_start,)."""
        return self.values[: self.unknowns.n_start]

    @property
    def deviation(self) -> Values:
        """Standard deviation of each value."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def n_number(self) -> int:
        """Numbers compared [-]."""
        return len(self.residual) - len(self.values)


def calibrate(
    comparison: Data,
    unknowns: Unknowns,
    start: Values,
    before: Any = None,
    report: Callable[[float], None] | None = None,
    *,
    slopes: Matrix | None = None,
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

    Raises
    ------
    ModelError
        Not even the model without any change can be predicted.
    """
    size, damping, failures, search = unknowns.size, FIRST_DAMPING, 0, comparison.search
    here = _start(comparison, unknowns, unknowns.clipped(np.array(start, dtype=np.float64)), before)
    jacobian = _jacobian(comparison, unknowns, here) if slopes is None else slopes
    fresh = slopes is None
    for _ in range(search.steps):
        trial, expected = _step(unknowns, here, jacobian, damping)
        enough = search.enough(here.chi2)
        there = _trial(comparison, unknowns, trial, here) if expected >= enough else here
        gained = here.chi2 - there.chi2
        if gained < enough and not fresh and not quick:
            # Only the Jacobian of here may say that there is nothing to gain.
            jacobian, fresh = _jacobian(comparison, unknowns, here), True
            continue
        if expected < enough:
            break
        if gained > 0:
            agreed = search.updated and gained > AGREED * expected
            jacobian = _updated(jacobian, here, there, size) if agreed else _jacobian(comparison, unknowns, there)
            here, damping, failures, fresh = there, damping * LESS, 0, not agreed
            if report is not None:
                report(here.chi2)
        else:
            damping, failures = max(damping, 1e-4) * MORE, failures + 1
            if failures > search.failures:
                break
    if exact and not fresh:
        jacobian = _jacobian(comparison, unknowns, here)
    return Fit(
        unknowns=unknowns, values=here.values, chi2=here.chi2, model=here.model,
        covariance=comparison.covariance(here.residual, jacobian, size), prediction=here.prediction,
        residual=here.residual, jacobian=jacobian,
    )  # fmt: skip


def inverse(jacobian: Matrix, size: Values) -> Float[NDArray[np.float64], "p p"]:
    """Of the curvature of chi^2 / 2, in which numbers count as multiples of what matters of each."""
    curvature = jacobian.T @ jacobian * np.outer(size, size)
    return np.asarray(np.linalg.pinv(curvature, hermitian=True) * np.outer(size, size))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Evaluation:
    values: Values
    model: Model
    prediction: Any
    residual: Vector
    chi2: float


def _evaluate(comparison: Data, unknowns: Unknowns, values: Values, before: Any) -> _Evaluation:
    model = unknowns.compose(values)
    prediction = comparison.predict(model, before, values[: unknowns.n_start])
    centre = unknowns.vanishing if unknowns.centre is None else unknowns.centre
    away = (centre - values) / unknowns.prior
    residual = np.concatenate([comparison.residual(prediction), away])
    return _Evaluation(
        values=values, model=model, prediction=prediction, residual=residual, chi2=float(residual @ residual)
    )


def _start(comparison: Data, unknowns: Unknowns, values: Values, before: Any) -> _Evaluation:
    """As `_evaluate`, nearer to no effect at all where the model of the start says nothing."""
    for share in NEARER[:-1]:
        try:
            return _evaluate(comparison, unknowns, unknowns.vanishing + share * (values - unknowns.vanishing), before)
        except ModelError:
            continue
    return _evaluate(comparison, unknowns, unknowns.vanishing, before)


def _trial(comparison: Data, unknowns: Unknowns, values: Values, here: _Evaluation) -> _Evaluation:
    """As `_evaluate`; infinitely bad where the model says nothing, so that the fit turns back."""
    try:
        return _evaluate(comparison, unknowns, values, here.prediction)
    except ModelError:
        return replace(here, chi2=np.inf)


def _step(unknowns: Unknowns, here: _Evaluation, jacobian: Matrix, damping: float) -> tuple[Values, float]:
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


def _updated(jacobian: Matrix, here: _Evaluation, there: _Evaluation, size: Values) -> Matrix:
    """Broyden's least change that explains the step made."""
    moved = there.values - here.values
    along = moved / size
    missed = here.residual - there.residual - jacobian @ moved
    return np.asarray(jacobian + np.outer(missed, along / size) / (along @ along))


def _jacobian(comparison: Data, unknowns: Unknowns, here: _Evaluation) -> Matrix:
    slopes = comparison.slopes(unknowns, here.values, here.model, here.prediction)
    return np.concatenate([slopes, np.diag(1 / unknowns.prior)])


def _free(unknowns: Unknowns, values: Values, gradient: Values) -> NDArray[np.bool_]:
    """Numbers that are not held at a bound by the gradient (of -chi^2 / 2)."""
    lower, upper = np.array(unknowns.bounds).reshape(-1, 2).T
    return np.asarray(~(((values <= lower) & (gradient < 0)) | ((values >= upper) & (gradient > 0))))
