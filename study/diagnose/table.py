"""Candidates of a round as rows for the terminal, the page and the files; formatted numbers."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from correlation.uncertainty.interval import TWO_SIDED_95
from diagnosis.candidate.effect import Effect, EffectParameter
from diagnosis.decision.verdict import count_digits
from diagnosis.fit.calibration_parameter import CalibrationParameter
from diagnosis.fit.mode_correction import FrequencyCorrection
from diagnosis.fit.problem import Refit
from diagnosis.fit.unknown_gain import UnknownGain
from diagnosis.screening import Score
from study.case.added import WRITTEN, format_parameter, make_parameter_key
from study.case.setup import Setup
from study.diagnose.edit import Written
from study.diagnose.history import Errors
from study.diagnose.round import Round, summarise_errors

#: Cosine of the changes by two effects above which a table marks them as alike; a verdict names them above 0.99.
MARKED_ALIKE = 0.95
#: Ratio of half an interval to its value above which no digit of the value is significant [-].
MAX_HALF_INTERVAL = 100.0
#: Size [SI] and name of a unit for values.
Unit = tuple[float, str]


@dataclass(frozen=True, kw_only=True, eq=False)
class Row:
    """One candidate.

    Parameters
    ----------
    effect
        The candidate.
    expected
        Fall of chi^2 to first order [-].
    gain
        Fall of chi^2 in a fit with the effect [-]; None if it was not fitted.
    strength, deviation
        Fitted strength and its standard deviation, else those to first order [unit of the effect].
    errors
        Errors of the fit with the effect; None if it was not fitted.
    cosine
        Cosine between the changes by this effect and by the first one, calibration parameters projected out [-]: if it
        is 1, these tests cannot distinguish the two. None if a small amount of either changes no reading.
    detectable
        Detection threshold of the strength [unit of the effect]; infinite if there is none.
    named
        Whether the verdict names it.
    unit, detectable_unit
        Units of strength and detection threshold shared with other rows; by default chosen for each row.
    """

    effect: Effect
    expected: float
    gain: float | None
    strength: float
    deviation: float
    errors: Errors | None
    cosine: float | None = None
    detectable: float
    named: bool
    unit: Unit | None = None
    detectable_unit: Unit | None = None

    @property
    def parameter(self) -> EffectParameter:
        """The effect's strength."""
        return self.effect.parameters[0]

    @property
    def in_words(self) -> str:
        """Strength with its interval."""
        return format_interval(self.strength, self.deviation, self.parameter, self.unit)

    @property
    def detectable_in_words(self) -> str:
        """Detection threshold as a distance from the neutral value of the effect; for a ratio in per cent."""
        if np.isfinite(self.detectable) and self.parameter.unit == "-" and self.parameter.vanishes:
            return f"{format_digits(100 * self.detectable, 2)} %"
        return format_strength(self.detectable, self.parameter, 2, self.detectable_unit)

    @property
    def fall(self) -> float:
        """Fall of chi^2 in the fit, or to first order without a fit [-]."""
        return self.expected if self.gain is None else self.gain


def list_rows(result: Round) -> list[Row]:
    """All candidates: first those named, then fitted ones, then the others, the latter two by their falls of chi^2.

    Added effects are no candidates.
    """
    diagnosis, verdict = result.diagnosis, result.diagnosis.verdict
    added = {item.effect.name for item in result.setup.added}
    scores = {score.effect.name: score for score in diagnosis.scores if score.effect.name not in added}
    refits = {refit.effect.name: refit for refit in diagnosis.refits if refit.effect and refit.effect.name not in added}
    seconds = [] if verdict.further is None else [verdict.further, *verdict.further_alternatives]
    refitted = [*verdict.effects, *seconds]
    # An effect that may be the first or the second one is listed as the first.
    named = {refit.effect.name: refit for refit in reversed(refitted) if refit.effect is not None}
    listed = [
        _make_row(score, named.get(name, refits.get(name)), verdict.detectable.get(name, np.inf), name in named)
        for name, score in scores.items()
    ]

    order = [refit.name for refit in refitted]

    def place(row: Row) -> tuple[int, bool, float]:
        return order.index(row.effect.name) if row.named else len(order), row.gain is None, -row.fall

    listed.sort(key=place)
    listed = share_units(listed)
    directions = [scores[row.effect.name].direction for row in listed]
    seen = [direction.any() for direction in directions]
    return [
        replace(row, cosine=float(abs(directions[number] @ directions[0])) if seen[0] and seen[number] else None)
        for number, row in enumerate(listed)
    ]


def share_units(rows: Sequence[Row]) -> list[Row]:
    """Rows with one unit for all of a kind: that of the first of them with a number."""
    units: dict[tuple[str, str], Unit] = {}
    detectable: dict[tuple[str, str], Unit] = {}
    for row in rows:
        key = row.effect.kind, row.parameter.unit
        if np.isfinite(row.strength) and row.strength:
            units.setdefault(key, split_unit(row.strength, row.parameter))
        if np.isfinite(row.detectable):
            detectable.setdefault(key, split_unit(row.detectable, row.parameter))
    keys = [(row.effect.kind, row.parameter.unit) for row in rows]
    return [
        replace(row, unit=units.get(key), detectable_unit=detectable.get(key))
        for row, key in zip(rows, keys, strict=True)
    ]


def format_digits(value: float, count: int) -> str:
    """A number with a count of digits, without an exponent if that is readable: 310,000."""
    if not np.isfinite(value):
        return "none"
    rounded = float(f"{value:.{count}g}") + 0.0  # no -0
    return f"{rounded:,.10g}" if 1e-4 <= abs(rounded) < 1e7 or not rounded else f"{rounded:g}"


