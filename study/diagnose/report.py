"""The report of a diagnosis for people: text with the verdict in three lines and details below."""

from collections.abc import Iterator, Sequence
from math import isfinite, isnan
from pathlib import Path
from textwrap import wrap

from correlation.uncertainty.interval import TWO_SIDED_95
from diagnosis.decision.verdict import Finding
from diagnosis.decision.wording import describe_held_out_change
from diagnosis.fit.problem import Refit
from diagnosis.fit.unknown_gain import describe_gain
from geometry.plain_number import format_number, percent
from study.compare.report import join_titles
from study.console import WIDTH
from study.diagnose.advice import choose_advice
from study.diagnose.doubt import HARMFUL_ERROR_RATIO, list_doubts, list_notes
from study.diagnose.history import ADD, CALIBRATION, UNDO, Errors, HistoryStep
from study.diagnose.missing_law import format_law
from study.diagnose.next_test import format_next_tests
from study.diagnose.resonance import describe_level_dependence
from study.diagnose.round import Round, summarise_errors
from study.diagnose.stages import list_stages
from study.diagnose.table import (
    Row,
    format_digits,
    format_fitted_strength,
    format_interval,
    list_factors,
    list_frequency_shifts,
    list_rows,
    list_sensor_gains,
    list_strengths,
)
from study.merge_sentences import name_wrong_places

#: Number of candidates and places that the terminal shows; the files contain all.
MAX_CANDIDATES, MAX_PLACES = 10, 3
#: Note if the case has values of an earlier fit.
REFITTED_NOTE = (
    "Every diagnosis fits all of these values again. The values of the case are in brackets; they stay in the file "
    'until the next stickslip add. "Nominal" is the structure without them, "as in the case" with the values in '
    'brackets, "refitted" with those of this diagnosis.'
)
HELD_OUT_NOTE = (
    "The held-out error is computed after preload, frequency offset and force of each held-out repeat have been "
    "fitted within their measured scatter. It is weighted by the covariance of its round, so that the same values may "
    "have another error in another round."
)
#: File of a recovered law.
LAW_FILE = "recovered_law.py"


def format_report(result: Round) -> str:
    """Report as text: verdict in three lines with doubts; then calibration, candidates, and untestable effects."""
    return "\n".join(
        [
            *_describe_verdict(result),
            "",
            *_describe_fitted(result),
            "",
            *_format_candidates(result),
            *_describe_places(result),
            *format_law(result.law, LAW_FILE),
            *format_next_tests(result.next_step),
            *_describe_untestable(result),
        ]
    )


def format_headline(result: Round) -> str:
    """The verdict with strengths in suitable units, its open questions, and the suspicious measurements."""
    where = name_wrong_places(result.suspicions)
    wrong = f" But some of these measurements look wrong: {where}." if where else ""
    changed = f" But {'; '.join(result.changes)}." if result.changes else ""
    return f"{_name_effects(result)}{changed}{wrong}"


def _name_effects(result: Round) -> str:
    """The verdict itself."""
    verdict = result.diagnosis.verdict
    if not verdict.effects:
        return verdict.sentence
    fits = result.uncalibrated, result.diagnosis.baseline, verdict.effects[0]
    return verdict.name_effects(format_fitted_strength, describe_error_fall(*map(summarise_errors, fits)), "tests")


def describe_error_fall(drawn: Errors, before: Errors, after: Errors) -> str:
    """Change of the held-out error by an effect, from the nominal model if calibration alone increases the error."""
    is_astray = before.held_out > HARMFUL_ERROR_RATIO * drawn.held_out
    if is_astray and drawn.held_out > after.held_out:
        error, then = (f"{100 * values.held_out:.3g}" for values in (drawn, after))
        return f"the held-out error falls from {error} % (nominal) to {then} %"
    return describe_held_out_change((before.held_out, after.held_out), (before.held_out_chi2, after.held_out_chi2))


def describe_threshold(result: Round) -> str:
    """The detection threshold, and its origin."""
    thresholds = result.diagnosis.thresholds
    if not result.diagnosis.scores:
        return "detection threshold: none, as no effect was tried"
    origin = f"{thresholds.n_trial} simulated ones" if thresholds.n_trial else "linear theory, with a margin"
    return (
        f"detection threshold: chi^2 falls by more than {thresholds.gain:.3g} in "
        f"{format_number(100 * thresholds.false_alarms)} % of campaigns without a missing effect ({origin})"
    )


def describe_errors(values: Errors) -> str:
    """Both errors, if they are known, with the reduced chi-squared."""
    training, held_out = format_digits(values.training_chi2, 3), format_digits(values.held_out_chi2, 3)
    chi2 = f"reduced chi-squared {training:>7}, held out {held_out:>7}"
    if isnan(values.training):
        return chi2
    return f"error {percent(values.training, 3):>9}, held out {percent(values.held_out, 3):>9}; {chi2}"


def describe_step(step: HistoryStep, case: Path) -> str:
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
            lines.append("  from its diagnosis; the next diagnosis fits all values again")
    return "\n".join([*lines, "", *step.diff])


