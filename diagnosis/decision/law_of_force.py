"""Test of the law of an effect: whether the force has this law, or another one describes the data better.

A stop, a play or a spring of another power changes the data much as the nearest known spring does. Each alternative law
of a kind is fitted instead of the effect. The alternative is accepted if -2 ln p falls, after subtraction of the loss
of the held-out data, by more than chance: a quantile of chi-square with one degree of freedom, since a law has at most
one parameter more. It is indistinguishable from the effect if -2 ln p of all data rises by less than would refute it.
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
    """A law that was fitted instead of that of an effect.

    Parameters
    ----------
    refit
        Fit of the law, and its test on held-out data.
    gain, held_out_gain
        Falls of -2 ln p of the training and of the held-out data, relative to the fit with the effect [-].
    words
        Law with its values, in words.
    is_distinct
        Whether the law differs from that of the effect.
    """

    refit: Refit
    gain: float
    held_out_gain: float
    words: str
    is_distinct: bool

    @property
    def chi2_by_noise(self) -> float:
        """Sum of the reduced chi-squared of training and of held-out data, by noise and stated errors [-]."""
        return self.refit.reduced_chi2_by_noise + self.refit.held_out_reduced_chi2_by_noise

    @property
    def whole_gain(self) -> float:
        """Fall of -2 ln p of all data [-]."""
        return self.gain + self.held_out_gain

    def is_better(self, chance: float) -> bool:
        """Whether the data prefer this law to that of the effect; held-out data count as for effects."""
        return self.is_distinct and discount_gain(self.gain, self.held_out_gain) > chance

    def is_alternative(self, refuted: float) -> bool:
        """Whether the data do not refute that the force has this law."""
        return self.is_distinct and self.whole_gain > -refuted


def has_other_laws(effect: Effect | None) -> bool:
    """Whether the kind of an effect names other laws."""
    return effect is not None and _find_other_laws(effect) is not None


def fit_other_laws(arrangement: Arrangement, beside: float, refit: Refit) -> list[FittedLaw]:
    """Fit the laws that the force of an effect may have instead.

    Parameters
    ----------
    arrangement
        Arrangement of the effect, without the effect added.
    beside
        Cost of the fit with the effect, see `diagnosis.fit.arrangement.Arrangement.cost`.
    refit
        Fit of the effect.
    """
    assert refit.effect is not None
    other_laws = _find_other_laws(refit.effect)
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
    """Fit a law with the covariance of its own model: the covariance of an effect that fits poorly is wrong for it.

    Parameters
    ----------
    law
        Law, fitted with the covariance of the effect.
    arrangement, beside
        Arrangement and fit of the effect with which the law is compared.
    refit_one
        Refits with another covariance, see `diagnosis.fit.finalist.refit_by_own_covariance`.
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
    """2 ln of the density of all data with a law instead of that of an effect, up to a constant [-]."""
    return compute_log_density(beside) + law.whole_gain


def find_better(laws: Sequence[FittedLaw], chance: float) -> FittedLaw | None:
    """The best of the laws that the data prefer to that of the effect; None without one."""
    better = [law for law in laws if law.is_better(chance)]
    return max(better, key=lambda law: law.whole_gain, default=None)


def find_alternatives(laws: Sequence[FittedLaw], refuted: float) -> list[FittedLaw]:
    """Laws that the data do not refute, best first; only the best one of each kind."""
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


def _find_other_laws(effect: Effect) -> OtherLaws | None:
    kind = find_kind(effect)
    return None if kind is None else kind.other_laws
