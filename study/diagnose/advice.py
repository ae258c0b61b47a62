"""The verdict in a few words, and the next step for the user."""

from diagnosis.decision.verdict import Finding
from study.diagnose.round import Round

#: The next step by the verdict.
ADVICE = {
    Finding.MISSING: 'stickslip add "{effect}" writes it into the case; --auto does so automatically',
    Finding.AMBIGUOUS: 'plan a test that separates them, or add one of them: stickslip add "{effect}"',
    Finding.NOTHING: "none; the case explains these measurements",
    Finding.NOT_CLOSE: "check supports, masses and loads of the case, and units and places of the sensors",
    Finding.UNKNOWN: "describe an effect of your own (docs/effects.md), or measure at other places and levels",
    Finding.NOT_TESTABLE: (
        "measure at higher levels, nearer to the resonances, at places that move more, or with more repeats; stickslip "
        "plan shows which effects such tests would detect (docs/plan.md)"
    ),
}
#: The verdict in a few words.
TAG = {
    Finding.MISSING: "An effect is missing",
    Finding.AMBIGUOUS: "One of several is missing",
    Finding.NOTHING: "Nothing is missing",
    Finding.UNKNOWN: "Something unknown is missing",
    Finding.NOT_CLOSE: "The model is not close enough",
    Finding.NOT_TESTABLE: "These measurements are not conclusive",
}
#: The same where an effect alone is not confirmed, and where two are missing together.
TAG_ONE = "An effect may be missing"
TAG_TWO = {Finding.MISSING: "Two effects are missing", Finding.AMBIGUOUS: "Two effects may be missing"}
#: The next step where two effects are missing.
ADVICE_TWO = (
    'stickslip add "{effect}" writes the first into the case, and a second diagnosis finds the other; --auto does both'
)
#: The next step where the first of two effects is certain, and the second is one of several.
ADVICE_FIRST = 'stickslip add "{effect}" writes the first into the case; diagnose again for the second'
#: The next step where an unknown force has a place.
ADVICE_PLACE = "inspect that place, or describe an effect of your own (docs/effects.md)"
#: ... and a law.
ADVICE_LAW = "inspect that place; a [[joint]] of the case can have such a law (docs/case.md)"
#: The next step where measurements look wrong.
ADVICE_WRONG_DATA = (
    "check the measurements that look wrong, correct them in the files or the manifest, and diagnose again"
)
#: The next step where nothing is missing from the mean of repeats that change, or may change, with the time.
ADVICE_CHANGES = "find out what changed from repeat to repeat, or repeat more often: the case explains only their mean"
#: The next step where a prior holds a calibration parameter back.
ADVICE_PRIORS = (
    "correct in the case the values that these parameters scale, or raise their deviations in [accepted]; then "
    "diagnose again"
)
#: The next step where held-out data or its interval do not confirm the only effect that is named.
ADVICE_UNCONFIRMED = 'hold out tests that show it, or add it: stickslip add "{effect}"'
#: The next step where a test separates what is left.
ADVICE_TEST = '{measure}; or add one of them: stickslip add "{effect}"'


def choose_tag(result: Round) -> str:
    """The verdict in a few words, as the heading of the page."""
    verdict = result.diagnosis.verdict
    tag = TAG[verdict.finding]
    if verdict.further is not None:
        tag = TAG_TWO.get(verdict.finding, tag)
    elif verdict.finding is Finding.AMBIGUOUS and (len(verdict.effects) == 1 or verdict.replaces_error):
        tag = TAG_ONE
    is_changed = verdict.finding is Finding.NOTHING and bool(result.changes)
    if is_changed:
        tag += " from the mean of the repeats" if result.wrong else ", unless the structure changed during the test"
    look_wrong = any(not (is_changed and item.of_time) for item in result.wrong)
    return f"{tag}, but some measurements look wrong" if look_wrong else tag


def choose_advice(result: Round) -> str:
    """The next step for the user."""
    best, verdict = result.best, result.diagnosis.verdict
    if verdict.finding is Finding.NOTHING and result.changes and all(item.of_time for item in result.wrong):
        return ADVICE_CHANGES
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
    if len(verdict.effects) == 1 and verdict.further_alternatives:
        return ADVICE_FIRST.format(effect=effect)
    if verdict.finding is Finding.AMBIGUOUS and len(verdict.effects) == 1 and not verdict.laws:
        return ADVICE_UNCONFIRMED.format(effect=effect)
    if verdict.finding is Finding.MISSING and verdict.further is not None:
        return ADVICE_TWO.format(effect=effect)
    return ADVICE[verdict.finding].format(effect=effect)
