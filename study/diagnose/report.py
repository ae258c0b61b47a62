"""What a round of diagnosis found, in words and as a document."""

from collections.abc import Iterator
from pathlib import Path
from textwrap import fill
from typing import Any

from diagnosis.decision.verdict import INTERVAL, Finding
from study.compare.report import side_by_side
from study.diagnose.history import ADD, Errors, Step
from study.diagnose.round import Round, errors
from study.diagnose.stages import stages
from study.diagnose.table import Row, beyond, digits, factors, interval, rows, short, strengths

#: Candidates and places that the terminal shows; the files hold all.
MOST, MOST_PLACES = 10, 3
#: Said where the case holds values of an earlier fit.
ANEW = (
    "Every diagnosis fits all of these anew; what the case holds is in brackets, and stays there until the next "
    'stickslip add. "As drawn" is the structure without them, "as the case says" with the values in brackets.'
)
SETTLED = (
    "A held-out error is told once pre-load and frequency of the held-out repeats have settled within their scatter, "
    "weighed by the covariance of its round: the same values had another one in the round before."
)
ADVICE = {
    Finding.MISSING: 'stickslip add "{effect}" writes it into the case; --auto does so by itself',
    Finding.AMBIGUOUS: 'stickslip add "{effect}" takes one of them all the same; tests that tell them apart are better',
    Finding.NOTHING: "the case explains these measurements",
    Finding.UNKNOWN: "look at that place, or offer an effect of your own (docs/effects.md)",
}


def in_words(of: Round) -> str:
    """For people: the verdict, what was calibrated, the candidates, and what cannot be tested."""
    return "\n".join([*_verdict(of), "", *_fitted(of), "", *_candidates(of), *_places(of), *_untestable(of)])


def verdict_in_words(of: Round) -> str:
    """The verdict; the smallest strengths that would have been named are a table of their own."""
    return of.diagnosis.verdict.sentence


def headline(of: Round) -> str:
    """The verdict with strengths in units of their size."""
    verdict = of.diagnosis.verdict
    named = [row for row in rows(of) if row.named]
    if not named or verdict.finding not in {Finding.MISSING, Finding.AMBIGUOUS}:
        return verdict_in_words(of)
    # In the order of the verdict: the first is the best, of which the errors are told.
    order = [each.effect.name for each in verdict.effects if each.effect is not None]
    named.sort(key=lambda row: order.index(row.effect.name))
    listed = " or ".join(f"{row.effect.name} ({row.in_words})" for row in named)
    fall = held_out_falls(errors(of.diagnosis.before), errors(verdict.effects[0]))
    if verdict.finding is Finding.AMBIGUOUS:
        return f"{listed} is missing, and these tests cannot tell which: {fall}."
    return f"{listed} is missing: {fall}."


def held_out_falls(before: Errors, after: Errors) -> str:
    """By how much what is held out is met better; what a weak effect changes, the relative error may not show."""
    error, then = (f"{100 * each.held_out:.3g}" for each in (before, after))
    if error != then and before.held_out > after.held_out:
        return f"the held-out error falls from {error} to {then} %"
    stays = f"stays {then} %" if error == then else f"goes from {error} to {then} %"
    chi2 = [digits(each.held_out_chi2, 3) for each in (before, after)]
    return f"held-out chi^2 a number falls from {chi2[0]} to {chi2[1]} (the held-out error {stays})"


def advice(of: Round) -> str:
    """What to do next."""
    best = of.best
    effect = best.effect.name if best is not None and best.effect is not None else ""
    return ADVICE[of.diagnosis.verdict.finding].format(effect=effect)


def chance(of: Round) -> str:
    """Where the threshold comes from."""
    of_layout = of.diagnosis.thresholds
    origin = "the linear theory, with a margin"
    if of_layout.n_trial:
        origin = f"{of_layout.n_trial} campaigns without any effect"
    return (
        f"chance lowers chi^2 by more than {of_layout.gain:.3g} in {100 * of_layout.false_alarms:.2g} % of campaigns "
        f"in which nothing is missing (from {origin})"
    )


def document(of: Round) -> dict[str, Any]:
    """The same for ``--json`` and ``diagnosis.json``; strengths in SI."""
    found = of.diagnosis
    return {
        "title": of.setup.title,
        "campaign": of.campaign.title,
        "finding": found.verdict.finding.value,
        "verdict": found.verdict.sentence,
        "effects": [each.effect.name for each in found.verdict.effects if each.effect is not None],
        "threshold": found.verdict.threshold,
        "thresholds": vars(found.thresholds),
        "errors": {**_case_errors(of), "before": errors(found.before).document},
        "named": [
            {"effect": effect.name, **_estimate(strength, deviation), "unit": effect.parameters[0].unit}
            for each in found.verdict.effects
            for effect, strength, deviation in strengths(of, each)[-1:]
        ],
        "calibrated": {
            name: {**_estimate(factor, deviation, "factor"), "in_case": of.setup.calibrated.get(name)}
            for name, (factor, deviation) in factors(of, found.before).items()
        },
        "added": [
            {
                "effect": effect.name,
                **_estimate(strength, deviation),
                "unit": effect.parameters[0].unit,
                "in_case": float(was.values[0]),
            }
            for (effect, strength, deviation), was in zip(strengths(of, found.before), of.setup.added, strict=True)
        ],
        "candidates": [_row_document(row) for row in rows(of)],
        "places": [
            {
                "place": place.name,
                "configuration": place.configuration,
                "gain": place.gain,
                "exponent": place.exponent,
                "exponent_deviation": place.exponent_deviation,
                "phase_deg": place.phase,
                "levels_n": place.level,
                "amplitude_m": place.amplitude,
                "stiffness_real": place.stiffness.real,
                "stiffness_imag": place.stiffness.imag,
                "stiffness_deviation": place.deviation,
            }
            for place in found.places
        ],
        "untestable": [{"effect": each.name, "reason": each.reason} for each in found.catalogue.untestable],
    }


