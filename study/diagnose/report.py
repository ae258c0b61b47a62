"""The report of a diagnosis: text with the verdict in three lines and details below, and a JSON document."""

from collections.abc import Iterator
from math import isfinite, isnan
from pathlib import Path
from textwrap import wrap
from typing import Any

from correlation.uncertainty.interval import TWO_SIDED_95
from diagnosis.decision.law_of_force import FittedLaw
from diagnosis.decision.verdict import Finding
from diagnosis.decision.wording import describe_held_out_change
from diagnosis.fit.problem import Refit
from diagnosis.fit.unknown_gain import describe_gain
from diagnosis.localisation import Place
from diagnosis.resonator import Resonator
from geometry.plain_number import percent, plain
from study.alike import name_wrong_places
from study.compare.report import side_by_side
from study.console import WIDTH
from study.diagnose.doubt import HARMFUL_ERROR_RATIO, list_doubts
from study.diagnose.history import ADD, CALIBRATION, UNDO, Errors, Step
from study.diagnose.missing_law import format_law
from study.diagnose.next_test import format_next_tests
from study.diagnose.resonance import describe_level_dependence
from study.diagnose.round import Round, summarise_errors
from study.diagnose.stages import list_stages
from study.diagnose.table import (
    Row,
    format_fitted_strength,
    format_interval,
    format_number,
    format_strength,
    list_factors,
    list_frequency_shifts,
    list_rows,
    list_sensor_gains,
    list_strengths,
)

#: Candidates and places that the terminal shows; the files hold all.
MOST, MOST_PLACES = 10, 3
#: Where the case has values of an earlier fit.
REFITTED_NOTE = (
    "Every diagnosis fits all of these values anew. The values of the case are in brackets; they stay in the file "
    'until the next stickslip add. "As drawn" is the structure without them, "as the case says" with the values in '
    "brackets."
)
HELD_OUT_NOTE = (
    "The held-out error is computed after preload, frequency offset and force of each held-out repeat have been "
    "fitted within their measured scatter. It is weighted by the covariance of its round, so that the same values may "
    "have another error in another round."
)
ADVICE = {
    Finding.MISSING: 'stickslip add "{effect}" writes it into the case; --auto does so by itself',
    Finding.AMBIGUOUS: 'plan a test that separates them, or add one of them: stickslip add "{effect}"',
    Finding.NOTHING: "none; the case explains these measurements",
    Finding.NOT_CLOSE: "check supports, masses and loads of the case, and units and places of the sensors",
    Finding.UNKNOWN: "describe an effect of your own (docs/effects.md), or measure at other places and levels",
    Finding.NOT_TESTABLE: (
        "measure at higher levels, nearer to the resonances, at places that move more, or with more repeats; stickslip "
        "plan tells what such tests would show (docs/plan.md)"
    ),
}
#: The verdict in a few words.
TAG = {
    Finding.MISSING: "An effect is missing",
    Finding.AMBIGUOUS: "One of several is missing",
    Finding.NOTHING: "Nothing is missing",
    Finding.UNKNOWN: "Something unknown is missing",
    Finding.NOT_CLOSE: "The model is not close enough",
    Finding.NOT_TESTABLE: "These measurements cannot tell",
}
#: The same where an effect alone is not confirmed, and where two are missing together.
TAG_ONE = "An effect may be missing"
TAG_TWO = {Finding.MISSING: "Two effects are missing", Finding.AMBIGUOUS: "Two effects may be missing"}
#: The next step where two effects are missing.
ADVICE_TWO = (
    'stickslip add "{effect}" writes the first into the case, and a second diagnosis finds the other; --auto does both'
)
#: File of a recovered law.
LAW_FILE = "recovered_law.py"
#: The next step where an unknown force has a place.
ADVICE_PLACE = "inspect that place, or describe an effect of your own (docs/effects.md)"
#: ... and a law.
ADVICE_LAW = "inspect that place; a [[joint]] of the case can have such a law (docs/case.md)"
#: The next step where measurements look wrong.
ADVICE_WRONG_DATA = (
    "check the measurements that look wrong, correct them in the files or the manifest, and diagnose again"
)
#: The next step where a prior holds a calibration parameter back.
ADVICE_PRIORS = (
    "correct in the case what these parameters scale, or raise their deviations in [accepted]; then diagnose again"
)
#: The next step where held-out data or its interval do not confirm the only effect that is named.
ADVICE_UNCONFIRMED = 'hold out tests that see it, or add it: stickslip add "{effect}"'
#: The next step where a test separates what is left.
ADVICE_TEST = '{measure}; or add one of them: stickslip add "{effect}"'


