"""``stickslip calibrate``: write the fitted calibration parameters and the values of the added effects into a case."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from correlation.campaign.measurement import Campaign
from correlation.errors import CampaignError
from diagnosis.feature.diagnose import calibrate_features, find_level
from diagnosis.fit.refit import make_baseline_refit
from study.case.setup import Setup, read_case, require_loads
from study.compare.suspicions import require_testable
from study.diagnose.add import CaseEditError, as_written, save_step
from study.diagnose.edit import edit_case, list_changes
from study.diagnose.feature_data import read_setup_with_sensors, summarise_feature_errors
from study.diagnose.history import CALIBRATION, Errors, HistoryStep, hash_case, history_of, read_text
from study.diagnose.progress import phases
from study.diagnose.round import Steps, summarise_errors
from study.diagnose.screen import ScreeningResult, screen_case
from study.diagnose.table import list_case_values
from study.kind.registry import open_case
from study.measured_campaign import read_measured
from study.run_context import RunContext


@dataclass(frozen=True, kw_only=True, eq=False)
class CaseFit:
    """Fit of the calibration parameters and the added effects of a case.

    Parameters
    ----------
    setup
        The case.
    values
        Values to write, from `list_case_values`.
    before, after
        Errors of the nominal model, and of the fit.
    has_features
        Whether the data are compared through features.
    """

    setup: Setup
    values: Mapping[str, Any]
    before: Errors
    after: Errors
    has_features: bool = False


def calibrate_case(case: Path, folder: Path, run: RunContext, without: tuple[str, ...] = ()) -> HistoryStep:
    """Fit the calibration parameters and the added effects of a case, and write their values into it.

    Parameters
    ----------
    case, folder
        A case file and a campaign.
    run
        Store and progress; the fit is reused from a screening or diagnosis of the same case with this store.
    without
        Kinds of effects to leave out; they only identify the stored screening.

    Returns
    -------
    The step in the history.

    Raises
    ------
    CaseEditError
        The case has nothing to fit, or was edited meanwhile.
    CaseError, CampaignError, OutputError
        An error in the case, the campaign or the folder.
    """
    text = read_text(case)
    open_case(case)  # mistakes of the file itself come first
    campaign = read_measured(folder, run)
    if campaign.has_only_typed_data:
        fit = fit_features(case, campaign, run, without)
    else:
        fit = take_fit(screen_campaign(case, campaign, folder, run, without))
    return write_calibration(case, folder, fit, text)


def fit_features(case: Path, campaign: Campaign, run: RunContext, without: tuple[str, ...] = ()) -> CaseFit:
    """Fit a case to a campaign without steady states; parameters and errors as for `calibrate_case`."""
    setup = read_setup_with_sensors(case, campaign, run)
    run_step = Steps(run.store, setup, campaign, tuple(sorted({*setup.without, *without})))
    with phases(run.progress, run_step.is_stored, len(setup.added) + 1) as shown:
        watched = shown.watched(run_step)
        shown.report("calibration", 0.0)
        arrangement = calibrate_features(
            setup.model, campaign.data, setup.calibration_parameters, find_level(setup.model, campaign.data),
            added=setup.added, extra=setup.effect_files, run_step=watched,
        )  # fmt: skip
        fitted = watched("held-out error", lambda: make_baseline_refit(arrangement))
        nominal = watched("nominal", lambda: arrangement.test_uncalibrated(setup.model))
        shown.report("done", 1.0)
    return CaseFit(
        setup=setup, values=list_case_values(setup, fitted), before=summarise_feature_errors(nominal),
        after=summarise_feature_errors(fitted), has_features=True,
    )  # fmt: skip


def take_fit(screened: ScreeningResult) -> CaseFit:
    """The fit of a screening."""
    return CaseFit(
        setup=screened.setup, values=list_case_values(screened.setup, screened.baseline),
        before=summarise_errors(screened.uncalibrated), after=summarise_errors(screened.baseline),
    )  # fmt: skip


def screen_file(case: Path, folder: Path, run: RunContext, without: tuple[str, ...] = ()) -> ScreeningResult:
    """`screen_case` of a case file and a campaign folder.

    Raises
    ------
    CaseError, CampaignError
        An error in them, or a campaign without steady states, repeats or held-out data.
    """
    open_case(case)  # mistakes of the file itself come first
    return screen_campaign(case, read_measured(folder, run), folder, run, without)


def screen_campaign(
    case: Path, campaign: Campaign, folder: Path, run: RunContext, without: tuple[str, ...] = ()
) -> ScreeningResult:
    """`screen_file` of a campaign that was read from its folder."""
    if not len(campaign.measurement):
        raise CampaignError(f"{folder} has no steady states, by which effects are screened: add a test with levels")
    require_testable(campaign, folder)
    setup = require_loads(read_case(case, campaign, run)).setup
    return screen_case(setup, campaign, without=without, store=run.store, progress=run.progress)


def write_calibration(case: Path, folder: Path, fit: CaseFit, text: str) -> HistoryStep:
    """Write a fit into a case, and note it in the history.

    Parameters
    ----------
    case, folder
        Its file and campaign.
    fit
        The fit.
    text
        Text of the file when it was read for the fit.

    Raises
    ------
    CaseEditError
        The case has nothing to fit, or another text now.
    """
    values = fit.values
    if not values["calibrated"] and not values["added"]:
        raise CaseEditError(f"{case}: there is no calibration parameter to fit: give one in [accepted]")
    if read_text(case) != text:
        raise CaseEditError(f"{case}: was edited during the fit, which is not written: calibrate again")
    added = {effect: as_written(numbers) for effect, numbers in values["added"].items()}
    new = edit_case(text, added, as_written(values["calibrated"]), str(case))
    # Errors of features are in standard deviations, and not in one chart with relative ones.
    step = HistoryStep(
        what=CALIBRATION, effect=CALIBRATION, campaign=str(folder.resolve()), calibrated=values["calibrated"],
        before=None if fit.setup.added or fit.setup.calibrated else fit.before, after=fit.after,
        drawn=None if fit.has_features else fit.before,
        accepted=None if fit.has_features or fit.setup.added else fit.after, case_before=text, case_after=new,
        diff=list_changes(text, new, case.name), case_key=hash_case(new),
    )  # fmt: skip
    return save_step(case, history_of(case), step, new)
