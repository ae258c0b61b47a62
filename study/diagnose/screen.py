"""Screening of a case: a diagnosis that ends when every effect has a score and the calibration is tested."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from correlation.campaign.measurement import Campaign
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.problem import Refit
from diagnosis.fit.refit import baseline_fit
from diagnosis.screening import Score
from pipeline.progress import Progress, SilentProgress
from pipeline.store import Store
from study.case.setup import Setup
from study.diagnose.round import Steps, diagnose_case, prepare_setup

#: Last step of a diagnosis that a screening needs.
LAST = "scores"


@dataclass(frozen=True, kw_only=True, eq=False)
class ScreeningResult:
    """What a diagnosis knows after its screening.

    Parameters
    ----------
    setup
        The case, with the sensors of the campaign.
    arrangement
        Measurements beside the model, with the fit of the calibration parameters and the added effects.
    scores
        Scores of all candidates, best first.
    uncalibrated, baseline
        The case without anything that was calibrated or added, and the fit of the arrangement, both tested on the
        held-out data.
    """

    setup: Setup
    arrangement: Arrangement
    scores: Sequence[Score]
    uncalibrated: Refit
    baseline: Refit


class _EnoughError(Exception):
    """Ends a diagnosis after its screening."""


def screen_case(
    setup: Setup,
    campaign: Campaign,
    *,
    without: Sequence[str] = (),
    store: Store | None = None,
    progress: Progress | None = None,
) -> ScreeningResult:
    """Screen the effects of a case; a diagnosis with the same store goes on from here.

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
    found: dict[str, Any] = {}

    def watch(name: str, value: object) -> None:
        found[name] = value
        if name == LAST:
            raise _EnoughError

    with suppress(_EnoughError):
        diagnose_case(setup, campaign, without=without, store=store, progress=progress, watch=watch)
    own, _ = prepare_setup(setup, campaign, store)
    run_step = Steps(store, own, campaign, tuple(sorted({*own.without, *without})))
    arrangement: Arrangement = found.get("branches", found["arrangement"])
    with progress.step("test of the calibration", expected=3):
        baseline = run_step("calibrated", lambda: baseline_fit(arrangement))
        uncalibrated = run_step("as drawn", lambda: arrangement.test_uncalibrated(own.model))
    return ScreeningResult(
        setup=own, arrangement=arrangement, scores=found[LAST], uncalibrated=uncalibrated, baseline=baseline
    )