def _case_errors(of: Round) -> dict[str, Any]:
    """Errors as drawn, without what the case has calibrated or added, and of all that the case says."""
    named = {"as drawn": "drawn", "as the case says": "in_case"}
    return {named[each.name]: errors(each.refit).document for each in stages(of) if each.name in named}


def _estimate(value: float, deviation: float, name: str = "strength") -> dict[str, Any]:
    """A fitted number with its standard deviation and its 95 % interval."""
    half = INTERVAL * deviation
    return {name: value, "deviation": deviation, "interval_95": [value - half, value + half]}


def errors_in_words(of: Errors) -> str:
    """Both errors with chi^2."""
    return (
        f"error {100 * of.training:7.3g} %, held out {100 * of.held_out:7.3g} %; chi^2 a number "
        f"{digits(of.training_chi2, 3):>7}, held out {digits(of.held_out_chi2, 3):>7}"
    )


def step_in_words(step: Step, case: Path) -> str:
    """What `add` or `undo` did."""
    values = ", ".join(str(value) for value, _ in step.values.values())
    lines = [f'{case}: "{step.effect}" ({values}) added' if step.what == ADD else f'{case}: "{step.effect}" taken back']
    if step.before is not None and step.after is not None:
        lines += [f"  before  {errors_in_words(step.before)}", f"  after   {errors_in_words(step.after)}"]
        if step.what == ADD:
            lines.append("  as its diagnosis fitted it; the next diagnosis fits all values anew")
    return "\n".join([*lines, "", *step.diff])


def _verdict(of: Round) -> Iterator[str]:
    yield side_by_side(of.setup.title, of.campaign.title)
    yield ""
    yield headline(of)
    yield f"  {chance(of)}"
    yield f"  next: {advice(of)}"


def _fitted(of: Round) -> Iterator[str]:
    before, held = of.diagnosis.before, of.setup.calibrated
    named = [
        f"{name} x {value:.5g} +- {INTERVAL * deviation:.2g}" + (f" (case: {held.get(name, 1.0):.5g})" if held else "")
        for name, (value, deviation) in factors(of, before).items()
    ]
    yield f"Calibrated: {', '.join(named) or 'nothing is accepted'}"
    for (effect, strength, deviation), was in zip(strengths(of, before), of.setup.added, strict=True):
        parameter = effect.parameters[0]
        now = interval(strength, deviation, parameter)
        yield f"Added: {effect.name}, {now} (case: {interval(float(was.values[0]), 0.0, parameter)})"
    if held or of.setup.added:
        yield from fill(ANEW, 118, initial_indent="  ", subsequent_indent="  ").splitlines()
    steps = [(stage.name, errors(stage.refit)) for stage in stages(of)]
    width = max(len(name) for name, _ in steps)
    for name, each in steps:
        yield f"  {name:<{width}}  {errors_in_words(each)}"
    if held or of.setup.added:
        yield from fill(SETTLED, 118, initial_indent="  ", subsequent_indent="  ").splitlines()


def _candidates(of: Round) -> Iterator[str]:
    shown = rows(of)[:MOST]
    if not shown:
        yield "No effect can be tested."
        return
    width = max(len(row.effect.name) for row in shown)
    yield f"  {'candidate':<{width}}  {'chi^2 falls by':>14}  {'held-out error':>14}  {'alike':>5}  {'strength'}"
    for row in shown:
        gain = digits(row.gain, 4) if row.gain is not None else f"({digits(row.expected, 4)})"
        held = f"{100 * row.errors.held_out:.3g} %" if row.errors is not None else ""
        mark = "*" if row.named else " "
        yield f"{mark} {row.effect.name:<{width}}  {gain:>14}  {held:>14}  {row.cosine:5.2f}  {row.in_words}"
    yield "  in brackets: to first order, not fitted; alike: 1 cannot be told from the best by these tests"
    if of.diagnosis.verdict.finding is Finding.NOTHING:
        yield ""
        yield "Smallest strengths that these tests would have shown:"
        least = [f"{row.effect.name} {beyond(row.detectable, row.parameter)}" for row in rows(of)]
        yield from fill(
            "; ".join(least), 118, initial_indent="  ", subsequent_indent="  ", break_on_hyphens=False
        ).splitlines()


def _places(of: Round) -> Iterator[str]:
    if of.diagnosis.verdict.finding is not Finding.UNKNOWN or not of.diagnosis.places:
        return
    yield ""
    yield "Where an unknown force would explain the difference:"
    for place in of.diagnosis.places[:MOST_PLACES]:
        yield f"  chi^2 falls by {digits(place.gain, 4)}: {place.sentence}"


def _untestable(of: Round) -> Iterator[str]:
    left = of.diagnosis.catalogue.untestable
    if left:
        yield ""
        yield "Cannot be tested:"
        yield from (f"  {each.name}: {each.reason}" for each in left)


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
        "smallest_detectable_in_words": short(row.detectable, row.parameter),
    }
