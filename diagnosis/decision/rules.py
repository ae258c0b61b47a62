r"""Rules that lead from refits to a verdict.

An effect passes if chi^2 of the training data falls by more than the detection threshold, and that of the held-out data
falls as well: an effect that fits noise makes the held-out data worse by as much as it gains. Effects are ranked by
both falls together. Effects so close to the best that the data cannot distinguish them are named with it. Then the
remaining residual is examined: if an unknown force or another effect explains a good part of the gain of the best one,
that one only stands in for it, and none of the known effects is the cause.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from diagnosis.candidate.catalogue import Catalogue
from diagnosis.candidate.effect import Effect
from diagnosis.decision.verdict import Finding, Verdict, smallest_detectable
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.problem import Refit
from diagnosis.fit.refit import fit_effect
from diagnosis.localisation import Place, localise
from diagnosis.screening import Score, compute_slope_gains, screen
from diagnosis.step import RunStep
from diagnosis.threshold.detection_threshold import Thresholds

#: Largest distance of an effect's falls of chi^2 behind the best for it to be named as well: odds of 20 to 1.
BEHIND = 6.0
#: Share of the gain of the best effect that others may gain beyond the threshold.
STAND_IN = 0.15
#: Standard deviations of chi^2 by which a fit must be worse than noise for its weights to be in doubt.
BEYOND = 5.0
#: Reduced chi-squared above which a fit is bad in any case, and the share of the excess that may stay.
BAD, LEFT = 2.0, 0.1
#: Largest number of effects whose linear gain is checked by a fit.
CHECKED = 2


@dataclass(frozen=True, kw_only=True, eq=False)
class Leftover:
    """Gain that remains beside an effect.

    Parameters
    ----------
    gain
        Fall of chi^2 by the best further effect: linear, or by a fit where the linear one exceeds the threshold.
    name
        Name of this effect.
    places
        Places where an unknown force would explain the rest, best first.
    """

    gain: float
    name: str
    places: tuple[Place, ...]


def with_effect(arrangement: Arrangement, refit: Refit) -> Arrangement:
    """Arrangement of the same measurements with an effect added to the model."""
    assert refit.effect is not None
    fit = refit.fit
    slopes = arrangement.train.slopes(fit.unknowns, fit.values, fit.model, fit.prediction)
    jacobian = np.concatenate([slopes, np.diag(1 / fit.unknowns.prior)])
    return replace(arrangement, added=(*arrangement.added, refit.effect), fit=replace(fit, jacobian=jacobian))


def find_leftover(arrangement: Arrangement, effects: Sequence[Effect], worth: float = np.inf) -> Leftover:
    """Gain that remains once an effect is added, see `with_effect`.

    Parameters
    ----------
    arrangement
        Arrangement with the effect.
    effects
        Candidates; the best few whose linear gain exceeds `worth` are fitted, since the linear gain of an effect on
        contacts that begin to slip may be far too large.
    worth
        Gain that matters [-].
    """
    gains = compute_slope_gains(arrangement, effects)
    promising = [number for number in np.argsort(-gains) if gains[number] > worth]
    for place, number in enumerate(promising):
        if place < CHECKED:
            (score,) = screen(arrangement, [effects[number]])
            gains[number] = arrangement.fit.chi2 - fit_effect(arrangement, score).chi2
        else:
            gains[number] = worth
    best = int(np.argmax(gains)) if len(gains) else -1
    return Leftover(
        gain=float(gains[best]) if best >= 0 else 0.0,
        name=effects[best].name if best >= 0 else "",
        places=tuple(localise(arrangement)),
    )


class Gate(Protocol):
    """Conditions for refits to be named, by the statistics of one kind of data."""

    def passes(self, refit: Refit) -> bool:
        """Whether an effect is significant."""
        ...

    def explains(self, refit: Refit) -> bool:
        """Whether an effect that passes leaves little enough, and stands in for no other."""
        ...

    def is_alike(self, best: Refit, other: Refit) -> bool:
        """Whether the data cannot distinguish an effect that passes from the best one."""
        ...

    def is_unexplained(self) -> bool:
        """Whether something is missing though no effect passes."""
        ...


def find(gate: Gate, refits: Sequence[Refit]) -> tuple[Finding, list[Refit]]:
    """Finding, and the effects that it names, from refits in order, best first."""
    passed = [refit for refit in refits if gate.passes(refit)]
    if not passed:
        return (Finding.UNKNOWN if gate.is_unexplained() else Finding.NOTHING), []
    best, *others = passed
    if not gate.explains(best):
        return Finding.UNKNOWN, []
    alike = [best, *(other for other in others if gate.is_alike(best, other))]
    return (Finding.AMBIGUOUS if len(alike) > 1 else Finding.MISSING), alike


def gain(arrangement: Arrangement, refit: Refit) -> float:
    """Fall of chi^2 of the training data."""
    return arrangement.fit.chi2 - refit.fit.chi2


def held_gain(arrangement: Arrangement, before: Refit, refit: Refit) -> float:
    """Fall of chi^2 of the held-out data."""
    return (before.held_chi2 - refit.held_chi2) * len(arrangement.settled.measured)


def support(arrangement: Arrangement, before: Refit, refit: Refit) -> float:
    """Fall of chi^2 of both."""
    return gain(arrangement, refit) + held_gain(arrangement, before, refit)


def passes(arrangement: Arrangement, before: Refit, refit: Refit, thresholds: Thresholds) -> bool:
    """Whether an effect is significant in the training data and improves the held-out data."""
    return gain(arrangement, refit) > thresholds.gain and held_gain(arrangement, before, refit) > 0


def decide(
    arrangement: Arrangement,
    catalogue: Catalogue,
    scores: Sequence[Score],
    before: Refit,
    refits: Sequence[Refit],
    places: Sequence[Place],
    thresholds: Thresholds,
    run_step: RunStep,
) -> Verdict:
    """Verdict.

    Parameters
    ----------
    arrangement, catalogue, scores, before, places, thresholds
        See `diagnosis.diagnose.Diagnosis`.
    refits
        Refits, best first, see `diagnosis.diagnose.Diagnosis`.
    run_step
        Looks up the stored result of a step, or computes it.
    """
    gate = _ChanceGate(arrangement, catalogue, before, places, thresholds, run_step)
    finding, effects = find(gate, refits)
    return Verdict(
        finding=finding, effects=effects, before=before, threshold=thresholds.gain,
        detectable=smallest_detectable(scores, thresholds.gain),
        units={score.effect.name: score.effect.parameters[0].unit for score in scores},
        place=places[0] if places and finding is Finding.UNKNOWN else None,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _ChanceGate:
    """Gains of chi^2 compared with the detection thresholds, in training and held-out data."""

    arrangement: Arrangement
    catalogue: Catalogue
    before: Refit
    places: Sequence[Place]
    thresholds: Thresholds
    run_step: RunStep

    def passes(self, refit: Refit) -> bool:
        return passes(self.arrangement, self.before, refit, self.thresholds)

    def explains(self, refit: Refit) -> bool:
        rest = self.run_step(
            f"what is left beside {refit.name}, limit {self.thresholds.gain:.6g}",
            lambda: find_leftover(
                with_effect(self.arrangement, refit), self.catalogue.candidates, self.thresholds.gain
            ),
        )
        stands_in = _stand_in(gain(self.arrangement, refit), rest, self.thresholds)
        return not (stands_in or _bad(self.arrangement, self.before, refit))

    def is_alike(self, best: Refit, other: Refit) -> bool:
        least = support(self.arrangement, self.before, best) - BEHIND
        return support(self.arrangement, self.before, other) > least

    def is_unexplained(self) -> bool:
        return bool(self.places) and misfit(self.places[0]) > self.thresholds.misfit


def worse_than_noise(arrangement: Arrangement) -> bool:
    """Whether the model without an effect fits so badly that its covariance is in doubt."""
    n = arrangement.fit.n_number
    return arrangement.fit.chi2 > n + BEYOND * float(np.sqrt(2 * n))


def misfit(place: Place) -> float:
    """Gain of an unknown force beyond the number of its parameters."""
    return place.gain - place.n_number


def _bad(arrangement: Arrangement, before: Refit, refit: Refit) -> bool:
    """Whether a good part of the misfit stays, far beyond noise, in the training or the held-out data."""
    n = refit.fit.n_number
    pairs = (refit.fit.chi2 / n, arrangement.fit.chi2 / n), (refit.held_chi2, before.held_chi2)
    return any(left > BAD + LEFT * max(was - BAD, 0.0) for left, was in pairs)


def _stand_in(explained: float, rest: Leftover, thresholds: Thresholds) -> bool:
    """Whether something else gains a good part of the gain of an effect, beyond the thresholds."""
    unknown = misfit(rest.places[0]) if rest.places else 0.0
    beyond = max(rest.gain - thresholds.gain, unknown - thresholds.misfit)
    return beyond > STAND_IN * explained
