"""The test: what the held-out error must do before an effect is named."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.candidate.effect import EffectParameter
from diagnosis.decision.verdict import Finding, Verdict
from diagnosis.fit.problem import Refit
from diagnosis.screening import Score
from diagnosis.time_record.held_out import MAX_EXCESS_RATIO, judge_records

QUIET = np.zeros(1)
LEVEL = np.random.default_rng(3).uniform(0.5, 1.5, 20)


def refit(name: str, blocks: NDArray[np.float64]) -> Refit:
    parameter = EffectParameter(name="mass", unit="kg", lower=0.0, upper=1.0, typical=0.01)
    effect = SimpleNamespace(name=name, kind="mass", parameters=(parameter,)) if name else None
    # A calibration parameter comes first, whose numbers must not be told.
    fit = SimpleNamespace(values=np.array([99.0, 0.0123]), deviation=np.array([77.0, 0.0005]), n_number=3)
    error = np.sqrt(blocks.mean(keepdims=True))
    return Refit(
        effect=effect, fit=fit, held_out_reduced_chi2=float(error[0] ** 2),  # type: ignore[arg-type]
        error=float(error[0]), held_out_error=float(error[0]), held_out_errors=error, held_out_names=("arrow",),
        blocks=blocks,
    )  # fmt: skip


BEFORE = refit("", 0.01 * LEVEL)


def judged(*refits: Refit, floor: NDArray[np.float64] = QUIET) -> Verdict:
    return judge_records(BEFORE, refits, floor)


def test_an_error_that_falls_everywhere_names_its_effect() -> None:
    verdict = judged(refit("mass at tip", 0.25 * BEFORE.blocks))
    assert verdict.finding is Finding.MISSING
    assert verdict.sentence == (
        "Mass at tip (0.0123 kg +- 0.00098) is missing: the held-out error falls from "
        f"{100 * BEFORE.held_out_error:.3g} to {50 * BEFORE.held_out_error:.3g} % in arrow."
    )


def test_an_error_that_hardly_falls_names_nothing() -> None:
    # The error is the root of the blocks' squares.
    assert judged(refit("mass at tip", (MAX_EXCESS_RATIO - 0.01) ** 2 * BEFORE.blocks)).finding is Finding.MISSING
    verdict = judged(refit("mass at tip", (MAX_EXCESS_RATIO + 0.01) ** 2 * BEFORE.blocks))
    assert verdict.finding is Finding.NOTHING
    assert "No effect lowers the held-out error enough" in verdict.sentence
    assert "with the best candidate, mass at tip, it is" in verdict.sentence
    assert "no candidate would lower it" in judged().sentence
    assert "beyond the noise" in judged(floor=np.array([BEFORE.held_out_error])).sentence


def test_an_error_that_falls_in_few_blocks_names_nothing() -> None:
    loud = np.array(BEFORE.blocks)
    loud[:2] *= 50
    before = refit("", loud)
    after = np.array(loud)
    after[:2] /= 100
    one = refit("mass at tip", after)
    assert one.held_out_error < 0.5 * before.held_out_error
    assert judge_records(before, [one], QUIET).finding is Finding.NOTHING


def test_two_effects_that_do_as_well_cannot_be_told_apart() -> None:
    scatter = np.random.default_rng(4).normal(1.0, 0.05, 20)
    one, other = refit("one", 0.25 * BEFORE.blocks), refit("other", 0.25 * scatter * BEFORE.blocks)
    verdict = judged(one, other)
    assert verdict.finding is Finding.AMBIGUOUS
    assert "one (0.0123 kg +- 0.00098) or other" in verdict.sentence
    # One that does worse everywhere is no rival, even if it does well.
    assert judged(one, refit("other", 0.3 * BEFORE.blocks)).finding is Finding.MISSING


def test_the_gate_counts_what_is_above_the_noise() -> None:
    # Of 100 parts 64 are noise: a fall to 80 is one of the excess by 0.56.
    floor = np.array([0.8 * BEFORE.held_out_error])
    after = refit("mass at tip", 0.75 * BEFORE.blocks)
    assert judged(after).finding is Finding.NOTHING
    assert judged(after, floor=floor).finding is Finding.MISSING


def test_a_stand_in_leaves_too_much_above_a_known_noise() -> None:
    after = refit("mass at tip", 0.36 * BEFORE.blocks)
    assert judged(after).finding is Finding.MISSING
    verdict = judged(after, floor=np.array([0.1 * BEFORE.held_out_error]))
    assert verdict.finding is Finding.UNKNOWN
    assert "none of the known effects" in verdict.sentence
    # Where nothing passes, but more is left than noise, that is said as well.
    assert judged(floor=np.array([0.1 * BEFORE.held_out_error])).finding is Finding.UNKNOWN


def test_a_refit_that_runs_away_is_never_named() -> None:
    assert judged(refit("mass at tip", np.full(20, np.inf))).finding is Finding.NOTHING


def test_strengths_that_would_have_passed_are_told() -> None:
    # An error of 0.75 beside one of 1 makes 1.25: taking it off leaves 0.8.
    effect = SimpleNamespace(
        name="mass at tip",
        parameters=(EffectParameter(name="mass", unit="kg", lower=0.0, upper=1.0, typical=0.01),),
    )
    nothing = np.zeros(3)
    # A root mean square of three numbers, per unit of strength.
    scores = [
        Score(
            effect=effect, strength=0.0, gain=0.0, absorbed=0.5, direction=nothing, start=nothing, slope=nothing,  # type: ignore[arg-type]
            size=size * np.sqrt(3) * 0.01,
        )
        for size in (30.0, 0.0)
    ]  # fmt: skip
    verdict = judge_records(BEFORE, [], QUIET, scores[:1])
    assert verdict.detectable == {"mass at tip": pytest.approx(0.75 * BEFORE.held_out_error / 30.0)}
    assert verdict.units == {"mass at tip": "kg"}
    assert "mass at tip 0.0025 kg" in verdict.smallest
    # One that is absorbed would never have passed.
    assert judge_records(BEFORE, [], QUIET, scores[1:]).smallest == ""