def _describe_verdict(result: Round) -> Iterator[str]:
    yield join_titles(result.setup.title, result.campaign.title)
    yield ""
    yield format_headline(result)
    yield from _describe_resonances(result)
    for doubt in list_doubts(result):
        yield from wrap(f"! {doubt}", WIDTH, initial_indent="  ", subsequent_indent="    ")
    for note in list_notes(result):
        yield from wrap(note, WIDTH, initial_indent="  ", subsequent_indent="    ")
    yield f"  {describe_threshold(result)}"
    yield f"  next: {choose_advice(result)}"


def _describe_resonances(result: Round) -> Iterator[str]:
    """Level dependence of the resonances, if an unidentified effect is missing."""
    for sentence in describe_level_dependence(result):
        yield from wrap(sentence, WIDTH, initial_indent="  ", subsequent_indent="    ")


def _describe_fitted(result: Round) -> Iterator[str]:
    baseline, in_case = result.diagnosis.baseline, result.setup.calibrated
    yield f"Calibrated: {_name_factors(result, baseline) or 'the case has no calibration parameters'}"
    if result.best is not None and (named := _name_factors(result, result.best)):
        yield f"Calibrated with {result.best.label}: {named}"
    last = result.best or baseline
    if gains := [describe_gain(name, *numbers) for name, numbers in list_sensor_gains(result.setup, last).items()]:
        beside = "" if result.best is None else f" with {last.label}"
        yield f"Unknown gains, fitted to the training data{beside}: {', '.join(gains)}"
    if shifts := list_frequency_shifts(result.setup, baseline):
        listed = ", ".join(f"{name} {100 * shift:+.2g} %" for name, shift in shifts.items())
        yield f"Errors of natural frequencies of the model that the fit found (+: too high): {listed}"
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


def _format_candidates(result: Round) -> Iterator[str]:
    listed = list_rows(result)
    shown = listed[:MAX_CANDIDATES]
    if not shown:
        is_far = result.diagnosis.verdict.finding is Finding.NOT_CLOSE
        yield ("No effect was tried: the model is too far from the data." if is_far else "No effect can be tested.")
        return
    width = max(len(row.effect.name) for row in shown)
    yield f"  {'candidate':<{width}}  {'chi^2 falls by':>14}  {'held-out error':>14}  {'similarity':>10}  {'strength'}"
    for row in shown:
        gain = format_digits(row.fall, 4) if row.gain is not None else f"({format_digits(row.fall, 4)})"
        error = percent(row.errors.held_out, 3) if row.errors is not None else ""
        alike = "" if row.cosine is None else f"{row.cosine:.2f}"
        mark = "*" if row.named else " "
        yield f"{mark} {row.effect.name:<{width}}  {gain:>14}  {error:>14}  {alike:>10}  {row.in_words}"
    yield "  in brackets: to first order, not fitted; similarity 1: these tests cannot separate it from the first one"
    if result.diagnosis.verdict.further is not None:
        yield (
            "  the two that are missing together: the gain of each in addition to the other, and the held-out error "
            "of both"
        )
    if result.diagnosis.verdict.finding in {Finding.NOTHING, Finding.NOT_TESTABLE}:
        yield ""
        if named := list_by_kind([row for row in listed if isfinite(row.detectable)]):
            yield "Smallest strengths that these tests would have detected:"
            for line in named:
                yield from wrap(line, WIDTH, initial_indent="  ", subsequent_indent="    ", break_on_hyphens=False)
        if hidden := sorted(row.effect.name for row in listed if not isfinite(row.detectable)):
            yield "Not detectable in these tests at any strength:"
            yield from wrap(
                "; ".join(hidden), WIDTH, initial_indent="  ", subsequent_indent="  ", break_on_hyphens=False
            )


def list_by_kind(rows: Sequence[Row]) -> list[str]:
    """Smallest detectable strengths, one line per kind, the smallest of each kind first."""
    kinds: dict[str, list[str]] = {}
    for row in sorted(rows, key=lambda row: (row.effect.kind, row.detectable)):
        place = row.effect.name.removeprefix(row.effect.kind).strip()
        kinds.setdefault(row.effect.kind, []).append(f"{place} {row.detectable_in_words}".strip())
    return [f"{kind}: {'; '.join(places)}" for kind, places in kinds.items()]


def _describe_places(result: Round) -> Iterator[str]:
    if result.diagnosis.verdict.finding is not Finding.UNKNOWN or not result.diagnosis.places:
        return
    yield ""
    yield "Where an unknown force would explain the difference:"
    for place in result.diagnosis.places[:MAX_PLACES]:
        yield f"  chi^2 falls by {format_digits(place.gain, 4)}: {place.sentence}"


def _describe_untestable(result: Round) -> Iterator[str]:
    left = result.diagnosis.catalogue.untestable
    if left:
        yield ""
        yield "Cannot be tested:"
        yield from (f"  {item.name}: {item.reason}" for item in left)
