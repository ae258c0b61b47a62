"""Shortlisted effects fitted in earnest with the accepted parameters, from several starts, tested on held-out data.

The screening is linear; a refit has turned its order round more than once. What ranks is the held-out error.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from correlation.prediction import Prediction
from diagnosis.arrangement import Arrangement
from diagnosis.calibration import Fit, calibrate
from diagnosis.effect.candidate import Effect
from diagnosis.screening import Score
from diagnosis.unknowns import Unknowns

#: The best few are refitted, and all others this parallel to one of them that promise this share of the best gain.
BEST, PARALLEL, PROMISING, MOST = 3, 0.6, 0.1, 7
#: A second start from the typical strength pays if the first one lies this many times above or below it.
FAR = 3.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Refit:
    """One effect, or none, fitted with the accepted parameters.

    Parameters
    ----------
    effect
        None for the accepted parameters alone.
    fit
        On the training data.
    held_chi2
        chi^2 a number of the held-out data [-].
    error, held_error
        |measured - predicted| / |measured| of the fundamentals of motion, training and held-out [-].
    """

    effect: Effect | None
    fit: Fit
    held_chi2: float
    error: float
    held_error: float

    @property
    def strength(self) -> float:
        """Of the effect [its unit]."""
        return float(self.fit.values[self._first]) if self.effect is not None else 0.0

    @property
    def deviation(self) -> float:
        """Standard deviation of the strength [its unit]."""
        return float(self.fit.deviation[self._first]) if self.effect is not None else 0.0

    @property
    def _first(self) -> int:
        return len(self.fit.values) - len(self.effect.parameters if self.effect is not None else ())


def shortlist(scores: Sequence[Score]) -> list[Score]:
    """Those that a refit may bring to the top."""
    best = list(scores[:BEST])
    chosen = [score for score in best if score.gain > 0]
    for score in scores[BEST:]:
        parallel = max((abs(float(score.direction @ other.direction)) for other in best), default=0.0)
        if len(chosen) < MOST and score.gain > PROMISING * best[0].gain and parallel > PARALLEL:
            chosen.append(score)
    return chosen


def unchanged(arrangement: Arrangement) -> Refit:
    """The accepted parameters alone."""
    return _tested(arrangement, None, arrangement.fit)


def refit(arrangement: Arrangement, score: Score, report: Callable[[float], None] | None = None) -> Refit:
    """Fit one effect beside the accepted parameters.

    Parameters
    ----------
    arrangement
        Measurements and model.
    score
        The effect, and where to start.
    report
        Called with chi^2 after each step.
    """
    effect, accepted = score.effect, arrangement.fit
    unknowns = arrangement.unknowns([effect])
    parameter = effect.parameters[0]
    rest = [each.vanishes for each in effect.parameters[1:]]
    starts = [score.strength]
    size = abs(parameter.typical - parameter.vanishes)
    share = abs(score.strength - parameter.vanishes) / size
    if share > FAR or share < 1 / FAR:
        other = parameter.vanishes + np.sign(score.strength - parameter.vanishes or 1.0) * size
        starts.append(float(np.clip(other, parameter.lower, parameter.upper)))
    best: Fit | None = None
    for start in starts:
        found = calibrate(
            arrangement.train, unknowns, np.array([*accepted.values, start, *rest]), accepted.prediction, report
        )
        if best is None or found.chi2 < best.chi2:
            best = found
    assert best is not None
    return _tested(arrangement, effect, best)


def _tested(arrangement: Arrangement, effect: Effect | None, fit: Fit) -> Refit:
    """Test on the held-out data; what differs between repeats may settle within its prior."""
    unknowns = Unknowns.of(fit.model, arrangement.jitter, ())
    settled = calibrate(arrangement.settled, unknowns, unknowns.vanishing, fit.prediction)
    return Refit(
        effect=effect, fit=fit, held_chi2=settled.chi2 / settled.n_number,
        error=_relative(arrangement.train.observed.value, fit.prediction),
        held_error=_relative(arrangement.settled.observed.value, settled.prediction),
    )  # fmt: skip


def _relative(measured: np.ndarray, prediction: Prediction) -> float:
    """Root mean square relative error of fundamentals, each as large as it is measured."""
    there = np.isfinite(prediction.value) & (prediction.points.harmonic == 1)
    return float(np.sqrt(np.mean(np.abs(prediction.value[there] / measured[there] - 1) ** 2)))
