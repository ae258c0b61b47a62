r"""From refits to a verdict.

An effect is claimed if chi^2 of the training data falls by more than chance makes it, and that of the held-out data
falls with it: an effect that fits noise makes the held-out data worse by as much as it gains. What explains better is
judged by both falls together. Candidates that come so close to the best that these data cannot part them are named with
it. Then the rest is looked at once more: where an unknown force, or another effect, explains a good part of what the
best one did, that one was a stand-in, and nothing known is the cause.
"""

from collections.abc import Sequence

import numpy as np

from diagnosis.decision.leftover import Leftover, leftover, with_effect
from diagnosis.decision.verdict import Finding, Verdict, smallest_detectable
from diagnosis.effect.catalogue import Catalogue
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.refit import Refit
from diagnosis.keep import Keep
from diagnosis.localisation import Place
from diagnosis.screening import Score
from diagnosis.threshold.thresholds import Limits

#: An effect whose falls of chi^2 are less than this behind the best one's may be the one: odds of 20 to 1 end there.
BEHIND = 6.0
#: Share of what the best effect explains that may be left for others beyond chance.
STAND_IN = 0.15
#: Standard deviations of chi^2 by which a fit must be worse than noise, that it be asked whether its weights are wrong.
BEYOND = 5.0
#: chi^2 a number above which a fit is bad whatever noise does, and the share of what was above it that may stay.
BAD, LEFT = 2.0, 0.1


def gain(arrangement: Arrangement, refit: Refit) -> float:
    """Fall of chi^2 of the training data."""
    return arrangement.fit.chi2 - refit.fit.chi2


def held_gain(arrangement: Arrangement, before: Refit, refit: Refit) -> float:
    """Fall of chi^2 of the held-out data."""
    return (before.held_chi2 - refit.held_chi2) * len(arrangement.settled.measured)


def support(arrangement: Arrangement, before: Refit, refit: Refit) -> float:
    """Fall of chi^2 of both."""
    return gain(arrangement, refit) + held_gain(arrangement, before, refit)


def passes(arrangement: Arrangement, before: Refit, refit: Refit, limits: Limits) -> bool:
    """Whether an effect may be claimed."""
    return gain(arrangement, refit) > limits.gain and held_gain(arrangement, before, refit) > 0


def decide(
    arrangement: Arrangement,
    catalogue: Catalogue,
    scores: Sequence[Score],
    before: Refit,
    refits: Sequence[Refit],
    places: Sequence[Place],
    limits: Limits,
    keep: Keep,
) -> Verdict:
    """The verdict.

    Parameters
    ----------
    arrangement, catalogue, scores, before, places, limits
        See `diagnosis.diagnose.Diagnosis`.
    refits
        Best first, see `diagnosis.diagnose.Diagnosis`.
    keep
        Looks up what a step gave before, or makes it.
    """
    detectable = smallest_detectable(scores, limits.gain)
    units = {score.effect.name: score.effect.parameters[0].unit for score in scores}

    def verdict(finding: Finding, effects: Sequence[Refit] = (), place: Place | None = None) -> Verdict:
        return Verdict(
            finding=finding, effects=tuple(effects), before=before, threshold=limits.gain, detectable=detectable,
            units=units, place=place,
        )  # fmt: skip

    passed = [refit for refit in refits if passes(arrangement, before, refit, limits)]
    there = places[0] if places else None
    if not passed:
        if there is not None and misfit(there) > limits.misfit:
            return verdict(Finding.UNKNOWN, place=there)
        return verdict(Finding.NOTHING)
    best = passed[0]
    rest = keep(
        f"what is left beside {best.name}, limit {limits.gain:.6g}",
        lambda: leftover(with_effect(arrangement, best), catalogue.candidates, limits.gain),
    )
    if _stand_in(gain(arrangement, best), rest, limits) or _bad(arrangement, before, best):
        return verdict(Finding.UNKNOWN, place=there)
    least = support(arrangement, before, best) - BEHIND
    alike = [refit for refit in passed if support(arrangement, before, refit) > least]
    return verdict(Finding.AMBIGUOUS if len(alike) > 1 else Finding.MISSING, alike)


def worse_than_noise(arrangement: Arrangement) -> bool:
    """Whether the model without an effect fits so badly that its covariance is in doubt."""
    n = arrangement.fit.n_number
    return arrangement.fit.chi2 > n + BEYOND * float(np.sqrt(2 * n))


def misfit(place: Place) -> float:
    """What an unknown force gains beyond the numbers that it has."""
    return place.gain - place.n_number


def _bad(arrangement: Arrangement, before: Refit, refit: Refit) -> bool:
    """Whether a good part of the misfit stays, far beyond noise, in the training data or in those held out."""
    n = refit.fit.n_number
    pairs = (refit.fit.chi2 / n, arrangement.fit.chi2 / n), (refit.held_chi2, before.held_chi2)
    return any(left > BAD + LEFT * max(was - BAD, 0.0) for left, was in pairs)


def _stand_in(explained: float, rest: Leftover, limits: Limits) -> bool:
    """Whether something else explains a good part of what an effect does, beyond chance."""
    unknown = misfit(rest.places[0]) if rest.places else 0.0
    beyond = max(rest.gain - limits.gain, unknown - limits.misfit)
    return beyond > STAND_IN * explained
