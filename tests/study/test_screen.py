"""A screening is the first part of a diagnosis, a calibration its fit, and a verdict is of the case as it was read."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from correlation.campaign.read_campaign import read_campaign
from correlation.prediction import Predictor
from geometry.errors import InputError
from pipeline.store import Store
from study.case.setup import read_case
from study.diagnose import run as diagnose_run
from study.diagnose.add import add, undo
from study.diagnose.calibrate import calibrate_case, screen_file, take_fit, write_calibration
from study.diagnose.history import hash_case, history_of, read_text
from study.diagnose.round import Round, diagnose_case, summarise_errors
from study.diagnose.run import diagnose_file
from study.diagnose.screen import screen_case
from study.diagnose.table import list_factors
from study.run_context import silent_run
from tests.slow import slow
from tests.study.conftest import TwoMasses

HIDDEN = {"mass at tip": 0.006}
FOLDER = Path("campaign")


@pytest.fixture
def diagnosed(two_masses: TwoMasses) -> Callable[[Store | None], Round]:
    """Diagnoses the two masses."""
    case = two_masses(HIDDEN)
    campaign = read_campaign(FOLDER)
    return lambda store: diagnose_case(read_case(case, campaign).setup, campaign, store=store)


def test_a_screening_has_the_scores_and_errors_of_the_diagnosis(
    diagnosed: Callable[[Store | None], Round], kept_rounds: Store
) -> None:
    campaign = read_campaign(FOLDER)
    screened, whole = screen_case(read_case("chain.toml", campaign).setup, campaign), diagnosed(kept_rounds)
    assert [(score.effect.name, score.gain) for score in screened.scores] == [
        (score.effect.name, score.gain) for score in whole.diagnosis.scores
    ]
    assert summarise_errors(screened.baseline) == summarise_errors(whole.diagnosis.baseline)
    assert summarise_errors(screened.uncalibrated) == summarise_errors(whole.uncalibrated)


@slow
def test_a_diagnosis_goes_on_from_its_screening(
    diagnosed: Callable[[Store | None], Round], monkeypatch: pytest.MonkeyPatch
) -> None:
    store, campaign = Store(Path("kept")), read_campaign(FOLDER)
    screen_case(read_case("chain.toml", campaign).setup, campaign, store=store)
    calls, predict = [0], Predictor.predict

    def counted(*arguments):  # type: ignore[no-untyped-def]
        calls[0] += 1
        return predict(*arguments)

    monkeypatch.setattr(Predictor, "predict", counted)
    diagnosed(store)
    from_there, calls[0] = calls[0], 0
    diagnosed(None)
    assert 0 < from_there < calls[0]


def test_a_calibration_writes_the_fit_of_the_diagnosis_and_undo_takes_it_back(two_masses: TwoMasses) -> None:
    case = two_masses({})
    drawn = read_text(case)
    run = replace(silent_run(), store=Store(Path("kept")))
    step = calibrate_case(case, FOLDER, run)
    screened = screen_file(Path("chain.toml"), FOLDER, run)
    written = read_case(case).setup.calibrated
    # Six digits are written, and a fit from its own result stays there within what a fit calls enough.
    assert written.keys() == {item.name for item in screened.setup.calibration_parameters}
    np.testing.assert_allclose(written["zeta"], 1.1, rtol=0.02)
    for name, (value, deviation) in list_factors(screened.setup, screened.baseline).items():
        assert abs(written[name] - value) < 0.5 * deviation
    assert step.after is not None
    assert step.before is not None
    assert step.after.training_chi2 < step.before.training_chi2
    assert undo(case).effect == "calibration"
    assert read_text(case) == drawn
    with pytest.raises(InputError):
        undo(case)


def test_a_case_that_is_edited_during_the_fit_is_not_written(two_masses: TwoMasses) -> None:
    case = two_masses({})
    text = read_text(case)
    screened = screen_file(case, FOLDER, silent_run())
    case.write_text(text + "# mine\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"chain\.toml"):
        write_calibration(case, FOLDER, take_fit(screened), text)
    assert read_text(case) == text + "# mine\n"
    assert history_of(case).steps == ()


def test_a_verdict_is_of_the_case_as_it_was_diagnosed(two_masses: TwoMasses, monkeypatch: pytest.MonkeyPatch) -> None:
    case = two_masses(HIDDEN)
    text = read_text(case)

    def edit_and_diagnose(*args: Any, **options: Any) -> Round:
        case.write_text(text.replace("highest = 3", "highest = 4"), encoding="utf-8")
        return diagnose_case(*args, **options)

    monkeypatch.setattr(diagnose_run, "diagnose_case", edit_and_diagnose)
    diagnose_file(case, read_campaign(FOLDER), FOLDER, without=["spring", "dashpot", "cubic"])
    assert history_of(case).steps[-1].case_key == hash_case(text)
    with pytest.raises(InputError, match="edited"):
        add(case, "mass at tip")
