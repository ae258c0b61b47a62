"""What a diagnosis says, in words with numbers; it may be that nothing is missing, or that the data cannot tell."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from diagnosis.fit.refit import Refit
from diagnosis.localisation import Place
from diagnosis.screening import Score

#: Standard deviations of an interval.
INTERVAL = 1.96


class Finding(Enum):
    """The four verdicts."""

    MISSING = "missing"
    """One effect is missing."""
    AMBIGUOUS = "ambiguous"
    """One of several is missing; these data cannot tell which."""
    NOTHING = "nothing"
    """Nothing is missing beyond noise and numerical error."""
    UNKNOWN = "unknown"
    """Something is missing, and none of the known effects is it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Verdict:
    """The outcome of one round.

    Parameters
    ----------
    finding
        Which of the four.
    effects
        Refits that explain the measurements, best first; empty if none does.
    before
        The accepted parameters alone.
    threshold
        Fall of chi^2 that chance exceeds in the share of nulls allowed.
    detectable
        Each candidate's smallest strength that would pass the threshold, by name; infinite if none does.
    place
        Where a force is missing, if something is.
    """

    finding: Finding
    effects: Sequence[Refit]
    before: Refit
    threshold: float
    detectable: dict[str, float]
    units: dict[str, str]
    place: Place | None = None

    @property
    def sentence(self) -> str:
        """The verdict in words."""
        if self.finding is Finding.NOTHING:
            return (
                "Nothing is missing beyond noise and numerical error: no candidate lowers chi^2 by more than chance "
                f"does ({self.threshold:.3g}) and the held-out error with it. {self._smallest()}"
            )
        if self.finding is Finding.UNKNOWN:
            where = f": {self.place.sentence}" if self.place is not None else ""
            return f"Something is missing, and it is none of the known effects{where}."
        told = [_told(each) for each in self.effects]
        before, after = self.before, self.effects[0]
        error = f"the held-out error falls from {100 * before.held_error:.2g} to {100 * after.held_error:.2g} %"
        if not after.held_error < before.held_error:
            error = f"held-out chi^2 a number falls from {before.held_chi2:.3g} to {after.held_chi2:.3g}"
        if self.finding is Finding.AMBIGUOUS:
            return f"{' or '.join(told)}: these data cannot tell which ({error})."
        return f"{told[0]} is missing; {error}."

    def _smallest(self) -> str:
        seen = [(name, value) for name, value in self.detectable.items() if value < float("inf")]
        listed = ", ".join(f"{name} {value:.2g} {self.units[name]}".rstrip(" -") for name, value in seen)
        return f"The smallest detectable strengths are: {listed}."


def smallest_detectable(scores: Sequence[Score], threshold: float) -> dict[str, float]:
    """Strength, beyond the vanishing one, at which each candidate's expected gain is the threshold."""
    return {score.effect.name: threshold**0.5 * score.detectable for score in scores}


def _told(refit: Refit) -> str:
    assert refit.effect is not None
    parameter = refit.effect.parameters[0]
    unit = "" if parameter.unit == "-" else f" {parameter.unit}"
    half = INTERVAL * refit.deviation
    return f"{refit.effect.name} ({refit.strength:.{worth(refit.strength, half)}g}{unit} +- {half:.2g})"


def worth(value: float, half: float) -> int:
    """Digits that a number is worth beside half its interval: as far as two of that one's, four at least."""
    if not (np.isfinite([value, half]).all() and value and half > 0):
        return 4
    return max(4, int(np.floor(np.log10(abs(value))) - np.floor(np.log10(half))) + 2)