def format_report(result: Round) -> str:
    """For people: verdict in three lines with doubts; then calibration, candidates, and what cannot be tested."""
    return "\n".join(
        [
            *_verdict(result),
            *_resonances(result),
            "",
            *_fitted(result),
            "",
            *_candidates(result),
            *_places(result),
            *format_law(result.law, LAW_FILE),
            *format_next_tests(result.next_step),
            *_untestable(result),
        ]
    )


def format_headline(result: Round) -> str:
    """The verdict with strengths in units of their size, and which measurements look wrong."""
    where = name_wrong_places(result.suspicions)
    wrong = f" But some of these measurements look wrong: {where}." if where else ""
    return f"{_name_effects(result)}{wrong}"


def _name_effects(result: Round) -> str:
    """The verdict itself."""
    verdict = result.diagnosis.verdict
    if not verdict.effects:
        return verdict.sentence
    names = [each.name for each in verdict.effects]
    chance = dict(zip(names, verdict.probabilities, strict=False)) if len(names) > 1 else {}

    def describe(refit: Refit) -> str:
        probability = f", probability {plain(100 * chance[refit.name])} %" if refit.name in chance else ""
        return f"{format_fitted_strength(refit)}{probability}"

    fits = result.uncalibrated, result.diagnosis.baseline, verdict.effects[0]
    return verdict.name_effects(describe, describe_error_fall(*map(summarise_errors, fits)), "tests")


def describe_error_fall(drawn: Errors, before: Errors, after: Errors) -> str:
    """Change of the held-out error by an effect, from the model as drawn where calibration alone has gone astray."""
    is_astray = before.held_out > HARMFUL_ERROR_RATIO * drawn.held_out
    if is_astray and drawn.held_out > after.held_out:
        error, then = (f"{100 * values.held_out:.3g}" for values in (drawn, after))
        return f"the held-out error falls from {error} % as drawn to {then} %"
    return describe_held_out_change((before.held_out, after.held_out), (before.held_out_chi2, after.held_out_chi2))


def choose_tag(result: Round) -> str:
    """The verdict in a few words, as the heading of the page."""
    verdict = result.diagnosis.verdict
    tag = TAG[verdict.finding]
    if verdict.further is not None:
        tag = TAG_TWO.get(verdict.finding, tag)
    elif verdict.finding is Finding.AMBIGUOUS and len(verdict.effects) == 1:
        tag = TAG_ONE
    return f"{tag}, but some measurements look wrong" if result.wrong else tag


def choose_advice(result: Round) -> str:
    """The next step for the user."""
    best, verdict = result.best, result.diagnosis.verdict
    if result.wrong:
        return ADVICE_WRONG_DATA
    if verdict.beyond_priors:
        return ADVICE_PRIORS
    if result.next_step.sentence and verdict.finding is Finding.AMBIGUOUS:
        effect = verdict.effects[0].name
        return ADVICE_TEST.format(measure=result.next_step.sentence, effect=effect)
    if result.next_step.sentence and verdict.finding in {Finding.UNKNOWN, Finding.NOT_TESTABLE}:
        return result.next_step.sentence
    if verdict.finding is Finding.UNKNOWN and verdict.laws:
        return ADVICE_LAW
    if verdict.place is not None:
        return ADVICE_PLACE
    effect = best.effect.name if best is not None and best.effect is not None else ""
    if verdict.finding is Finding.AMBIGUOUS and len(verdict.effects) == 1 and not verdict.laws:
        return ADVICE_UNCONFIRMED.format(effect=effect)
    if verdict.finding is Finding.MISSING and verdict.further is not None:
        return ADVICE_TWO.format(effect=effect)
    return ADVICE[verdict.finding].format(effect=effect)


