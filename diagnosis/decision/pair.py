"""Two effects that are missing at once, fitted together, each tested against a fit with the other alone.

The model error that one effect leaves is what the other one is taken for. So each fit has a model error of its own: by
that of the first effect alone, an unknown force would seem to explain what is only less model error.
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
        The fit with both, tested as one of each effect: it gains what both gain beyond the other one alone.
    alone
        The second effect alone.
    alternatives
        Fits of other effects in place of the first one, beside the second.
    force
        Excess gain of an unknown force beside both [-].
    """

    first: Finalist
    second: Finalist
    alone: Finalist
    alternatives: tuple[Finalist, ...]
    force: float

    @property
    def ranked(self) -> list[Finalist]:
        """The first effect, then the alternatives by falling density."""
        return [self.first, *sorted(self.alternatives, key=lambda item: -compute_log_density(item.refit))]


def fit_pair(
    arrangement: Arrangement, baseline: Refit, first: Refit, further: Refit, others: Sequence[Refit] = ()
) -> Pair:
    """Fit two effects together, and others in place of the first one.

    Parameters
    ----------
    arrangement
        Arrangement by the covariance of the model with the first effect, and the fit with it.
    baseline
        Fit without an effect.
    first, further
        The first effect alone, and the further one beside it.
    others
        Other effects alone.
    """
    one, second = _effect_of(first), _effect_of(further)
    (values_of_both, own), nearby = _split(further.fit.values, second), further.fit.prediction
    calibrated, _ = _split(values_of_both, one)

    def fit(effects: Sequence[Effect], start: Values, by: Comparison | None = None) -> Arrangement:
        """The further effect beside others."""
        return arrangement.with_refit_from([*effects, second], np.append(start, own), nearby, by)

    def test(arrangement: Arrangement) -> Finalist:
        """A fit as one of the further effect, with the density of all data."""
        tested = arrangement.tested(second, arrangement.fit)
        return Finalist(refit=replace(tested, cost=arrangement.cost + tested.held_out_cost), arrangement=arrangement)

    def beside(effect: Effect, finalist: Finalist) -> Finalist:
        """The fit with both as one of an effect beside the further one."""
        return _compare(replace(finalist, refit=replace(finalist.refit, effect=effect, beside=second)), alone)

    both = test(fit([one], values_of_both))
    # What the first effect has moved the calibration parameters to may be far from the minimum without it. Where it is
    # not there, the model error is no larger without it, and a larger one would keep the fit from the minimum.
    starts = ((calibrated, None), (calibrated, both.arrangement.train), (baseline.fit.values, None))
    alone = test(min((fit([], *start) for start in starts), key=attrgetter("cost")))
    strengths = [(_effect_of(item), _split(item.fit.values, _effect_of(item))[1]) for item in others]
    forces = find_unknown_forces(add_effect(both.arrangement, both.refit))
    return Pair(
        first=beside(one, both),
        second=_compare(both, Finalist(refit=first, arrangement=arrangement)),
        alone=alone,
        alternatives=tuple(
            beside(item, test(fit([item], np.append(calibrated, values)))) for item, values in strengths
        ),
        force=max(map(compute_excess_gain, forces), default=0.0),
    )


def _compare(both: Finalist, alone: Finalist) -> Finalist:
    """The fit with both effects, and its gains over the fit with one of them."""
    gain = alone.arrangement.cost - both.arrangement.cost
    return replace(both, refit=compare(both.refit, alone.refit, gain))


def _split(values: Values, effect: Effect) -> tuple[Values, Values]:
    """Values before those of the last effect, and its own."""
    count = len(values) - len(effect.parameters)
    return values[:count], values[count:]


def _effect_of(refit: Refit) -> Effect:
    assert refit.effect is not None
    return refit.effect
