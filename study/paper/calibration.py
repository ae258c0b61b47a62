"""``stickslip study calibrate``: the calibration by hand of the paper, for a user's case of a rig and campaign."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from casefile.table import load_case
from correlation.errors import CampaignError
from figure.registry import pictures
from geometry.errors import InputError
from pipeline.parallel import process_pool
from pipeline.progress import SilentProgress
from study.case.setup import read_case
from study.estimate.first_estimate import FirstEstimate, choose_estimate
from study.estimate.run import estimate_all
from study.kind.registry import open_case
from study.measured_campaign import read_measured
from study.paper.by_hand import POOL_MODULES, ByHand, calibrate_by_hand, calibrate_linear_stage, make_hand_document
from study.paper.calibration_page import make_calibration_page
from study.paper.case import PaperCase
from study.paper.case_file import write_parameters
from study.paper.limits import rename_by_line
from study.paper.model import PaperModel
from study.paper.pictures import draw_by_hand
from study.paper.plan import make_case_plan
from study.paper.replay import quicken
from study.run_context import RunContext
from study.shipped_cases import PAPER

KIND = "rig"
PAGE = "calibration.html"


@dataclass(frozen=True, kw_only=True, eq=False)
class Calibration:
    """A case calibrated by hand.

    Parameters
    ----------
    title
        Title of the case.
    guesses
        First guesses of kt and mu, if the campaign has the data for them.
    hand
        Iterations and intervals.
    missing
        What was not done and why, one sentence each.
    files
        Written files; the calibrated case is the last but one, the page the last one.
    """

    title: str
    guesses: tuple[FirstEstimate, ...]
    hand: ByHand
    missing: tuple[str, ...]
    files: tuple[Path, ...] = ()

    def document(self) -> dict[str, Any]:
        """For ``--json``."""
        return {
            "missing": list(self.missing),
            "first_guess": {item.parameter: item.value for item in self.guesses},
            **make_hand_document(self.hand),
            "files": [str(file) for file in self.files],
        }

    def text(self) -> str:
        """For people."""
        words = {True: "yes", False: "no", None: "-"}
        lines = ["  linear      free  stuck"]
        lines += [
            f"  {number}           {words[item.own.free_met]:4}  {words[item.own.stuck_met]}"
            for number, item in enumerate(self.hand.linear.iterations, start=1)
        ]
        lines += ["", "  nonlinear   response  force"]
        lines += [
            f"  {item.number}           {words[item.response.met]:8}  {words[item.force.met]}"
            for item in self.hand.nonlinear.iterations
        ]
        lines += ["", *self.missing] if self.missing else []
        case, page = self.files[-2:]
        return "\n".join([*lines, "", f"calibrated case: {case}", f"page: {page}"])


def run_calibration(case: Path, folder: Path, run: RunContext, *, quick: bool) -> Calibration:
    """Calibrate by hand, and write page, figures and the calibrated case.

    Parameters
    ----------
    case, folder
        Case of kind "rig", and campaign.
    run
        Output folder, store and progress.
    quick
        Few points and evaluations, to try it.

    Raises
    ------
    CaseError, CampaignError, InputError
        An error in the case or the campaign, or a case of another kind.
    ComputationFailed
        No resonance in the tests, no rest under the dead weights, or a process that was killed.
    """
    opened, paper = open_case(case), load_case(PAPER, PaperCase)
    if opened.kind.name != KIND:
        raise InputError(
            f'{case}: kind = "{opened.kind.name}" has no dead weights to shift and no load cells: give a case of kind '
            f'"{KIND}", or calibrate this one with stickslip compare {case} {folder} --calibrate-families'
        )
    paper = quicken(paper) if quick else paper
    campaign = rename_by_line(read_measured(folder, run))
    if not len(campaign.measurement):
        raise CampaignError(f"{folder} has no stepped sines: limits are compared with amplitudes of steady states")
    opened.kind.structure(opened, run)  # reduced with progress; the models that follow find it in the store
    silent = replace(run, progress=SilentProgress(), quiet=True)
    model = PaperModel(opened=opened, campaign=campaign, run=silent, effort=paper.effort)
    warnings: list[str] = []
    estimates = tuple(estimate_all(read_case(opened, campaign, silent).setup.model, campaign, warnings))
    guesses = tuple(item for name in ("kt", "mu") if (item := choose_estimate(estimates, name)) is not None)
    mu = next((item.value for item in guesses if item.parameter == "mu"), opened.case.structure.contact.mu)
    plan = make_case_plan(opened.case, paper)
    begun = calibrate_linear_stage(plan, model, mu, run)
    with process_pool(POOL_MODULES) as executor:
        hand = calibrate_by_hand(plan, model, begun, run, executor)
    missing = [*warnings, *hand.missing]
    if opened.case.added or opened.case.calibrated.given:
        missing.append("[calibrated] and [[added]] of the case are left out: the iterations set the values themselves.")
    result = Calibration(title=opened.title, guesses=guesses, hand=hand, missing=tuple(missing))
    with run.progress.step("figures"):
        drawn = pictures(draw_by_hand(hand, model))
    text = opened.path.read_text(encoding="utf-8")
    calibrated = write_parameters(text, hand.last.parameters, model.find_ratio(hand.last.parameters))
    written: dict[str, str | bytes] = {f"{name}.png": picture for name, picture in drawn.items()}
    written[f"{case.stem}_calibrated.toml"] = calibrated
    written[PAGE] = make_calibration_page(result.title, guesses, hand, missing, drawn)
    return replace(result, files=run.write_files(written))
