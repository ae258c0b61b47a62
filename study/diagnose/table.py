"""What a round says about each candidate, as rows for the terminal, the page and the files."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from diagnosis.candidate.effect import Effect, EffectParameter
from diagnosis.decision.verdict import INTERVAL, worth
from diagnosis.fit.problem import Refit
from diagnosis.screening import Score
from study.case.added import WRITTEN, key_of, text_of
from study.diagnose.edit import Values, Written
from study.diagnose.history import Errors
from study.diagnose.round import Round, errors

#: Cosine of two effects' changes above which a table calls them alike.
ALIKE = 0.95


@dataclass(frozen=True, kw_only=True, eq=False)
class Row:
    """One candidate.

    Parameters
    ----------
    effect
        Which.
    expected
        By how much chi^2 would fall to first order.
    gain
        By how much it fell when the effect was fitted in earnest; none if it was not.
    strength, deviation
        Fitted, else to first order [its unit].
    errors
        With the effect; none if it was not fitted.
    cosine
        Between what this effect and the best one change, accepted parameters projected out: 1 cannot be told apart.
    detectable
        Least strength that these tests would show; infinite if none.
    named
        Whether the verdict names it.
    """

    effect: Effect
    expected: float
    gain: float | None
    strength: float
    deviation: float
    errors: Errors | None
    cosine: float
    detectable: float
    named: bool

    @property
    def parameter(self) -> EffectParameter:
        """The effect's strength."""
        return self.effect.parameters[0]

    @property
    def in_words(self) -> str:
        """Strength with its interval."""
        return interval(self.strength, self.deviation, self.parameter)


def rows(of: Round) -> list[Row]:
    """All candidates, each by its fall of chi^2: those named first, then those fitted in earnest, then the others.

    What was added before is none any more.
    """
    found, verdict = of.diagnosis, of.diagnosis.verdict
    added = {each.effect.name for each in of.setup.added}
    scores = {score.effect.name: score for score in found.scores if score.effect.name not in added}
    refits = {refit.effect.name: refit for refit in found.refits if refit.effect and refit.effect.name not in added}
    named = [each.effect.name for each in verdict.effects if each.effect is not None]
    best = scores.get(next(iter([*named, *refits, *scores]), ""))
    listed = [
        _row(
            score, refits.get(name), best, verdict.detectable.get(name, np.inf), name in named, found.before.fit.chi2
        )
        for name, score in scores.items()
    ]  # fmt: skip

    def place(row: Row) -> tuple[bool, bool, float]:
        return not row.named, row.gain is None, -(row.expected if row.gain is None else row.gain)

    return sorted(listed, key=place)


def digits(value: float, count: int) -> str:
    """A number with so many digits, without an exponent where that is readable: 310,000."""
    if not np.isfinite(value):
        return "none"
    rounded = float(f"{value:.{count}g}") + 0.0  # no -0
    return f"{rounded:,.10g}" if 1e-4 <= abs(rounded) < 1e7 or not rounded else f"{rounded:g}"


def interval(value: float, deviation: float, parameter: EffectParameter) -> str:
    """A value with its 95 % interval in one unit: "52.4 +- 2.1 mg"."""
    _, _, unit = text_of(value, parameter).partition(" ")
    size = dict(WRITTEN.get(parameter.unit, ())).get(unit, 1.0)
    half = INTERVAL * deviation / size
    number = digits(value / size, worth(value / size, half))
    if not np.isfinite(deviation) or deviation <= 0:
        return f"{number} {unit}".rstrip()
    return f"{number} +- {digits(half, 2)} {unit}".rstrip()


def short(value: float, parameter: EffectParameter, count: int = 3) -> str:
    """A strength with a few digits; "none" if it is infinite."""
    if not np.isfinite(value):
        return "none"
    _, _, unit = text_of(value, parameter).partition(" ")
    return f"{digits(value / dict(WRITTEN.get(parameter.unit, ())).get(unit, 1.0), count)} {unit}".rstrip()


