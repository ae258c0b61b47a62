"""What the paper tunes by hand, by numbers: parameters whose bands hold the families tightest.

Minimised is the score of `diagnosis.fit.family_fit`: the logarithms of the interval scores of all families over the
band that some friction histories reach, with a wide prior around the start.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import scipy.optimize
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model
from diagnosis.fit.family_fit import HOPELESS, FamilyTarget
from geometry.errors import InputError
from hbsolve.errors import BalanceError, NoSteadyState
from pipeline.store import stage
from study.case.tables import Case
from study.kind.rig.table import RigTable
from study.paper.parameters import RigParameters

Values = Float[NDArray[np.float64], " p"]

#: First step of the simplex and standard deviation of the prior, in the scale of each parameter [-].
STEP, PRIOR = 0.5, 5.0
#: When it ends: in the scale, and in the score of a curve.
CLOSE, FLAT = 0.05, 2e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class ParameterFit:
    """A fit of p parameters.

    Parameters
    ----------
    start
        Parameters that it started from.
    scale
        Parameters that were tuned by name, each with a step that matters [unit of the parameter].
    parameters
        Best parameters.
    before, after
        Score at the start and at the end, prior included [-].
    tried
        Tuned parameters less those of the start, in steps, shape (n, p) [-].
    score
        Score of each without the prior, shape (n,) [-].
    """

    start: RigParameters
    scale: Mapping[str, float]
    parameters: RigParameters
    before: float
    after: float
    tried: Float[NDArray[np.float64], "n p"]
    score: Float[NDArray[np.float64], " n"]


@dataclass(frozen=True, kw_only=True, eq=False)
class ParameterScore:
    """The score of the rig with some parameters changed.

    Parameters
    ----------
    start, scale
        As in `ParameterFit`.
    target
        Families.
    make
        Makes the model of some parameters.
    """

    start: RigParameters
    scale: Mapping[str, float]
    target: FamilyTarget
    make: Callable[[RigParameters], Model]

    def compose(self, scaled: Values) -> RigParameters:
        """The parameters that are so many steps off the start, shape (p,) [-]."""
        moved = zip(self.scale.items(), scaled, strict=True)
        return replace(self.start, **{name: float(getattr(self.start, name) + step * by) for (name, step), by in moved})

    def __call__(self, scaled: Values) -> float:
        """Score so many steps off the start, without a prior; of a rig that does not exist the worst one."""
        try:
            return self.target.score(self.make(self.compose(scaled)))
        except (BalanceError, NoSteadyState, InputError):  # a damper out of its groove, say
            return self.target.count * float(np.log(HOPELESS))


@stage("fit of the rig's parameters", ignore=("make", "report"))
def fit_parameters(
    case: Case[RigTable],  # noqa: ARG001 - what is stored depends on it, and `make` cannot be looked into
    start: RigParameters,
    scale: Mapping[str, float],
    target: FamilyTarget,
    most: int,
    make: Callable[[RigParameters], Model],
    report: Callable[[float, float], None] | None = None,
) -> ParameterFit:
    """Tune some parameters to families by the simplex method.

    Parameters
    ----------
    case
        Case of the rig, on which the models depend.
    start
        Parameters to start from.
    scale
        Parameters that are tuned by name, each with a step that matters [unit of the parameter].
    target
        Families.
    most
        Evaluations at most [-].
    make
        Makes the model of some parameters.
    report
        Progress.
    """
    compute_score = ParameterScore(start=start, scale=scale, target=target, make=make)
    tried: list[Values] = []
    score: list[float] = []

    def cost(scaled: Values) -> float:
        tried.append(np.array(scaled))
        score.append(compute_score(scaled))
        if report is not None:
            report(len(tried), most)
        return score[-1] + compute_prior(scaled)

    simplex = np.vstack([np.zeros(len(scale)), STEP * np.eye(len(scale))])
    before = cost(simplex[0])
    result = scipy.optimize.minimize(
        cost, simplex[0], method="Nelder-Mead",
        options={
            "initial_simplex": simplex, "maxfev": most - 1, "xatol": CLOSE, "fatol": FLAT * target.count,
            "adaptive": True,
        },
    )  # fmt: skip
    best = compute_score.compose(np.asarray(result.x))
    return ParameterFit(
        start=start, scale=scale, parameters=best, before=before, after=float(result.fun), tried=np.array(tried),
        score=np.array(score),
    )  # fmt: skip


def compute_prior(scaled: Values) -> float:
    """What the wide prior around the start adds to the score [-]."""
    return 0.5 * float(np.sum((scaled / PRIOR) ** 2))
