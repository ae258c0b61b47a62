"""Verdict of a diagnosis, in words with numbers: one missing effect, several possible ones, none, or an unknown one."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np

from correlation.noise.error_size import NO_ERROR, ErrorSize
from correlation.uncertainty.interval import TWO_SIDED_95
from diagnosis.candidate.effect import EffectParameter
from diagnosis.decision.law_of_force import FittedLaw
from diagnosis.decision.pair import Pair
from diagnosis.decision.wording import claim, describe_held_out_fall
from diagnosis.fit.finalist import Finalist
from diagnosis.fit.problem import Refit
from diagnosis.screening import Score
from diagnosis.unknown_force import UnknownForce
from fe.notebook import Tabular
from geometry.plain_number import format_number

if TYPE_CHECKING:
    import pandas

#: Most digits of a strength: intervals of records without noise are next to zero.
MOST_DIGITS = 6


class Finding(Enum):
    """The six verdicts."""

    MISSING = "missing"
    """One effect is missing, or two."""
    AMBIGUOUS = "ambiguous"
    """One of several effects is missing, or one that held-out data or its interval do not confirm."""
    NOTHING = "nothing"
    """Nothing is missing beyond noise and numerical error."""
    UNKNOWN = "unknown"
    """Something is missing that is none of the known effects."""
    NOT_CLOSE = "not close"
    """The model is too far from the measurements to identify a missing effect."""
    NOT_TESTABLE = "not testable"
    """No effect would be visible in these measurements."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Verdict(Tabular):
    """Verdict of one round: the missing effects and their probabilities.

    Parameters
    ----------
    finding
        Kind of the verdict.
    effects
        Refits that explain the measurements, best first; empty if none does.
    baseline
        Fit of the calibration parameters and added effects alone.
    detectable
        Smallest detectable strength of each candidate, from its neutral value, by name; infinite if there is none.
    units
        Units of these strengths, by name.
    threshold
        Detection threshold of the fall of chi^2; None if the held-out error decides.
    place
        Place of the missing force, if the cause is unknown.
    nearest
        Best known effect that passes, if the cause is unknown nevertheless.
    model_error_size
        Model error beyond noise, of the fit with the passing effect, or without an effect.
    pair
        Fits of the first effect with a second missing effect.
    instead
        Effect that is to be judged alone, since the best one does not pass together with it.
    alike
        Names of other effects that change the data in the same way as the first effect.
    laws
        Other laws that the force of the first effect may have; if the cause is unknown and a law was found, this law.
    probabilities
        Probability of each named effect, given that one of the passing effects is true [-]; empty if the held-out error
        decides.
    replaces_error
        Whether these effects replace a model error too large for a sound model, and may be that error themselves.
    beyond_priors
        Calibration parameters beyond their priors, if the cause is unknown; of the fit with the passing effect, if
        there is one.
    reason
        Finding in words if no effect is named; derived from threshold and place if empty.
    """

    finding: Finding
    effects: Sequence[Refit]
    baseline: Refit
    detectable: Mapping[str, float]
    units: Mapping[str, str]
    threshold: float | None = None
    place: UnknownForce | None = None
    nearest: Refit | None = None
    model_error_size: ErrorSize = NO_ERROR
    pair: Pair | None = None
    instead: Finalist | None = None
    alike: Sequence[str] = ()
    laws: Sequence[FittedLaw] = ()
    probabilities: Sequence[float] = ()
    replaces_error: bool = False
    beyond_priors: Sequence[str] = ()
    reason: str = ""

    def with_fits(self, baseline: Refit, effects: Sequence[Refit], pair: Pair | None = None) -> "Verdict":
        """The same with other intervals; `AMBIGUOUS` if the interval of a named effect contains its neutral value."""
        named = [*effects[:1], *([] if pair is None else [pair.second.refit])]
        doubtful = self.finding is Finding.MISSING and any(item.may_vanish for item in named)
        finding = Finding.AMBIGUOUS if doubtful else self.finding
        return replace(self, finding=finding, baseline=baseline, effects=tuple(effects), pair=pair)

    @property
    def further(self) -> Refit | None:
        """The second missing effect, from the fit with both."""
        return None if self.pair is None else self.pair.second.refit

    @property
    def further_alternatives(self) -> list[Refit]:
        """Effects that these data cannot distinguish from the second one, each from the fit with the first."""
        return [] if self.pair is None else [item.refit for item in self.pair.second_alternatives]

    def to_pandas(self) -> "pandas.DataFrame":
        """One row per fit, the baseline first; errors relative to the measured values."""
        import pandas

        fits = [self.baseline, *self.effects]
        columns = {
            "strength": [item.strength for item in fits],
            "standard deviation": [item.deviation for item in fits],
            "training error [-]": [item.error for item in fits],
            "held-out error [-]": [item.held_out_error for item in fits],
            "held-out reduced chi-squared [-]": [item.held_out_reduced_chi2 for item in fits],
        }
        return pandas.DataFrame(columns, index=pandas.Index([item.label for item in fits], name="added"))

    @property
    def sentence(self) -> str:
        """Verdict in one sentence."""
        if self.reason and not self.effects:
            return self.reason
        if self.finding is Finding.NOT_CLOSE:
            return (
                "The model is not close enough to be diagnosed: beyond noise its error is "
                f"{self.model_error_size.words}, and neither calibration nor a known effect explains it."
            )
        if self.finding is Finding.NOTHING:
            size = self.model_error_size.words
            error = f" and model error ({size})" if size else " and numerical error"
            return (
                f"Nothing is missing beyond noise{error}: no candidate lowers chi^2 by more than the detection "
                f"threshold ({self.threshold:.3g}) without contradicting the held-out data."
            )
        if self.finding is Finding.UNKNOWN:
            where = f": {self.place.sentence}" if self.place is not None else ""
            near = f" {self.nearest.name} comes nearest: {self._fall(self.nearest)}." if self.nearest else ""
            return f"Something is missing, and it is none of the known effects{where}.{near}"
        alike = f" Others explain it as well: {', '.join(self.alike)}." if self.alike else ""
        return f"{self.name_effects(self._format_strength, self._fall(self.effects[0]), 'data')}{alike}"

    def name_effects(self, describe: Callable[[Refit], str], fall: str, data: str) -> str:
        """Sentence about the effects that are missing or may be missing.

        Parameters
        ----------
        describe
            Words for the strength of an effect.
        fall
            Words for the change of the held-out error by the best effect.
        data
            Noun for what cannot distinguish several effects, such as "data".
        """
        further = [] if self.further is None else [self.further]
        seconds = [f"{item.name} ({describe(item)})" for item in (*further, *self.further_alternatives)]
        if len(self.effects) > 1 or len(seconds) > 1:
            known = self.probabilities if 1 < len(self.effects) == len(self.probabilities) else ()
            chances = [f"probability {format_number(100 * item)} %" for item in known] or [""] * len(self.effects)
            claimed = claim(self.effects, [describe(item) for item in self.effects], chances, "or")
            beside = f", and also {' or '.join(seconds)}" if seconds else ""
            beside += ", or a model error resembles one of them" if self.replaces_error else ""
            return f"{claimed}{beside}, and these {data} cannot tell which: {fall}.{self._other_laws}"
        every = [*self.effects, *further]
        doubt = f", or {self._alternative}" if self.finding is Finding.AMBIGUOUS else ""
        claimed = claim(every, [describe(item) for item in every], [""] * len(every), "and")
        return f"{claimed}{doubt}: {fall}.{self._other_laws}"

    @property
    def _alternative(self) -> str:
        """Words for the alternative to a single named effect that is not confirmed."""
        if self.laws:
            return "another force at its place"
        return "a model error resembles it, and these data cannot separate the two"

    @property
    def _other_laws(self) -> str:
        """Following sentence about other possible laws of the force of the best effect; empty without any."""
        words = " or ".join(law.words for law in self.laws)
        return f" The force there may also be {words}." if words else ""

    @property
    def smallest(self) -> str:
        """Smallest detectable strength of each candidate in one sentence; empty if there is none."""
        finite = [(name, value) for name, value in self.detectable.items() if value < float("inf")]
        strengths = ", ".join(f"{name} {value:.2g} {self.units[name]}".rstrip(" -") for name, value in finite)
        return f"The smallest detectable strengths are: {strengths}." if strengths else ""

    def _fall(self, refit: Refit) -> str:
        return describe_held_out_fall(self.baseline, refit)

    def _format_strength(self, refit: Refit) -> str:
        assert refit.effect is not None
        unit = self.units.get(refit.name, refit.effect.parameters[0].unit)
        half = TWO_SIDED_95 * refit.deviation
        unit = "" if unit == "-" else f" {unit}"
        count = min(count_digits(refit.strength, half), MOST_DIGITS)
        return f"{refit.strength:.{count}g}{unit} +- {half:.2g}"


def compute_detectable_strengths(scores: Sequence[Score], threshold: float) -> dict[str, float]:
    """Strength of each candidate, from its neutral value, at which the expected gain equals the threshold, by name.

    Infinite if that strength is outside the bounds of the effect.
    """
    return {
        score.effect.name: _within(score.effect.parameters[0], max(threshold**0.5 * score.detectable, score.begins))
        for score in scores
    }


def _within(parameter: EffectParameter, strength: float) -> float:
    reach = max(parameter.upper - parameter.vanishes, parameter.vanishes - parameter.lower)
    return strength if strength <= reach else np.inf


def count_digits(value: float, half: float) -> int:
    """Significant digits of a value, down to the second digit of the half-width of its interval; at least four."""
    if not (np.isfinite([value, half]).all() and value and half > 0):
        return 4
    return max(4, int(np.floor(np.log10(abs(value))) - np.floor(np.log10(half))) + 2)