def beyond(value: float, parameter: EffectParameter) -> str:
    """A strength reckoned from where the effect vanishes: a ratio as +- so many per cent."""
    if not np.isfinite(value):
        return "none"
    if parameter.unit == "-" and parameter.vanishes:
        return f"{digits(100 * value, 2)} %"
    return short(value, parameter, 2)


def write_up(of: Round, refit: Refit) -> dict[str, Any]:
    """What `stickslip add` would write into the case for a refit: all of its values, with what is noted behind each."""
    calibrated, added, own = _values(of, refit)
    assert refit.effect is not None
    return {
        "effect": refit.effect.name,
        "values": _document(own),
        "added": {name: _document(values) for name, values in added.items()},
        "calibrated": _document(calibrated),
        "after": errors(refit).document,
    }


def read_values(document: Mapping[str, Sequence[Any]]) -> dict[str, Written]:
    """Values as `write_up` noted them."""
    return {key: Written(value=value, note=note) for key, (value, note) in document.items()}


def factors(of: Round, refit: Refit) -> dict[str, tuple[float, float]]:
    """Calibration parameters of a fit with their standard deviations, by name."""
    n = len(of.setup.accepted)
    pairs = zip(refit.fit.values[:n].tolist(), refit.fit.deviation[:n].tolist(), strict=True)
    return dict(zip((each.name for each in of.setup.accepted), pairs, strict=True))


def strengths(of: Round, refit: Refit) -> list[tuple[Effect, float, float]]:
    """Effects that were added before, and the refit's own, with strength and standard deviation."""
    effects = [each.effect for each in of.setup.added] + ([] if refit.effect is None else [refit.effect])
    found, first = [], len(of.setup.accepted)
    for effect in effects:
        found.append((effect, float(refit.fit.values[first]), float(refit.fit.deviation[first])))
        first += len(effect.parameters)
    return found


def _values(of: Round, refit: Refit) -> tuple[Values, dict[str, Values], Values]:
    calibrated = {
        name: Written(value=float(f"{value:.6g}"), note=f"{INTERVAL * deviation:.2g}")
        for name, (value, deviation) in factors(of, refit).items()
    }
    first = len(of.setup.accepted)
    found: dict[str, Values] = {}
    effects = [each.effect for each in of.setup.added] + ([] if refit.effect is None else [refit.effect])
    for effect in effects:
        last = first + len(effect.parameters)
        numbers = zip(refit.fit.values[first:last], refit.fit.deviation[first:last], strict=True)
        found[effect.name] = {
            key_of(parameter): _written(float(value), float(deviation), parameter)
            for parameter, (value, deviation) in zip(effect.parameters, numbers, strict=True)
        }
        first = last
    own = found.pop(effects[-1].name) if refit.effect is not None else {}
    return calibrated, found, own


def _written(value: float, deviation: float, parameter: EffectParameter) -> Written:
    text = text_of(value, parameter)
    number, _, unit = text.partition(" ")
    size = dict(WRITTEN.get(parameter.unit, ())).get(unit, 1.0)
    note = f"{INTERVAL * deviation / size:.2g} {unit}".rstrip()
    return Written(value=text if unit else float(number), note=note)


def _document(values: Values) -> dict[str, list[Any]]:
    return {key: [each.value, each.note] for key, each in values.items()}


def _row(score: Score, refit: Refit | None, best: Score | None, detectable: float, named: bool, chi2: float) -> Row:
    size, parameter = abs(score.effect.parameters[0].typical - score.effect.parameters[0].vanishes), score.size
    return Row(
        effect=score.effect,
        expected=score.gain,
        gain=None if refit is None else chi2 - refit.fit.chi2,
        strength=score.strength if refit is None else refit.strength,
        deviation=(size / parameter if parameter else np.inf) if refit is None else refit.deviation,
        errors=None if refit is None else errors(refit),
        cosine=0.0 if best is None else float(abs(score.direction @ best.direction)),
        detectable=detectable,
        named=named,
    )
