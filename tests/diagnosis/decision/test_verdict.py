"""What a diagnosis says: one sentence for each of the four findings, with its numbers and units."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from diagnosis.candidate.effect import EffectParameter
from diagnosis.decision.law_of_force import FittedLaw
from diagnosis.decision.verdict import Finding, Verdict, compute_detectable_strengths, count_digits
from diagnosis.decision.wording import describe_held_out_fall
from diagnosis.fit.problem import Refit
from diagnosis.localisation import UnknownForcePlace
from diagnosis.screening import Score

MASS = EffectParameter(name="mass", unit="kg", lower=0.0, upper=1.0, typical=0.01)
RATIO = EffectParameter(name="ratio", unit="-", lower=0.5, upper=2.0, typical=1.1, vanishes=1.0)


def effect(name: str, parameter: EffectParameter) -> SimpleNamespace:
    return SimpleNamespace(name=name, kind=name.split(" ")[0], parameters=(parameter,))


def refit(what: SimpleNamespace | None, strength: float, deviation: float, held_out_error: float) -> Refit:
    # A calibration parameter comes first, whose numbers must not be told.
    numbers = [99.0] + ([] if what is None else [strength])
    fit = SimpleNamespace(values=np.array(numbers), deviation=np.array([77.0] + ([] if what is None else [deviation])))
    return Refit(effect=what, fit=fit, held_out_reduced_chi2=1.0, error=held_out_error, held_out_error=held_out_error)  # type: ignore[arg-type]


BEFORE = refit(None, 0.0, 0.0, 0.034)
TIP = refit(effect("mass at tip z", MASS), 0.0123, 0.0005, 0.0021)
LINE = refit(effect("gap of left", RATIO), 1.2, 0.1, 0.0022)


def verdict(finding: Finding, *effects: Refit, place: UnknownForcePlace | None = None) -> str:
    return made(finding, *effects, place=place).sentence


def made(finding: Finding, *effects: Refit, place: UnknownForcePlace | None = None) -> Verdict:
    return Verdict(
        finding=finding, effects=effects, baseline=BEFORE, threshold=12.4,
        detectable={"mass at tip z": 0.00123, "gap of left": 0.05, "unseen": float("inf")},
        units={"mass at tip z": "kg", "gap of left": "-", "unseen": "m"}, place=place,
    )  # fmt: skip


def test_one_effect_is_missing() -> None:
    assert verdict(Finding.MISSING, TIP) == (
        "Mass at tip z (0.0123 kg +- 0.00098) is missing: the held-out error falls from 3.4 to 0.21 %."
    )


def test_a_factor_on_the_case_is_not_missing_and_a_name_of_the_case_keeps_its_case() -> None:
    bolt = SimpleNamespace(name="bolt 2.limit_force", kind="joint parameter", parameters=(RATIO,))
    said = verdict(Finding.MISSING, refit(bolt, 0.3981, 0.0041, 0.0021))
    assert said.startswith("The value of bolt 2.limit_force is 0.3981 +- 0.008 times as large as the case says: ")
    assert verdict(Finding.MISSING, LINE).startswith("Gap of left is 1.2 +- 0.2 times as large as the case says: ")
    force = refit(effect("force at tip", MASS), 0.2, 0.01, 0.0022)
    likely = replace(made(Finding.AMBIGUOUS, TIP, force, LINE), probabilities=(0.6, 0.3, 0.1))
    assert likely.sentence.startswith(
        "Mass at tip z (0.0123 kg +- 0.00098, probability 60 %) is missing, or force at tip (0.2 kg +- 0.02, "
        "probability 30 %) is missing, or gap of left is 1.2 +- 0.2 (probability 10 %) times as large"
    )


def test_what_does_not_fall_is_not_said_to_fall() -> None:
    weak = replace(TIP, held_out_error=0.035, held_out_reduced_chi2=0.812)
    assert "the held-out reduced chi-squared falls from 1 to 0.812 (" in verdict(Finding.MISSING, weak)
    worse = replace(weak, held_out_names=("arrow",), held_out_errors=np.array([0.035]))
    before = replace(BEFORE, held_out_errors=np.array([0.034]))
    assert describe_held_out_fall(before, worse) == "the held-out error goes from 3.4 to 3.5 % in arrow"


def test_several_cannot_be_told_apart() -> None:
    assert verdict(Finding.AMBIGUOUS, TIP, LINE) == (
        "Mass at tip z (0.0123 kg +- 0.00098) is missing, or gap of left is 1.2 +- 0.2 times as large as the "
        "case says, and these data cannot tell which: the held-out error falls from 3.4 to 0.21 %."
    )


def test_what_the_held_out_data_do_not_confirm_is_told_with_doubt() -> None:
    said = verdict(Finding.AMBIGUOUS, TIP)
    assert said.startswith("Mass at tip z (0.0123 kg +- 0.00098) is missing, or a model error resembles")
    assert "cannot separate" in said


@pytest.mark.parametrize(("deviation", "finding"), [(0.1, Finding.MISSING), (0.103, Finding.AMBIGUOUS)])
def test_an_effect_whose_wider_interval_holds_none_is_told_with_doubt(deviation: float, finding: Finding) -> None:
    """A ratio of 1.2 is 0.2 from none: 1.96 standard deviations of 0.102."""
    wide = refit(effect("gap of left", RATIO), 1.2, deviation, 0.0022)
    assert made(Finding.MISSING, LINE).with_fits(BEFORE, [wide]).finding is finding


def test_another_law_of_the_force_is_told() -> None:
    law = FittedLaw(refit=TIP, gain=-1.0, held_out_gain=0.0, words="a force of the kind clearance", is_distinct=True)
    one, both = (replace(made(Finding.AMBIGUOUS, *effects), laws=[law]) for effects in ((TIP,), (TIP, LINE)))
    assert one.sentence == (
        "Mass at tip z (0.0123 kg +- 0.00098) is missing, or another force at its place: the held-out error falls from "
        "3.4 to 0.21 %. The force there may also be a force of the kind clearance."
    )
    assert both.sentence.endswith("from 3.4 to 0.21 %. The force there may also be a force of the kind clearance.")


def test_nothing_is_missing() -> None:
    said = verdict(Finding.NOTHING)
    assert said.startswith("Nothing is missing beyond noise and numerical error")
    assert "than the detection threshold (12.4)" in said
    # A list of dozens of strengths is no part of the sentence.
    assert made(Finding.NOTHING).smallest == (
        "The smallest detectable strengths are: mass at tip z 0.0012 kg, gap of left 0.05."
    )


def test_something_unknown_is_missing() -> None:
    place = UnknownForcePlace(
        name="tip z", gain=100.0, n_number=4, level=np.ones(2), amplitude=np.ones(2), stiffness=np.ones(2, complex),
        deviation=np.ones(2),
        third=np.zeros(2, complex), exponent=2.96, exponent_deviation=0.06, phase=179.6, configuration="free",
    )  # fmt: skip
    said = verdict(Finding.UNKNOWN, place=place)
    assert said == (
        "Something is missing, and it is none of the known effects: near tip z, a force that grows with amplitude to "
        "the power 3.0 +- 0.1, at 180 deg to the displacement (180 spring, 0 mass, -90 damping), in the free structure."
    )
    assert verdict(Finding.UNKNOWN) == "Something is missing, and it is none of the known effects."


def test_the_smallest_detectable_strength_gains_the_threshold() -> None:
    """A strength of one standard deviation in all gains 1; gains grow with its square."""
    none = np.zeros(1)
    score, unseen, faint = (
        Score(
            effect=effect(name, parameter), strength=parameter.vanishes, gain=0.0, size=size, absorbed=0.0,  # type: ignore[arg-type]
            direction=none, start=none, slope=none,
        )
        for name, parameter, size in (("mass", MASS, 20.0), ("far", RATIO, 0.0), ("faint", MASS, 1e-9))
    )  # fmt: skip
    result = compute_detectable_strengths([score, unseen, faint], 16.0)
    assert result["mass"] == pytest.approx(4 * 0.01 / 20)
    assert result["far"] == float("inf")
    assert result["faint"] == float("inf")  # beyond the bounds of the mass


def test_a_number_has_the_digits_that_its_interval_leaves() -> None:
    numbers = (0.99996, 0.00024), (918.3, 29.0), (1.0, 0.0), (0.0, 1.0)
    assert [count_digits(*item) for item in numbers] == [5, 4, 4, 4]
    assert f"{0.99996:.{count_digits(0.99996, 0.00024)}g}" == "0.99996"
    assert count_digits(12345.6789, 0.02) == 8
