"""Screening of a case: the first part of a diagnosis, up to the scores of all effects and the tested calibration."""

from collections.abc import Sequence
from dataclasses import dataclass

from correlation.campaign.measurement import Campaign
from diagnosis.diagnose import calibrate_model, screen_effects
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.problem import Refit
from diagnosis.fit.refit import make_baseline_refit
from diagnosis.screening import Score
from fe.blas_threads import one_blas_thread
from pipeline.progress import Progress, SilentProgress
from pipeline.store import Store
from study.case.setup import Setup
from study.diagnose.progress import phases
from study.diagnose.round import Steps, prepare_setup


@dataclass(frozen=True, kw_only=True, eq=False)
class ScreeningResult:
    """Result of the screening of a diagnosis.

    Parameters
    ----------
    setup
        The case, with the sensors of the campaign.
    arrangement
        Measurements and model, with the fit of the calibration parameters and the added effects.
    scores
        Scores of all candidates, best first.
    uncalibrated, baseline
        The case without calibrated values and added effects, and the fit of the arrangement, both tested on the
        held-out data.
    """

    setup: Setup
    arrangement: Arrangement
    scores: Sequence[Score]
    uncalibrated: Refit
    baseline: Refit


def screen_case(
    setup: Setup,
    campaign: Campaign,
    *,
    without: Sequence[str] = (),
    store: Store | None = None,
    progress: Progress | None = None,
) -> ScreeningResult:
    """Screen the effects of a case; a diagnosis with the same store continues from here.

    Parameters
    ----------
    setup, campaign, without, store, progress
        As in `study.diagnose.round.diagnose_case`.

    Raises
    ------
    CampaignError, EffectError
        As there.
    """
    store, progress = store or Store(None), progress or SilentProgress()
    setup, _ = prepare_setup(setup, campaign, store)
    without = tuple(sorted({*setup.without, *without}))
    run_step = Steps(store, setup, campaign, without)
    with one_blas_thread(), phases(progress, run_step.is_stored, len(setup.added) + 1) as shown:
        watched = shown.watched(run_step)
        result = calibrate_model(
            campaign, setup.model, setup.calibration_parameters, setup.budget, added=setup.added, without=without,
            extra=setup.effect_files, run_step=watched, report=shown.report,
        )  # fmt: skip
        scores = screen_effects(result.screening, result.effects, watched, shown.report, result.progress)
    arrangement = result.arrangement
    with progress.step("test of the calibration", expected=3):
        baseline = run_step("calibrated", lambda: make_baseline_refit(arrangement))
        uncalibrated = run_step("nominal", lambda: arrangement.test_uncalibrated(setup.model))
    return ScreeningResult(
        setup=setup, arrangement=arrangement, scores=scores, uncalibrated=uncalibrated, baseline=baseline
    )
