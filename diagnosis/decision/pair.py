"""Two missing effects, fitted together, each tested against a fit with the other alone.

With one effect alone, the second one is mistaken for model error. The model error is therefore estimated for each fit
separately: with that of the first effect alone, an unknown force would seem to explain a mere fall of model error.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from operator import attrgetter

import numpy as np

from diagnosis.candidate.effect import Effect
from diagnosis.decision.evidence import compute_log_density
from diagnosis.decision.residual_explanation import add_effect
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.comparison import Comparison
from diagnosis.fit.finalist import Finalist, compare
from diagnosis.fit.fit_parameter import Values
from diagnosis.fit.problem import Refit
from diagnosis.unknown_force import compute_excess_gain, find_unknown_forces


@dataclass(frozen=True, kw_only=True, eq=False)
class Pair:
    """Two effects that were fitted together.

    Parameters
    ----------
    first, second
        The fit with both, as a test of each effect: its gain is relative to the fit with the other one alone.
    alone
        Fit with the second effect alone.
    alternatives
        Fits with other effects instead of the first one, together with the second.
    force
        Excess gain of an unknown force added to both [-].
    second_alternatives
        Fits with other effects instead of the second one, together with the first.
    """

    first: Finalist
    second: Finalist
    alone: Finalist
    alternatives: tuple[Finalist, ...]
    force: float
    second_alternatives: tuple[Finalist, ...] = ()

    @property
    def ranked(self) -> list[Finalist]:
        """The first effect, then the alternatives in order of decreasing density."""
        return [self.first, *sorted(self.alternatives, key=lambda item: -compute_log_density(item.refit))]


def fit_pair(
    arrangement: Arrangement, baseline: Refit, first: Refit, further: Refit, others: Sequence[Refit] = ()
) -> Pair:
    """Fit two effects together, and other effects instead of the first one.

    Parameters
    ----------
    arrangement
        Arrangement with the covariance of the model with the first effect, and the fit with it.
    baseline
        Fit without an effect.
    first, further
        Fit with the first effect alone; fit with the further effect added to it.
    others
        Fits with one other effect each.
    """
    one, second = _get_effect(first), _get_effect(further)
    (values_of_both, own), nearby = _split(further.fit.values, second), further.fit.prediction
    calibrated, _ = _split(values_of_both, one)

    def fit(effects: Sequence[Effect], start: Values, by: Comparison | None = None) -> Arrangement:
        """Fit with the further effect added to others."""
        return arrangement.with_refit_from([*effects, second], np.append(start, own), nearby, by)

    def beside(effect: Effect, finalist: Finalist) -> Finalist:
        """The fit with both as a test of an effect relative to the further one alone."""
        return _compare(replace(finalist, refit=replace(finalist.refit, effect=effect, beside=second)), alone)

    both = _test(second, fit([one], values_of_both))
    # The first effect may have moved the calibration parameters far from the minimum without it. If it is not present,
    # the model error is no larger without it; a fit that starts with a larger model error would miss that minimum.
    starts = ((calibrated, None), (calibrated, both.arrangement.train), (baseline.fit.values, None))
    alone = _test(second, min((fit([], *start) for start in starts), key=attrgetter("cost")))
    strengths = [(_get_effect(item), _split(item.fit.values, _get_effect(item))[1]) for item in others]
    forces = find_unknown_forces(add_effect(both.arrangement, both.refit))
    return Pair(
        first=beside(one, both),
        second=_compare(both, Finalist(refit=first, arrangement=arrangement)),
        alone=alone,
        alternatives=tuple(
            beside(item, _test(second, fit([item], np.append(calibrated, values)))) for item, values in strengths
        ),
        force=max(map(compute_excess_gain, forces), default=0.0),
    )


def fit_seconds(arrangement: Arrangement, first: Refit, pair: Pair, others: Sequence[Refit]) -> list[Finalist]:
    """Fit the second effect of a pair and others instead of it, together with the first one.

    Each fit starts from the best one so far, and earlier ones are fitted once more from the best of all: a fit may end
    at another minimum of the calibration parameters, and its effect must not lose for that alone.

    Parameters
    ----------
    arrangement, first
        Arrangement with the covariance of the model with the first effect, and the fit with it alone.
    pair
        The pair.
    others
        Fits with one of the other effects each, with or without the first one.

    Returns
    -------
    Fits with the second effect of the pair, and then with the others.
    """
    one, seconds = _get_effect(first), (pair.second.refit, *others)
    effects = [_get_effect(item) for item in seconds]
    n_shared = len(pair.second.refit.fit.values) - len(effects[0].parameters)

    def fit(effect: Effect, values: Values, start: Arrangement) -> Arrangement:
        """Fit with an effect from its own values, and those of all else of another fit."""
        values = np.append(start.fit.values[:n_shared], values)
        return arrangement.with_refit_from([one, effect], values, start.fit.prediction)

    best = pair.second.arrangement
    result, starts = [best], [best]
    for item, effect in zip(others, effects[1:], strict=True):
        starts.append(best)
        result.append(fit(effect, _split(item.fit.values, effect)[1], best))
        best = min(best, result[-1], key=attrgetter("cost"))
    for number, (effect, start) in enumerate(zip(effects, starts, strict=True)):
        if start is not best and result[number] is not best:
            again = fit(effect, result[number].fit.values[n_shared:], best)
            result[number] = min(result[number], again, key=attrgetter("cost"))
    alone = Finalist(refit=first, arrangement=arrangement)
    return [
        pair.second if item is pair.second.arrangement else _compare(_test(effect, item), alone)
        for effect, item in zip(effects, result, strict=True)
    ]


def _test(effect: Effect, arrangement: Arrangement) -> Finalist:
    """A fit as a test of an effect, with the density of all data."""
    tested = arrangement.tested(effect, arrangement.fit)
    return Finalist(refit=replace(tested, cost=arrangement.cost + tested.held_out_cost), arrangement=arrangement)


def _compare(both: Finalist, alone: Finalist) -> Finalist:
    """The fit with both effects, with its gains over the fit with one of them."""
    gain = alone.arrangement.cost - both.arrangement.cost
    return replace(both, refit=compare(both.refit, alone.refit, gain))


def _split(values: Values, effect: Effect) -> tuple[Values, Values]:
    """Values before those of the last effect, and the values of this effect."""
    count = len(values) - len(effect.parameters)
    return values[:count], values[count:]


def _get_effect(refit: Refit) -> Effect:
    assert refit.effect is not None
    return refit.effect
