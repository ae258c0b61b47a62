"""Doubts of a diagnosis: what is named, and what is not."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from correlation.campaign.measurement import Suspicion
from correlation.metric.jump_error import JumpError
from correlation.noise.error_size import NO_ERROR, ErrorSize
from diagnosis.candidate.effect import EffectParameter
from diagnosis.fit.mode_correction import PRIOR_WIDENING, FrequencyCorrection
from study.compare.report import describe_jump
from study.diagnose.doubt import list_doubts, list_notes
from study.diagnose.table import list_frequency_shifts

#: No reading stands out of the noise.
SHARES = SimpleNamespace(shares=np.zeros(3))


def result(
    values: tuple[float, ...] = (1.0,), drawn: float = 0.2, before: float = 0.1, chi2: float = -1.0,
    error: ErrorSize = NO_ERROR, best: Any = None, wrong: tuple[Suspicion, ...] = (),
) -> Any:  # fmt: skip
    factor = EffectParameter(name="factor", unit="-", lower=0.95, upper=1.05, typical=1.01, vanishes=1.0)
    parameter = SimpleNamespace(name="E", stated_deviation=0.01, parameters=(factor,))
    calibration = tuple(parameter for _ in values)
    fit = SimpleNamespace(values=np.array(values))
    return SimpleNamespace(
        uncalibrated=SimpleNamespace(held_out_reduced_chi2_by_noise=1.0, held_out_error=drawn), best=best,
        setup=SimpleNamespace(added=()), remarks=(), wrong=wrong,
        diagnosis=SimpleNamespace(
            baseline=SimpleNamespace(
                held_out_reduced_chi2_by_noise=1.0 + chi2, held_out_error=before, error=before, fit=fit, n_held_out=100,
                held_out_jumps=(),
            ),
            arrangement=SimpleNamespace(calibration=calibration, train=SHARES, held_out=SHARES),
            verdict=SimpleNamespace(model_error_size=error),
        ),
    )  # fmt: skip


def test_a_calibration_that_helps_is_not_in_doubt() -> None:
    assert list_doubts(result((1.01,))) == []


@pytest.mark.parametrize(("chi2", "doubted"), [(0.05, True), (0.03, False)])
def test_a_calibration_that_harms_is_named_with_both_errors(chi2: float, doubted: bool) -> None:
    """Of 100 held-out numbers chi^2 rises by 5, or by 3, which is below 4."""
    doubts = list_doubts(result(drawn=0.25, before=0.49, chi2=chi2))
    assert len(doubts) == doubted
    if doubted:
        assert "25 %" in doubts[0]
        assert "49 %" in doubts[0]


def test_a_calibration_that_doubles_the_error_is_named_whatever_chi_squared_says() -> None:
    """As where the model without an effect is lost: a wrong peak may be nearer to the measured one, and far larger."""
    (doubt,) = list_doubts(result(drawn=0.81, before=2.28, chi2=-0.5))
    assert "228 %" in doubt
    assert list_doubts(result(drawn=0.81, before=1.2, chi2=-0.5)) == []


@pytest.mark.parametrize(("value", "words"), [(1.035, "3.5 standard deviations"), (0.95, "at a bound of the fit")])
def test_a_parameter_far_from_the_case_is_named(value: float, words: str) -> None:
    (doubt,) = list_doubts(result((value,)))
    assert doubt.startswith("E x ")
    assert words in doubt


def test_a_shift_far_from_the_case_is_named_in_its_unit() -> None:
    found, shift = result((0.0025,)), EffectParameter(name="shift", unit="m", lower=-0.0025, upper=0.0025, typical=5e-4)
    parameter = SimpleNamespace(name="shift of lid", stated_deviation=5e-4, parameters=(shift,))
    found.diagnosis.arrangement.calibration = (parameter,)
    (doubt,) = list_doubts(found)
    assert doubt.startswith("shift of lid = 0.0025 m is at a bound of the fit")


@pytest.fixture
def jump() -> JumpError:
    return JumpError(
        free=False, level=2.0, sweep=1, falls=True, frequency=42.3, frequency_deviation=0.02, predicted_frequency=42.6,
        swept_both_ways=True,
    )  # fmt: skip


def test_a_held_out_jump_that_the_model_has_elsewhere_is_said(jump: JumpError) -> None:
    found = result()
    found.campaign = SimpleNamespace(drive=SimpleNamespace(unit="V"))
    found.diagnosis.baseline.held_out_jumps = (jump, replace(jump, level=1.0, predicted_frequency=42.31))
    doubt, between = list_doubts(found)
    assert doubt.endswith("2 V, up-sweep: jumps down at 42.3 Hz, the model at 42.6 Hz (+0.3 Hz).")
    assert between.startswith("Between a measured and a predicted jump")
    # Within the step of the sweep the jump is where it was measured.
    assert "1 V" not in doubt


@pytest.mark.parametrize(("missing", "words"), [
    ({"predicted_frequency": math.nan}, "jumps down at 42.3 Hz, the model does not"),
    ({"frequency": math.nan}, "the model jumps down at 42.6 Hz, the measured response does not"),
])  # fmt: skip
def test_a_held_out_jump_that_only_one_of_both_has_is_said(
    missing: dict[str, float], words: str, jump: JumpError
) -> None:
    found = result()
    found.campaign = SimpleNamespace(drive=SimpleNamespace(unit="V"))
    found.diagnosis.baseline.held_out_jumps = (replace(jump, **missing),)
    (doubt,) = list_doubts(found)
    assert words in doubt
    # What one sweep measured may be a steep flank, and is told as such where it is told.
    assert ("one sweep cannot tell" in describe_jump(replace(jump, swept_both_ways=False, **missing), "V")) == (
        "predicted_frequency" in missing
    )
    found.diagnosis.baseline.held_out_jumps = (replace(jump, swept_both_ways=False, **missing),)
    assert len(list_doubts(found)) == ("frequency" in missing)


@pytest.mark.parametrize(("value", "doubted"), [(1.0094, True), (0.9906, True), (1.0086, False)])
def test_a_natural_frequency_beyond_what_the_case_states_is_in_doubt(value: float, doubted: bool) -> None:
    """Stated are 0.3 %, of which a fit allows for more."""
    factor = EffectParameter(name="factor", unit="-", lower=0.97, upper=1.03, typical=1.01, vanishes=1.0)
    correction = FrequencyCorrection(
        name="natural frequency 1", physics="", deviation=0.003 * PRIOR_WIDENING, parameters=(factor,), n_dof=8
    )
    found = result((value,))
    found.diagnosis.arrangement.calibration = (correction,)
    doubts = list_doubts(found)
    assert len(doubts) == doubted
    if doubted:
        assert "3.1 standard deviations of its prior" in doubts[0]
    found.setup.calibration_parameters = (correction,)
    found.diagnosis.baseline.fit.deviation = np.array([1e-4])
    # The fit multiplies the model's frequency by the value: the model itself is off the other way.
    shifts = list_frequency_shifts(found.setup, found.diagnosis.baseline)
    assert shifts == {"natural frequency 1": pytest.approx(1 / value - 1)}


def test_what_the_model_errs_by_is_a_note_and_no_doubt() -> None:
    found = result(error=ErrorSize(frequency=0.003))
    (note,) = list_notes(found)
    assert "0.3 % in natural frequencies" in note
    assert list_doubts(found) == []
    assert list_notes(result()) == []


def test_a_large_held_out_error_that_is_left_is_said() -> None:
    fit = SimpleNamespace(values=np.array([1.0]))
    best = SimpleNamespace(
        held_out_reduced_chi2_by_noise=30.0,
        held_out_error=0.33,
        error=0.12,
        name="density of all",
        label="density of all",
        fit=fit,
        held_out_jumps=(),
    )
    (doubt,) = list_doubts(result(drawn=5.0, before=4.8, best=best))
    assert doubt.startswith(
        "With density of all the error of the model is still 33 % on the held-out data (12 % on the training data)"
    )
    # Noise may be as large.
    best.held_out_reduced_chi2_by_noise = 1.1
    assert list_doubts(result(drawn=5.0, before=4.8, best=best)) == []


def test_errors_that_nothing_tells_are_said_to_be_unknown() -> None:
    (doubt,) = list_doubts(result(drawn=np.nan, before=np.nan))
    assert "unknown" in doubt
    assert "no motion exceeds" in doubt


def test_what_looks_wrong_in_the_measurements_comes_first() -> None:
    swapped = Suspicion(where='test "sine", repeat 2', sentence="were their cables swapped?")
    assert list_doubts(result((1.035,), wrong=(swapped,)))[0] == 'test "sine", repeat 2: were their cables swapped?'
