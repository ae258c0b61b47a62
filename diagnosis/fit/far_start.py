"""Start values far from the neutral strength, for effects whose derivative at that strength is not representative.

A contact that slips at the neutral strength may stick at a larger one, which no derivative predicts. Nor does a
derivative predict the effect of a doubled line stiffness on peaks that the calibration has already moved.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from correlation.prediction import Prediction
from diagnosis.candidate.effect import Effect, changes_joints
from diagnosis.candidate.far_strength import list_far_strengths
from diagnosis.fit.calibration import compute_chi2
from diagnosis.fit.fit_parameter import Values, make_start
from diagnosis.fit.problem import FitProblem
from diagnosis.fit.refit import MAX_BY_SLIP, acts_by_slip_alone

#: Ratio of chi^2 at a start to that of the fit above which the start is left out. Of 31 starts with a ratio above 1000
#: to four development seeds none led to a better fit; one with 490 did [-].
MAX_START_RATIO = 1e4


class Start(NamedTuple):
    """Start values of a fit, shape (p,), and their chi^2 [-]."""

    values: Values
    chi2: float


def list_far_starts(problem: FitProblem, effects: Sequence[Effect]) -> list[tuple[Effect, Values]]:
    """Fitted values with far strengths of the first few effects that are factors on joints, or act through slip alone.

    There are two starts on either side: the nearest far strength, and of the others the one with the lower chi^2. A
    start that changes nothing, or has a very large chi^2, is left out.
    """
    fit, model = problem.fit, problem.fit.model
    far = [
        item
        for item in effects
        if acts_by_slip_alone(item) or (item.parameters[0].is_ratio and changes_joints(item, model))
    ]
    result = list[tuple[Effect, Values]]()
    for effect in far[:MAX_BY_SLIP]:
        for nearest, *others in list_far_strengths(effect.parameters[0]):
            before = fit.chi2
            for strengths in ([nearest], others):
                start = choose_start(problem, effect, fit.values, strengths, fit.prediction)
                if start.chi2 <= MAX_START_RATIO * fit.chi2 and not np.isclose(start.chi2, before, rtol=1e-9):
                    result.append((effect, start.values))
                before = start.chi2
    return result


def choose_start(
    problem: FitProblem, effect: Effect, fitted: Values, strengths: Iterable[float], nearby: Prediction
) -> Start:
    """Fitted values with the strength of an effect that has the lowest chi^2, computed from a prediction nearby."""
    unknowns = problem.unknowns([effect])
    begins = [make_start(fitted, effect, strength) for strength in strengths]
    starts = [Start(begin, compute_chi2(problem.train, unknowns, begin, nearby)) for begin in begins]
    return min(starts, key=lambda start: start.chi2)
