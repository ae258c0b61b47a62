"""Test of the law of an effect: whether the force has this law, or another one describes the data better.

A stop, a play or a spring of another power changes the data much as the nearest known spring does. Each law that a kind
names beside its own is fitted in place of the effect. It is another force if -2 ln p falls by more than chance lets it,
a chi-square of one degree of freedom, for laws of at most one parameter more, and the held-out data do not object. It
cannot be told from the effect where -2 ln p of all data rises by no more than what would refute it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.candidate.effect import Effect
from diagnosis.candidate.force_law import ForceLaw
from diagnosis.effect import OtherLaws, find_kind
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.problem import Refit
from diagnosis.fit.refit import fit_from


@dataclass(frozen=True, kw_only=True, eq=False)
class FittedLaw:
    """A law that was fitted in place of that of an effect.

    Parameters
    ----------
    refit
        Its fit, and its test on held-out data.
    gain, held_out_gain
        Falls of -2 ln p of the training and of the held-out data, from those with the effect [-].
    words
        Law with its values, in words.
    is_distinct
        Whether it differs from the law of the effect.
    """

    refit: Refit
    gain: float
    held_out_gain: float
    words: str
    is_distinct: bool

    @property
    def whole_gain(self) -> float:
        """Fall of -2 ln p of all data [-]."""
        return self.gain + self.held_out_gain

    def is_better(self, chance: float) -> bool:
        """Whether the force has this law, and not that of the effect."""
        return self.is_distinct and self.gain > chance and self.held_out_gain >= 0

    def is_alternative(self, refuted: float) -> bool:
        """Whether the data do not refute that the force has this law."""
        return self.is_distinct and self.whole_gain > -refuted


def has_other_laws(effect: Effect | None) -> bool:
    """Whether other laws may be tried in place of that of an effect."""
    return effect is not None and _other_laws(effect) is not None


def fit_other_laws(arrangement: Arrangement, beside: float, refit: Refit) -> list[FittedLaw]:
    """Fit the laws that the force of an effect may have instead.

    Parameters
    ----------
    arrangement
        Arrangement of the effect, without it.
    beside
        Cost of the effect's own fit, by `diagnosis.fit.arrangement.Arrangement.cost`.
    refit
        Fit of the effect.
    """
    assert refit.effect is not None
    other_laws = _other_laws(refit.effect)
    assert other_laws is not None
    fit, states = refit.fit, [*refit.fit.prediction.states.values()]
    return [
        _fit(arrangement, beside, refit, law) for law in other_laws(refit.effect, refit.strength, fit.model, states)
    ]


def find_better(laws: Sequence[FittedLaw], chance: float) -> FittedLaw | None:
    """The law that describes the data best, if it is better than that of the effect; else None."""
    better = [law for law in laws if law.is_better(chance)]
    return max(better, key=lambda law: law.whole_gain, default=None)


def find_alternatives(laws: Sequence[FittedLaw], refuted: float) -> list[FittedLaw]:
    """Laws that the data do not refute, the best first; of those of one kind the best."""
    found: dict[str, FittedLaw] = {}
    for law in sorted(laws, key=lambda law: -law.whole_gain):
        if law.is_alternative(refuted) and law.refit.effect is not None:
            found.setdefault(law.refit.effect.kind, law)
    return [*found.values()]


def _fit(arrangement: Arrangement, beside: float, refit: Refit, law: ForceLaw) -> FittedLaw:
    count = len(law.start)
    start = np.array([*refit.fit.values[: len(arrangement.unknowns([]).vanishing)], *law.start])
    fit = fit_from(arrangement, law, start, refit.fit.prediction)
    tested = arrangement.tested(law, fit)
    values, deviations = (each[-count:].tolist() for each in (fit.values, fit.deviation))
    return FittedLaw(
        refit=tested, gain=beside - arrangement.cost_with_error_left(fit),
        held_out_gain=refit.held_out_cost - tested.held_out_cost, words=law.describe(values, deviations),
        is_distinct=law.is_distinct(values, deviations),
    )  # fmt: skip


def _other_laws(effect: Effect) -> OtherLaws | None:
    kind = find_kind(effect)
    return None if kind is None else kind.other_laws
