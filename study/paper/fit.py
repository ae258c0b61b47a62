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


@dataclass(frozen=True, kw_only=True)
class ParameterFit:
    """A fit.

    Parameters
    ----------
    parameters
        Best parameters.
    before, after
        Score at the start and at the end [-].
    n_evaluation
        Models whose bands were sampled [-].
    """

    parameters: RigParameters
    before: float
    after: float
    n_evaluation: int


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
    names, steps = list(scale), np.array(list(scale.values()))
    first = np.array([getattr(start, name) for name in names])
    count = 0

    def composed(scaled: Values) -> RigParameters:
        values = first + steps * scaled
        return replace(start, **dict(zip(names, map(float, values), strict=True)))

    def cost(scaled: Values) -> float:
        nonlocal count
        count += 1
        if report is not None:
            report(count, most)
        try:
            score = target.score(make(composed(scaled)))
        except (BalanceError, NoSteadyState, InputError):  # no such rig: a damper out of its groove, say
            score = target.count * float(np.log(HOPELESS))
        return float(score + 0.5 * np.sum((scaled / PRIOR) ** 2))

    simplex = np.vstack([np.zeros(len(names)), STEP * np.eye(len(names))])
    before = cost(simplex[0])
    result = scipy.optimize.minimize(
        cost, simplex[0], method="Nelder-Mead",
        options={
            "initial_simplex": simplex, "maxfev": most - 1, "xatol": CLOSE, "fatol": FLAT * target.count,
            "adaptive": True,
        },
    )  # fmt: skip
    best = composed(np.asarray(result.x))
    return ParameterFit(parameters=best, before=before, after=float(result.fun), n_evaluation=count)