def format_interval(value: float, deviation: float, parameter: EffectParameter, common: Unit | None = None) -> str:
    """A value with its 95 % interval in one unit: "52.4 +- 2.1 mg"; for an undetermined value "0 +- 700 g".

    The unit is the common one of a list, or by default that of the value.
    """
    if np.isfinite(deviation) and TWO_SIDED_95 * deviation > MAX_HALF_INTERVAL * abs(value):
        size, unit = common or split_unit(TWO_SIDED_95 * deviation, parameter)
        return f"0 +- {format_digits(TWO_SIDED_95 * deviation / size, 2)} {unit}".rstrip()
    size, unit = common or split_unit(value, parameter)
    half = TWO_SIDED_95 * deviation / size
    number = format_digits(value / size, count_digits(value / size, half))
    if not np.isfinite(deviation) or deviation <= 0:
        return f"{number} {unit}".rstrip()
    return f"{number} +- {format_digits(half, 2)} {unit}".rstrip()


def format_fitted_strength(refit: Refit) -> str:
    """Strength of a fitted effect with its interval."""
    assert refit.effect is not None
    return format_interval(refit.strength, refit.deviation, refit.effect.parameters[0])


def format_strength(value: float, parameter: EffectParameter, count: int = 3, common: Unit | None = None) -> str:
    """A strength with a few digits, in its own unit or the common one of a list; "none" if it is infinite."""
    if not np.isfinite(value):
        return "none"
    size, unit = common or split_unit(value, parameter)
    return f"{format_digits(value / size, count)} {unit}".rstrip()


def list_factors(setup: Setup, refit: Refit) -> dict[str, tuple[float, float]]:
    """Calibration parameters of the case in a fit, with their standard deviations, by name."""
    return {item.name: (a, b) for item, a, b in _list_calibrated(setup, refit) if item.is_of_case}


def list_sensor_gains(setup: Setup, refit: Refit) -> dict[str, tuple[float, float]]:
    """Fitted unstated gains with their standard deviations, by name."""
    fitted = _list_calibrated(setup, refit)
    return {item.name: (item.start * a, item.start * b) for item, a, b in fitted if isinstance(item, UnknownGain)}


def list_frequency_shifts(setup: Setup, refit: Refit) -> dict[str, float]:
    """Fitted relative errors of the model's natural frequencies, by name [-]."""
    fitted = _list_calibrated(setup, refit)
    return {item.name: 1 / value - 1 for item, value, _ in fitted if isinstance(item, FrequencyCorrection)}


def _list_calibrated(setup: Setup, refit: Refit) -> list[tuple[CalibrationParameter, float, float]]:
    """All calibration parameters of a fit, with value and standard deviation; effects follow them in the fit."""
    fit = refit.fit
    return list(zip(setup.calibration_parameters, fit.values.tolist(), fit.deviation.tolist(), strict=False))


def list_strengths(setup: Setup, refit: Refit) -> list[tuple[Effect, float, float]]:
    """Added effects and those of the refit, with strength and standard deviation."""
    return [(effect, *numbers[0]) for effect, numbers in _list_effects(setup, refit)]


def list_case_values(setup: Setup, refit: Refit) -> dict[str, Any]:
    """Values that `stickslip add` would write into the case for a refit, each with half its 95 % interval.

    For a refit without an effect, the values of `stickslip calibrate`.
    """
    added = {
        effect.name: {
            make_parameter_key(parameter): _make_written(value, deviation, parameter)
            for parameter, (value, deviation) in zip(effect.parameters, numbers, strict=True)
        }
        for effect, numbers in _list_effects(setup, refit)
    }
    name = "" if refit.effect is None else refit.effect.name
    return {
        "effect": name,
        "values": added.pop(name, {}),
        "added": added,
        "calibrated": {
            name: Written(float(f"{value:.6g}"), f"{TWO_SIDED_95 * deviation:.2g}")
            for name, (value, deviation) in list_factors(setup, refit).items()
        },
        "after": summarise_errors(refit).document,
    }


def _list_effects(setup: Setup, refit: Refit) -> list[tuple[Effect, list[tuple[float, float]]]]:
    """Added effects and those of the refit, with values and standard deviations of their parameters."""
    effects = [*(item.effect for item in setup.added), *filter(None, (refit.effect, refit.beside))]
    numbers = list(zip(refit.fit.values.tolist(), refit.fit.deviation.tolist(), strict=True))
    listed, first = [], len(setup.calibration_parameters)
    for effect in effects:
        listed.append((effect, numbers[first : first + len(effect.parameters)]))
        first += len(effect.parameters)
    return listed


def _make_written(value: float, deviation: float, parameter: EffectParameter) -> Written:
    text, (size, unit) = format_parameter(value, parameter), split_unit(value, parameter)
    return Written(text if unit else float(text), f"{TWO_SIDED_95 * deviation / size:.2g} {unit}".rstrip())


def split_unit(value: float, parameter: EffectParameter) -> Unit:
    """Size of the unit of a value [SI], and its name."""
    unit = format_parameter(value, parameter).partition(" ")[2]
    return dict(WRITTEN.get(parameter.unit, ())).get(unit, 1.0), unit


def _make_row(score: Score, refit: Refit | None, detectable: float, named: bool) -> Row:
    """A candidate without its cosine to the first one."""
    return Row(
        effect=score.effect,
        expected=score.gain,
        gain=None if refit is None else refit.gain,
        strength=score.strength if refit is None else refit.strength,
        deviation=score.detectable if refit is None else refit.deviation,
        errors=None if refit is None else summarise_errors(refit),
        detectable=detectable,
        named=named,
    )
