"""``stickslip calibrate``: write the fitted calibration parameters and the values of the added effects into a case."""

from pathlib import Path

from correlation.errors import CampaignError
from study.case.setup import read_case, require_loads
from study.compare.suspicions import require_testable
from study.diagnose.add import CaseEditError, as_written, save_step
from study.diagnose.edit import edit_case, list_changes
from study.diagnose.history import CALIBRATION, HistoryStep, hash_case, history_of, read_text
from study.diagnose.round import summarise_errors
from study.diagnose.screen import ScreeningResult, screen_case
from study.diagnose.table import list_case_values
from study.kind.registry import open_case
from study.measured_campaign import read_measured
from study.run_context import RunContext


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
    return write_calibration(case, folder, screen_file(case, folder, run, without), text)


def screen_file(case: Path, folder: Path, run: RunContext, without: tuple[str, ...] = ()) -> ScreeningResult:
    """`screen_case` of a case file and a campaign folder.

    Raises
    ------
    CaseError, CampaignError
        An error in them, or a campaign without steady states, repeats or held-out data.
    """
    open_case(case)  # mistakes of the file itself come first
    campaign = read_measured(folder, run)
    if not len(campaign.measurement):
        raise CampaignError(f"{folder} has no steady states, by which effects are screened: add a test with levels")
    require_testable(campaign, folder)
    setup = require_loads(read_case(case, campaign, run)).setup
    return screen_case(setup, campaign, without=without, store=run.store, progress=run.progress)


def write_calibration(case: Path, folder: Path, screened: ScreeningResult, text: str) -> HistoryStep:
    """Write a fit into a case, and note it in the history.

    Parameters
    ----------
    case, folder
        Its file and campaign.
    screened
        The fit.
    text
        Text of the file when it was read for the fit.

    Raises
    ------
    CaseEditError
        The case has nothing to fit, or another text now.
    """
    values = list_case_values(screened.setup, screened.baseline)
    if not values["calibrated"] and not values["added"]:
        raise CaseEditError(f"{case}: there is no calibration parameter to fit: give one in [accepted]")
    if read_text(case) != text:
        raise CaseEditError(f"{case}: was edited during the fit, which is not written: calibrate again")
    added = {effect: as_written(numbers) for effect, numbers in values["added"].items()}
    new = edit_case(text, added, as_written(values["calibrated"]), str(case))
    drawn, after = summarise_errors(screened.uncalibrated), summarise_errors(screened.baseline)
    step = HistoryStep(
        what=CALIBRATION, effect=CALIBRATION, campaign=str(folder.resolve()), calibrated=values["calibrated"],
        before=None if screened.setup.added or screened.setup.calibrated else drawn, after=after, drawn=drawn,
        accepted=None if screened.setup.added else after, case_before=text, case_after=new,
        diff=list_changes(text, new, case.name), case_key=hash_case(new),
    )  # fmt: skip
    return save_step(case, history_of(case), step, new)