def describe_threshold(result: Round) -> str:
    """The detection threshold, and its origin."""
    thresholds = result.diagnosis.thresholds
    if not result.diagnosis.scores:
        return "detection threshold: none, as no effect was tried"
    origin = f"{thresholds.n_trial} simulated ones" if thresholds.n_trial else "linear theory, with a margin"
    return (
        f"detection threshold: chi^2 falls by more than {thresholds.gain:.3g} in "
        f"{plain(100 * thresholds.false_alarms)} % of campaigns without a missing effect ({origin})"
    )


def _document_effect(item: Refit) -> dict[str, Any]:
    """An effect with its strength, and the falls of -2 ln p by it."""
    assert item.effect is not None
    return {
        "effect": item.name,
        **_estimate(item.strength, item.deviation),
        "unit": item.effect.parameters[0].unit,
        "gain": item.gain,
        "held_out_gain": item.held_out_gain,
    }


def make_document(result: Round) -> dict[str, Any]:
    """The report for ``--json`` and ``diagnosis.json``; strengths in SI units."""
    diagnosis, further = result.diagnosis, result.diagnosis.verdict.further
    return {
        "title": result.setup.title,
        "campaign": result.campaign.title,
        "finding": diagnosis.verdict.finding.value,
        "verdict": format_headline(result),
        "doubts": list_doubts(result),
        "suspicions": [str(each) for each in result.suspicions],
        "model_error": vars(diagnosis.verdict.model_error_size),
        "effects": [item.effect.name for item in diagnosis.verdict.effects if item.effect is not None],
        "probabilities": [*diagnosis.verdict.probabilities],
        "alike": [*diagnosis.verdict.alike],
        "laws": [_law_document(law) for law in diagnosis.verdict.laws],
        "further": None if further is None else _document_effect(further),
        "threshold": diagnosis.verdict.threshold,
        "thresholds": vars(diagnosis.thresholds),
        "errors": {**_case_errors(result), "before": summarise_errors(diagnosis.baseline).document},
        "named": [_document_effect(item) for item in diagnosis.verdict.effects],
        "calibrated": {
            name: {**_estimate(factor, deviation, "factor"), "in_case": result.setup.calibrated.get(name)}
            for name, (factor, deviation) in list_factors(result.setup, diagnosis.baseline).items()
        },
        "frequency_shifts": list_frequency_shifts(result.setup, diagnosis.baseline),
        "gains": {
            name: _estimate(*numbers, "gain")
            for name, numbers in list_sensor_gains(result.setup, diagnosis.baseline).items()
        },
        "added": [
            {
                "effect": effect.name,
                **_estimate(strength, deviation),
                "unit": effect.parameters[0].unit,
                "in_case": float(was.values[0]),
            }
            for (effect, strength, deviation), was in zip(
                list_strengths(result.setup, diagnosis.baseline), result.setup.added, strict=True
            )
        ],
        "candidates": [_row_document(row) for row in list_rows(result)],
        "places": [
            {
                "place": place.name,
                "configuration": place.configuration,
                "gain": place.gain,
                "exponent": place.exponent,
                "exponent_deviation": place.exponent_deviation,
                "phase_deg": place.phase,
                "levels_n": place.level,
                f"amplitude_{place.units.motion}": place.amplitude,
                "stiffness_real": place.stiffness.real,
                "stiffness_imag": place.stiffness.imag,
                "stiffness_deviation": place.deviation,
            }
            for place in diagnosis.places
            if isinstance(place, Place)
        ],
        "resonators": [_resonator_document(each) for each in diagnosis.places if isinstance(each, Resonator)],
        "missing_law": None if result.law is None else result.law.document,
        "next_test": result.next_step.document,
        "untestable": [{"effect": item.name, "reason": item.reason} for item in diagnosis.catalogue.untestable],
    }


def _case_errors(result: Round) -> dict[str, Any]:
    """Errors as drawn, without what the case has calibrated or added, and of all that the case says."""
    named = {"as drawn": "drawn", "as the case says": "in_case"}
    return {
        named[item.name]: summarise_errors(item.refit).document for item in list_stages(result) if item.name in named
    }


