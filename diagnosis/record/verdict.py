"""What time records say, in words with numbers.

What a model leaves of a record is coloured, and mostly the model's own error: a nominal test would claim all and
everything. The gate is the error on records that no fit saw. It must fall to `RATIO` of its excess over the noise, and
do so all over these records: each of their blocks votes by (e0 - e1) / (e0 + e1), e the mean squared error before and
after, and the mean vote must be above zero by `SURE` times its standard error.

Where the noise is known there is a second gate behind the first: an effect that leaves more than `PART` of the excess,
and that above the noise, is a stand-in for another, as a linear spring is for a cubic one at a single level.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from diagnosis.decision.verdict import INTERVAL, Finding
from diagnosis.record.refit import PerRecord, RecordRefit
from diagnosis.record.screening import RecordScore

#: Of the excess held-out error: what must be left at most.
RATIO = 0.8
#: Error of an effect, relative to all else, that takes this ratio off when it is fitted: 1 / r^2 = 1 + x^2.
DOUBT = (RATIO**-2 - 1) ** 0.5
#: Held-out error that is none: a fit ends, and a march rounds off, with this much [-].
NONE = 1e-6
#: Of the excess held-out error: what an effect may leave at most and still be named, where the noise is known.
PART = 0.5
#: Standard errors of the blocks' mean vote; with less than that two effects cannot be told apart.
SURE = 4.0


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordVerdict:
    """The outcome of one round.

    Parameters
    ----------
    finding
        Which of the four.
    effects
        Refits that pass, best first; empty if none does.
    before
        The accepted parameters and the added effects alone.
    tried
        All refits, best first.
    floor
        Share of each held-out record that is noise; 0 where it is not known [-].
    names
        Of the held-out records.
    detectable
        By name, the strength beyond the vanishing one whose removal would take the held-out error through the gate, and
        its unit; without those that are absorbed.
    units
        What "N" and "m" are in a model that is not in SI, such as {"N": "V", "m": "V"} in a record in volts.
    """

    finding: Finding
    effects: tuple[RecordRefit, ...]
    before: RecordRefit
    tried: tuple[RecordRefit, ...]
    floor: PerRecord
    names: tuple[str, ...]
    detectable: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)

    @property
    def sentence(self) -> str:
        """The verdict in words."""
        error = f"the held-out error is {100 * self.before.held_error:.2g} %, and {self._best()}"
        noise = float(np.sqrt(np.mean(self.floor**2)))
        if self.finding is Finding.UNKNOWN:
            known = f"the noise is {100 * noise:.2g} %"
            return f"Something is missing, and it is none of the known effects: {known}, {error}."
        if self.finding is Finding.NOTHING and noise:
            return f"Nothing is missing beyond the noise of {100 * noise:.2g} %: {error}.{self._smallest()}"
        if self.finding is Finding.NOTHING:
            return f"Nothing passes the gate: {error}; how much of this is noise is not known.{self._smallest()}"
        told = " or ".join(self._told(each) for each in self.effects)
        falls = ", ".join(
            f"{100 * before:.2g} to {100 * after:.2g} % in {name}"
            for name, before, after in zip(
                self.names, self.before.held_errors, self.effects[0].held_errors, strict=True
            )
        )
        if self.finding is Finding.AMBIGUOUS:
            return f"{told}: these records cannot tell which (held-out error from {falls})."
        return f"{told} is missing; the held-out error falls from {falls}."

    def _told(self, refit: RecordRefit) -> str:
        assert refit.effect is not None
        unit = self.unit(refit.effect.parameters[0].unit)
        return f"{refit.effect.name} ({refit.strength:.4g}{unit} +- {INTERVAL * refit.deviation:.2g})"

    def unit(self, unit: str) -> str:
        """A unit as it stands behind a number."""
        if unit == "-":
            return ""
        if self.units:
            unit = re.sub(r"\bkg\b", "N s^2/m", unit)
            unit = re.sub(r"\b[Nm]\b", lambda found: self.units.get(found[0], found[0]), unit)
        return f" {unit}"

    def _smallest(self) -> str:
        if not self.detectable:
            return ""
        listed = ", ".join(f"{name} {strength:.2g}{self.unit(of)}" for name, (strength, of) in self.detectable.items())
        return f" Strengths that would have passed are about: {listed}."

    def _best(self) -> str:
        if not self.tried:
            return "no candidate would lower it"
        best = self.tried[0]
        assert best.effect is not None
        return f"the best candidate, {best.effect.name}, leaves {100 * best.held_error:.2g} %"


def judge_records(
    before: RecordRefit,
    refits: Sequence[RecordRefit],
    floor: PerRecord,
    names: Sequence[str],
    scores: Sequence[RecordScore] = (),
    units: Mapping[str, str] | None = None,
) -> RecordVerdict:
    """Send refits through the gate.

    Parameters
    ----------
    before
        The accepted parameters and the added effects alone.
    refits
        Best first.
    floor
        Share of each held-out record that is noise [-].
    names
        Of the held-out records.
    scores
        Of all candidates.
    units
        What "N" and "m" are; themselves by default.
    """
    passed = [each for each in refits if passes(before, each, floor)]
    named = [each for each in passed if _explains(before, each, floor)]
    rivals = [each for each in named[1:] if not _surely_better(each.blocks, named[0].blocks)]
    effects = [*named[:1], *rivals]
    if effects:
        finding = Finding.AMBIGUOUS if rivals else Finding.MISSING
    else:
        finding = Finding.UNKNOWN if passed or _loud(before, floor) else Finding.NOTHING
    return RecordVerdict(
        finding=finding, effects=tuple(effects), before=before, tried=tuple(refits), floor=floor, names=tuple(names),
        detectable={
            each.effect.name: (DOUBT * before.held_error / each.size, each.effect.parameters[0].unit)
            for each in scores
            if each.size
        },
        units=dict(units or {}),
    )  # fmt: skip


def passes(before: RecordRefit, after: RecordRefit, floor: PerRecord) -> bool:
    """Whether a refit may be claimed."""
    noise = float(np.mean(floor**2))
    excess, left = before.held_error**2 - noise, after.held_error**2 - noise
    return bool(excess > NONE**2 and left <= RATIO**2 * excess and _surely_better(before.blocks, after.blocks))


def _explains(before: RecordRefit, after: RecordRefit, floor: PerRecord) -> bool:
    """Whether little is left but noise, as far as that is known."""
    noise = float(np.mean(floor**2))
    left = after.held_error**2 - noise
    return not _loud(after, floor) or bool(left <= PART**2 * (before.held_error**2 - noise))


def _loud(refit: RecordRefit, floor: PerRecord) -> bool:
    """Whether there is at least as much again as the noise; no where that is not known."""
    noise = float(np.mean(floor**2))
    return bool(noise and refit.held_error**2 > 2 * noise)


def _surely_better(before: Float[NDArray[np.float64], " b"], after: Float[NDArray[np.float64], " b"]) -> bool:
    """Whether the blocks vote for the second by more than their scatter."""
    if not np.isfinite(before).all():
        return bool(np.isfinite(after).all())
    if not np.isfinite(after).all():
        return False
    votes = (before - after) / np.maximum(before + after, np.finfo(float).tiny)
    return bool(votes.mean() > SURE * votes.std(ddof=1) / np.sqrt(len(votes)))
