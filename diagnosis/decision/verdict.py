"""What a diagnosis says, in words with numbers; it may be that nothing is missing, or that the data cannot tell."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np

from diagnosis.fit.problem import Refit
from diagnosis.localisation import Place
from diagnosis.screening import Score
from fe.notebook import Tabular

if TYPE_CHECKING:
    import pandas

#: Standard deviations of an interval.
INTERVAL = 1.96
#: Digits of a strength at most: records without noise leave next to no interval.
MOST_DIGITS = 6


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
class Verdict(Tabular):
    """The outcome of one round.

    Parameters
    ----------
    finding
        Which of the four.
    effects
        Refits that explain the measurements, best first; empty if none does.
    before
        The calibration parameters, and what was added, alone.
    detectable
        Each candidate's smallest strength beyond the vanishing one that would be named, by name; infinite if none is.
    units
        Of these strengths, by name.
    threshold
        Fall of chi^2 that chance exceeds in the share of nulls allowed; none where other gates decide.
    place
        Where a force is missing, if something is.
    reason
        The finding in words where no effect is named; by the threshold and the place where it is empty.
    """

    finding: Finding
    effects: Sequence[Refit]
    before: Refit
    detectable: Mapping[str, float]
    units: Mapping[str, str]
    threshold: float | None = None
    place: Place | None = None
    reason: str = ""

    def to_pandas(self) -> "pandas.DataFrame":
        """One row per fit, the model as it is first; errors relative to what was measured."""
        import pandas

        fits = [self.before, *self.effects]
        columns = {
            "strength": [each.strength for each in fits],
            "standard deviation": [each.deviation for each in fits],
            "training error [-]": [each.error for each in fits],
            "held-out error [-]": [each.held_error for each in fits],
            "held-out reduced chi-squared [-]": [each.held_chi2 for each in fits],
        }
        return pandas.DataFrame(columns, index=pandas.Index([each.name for each in fits], name="added"))

    @property
    def sentence(self) -> str:
        """The verdict in words."""
        if self.finding in {Finding.NOTHING, Finding.UNKNOWN} and self.reason:
            return self.reason
        if self.finding is Finding.NOTHING:
            return (
                "Nothing is missing beyond noise and numerical error: no candidate lowers chi^2 by more than chance "
                f"does ({self.threshold:.3g}) and the held-out error with it."
            )
        if self.finding is Finding.UNKNOWN:
            where = f": {self.place.sentence}" if self.place is not None else ""
            return f"Something is missing, and it is none of the known effects{where}."
        named = [self._named(each) for each in self.effects]
        fall = held_out_fall(self.before, self.effects[0])
        if self.finding is Finding.AMBIGUOUS:
            return f"{' or '.join(named)}: these data cannot tell which ({fall})."
        return f"{named[0]} is missing; {fall}."

    @property
    def smallest(self) -> str:
        """The smallest strength of each candidate that would be named, in words; empty if there is none."""
        seen = [(name, value) for name, value in self.detectable.items() if value < float("inf")]
        listed = ", ".join(f"{name} {value:.2g} {self.units[name]}".rstrip(" -") for name, value in seen)
        return f"The smallest detectable strengths are: {listed}." if listed else ""

    def _named(self, refit: Refit) -> str:
        assert refit.effect is not None
        unit = self.units.get(refit.name, refit.effect.parameters[0].unit)
        half = INTERVAL * refit.deviation
        unit = "" if unit == "-" else f" {unit}"
        count = min(worth(refit.strength, half), MOST_DIGITS)
        return f"{refit.name} ({refit.strength:.{count}g}{unit} +- {half:.2g})"


def held_out_fall(before: Refit, after: Refit) -> str:
    """By how much an effect lets what is held out be met better."""
    falls = [
        f"{100 * was:.2g} to {100 * now:.2g} % in {name}"
        for was, now, name in zip(before.held_errors, after.held_errors, after.held_names, strict=True)
    ]
    if not falls and not after.held_error < before.held_error:
        return f"held-out reduced chi-squared falls from {before.held_chi2:.3g} to {after.held_chi2:.3g}"
    whole = f"{100 * before.held_error:.2g} to {100 * after.held_error:.2g} %"
    return f"the held-out error falls from {', '.join(falls) or whole}"


def smallest_detectable(scores: Sequence[Score], threshold: float) -> dict[str, float]:
    """Strength, beyond the vanishing one, at which each candidate's expected gain is the threshold."""
    return {score.effect.name: threshold**0.5 * score.detectable for score in scores}


def worth(value: float, half: float) -> int:
    """Digits that a number is worth beside half its interval: as far as two of that one's, four at least."""
    if not (np.isfinite([value, half]).all() and value and half > 0):
        return 4
    return max(4, int(np.floor(np.log10(abs(value))) - np.floor(np.log10(half))) + 2)