def _resonator_document(resonator: Resonator) -> dict[str, Any]:
    return {
        "place": resonator.name,
        "configuration": resonator.configuration,
        "gain": resonator.gain,
        "frequency_hz": resonator.frequency,
        "damping_ratio": resonator.damping,
        "mass": resonator.mass,
        "deviation": resonator.deviation,
        "unit": resonator.unit,
    }


def _law_document(law: FittedLaw) -> dict[str, Any]:
    """A law in place of that of an effect; its gains are those over the effect."""
    assert law.refit.effect is not None
    parameters, fit = law.refit.effect.parameters, law.refit.fit
    numbers = zip(parameters, fit.values[-len(parameters) :], fit.deviation[-len(parameters) :], strict=True)
    return {
        "law": law.refit.effect.kind,
        "in_words": law.words,
        "gain": law.gain,
        "held_out_gain": law.held_out_gain,
        "held_out_error": law.refit.held_out_error,
        "values": {
            parameter.name: {**_estimate(float(value), float(deviation), "value"), "unit": parameter.unit}
            for parameter, value, deviation in numbers
        },
    }


def _estimate(value: float, deviation: float, name: str = "strength") -> dict[str, Any]:
    """A fitted number with its standard deviation and its 95 % interval."""
    half = TWO_SIDED_95 * deviation
    return {name: value, "deviation": deviation, "interval_95": [value - half, value + half]}


def describe_errors(values: Errors) -> str:
    """Both errors, if they are known, with the reduced chi-squared."""
    training, held_out = format_number(values.training_chi2, 3), format_number(values.held_out_chi2, 3)
    chi2 = f"reduced chi-squared {training:>7}, held out {held_out:>7}"
    if isnan(values.training):
        return chi2
    return f"error {percent(values.training, 3):>9}, held out {percent(values.held_out, 3):>9}; {chi2}"


def describe_step(step: Step, case: Path) -> str:
    """Report of `add`, `calibrate` or `undo`."""
    values = ", ".join(str(value) for value, _ in step.values.values())
    done = {
        ADD: f'"{step.effect}" ({values}) added',
        CALIBRATION: f"{len(step.calibrated)} fitted factors written",
        UNDO: f'"{step.effect}" taken back',
    }
    lines = [f"{case}: {done[step.what]}"]
    if step.before is not None and step.after is not None:
        lines += [f"  before  {describe_errors(step.before)}", f"  after   {describe_errors(step.after)}"]
        if step.what == ADD:
            lines.append("  from its diagnosis; the next diagnosis fits all values anew")
    return "\n".join([*lines, "", *step.diff])


def _verdict(result: Round) -> Iterator[str]:
    yield side_by_side(result.setup.title, result.campaign.title)
    yield ""
    yield format_headline(result)
    for doubt in list_doubts(result):
        yield from wrap(f"! {doubt}", WIDTH, initial_indent="  ", subsequent_indent="    ")
    yield f"  {describe_threshold(result)}"
    yield f"  next: {choose_advice(result)}"


def _resonances(result: Round) -> Iterator[str]:
    """How the resonances change with the level, where something that has no name is missing."""
    for sentence in describe_level_dependence(result):
        yield from wrap(sentence, WIDTH, initial_indent="  ", subsequent_indent="    ")


def _fitted(result: Round) -> Iterator[str]:
    baseline, in_case = result.diagnosis.baseline, result.setup.calibrated
    yield f"Calibrated: {_name_factors(result, baseline) or 'the case has no calibration parameters'}"
    if result.best is not None and (named := _name_factors(result, result.best)):
        yield f"Calibrated with {result.best.label}: {named}"
    if found := [describe_gain(name, *numbers) for name, numbers in list_sensor_gains(result.setup, baseline).items()]:
        yield f"Gains that nobody stated, fitted to the training data: {', '.join(found)}"
    if shifts := list_frequency_shifts(result.setup, baseline):
        listed = ", ".join(f"{name} {100 * shift:+.2g} %" for name, shift in shifts.items())
        yield f"Errors of the mesh that the fit found: {listed}"
    for (effect, strength, deviation), was in zip(
        list_strengths(result.setup, baseline), result.setup.added, strict=True
    ):
        parameter = effect.parameters[0]
        now = format_interval(strength, deviation, parameter)
        yield f"Added: {effect.name}, {now} (case: {format_interval(float(was.values[0]), 0.0, parameter)})"
    if in_case or result.setup.added:
        yield from wrap(REFITTED_NOTE, WIDTH, initial_indent="  ", subsequent_indent="  ")
    steps = [(stage.name, summarise_errors(stage.refit)) for stage in list_stages(result)]
    width = max(len(name) for name, _ in steps)
    for name, values in steps:
        yield f"  {name:<{width}}  {describe_errors(values)}"
    if in_case or result.setup.added:
        yield from wrap(HELD_OUT_NOTE, WIDTH, initial_indent="  ", subsequent_indent="  ")


