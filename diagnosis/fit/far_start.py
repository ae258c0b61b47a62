"""Start values far from the neutral strength, for effects whose derivative at that strength is not representative.

A contact that slips at the neutral strength may stick at a larger one, which no derivative predicts. Nor does a
derivative predict the effect of a doubled line stiffness on peaks that the calibration has already moved.
"""

from collections.abc import Sequence

import numpy as np

from diagnosis.candidate.effect import Effect, changes_joints
from diagnosis.candidate.far_strength import list_far_strengths
from diagnosis.fit.calibration import compute_chi2
from diagnosis.fit.fit_parameter import Values, make_start
from diagnosis.fit.problem import FitProblem
from diagnosis.fit.refit import MAX_BY_SLIP, acts_by_slip_alone

#: Ratio of chi^2 at a start to that of the fit above which the start is left out. On four development seeds none of 31
#: starts with a ratio above 1000 led to a better fit, and one with 490 did; a factor of ten is margin [-].
MAX_START_RATIO = 1e4
#: Relative change of chi^2 below which a strength changes nothing: more than the error of a solution [-].
UNCHANGED = 1e-6


def list_far_starts(problem: FitProblem, effects: Sequence[Effect]) -> list[tuple[Effect, Values]]:
    """Fitted values with far strengths of the first few effects that are factors on joints, or act through slip alone.

    There are two starts on either side: the nearest far strength, and of the others the one with the lower chi^2. A
    strength that changes nothing, or has a very large chi^2, is left out.
    """
    fit, model = problem.fit, problem.fit.model
    far = [
        item
        for item in effects
        if acts_by_slip_alone(item) or (item.parameters[0].is_ratio and changes_joints(item, model))
    ]
    return [
        (effect, make_start(fit.values, effect, strength))
        for effect in far[:MAX_BY_SLIP]
        for strengths in list_far_strengths(effect.parameters[0])
        for strength in _choose_strengths(problem, effect, strengths.tolist())
    ]


def _choose_strengths(problem: FitProblem, effect: Effect, strengths: Sequence[float]) -> list[float]:
    """Of the far strengths on one side, the nearest and the best of the others, if they are any use."""
    fit, unknowns, known = problem.fit, problem.unknowns([effect]), [problem.fit.chi2]
    useful = dict[float, float]()
    for strength in strengths:
        if strength == effect.parameters[0].vanishes or not np.isfinite(strength):
            continue
        chi2 = compute_chi2(problem.train, unknowns, make_start(fit.values, effect, strength), fit.prediction)
        if chi2 <= MAX_START_RATIO * fit.chi2 and not np.isclose(chi2, known, rtol=UNCHANGED, atol=0.0).any():
            useful[strength] = chi2
        known.append(chi2)
    nearest, others = list(useful)[:1], list(useful)[1:]
    return [*nearest, *sorted(others, key=lambda strength: useful[strength])[:1]]
