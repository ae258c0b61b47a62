"""Test of the law of an effect: whether the force has this law, or another one describes the data better.

A stop, a play or a spring of another power changes the data much as the nearest known spring does. Each law that a kind
names beside its own is fitted in place of the effect. It is another force if -2 ln p falls by more than chance lets it,
a chi-square of one degree of freedom, for laws of at most one parameter more, less what the held-out data lose. It
cannot be told from the effect where -2 ln p of all data rises by no more than what would refute it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np

from diagnosis.candidate.effect import Effect
from diagnosis.candidate.force_law import ForceLaw
from diagnosis.decision.evidence import compute_log_density, discount_gain
from diagnosis.effect import OtherLaws, find_kind
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.comparison import Comparison
from diagnosis.fit.finalist import Finalist
from diagnosis.fit.problem import UNEXPLAINED_CHI2, Refit
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
    def chi2_by_noise(self) -> float:
        """Reduced chi-squared of training and of held-out data by noise and stated errors, together [-]."""
        return self.refit.reduced_chi2_by_noise + self.refit.held_out_reduced_chi2_by_noise

    @property
    def whole_gain(self) -> float:
        """Fall of -2 ln p of all data [-]."""
        return self.gain + self.held_out_gain

    def is_better(self, chance: float) -> bool:
        """Whether the force has this law, and not that of the effect: held-out data count as they do for effects."""
        return self.is_distinct and discount_gain(self.gain, self.held_out_gain) > chance

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
    leaves_much = refit.reduced_chi2_by_noise > UNEXPLAINED_CHI2
    return [
        _fit(arrangement, beside, refit, law)
        for law in other_laws(refit.effect, refit.strength, fit.model, states)
        if law.is_expected or leaves_much
    ]


def fit_by_own_covariance(
    law: FittedLaw, arrangement: Arrangement, beside: Refit, refit_one: Callable[[Comparison, Refit], Finalist]
) -> FittedLaw:
    """Fit a law by the covariance of its own model: that of an effect which fits poorly is none for a law that is true.

    Parameters
    ----------
    law
        Law, fitted by the covariance of the effect.
    arrangement, beside
        Arrangement of the effect, and its fit, which the law is compared with.
    refit_one
        Fits anew by another covariance, see `diagnosis.fit.finalist.refit_by_own_covariance`.
    """
    refit, effect = refit_one(arrangement.train, law.refit).refit, cast("ForceLaw", law.refit.effect)
    count = len(effect.start)
    values, deviations = (item[-count:].tolist() for item in (refit.fit.values, refit.fit.deviation))
    held_out_gain = beside.held_out_cost - refit.held_out_cost
    return FittedLaw(
        refit=refit, gain=compute_log_density(refit) - compute_log_density(beside) - held_out_gain,
        held_out_gain=held_out_gain, words=effect.describe(values, deviations),
        is_distinct=effect.is_distinct(values, deviations),
    )  # fmt: skip


def compute_law_density(beside: Refit, law: FittedLaw) -> float:
    """2 ln of the density of all data with a law in place of that of an effect, up to a constant [-]."""
    return compute_log_density(beside) + law.whole_gain


def find_better(laws: Sequence[FittedLaw], chance: float) -> FittedLaw | None:
    """The law that describes the data best, if it is better than that of the effect; else None."""
    better = [law for law in laws if law.is_better(chance)]
    return max(better, key=lambda law: law.whole_gain, default=None)


def find_alternatives(laws: Sequence[FittedLaw], refuted: float) -> list[FittedLaw]:
    """Laws that the data do not refute, the best first; of those of one kind the best."""
    result: dict[str, FittedLaw] = {}
    for law in sorted(laws, key=lambda law: -law.whole_gain):
        if law.is_alternative(refuted) and law.refit.effect is not None:
            result.setdefault(law.refit.effect.kind, law)
    return [*result.values()]


def _fit(arrangement: Arrangement, beside: float, refit: Refit, law: ForceLaw) -> FittedLaw:
    count = len(law.start)
    start = np.array([*refit.fit.values[: len(arrangement.unknowns([]).vanishing)], *law.start])
    fit = fit_from(arrangement, law, start, refit.fit.prediction)
    tested = arrangement.tested(law, fit)
    values, deviations = (item[-count:].tolist() for item in (fit.values, fit.deviation))
    return FittedLaw(
        refit=tested, gain=beside - arrangement.cost_with_error_left(fit),
        held_out_gain=refit.held_out_cost - tested.held_out_cost, words=law.describe(values, deviations),
        is_distinct=law.is_distinct(values, deviations),
    )  # fmt: skip


def _other_laws(effect: Effect) -> OtherLaws | None:
    kind = find_kind(effect)
    return None if kind is None else kind.other_laws