def _name_factors(result: Round, refit: Refit) -> str:
    """Calibration parameters of a fit, with their intervals."""
    in_case = result.setup.calibrated
    return ", ".join(
        f"{name} x {value:.5g} +- {TWO_SIDED_95 * deviation:.2g}"
        + (f" (case: {in_case.get(name, 1.0):.5g})" if in_case else "")
        for name, (value, deviation) in list_factors(result.setup, refit).items()
    )


def _candidates(result: Round) -> Iterator[str]:
    listed = list_rows(result)
    shown = listed[:MOST]
    if not shown:
        is_far = result.diagnosis.verdict.finding is Finding.NOT_CLOSE
        yield "No effect was tried in a model that is so far off." if is_far else "No effect can be tested."
        return
    width = max(len(row.effect.name) for row in shown)
    yield f"  {'candidate':<{width}}  {'chi^2 falls by':>14}  {'held-out error':>14}  {'alike':>5}  {'strength'}"
    for row in shown:
        gain = format_number(row.fall, 4) if row.gain is not None else f"({format_number(row.fall, 4)})"
        error = percent(row.errors.held_out, 3) if row.errors is not None else ""
        alike = "" if row.cosine is None else f"{row.cosine:.2f}"
        mark = "*" if row.named else " "
        yield f"{mark} {row.effect.name:<{width}}  {gain:>14}  {error:>14}  {alike:>5}  {row.in_words}"
    yield "  in brackets: to first order, not fitted; alike: at 1 these tests cannot separate it from the first one"
    if result.diagnosis.verdict.further is not None:
        yield "  the two that are missing together: what each does beside the other, and the held-out error of both"
    if result.diagnosis.verdict.finding in {Finding.NOTHING, Finding.NOT_TESTABLE}:
        yield ""
        listed_by_title = {
            "Smallest strengths that these tests would have detected:": [
                f"{row.effect.name} {row.detectable_in_words}" for row in listed if isfinite(row.detectable)
            ],
            "These tests detect at no strength:": [row.effect.name for row in listed if not isfinite(row.detectable)],
        }
        for title, names in listed_by_title.items():
            if names:
                yield title
                yield from wrap(
                    "; ".join(names), WIDTH, initial_indent="  ", subsequent_indent="  ", break_on_hyphens=False
                )


def _places(result: Round) -> Iterator[str]:
    if result.diagnosis.verdict.finding is not Finding.UNKNOWN or not result.diagnosis.places:
        return
    yield ""
    yield "Where an unknown force would explain the difference:"
    for place in result.diagnosis.places[:MOST_PLACES]:
        yield f"  chi^2 falls by {format_number(place.gain, 4)}: {place.sentence}"


def _untestable(result: Round) -> Iterator[str]:
    left = result.diagnosis.catalogue.untestable
    if left:
        yield ""
        yield "Cannot be tested:"
        yield from (f"  {item.name}: {item.reason}" for item in left)


def _row_document(row: Row) -> dict[str, Any]:
    return {
        "effect": row.effect.name,
        "kind": row.effect.kind,
        "named": row.named,
        "expected_gain": row.expected,
        "gain": row.gain,
        **_estimate(row.strength, row.deviation),
        "unit": row.parameter.unit,
        "in_words": row.in_words,
        "errors": None if row.errors is None else row.errors.document,
        "cosine_to_best": row.cosine,
        "smallest_detectable": row.detectable,
        "smallest_detectable_in_words": format_strength(row.detectable, row.parameter),
    }
