"""Test of the law of an effect: whether its force is the power of the displacement that it says.

A stop, play or a spring of another power is told apart from the nearest known spring by the exponent that fits best
once the effect has been added: the known law is one value of a further parameter, and -2 ln p falls by a chi-square of
one degree of freedom where it is the true one. An exponent that is nearer to the law's than to that of any other
integer is no other law: real springs are powers only about.
"""

from dataclasses import dataclass

from diagnosis.candidate.effect import Effect
from diagnosis.decision.verdict import INTERVAL
from diagnosis.effect import EFFECTS, FreeExponent
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.problem import Refit
from diagnosis.fit.refit import quick_fit
from diagnosis.screening import screen

#: Exponents that are so near to that of a law are rounded to it [-].
ROUNDED = 0.5


@dataclass(frozen=True, kw_only=True, eq=False)
class LawExponent:
    """Exponent of the force of an effect, as fitted beside it.

    Parameters
    ----------
    law
        Exponent that the effect has [-].
    refit
        Fit with the exponent as the last parameter, and its test on held-out data.
    gain
        Fall of -2 ln p of the training data beyond that by the effect [-].
    """

    law: float
    refit: Refit
    gain: float

    @property
    def words(self) -> str:
        """The exponent with its 95 % interval."""
        half = INTERVAL * float(self.refit.fit.deviation[-1])
        return f"{self.value:.1f} +- {half:.1g}"

    @property
    def value(self) -> float:
        """The exponent [-]."""
        return float(self.refit.fit.values[-1])

    def is_another(self, chance: float) -> bool:
        """Whether the force has another law, none of a linear spring either, by a gain beyond chance."""
        return self.gain > chance and min(abs(self.value - self.law), abs(self.value - 1)) > ROUNDED


def has_exponent(effect: Effect | None) -> bool:
    """Whether the force of an effect is a power of the displacement."""
    return effect is not None and _get_free_exponent(effect) is not None


def fit_exponent(arrangement: Arrangement, refit: Refit) -> LawExponent | None:
    """Fit the exponent of the force of an effect that has one; None for one of a user's own that has not.

    Parameters
    ----------
    arrangement
        Arrangement with the effect, see `diagnosis.decision.rules.with_effect`.
    refit
        The effect.
    """
    assert refit.effect is not None
    free = _get_free_exponent(refit.effect)
    assert free is not None
    effect = free(refit.effect, [*arrangement.fit.prediction.states.values()])
    if effect is None:
        return None
    (score,) = screen(arrangement, [effect])
    fit = quick_fit(arrangement, score)
    return LawExponent(
        law=effect.parameters[0].vanishes, refit=arrangement.tested(effect, fit),
        gain=arrangement.cost - arrangement.cost_with_error_left(fit),
    )  # fmt: skip


def _get_free_exponent(effect: Effect) -> FreeExponent | None:
    return next((kind.free_exponent for kind in EFFECTS if kind.name == effect.kind), None)
