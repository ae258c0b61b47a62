"""Start values far from the neutral strength, for effects whose derivative at that strength is not representative.

A contact that slips at the neutral strength may stick at a larger one, which no derivative predicts. Nor does a
derivative predict the effect of a doubled line stiffness on peaks that the calibration has already moved.
"""

from collections.abc import Iterable, Sequence

from correlation.prediction import Prediction
from diagnosis.candidate.effect import Effect, changes_joints
from diagnosis.candidate.far_strength import list_far_strengths
from diagnosis.fit.calibration import compute_chi2
from diagnosis.fit.fit_parameter import Values, make_start
from diagnosis.fit.problem import FitProblem
from diagnosis.fit.refit import MAX_BY_SLIP, acts_by_slip_alone


def list_far_starts(problem: FitProblem, effects: Sequence[Effect]) -> list[tuple[Effect, Values]]:
    """Fitted values with far strengths of the first few effects that are factors on joints, or act through slip alone.

    There are two starts on either side: the nearest far strength, and of the others the one with the lower chi^2.
    """
    fit, model = problem.fit, problem.fit.model
    far = [
        item
        for item in effects
        if acts_by_slip_alone(item) or (item.parameters[0].is_ratio and changes_joints(item, model))
    ]
    return [
        (effect, choose_start(problem, effect, fit.values, strengths, fit.prediction))
        for effect in far[:MAX_BY_SLIP]
        for nearest, *others in list_far_strengths(effect.parameters[0])
        for strengths in ([nearest], others)
    ]


def choose_start(
    problem: FitProblem, effect: Effect, fitted: Values, strengths: Iterable[float], nearby: Prediction
) -> Values:
    """Fitted values with the strength of an effect that has the lowest chi^2, computed from a prediction nearby."""
    unknowns = problem.unknowns([effect])
    begins = [make_start(fitted, effect, strength) for strength in strengths]
    return min(begins, key=lambda begin: compute_chi2(problem.train, unknowns, begin, nearby))
