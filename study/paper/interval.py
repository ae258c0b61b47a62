r"""Intervals of calibrated parameters.

Where parameters are fitted to families, the score C of `diagnosis.fit.family_fit` is minus the logarithm of a
likelihood. A quadratic surface is laid through it by least squares, with the prior known exactly,

.. math:: C(s) = c + g^T s + \tfrac12 s^T H s, \qquad \operatorname{cov} s = (H + 1 / \sigma^2)^{-1},

s being the parameters in their steps and sigma the standard deviation of their prior. At the ends of the 95 % interval
of a parameter, all others free, the profile of C and prior has risen by 1.92. What the families do not tell is as wide
as the prior. The density follows from the free resonance in closed form, so that its interval is that of least squares.

References
----------
D. A. Sprott, Statistical Inference in Science (2000), on profile likelihood.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model
from correlation.uncertainty.interval import TWO_SIDED_95
from diagnosis.fit.family_fit import FamilyTarget
from pipeline.store import stage
from study.case.tables import Case
from study.estimate.resonance import MeasuredResonance
from study.kind.rig.table import RigTable
from study.paper.fit import PRIOR, ParameterFit, ParameterScore, compute_prior
from study.paper.parameters import RigParameters

Matrix = Float[NDArray[np.float64], "p p"]
Points = Float[NDArray[np.float64], "n p"]
Values = Float[NDArray[np.float64], " n"]

#: How far the profile has risen at the ends of a 95 % interval.
RISE = TWO_SIDED_95**2 / 2
#: A step along one parameter is good if the score rises by this much; so often it is doubled or halved to get there.
GOOD, TRIALS = (0.3 * RISE, 3 * RISE), 3
#: Scores further above the least are not near the minimum, and no part of the surface.
DEEP = 5 * RISE
PROFILE, LEAST_SQUARES = "profile of the criterion", "least squares"


@dataclass(frozen=True, kw_only=True)
class Interval:
    """A 95 % interval.

    Parameters
    ----------
    name
        Parameter.
    value, lower, upper
        Calibrated value and both ends [unit of the parameter].
    source
        What it follows from.
    """

    name: str
    value: float
    lower: float
    upper: float
    source: str

    def holds(self, value: float) -> bool:
        """Whether a value is in it."""
        return self.lower <= value <= self.upper


@stage("intervals of the rig's parameters", ignore=("make", "report"))
def find_intervals(
    case: Case[RigTable],  # noqa: ARG001 - what is stored depends on it, and `make` cannot be looked into
    fit: ParameterFit,
    target: FamilyTarget,
    make: Callable[[RigParameters], Model],
    report: Callable[[float, float], None] | None = None,
) -> tuple[Interval, ...]:
    """Intervals of the parameters of a fit by the surface of its score.

    Parameters
    ----------
    case
        Case of the rig, on which the models depend.
    fit
        Fit.
    target
        Families that it was made to.
    make
        Makes the model of some parameters.
    report
        Progress.
    """
    compute_score = ParameterScore(start=fit.start, scale=fit.scale, target=target, make=make)
    steps = np.array(list(fit.scale.values()))
    here = np.array([getattr(fit.parameters, name) - getattr(fit.start, name) for name in fit.scale]) / steps
    most = 2 * len(steps) * TRIALS + len(steps) * (len(steps) - 1)
    tried, score = [*fit.tried], [*fit.score]

    def look(scaled: NDArray[np.float64]) -> float:
        tried.append(scaled)
        now = compute_score(scaled)
        score.append(now)
        if report is not None:
            report(min(len(tried) - len(fit.tried), most), most)
        return now + compute_prior(scaled)

    explore(look, here, fit.after)
    centre, covariance = fit_surface(np.array(tried), np.array(score), here)
    half = TWO_SIDED_95 * np.sqrt(np.diag(covariance))
    # The surface may have its minimum beside the best parameters that were tried: both count.
    lower, upper = np.minimum(centre, here) - half, np.maximum(centre, here) + half
    return tuple(
        Interval(
            name=name, value=getattr(fit.parameters, name), lower=getattr(fit.start, name) + step * low,
            upper=getattr(fit.start, name) + step * high, source=PROFILE,
        )
        for name, step, low, high in zip(fit.scale, steps, lower, upper, strict=True)
    )  # fmt: skip


def explore(look: Callable[[NDArray[np.float64]], float], here: NDArray[np.float64], least: float) -> None:
    """Look at both sides of each parameter, as far off as the score tells, and along the diagonals of each two.

    Parameters
    ----------
    look
        Score with its prior; keeps what it has looked at.
    here
        Where the minimum is, shape (p,).
    least
        Its score.
    """
    n, size = len(here), np.ones(len(here))
    for number in range(n):
        for _ in range(TRIALS):
            move = size[number] * np.eye(n)[number]
            rise = max(look(here + move), look(here - move)) - least
            if GOOD[0] <= rise <= GOOD[1]:
                break
            size[number] = np.clip(size[number] * (2.0 if rise < GOOD[0] else 0.5), 0.125, PRIOR)
    for a, b in combinations(range(n), 2):
        move = (size[a] * np.eye(n)[a] + size[b] * np.eye(n)[b]) / np.sqrt(2)
        look(here + move)
        look(here - move)


def fit_surface(tried: Points, score: Values, here: NDArray[np.float64]) -> tuple[NDArray[np.float64], Matrix]:
    """Minimum and covariance of the quadratic surface of a score with its prior, shapes (p,) and (p, p).

    Parameters
    ----------
    tried
        Parameters, shape (n, p).
    score
        Score of each without the prior, shape (n,).
    here
        The best ones, shape (p,).
    """
    with_prior = score + [compute_prior(item) for item in tried]
    order = np.argsort(with_prior, kind="stable")
    n = len(here)
    n_term = (n + 1) * (n + 2) // 2
    near = order[: max(int(np.sum(with_prior <= with_prior.min() + DEEP)), n_term)]
    moved = tried[near] - here
    pairs = [*combinations(range(n), 2)]
    columns = [
        np.ones(len(near)), *moved.T, *(moved.T**2 / 2), *(moved[:, a] * moved[:, b] for a, b in pairs),
    ]  # fmt: skip
    # A point far up says less of the surface near its minimum.
    weight = 1 / (1 + (with_prior[near] - with_prior.min()) / RISE)
    solved = np.linalg.lstsq(np.column_stack(columns) * weight[:, None], score[near] * weight, rcond=None)[0]
    hessian = np.diag(solved[n + 1 : 2 * n + 1])
    for value, (a, b) in zip(solved[2 * n + 1 :], pairs, strict=True):
        hessian[a, b] = hessian[b, a] = value
    size, vector = np.linalg.eigh(hessian)
    # Along a direction without curvature the families tell nothing.
    convex = (vector * np.maximum(size, 0.0)) @ vector.T
    covariance = np.linalg.inv(convex + np.eye(n) / PRIOR**2)
    gradient = solved[1 : n + 1] + here / PRIOR**2
    reach = np.abs(moved).max(axis=0)
    return here - np.clip(covariance @ gradient, -reach, reach), covariance


def find_density_interval(parameters: RigParameters, free: MeasuredResonance | None) -> Iterator[Interval]:
    """The density by the measured free resonance, the root being right: one density scales all frequencies alike."""
    if free is not None and parameters.density is not None:
        half = 2 * TWO_SIDED_95 * free.frequency_deviation / free.frequency * parameters.density
        yield Interval(
            name="density", value=parameters.density, lower=parameters.density - half,
            upper=parameters.density + half, source=LEAST_SQUARES,
        )  # fmt: skip
