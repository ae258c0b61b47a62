"""What a diagnosis says of values that are fitted anew, of weak effects, and of its candidates' order."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.measurement import Suspicion
from correlation.campaign.read_campaign import read_campaign
from diagnosis.candidate.effect import EffectParameter
from diagnosis.decision.law_of_force import FittedLaw
from diagnosis.decision.pair import Pair
from diagnosis.decision.verdict import Finding
from diagnosis.fit.finalist import Finalist
from pipeline.store import Store
from study.case.setup import read_case
from study.compare.report import join_titles
from study.diagnose.add import add
from study.diagnose.advice import choose_advice, choose_tag
from study.diagnose.document import make_document
from study.diagnose.history import Errors, history_of
from study.diagnose.page import make_files
from study.diagnose.report import describe_error_fall, format_headline, format_report
from study.diagnose.round import diagnose_case
from study.diagnose.run import diagnose_file
from study.diagnose.stages import list_stages
from study.diagnose.table import format_interval, list_rows
from study.run_context import silent_run

TwoMasses = Callable[..., Path]
ERRORS = Errors(training=0.02, held_out=0.0233, training_chi2=0.822, held_out_chi2=0.775)


def test_a_round_with_an_added_effect_says_what_the_case_holds_and_what_it_fits_anew(
    two_masses: TwoMasses, kept_rounds: Store
) -> None:
    case, folder = two_masses({"mass at tip": 0.006}), Path("campaign")
    campaign = read_campaign(folder)
    first = diagnose_file(case, campaign, folder, replace(silent_run(), store=kept_rounds)).last
    assert "(case:" not in format_report(first)
    assert [stage.name for stage in list_stages(first)] == ["nominal", "calibrated", "with mass at tip"]
    add(case, "mass at tip")
    setup = read_case(case, campaign).setup
    # As if it had been edited: the case holds another mass than the one that fits.
    held = replace(setup, added=(replace(setup.added[0], values=(0.0055,)),))
    # What counts here is fitted whatever is a candidate.
    later = diagnose_case(held, campaign, without=["spring", "dashpot", "cubic"])
    words = format_report(later)
    first_added = len(later.setup.calibration_parameters)
    assert later.diagnosis.baseline.fit.values[first_added] == pytest.approx(0.006, rel=0.02)
    assert "(case: 5.5 g)" in words
    assert f"(case: {setup.calibrated['zeta']:.5g})" in words
    assert "Every diagnosis fits all of these values again" in words
    names = {stage.name: stage.refit for stage in list_stages(later)}
    assert list(names) == ["nominal", "as in the case", "refitted"]
    assert names["refitted"].fit.chi2 < names["as in the case"].fit.chi2 < names["nominal"].fit.chi2
    named, result = make_document(first)["named"][0], make_document(later)
    assert named["effect"] == "mass at tip"
    half = 1.96 * named["deviation"]  # 95 % of a normal distribution
    assert named["interval_95"] == pytest.approx([named["strength"] - half, named["strength"] + half])
    assert all(
        item["interval_95"][0] < item["factor"] < item["interval_95"][1] for item in result["calibrated"].values()
    )
    (told,) = result["added"]
    assert told["in_case"] == 0.0055
    assert told["interval_95"][0] < told["strength"] < told["interval_95"][1]
    # What the case says is more than what is drawn: its factors and its mass are in it.
    assert result["errors"]["in_case"]["training_chi2"] < result["errors"]["drawn"]["training_chi2"]
    assert "in_case" not in make_document(first)["errors"]
    page = make_files(later, history_of(case), case)["chain_diagnosis.html"].decode()
    assert "<th>in the case</th><th>refitted</th>" in page
    assert "<td>5.5 g</td>" in page


def test_a_law_that_the_force_may_have_as_well_is_told_in_words_and_numbers(
    two_masses: TwoMasses, kept_rounds: Store
) -> None:
    case, campaign = two_masses({"mass at tip": 0.006}), read_campaign(Path("campaign"))
    result = diagnose_case(read_case(case, campaign).setup, campaign, store=kept_rounds)
    assert make_document(result)["laws"] == []
    (best,) = result.diagnosis.verdict.effects
    law = FittedLaw(refit=best, gain=-3.0, held_out_gain=1.0, words="another force", is_distinct=True)
    verdict = replace(result.diagnosis.verdict, finding=Finding.AMBIGUOUS, laws=[law])
    doubtful = replace(result, diagnosis=replace(result.diagnosis, verdict=verdict))
    assert "is missing, or another force at its place: the held-out error falls" in format_headline(doubtful)
    assert format_headline(doubtful).endswith("The force there may also be another force.")
    (told,) = make_document(doubtful)["laws"]
    assert (told["law"], told["in_words"], told["gain"], told["held_out_gain"]) == ("mass", "another force", -3.0, 1.0)
    assert told["values"]["mass"]["value"] == pytest.approx(0.006, rel=0.02)
    assert told["values"]["mass"]["unit"] == "kg"


def test_two_missing_effects_are_told_with_their_strengths(two_masses: TwoMasses, kept_rounds: Store) -> None:
    case, campaign = two_masses({"mass at tip": 0.006}), read_campaign(Path("campaign"))
    result = diagnose_case(read_case(case, campaign).setup, campaign, store=kept_rounds)
    (best,) = result.diagnosis.verdict.effects
    further = next(item for item in result.diagnosis.refits if item.name != best.name)
    together = replace(best, beside=further.effect)
    # The values of the further effect come last.
    values, variances = (
        np.append(first, second[-1:])
        for first, second in (
            (best.fit.values, further.fit.values),
            (np.diag(best.fit.covariance), np.diag(further.fit.covariance)),
        )
    )
    fit = replace(best.fit, values=values, covariance=np.diag(variances))
    together, further = replace(together, fit=fit), replace(further, fit=fit)
    assert together.strength == best.strength
    first, second = (Finalist(refit=item, arrangement=result.diagnosis.arrangement) for item in (together, further))
    pair = Pair(first=first, second=second, alone=second, alternatives=(), force=0.0)
    verdict = replace(result.diagnosis.verdict, effects=(together,), pair=pair)
    two = replace(result, diagnosis=replace(result.diagnosis, verdict=verdict))
    # The further one is a factor on the density.
    assert re.match(
        rf"Mass at tip \(.*\) is missing, and {further.name} is 1\.\d+ .* as large as the case says: the held",
        format_headline(two),
    )
    assert list_stages(two)[-1].name == f"with mass at tip and {further.name}"
    assert "writes the first into the case" in choose_advice(two)
    told = make_document(two)["further"]
    assert (told["effect"], told["strength"]) == (further.name, pytest.approx(values[-1]))
    assert make_document(two)["named"][0]["strength"] == pytest.approx(best.strength)
    assert [row.effect.name for row in list_rows(two) if row.named] == ["mass at tip", further.name]
    page = make_files(two, history_of(case), case)["chain_diagnosis.html"].decode()
    assert "Two effects are missing" in page
    # Another effect may be the second one.
    other = replace(further, effect=replace(best.effect, name="mass at base"))
    open_second = replace(pair, second_alternatives=(Finalist(refit=other, arrangement=first.arrangement),))
    verdict = replace(verdict, finding=Finding.AMBIGUOUS, pair=open_second)
    doubtful = replace(two, diagnosis=replace(result.diagnosis, verdict=verdict))
    assert re.match(
        rf"Mass at tip \(.*\) is missing, and also {further.name} \(.*\) or mass at base", format_headline(doubtful)
    )
    assert choose_advice(doubtful).endswith("diagnose again for the second")
    assert [item["effect"] for item in make_document(doubtful)["further_alternatives"]] == ["mass at base"]


def test_candidates_stand_by_their_fall_of_chi2_the_named_and_the_fitted_first(
    two_masses: TwoMasses, kept_rounds: Store
) -> None:
    case, folder = two_masses({"mass at tip": 0.006}), Path("campaign")
    setup = read_case(case, campaign := read_campaign(folder)).setup
    listed = list_rows(diagnose_case(setup, campaign, store=kept_rounds))
    fitted = [row for row in listed if row.gain is not None]
    assert listed[0].named
    assert listed[: len(fitted)] == fitted
    for part in (fitted[1:], listed[len(fitted) :]):
        gains = [row.expected if row.gain is None else row.gain for row in part]
        assert gains == sorted(gains, reverse=True)
    assert len(listed) > len(fitted) > 1
    # The first is beside itself, and the others are no more than like it.
    assert listed[0].cosine == pytest.approx(1.0, abs=1e-12)
    assert all(row.cosine is None or row.cosine < 1.0 for row in listed[1:])


def test_a_verdict_names_the_measurements_that_look_wrong(two_masses: TwoMasses, kept_rounds: Store) -> None:
    case, folder = two_masses({"mass at tip": 0.006}), Path("campaign")
    swapped = Suspicion(where='test "sine", repeat 2', sentence="were their cables swapped?")
    setup = read_case(case, campaign := read_campaign(folder)).setup
    sound = diagnose_case(setup, campaign, store=kept_rounds)
    remark = replace(sound, suspicions=[replace(swapped, remark=True)])
    assert (format_headline(remark), choose_advice(remark)) == (format_headline(sound), choose_advice(sound))
    wrong = replace(sound, suspicions=[swapped])
    assert (
        format_headline(wrong)
        == f'{format_headline(sound)} But some of these measurements look wrong: test "sine", repeat 2.'
    )
    assert choose_advice(wrong).startswith("check the measurements")
    assert make_document(wrong)["suspicions"] == [str(swapped)]
    shown = make_files(wrong, history_of(case), case)[f"{case.stem}_diagnosis.html"].decode()
    assert "but some measurements look wrong</div>" in shown
    assert "were their cables swapped?" in shown


def test_a_verdict_of_nothing_says_that_no_case_explains_a_change_with_the_time(
    two_masses: TwoMasses, kept_rounds: Store
) -> None:
    case, folder = two_masses({"mass at tip": 0.006}), Path("campaign")
    setup = read_case(case, campaign := read_campaign(folder)).setup
    missing = diagnose_case(setup, campaign, store=kept_rounds)
    verdict = replace(missing.diagnosis.verdict, finding=Finding.NOTHING, effects=())
    sound = replace(missing, diagnosis=replace(missing.diagnosis, verdict=verdict))
    changed = Suspicion(where='test "sine"', sentence="wear?", headline='test "sine" changed', of_time=True)
    is_open, swapped = replace(changed, remark=True), Suspicion(where='test "sine", repeat 2', sentence="swapped?")
    for suspicion, tag in ((changed, "from the mean of the repeats"), (is_open, "unless the structure changed")):
        result = replace(sound, suspicions=[suspicion])
        assert format_headline(result) == f'{format_headline(sound)} But test "sine" changed.'
        assert choose_advice(result).startswith("find out what changed from repeat to repeat")
        assert tag in choose_tag(result)
        assert "look wrong" not in choose_tag(result)
    # A mistake comes first; and beside an effect that is missing, what is open counts for little.
    wrong = replace(sound, suspicions=[changed, swapped])
    assert choose_advice(wrong).startswith("check the measurements")
    assert choose_tag(wrong).endswith("from the mean of the repeats, but some measurements look wrong")
    assert format_headline(replace(missing, suspicions=[is_open])) == format_headline(missing)


@pytest.mark.parametrize(
    ("held_out", "chi2", "said"),
    [
        (0.00807, 0.72, "the held-out error falls from 2.33 to 0.807 %"),
        (
            0.02331,
            0.758,
            "the held-out reduced chi-squared falls from 0.775 to 0.758 (the held-out error stays 2.33 %)",
        ),
        (
            0.0241,
            0.758,
            "the held-out reduced chi-squared falls from 0.775 to 0.758 (the held-out error goes from 2.33 to 2.41 %)",
        ),
        (
            0.0241,
            0.812,
            "the held-out reduced chi-squared rises from 0.775 to 0.812 (the held-out error goes from 2.33 to 2.41 %)",
        ),
        (np.nan, 0.758, "the held-out reduced chi-squared falls from 0.775 to 0.758 (the held-out error is unknown)"),
    ],
)
def test_an_error_is_said_to_fall_only_if_it_does(held_out: float, chi2: float, said: str) -> None:
    assert describe_error_fall(ERRORS, ERRORS, replace(ERRORS, held_out=held_out, held_out_chi2=chi2)) == said


@pytest.mark.parametrize(
    ("calibrated", "after", "said"),
    [
        (4.76, 0.136, "from 83.7 % (nominal) to 13.6 %"),
        (0.9, 0.136, "from 90 to 13.6 %"),
        (4.76, 0.9, "from 476 to 90 %"),
    ],
)
def test_a_calibration_that_went_astray_makes_no_effect_look_better(calibrated: float, after: float, said: str) -> None:
    states = (replace(ERRORS, held_out=error) for error in (0.837, calibrated, after))
    assert describe_error_fall(*states).endswith(said)


@pytest.mark.parametrize(
    ("value", "deviation", "written"),
    [(5.24e-5, 1.05e-6, "52.4 +- 2.1 mg"), (-1.02e-4, 0.35, "0 +- 690 g"), (2e-3, 0.05, "2 +- 98 g")],
)
def test_a_value_has_as_many_digits_as_its_interval_tells(value: float, deviation: float, written: str) -> None:
    mass = EffectParameter(name="mass", unit="kg", lower=-1.0, upper=1.0, typical=0.01)
    assert format_interval(value, deviation, mass) == written


def test_titles_that_are_alike_are_told_once() -> None:
    assert join_titles("Beam", "Beam") == "Beam"
    assert join_titles("Beam", "Tests of May") == "Beam beside Tests of May"
    assert join_titles("Beam", "") == "Beam"
