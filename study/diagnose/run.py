"""``stickslip diagnose``: missing effects of a case as text, page and files; with ``--auto`` until none is missing."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from correlation.campaign.measurement import Campaign
from correlation.data_type.linear_state import count_free_responses
from correlation.errors import CampaignError
from correlation.sensor_placement import with_sensors
from diagnosis.decision.verdict import Finding
from diagnosis.fit.problem import Refit
from study.case.setup import Setup, read_case, require_loads
from study.compare.suspicions import find_all_suspicions, require_testable
from study.diagnose.add import add
from study.diagnose.data_run import DataDiagnosisResult, run_data_diagnosis
from study.diagnose.document import make_document
from study.diagnose.history import (
    ADD,
    CALIBRATION,
    DIAGNOSIS,
    UNDO,
    History,
    HistoryStep,
    hash_case,
    history_of,
    read_text,
)
from study.diagnose.report import format_headline, format_report
from study.diagnose.round import MOST_ADDED, Round, Steps, diagnose_case, summarise_errors
from study.diagnose.table import list_case_values
from study.json_value import to_json
from study.kind.registry import open_case
from study.measured_campaign import read_measured
from study.merge_sentences import merge_suspicions
from study.run_context import RunContext


@dataclass(frozen=True, kw_only=True, eq=False)
class DiagnosisResult:
    """Result of the command.

    Parameters
    ----------
    rounds
        Rounds in their order; each but the last added the effect that it named.
    history
        History of the case.
    files
        Written files.
    """

    rounds: tuple[Round, ...]
    history: History
    files: tuple[Path, ...] = ()

    @property
    def last(self) -> Round:
        """The latest round."""
        return self.rounds[-1]


def run_diagnose(
    case: Path, folder: Path, run: RunContext, *, without: Sequence[str] = (), auto: bool = False, trials: int = 0
) -> DiagnosisResult | DataDiagnosisResult:
    """Diagnose, record it in the history of the case, and write page, figures and JSON.

    Parameters
    ----------
    case
        A case file; `auto` edits it.
    folder
        A campaign.
    run
        Output folder, store and progress.
    without
        Kinds of effects to leave out.
    auto
        Whether to add a missing effect and diagnose the case again.
    trials
        See `study.diagnose.round.diagnose_case`.

    Raises
    ------
    CaseError, CampaignError, EffectError, OutputError
        An error in the case, the campaign, the kinds or the folders.
    """
    assert run.output is not None
    open_case(case)  # mistakes of the file itself come first
    campaign = read_measured(folder, run)
    if campaign.has_only_typed_data:
        return run_data_diagnosis(case, campaign, folder, run, without=without, auto=auto)
    diagnosed = diagnose_file(case, campaign, folder, run, without=without, auto=auto, trials=trials)
    from study.diagnose.page import make_files

    with run.progress.step("page and figures", expected=10):
        drawn = make_files(diagnosed.last, diagnosed.history, case)
    table = f"{case.stem}_diagnosis.json"
    diagnosed = replace(diagnosed, files=tuple(run.output / name for name in (*drawn, table)))
    document = json.dumps(to_json(make_full_document(diagnosed)), indent=1, ensure_ascii=False).encode()
    run.write_files({**drawn, table: document})
    return diagnosed


def diagnose_file(
    case: Path,
    campaign: Campaign,
    folder: Path,
    run: RunContext | None = None,
    *,
    without: Sequence[str] = (),
    auto: bool = False,
    trials: int = 0,
) -> DiagnosisResult:
    """`run_diagnose` of steady states that writes the history of the case only, and with `auto` the case itself.

    Raises
    ------
    CaseError, CampaignError, EffectError
        An error in the case, the campaign or the kinds, or a campaign without steady states.
    """
    if campaign.has_only_typed_data:
        types = ", ".join(sorted({datum.type for datum in campaign.data}))
        raise CampaignError(
            f"{folder} contains no steady states but data of other types ({types}), which diagnose_file does not read: "
            "call study.diagnose.data_run.diagnose_data(case, campaign, folder), as docs/diagnose.md shows"
        )
    if not len(campaign.measurement):
        raise CampaignError(
            f"{folder} contains only time records, which this command does not read: diagnose them in Python, as "
            "docs/time_records.md shows"
        )
    require_testable(campaign, folder)
    setup = require_loads(read_case(case, campaign, run)).setup
    suspicions = None
    if run is not None:  # before what takes minutes: it may be in vain
        run_step = Steps(run.store, setup, campaign, without)
        model = with_sensors(setup.complete, campaign)
        suspicions = merge_suspicions(run_step("suspicions", partial(find_all_suspicions, campaign, model)))
        for suspicion in suspicions:
            run.warn(str(suspicion))
    campaign = _count_free_responses(setup, campaign, folder, run)
    rounds: list[Round] = []
    while True:
        key = hash_case(read_text(case))
        result = diagnose_case(
            setup,
            campaign,
            without=without,
            trials=trials,
            announce=None if run is None else run.note,
            store=None if run is None else run.store,
            progress=None if run is None else run.progress,
            workers=None if run is None else run.scheduler,
            suspicions=suspicions,
        )
        rounds.append(result)
        record_diagnosis(result, case, folder, key)
        best = result.best
        stop = result.diagnosis.verdict.finding is not Finding.MISSING or len(rounds) > MOST_ADDED
        if not auto or stop or best is None or best.effect is None:
            return DiagnosisResult(rounds=tuple(rounds), history=history_of(case))
        add(case, best.effect.name, run=run)
        setup = require_loads(read_case(case, campaign, run)).setup


def _count_free_responses(setup: Setup, campaign: Campaign, folder: Path, run: RunContext | None) -> Campaign:
    """Add frequency responses of the free structure if its model is linear; report the data that are not used."""
    counted: tuple[str, ...] = ()
    if not setup.model.without_contacts().system.joints:
        campaign, counted = count_free_responses(campaign)
    others = ", ".join(sorted({datum.type for datum in campaign.data if datum.name not in counted}))
    if run is not None and counted:
        run.note(
            f"{', '.join(counted)}: counted as steady states of the free structure at {campaign.levels[0]:.3g} "
            f"{campaign.drive.unit}, which represents all levels, since that structure is linear"
        )
    if run is not None and others:
        run.warn(
            f"{folder}: a diagnosis compares steady states, and frequency responses of the free structure; other data "
            f"({others}) are not used: stickslip compare shows them, and with --calibrate fits to both"
        )
    return campaign


def record_diagnosis(result: Round, case: Path, campaign: Path, key: str = "") -> HistoryStep:
    """Record a diagnosis in the history of its case, from which `add` takes the strengths.

    Parameters
    ----------
    result
        The round.
    case, campaign
        Its file and folder.
    key
        Hash of the diagnosed case; by default that of the present file.
    """
    history, key = history_of(case), key or hash_case(read_text(case))
    before, drawn = summarise_errors(result.diagnosis.baseline), summarise_errors(result.uncalibrated)
    added = {item.effect.name for item in result.setup.added}
    # The error with calibration parameters alone is known from a diagnosis before anything was added.
    earlier = [step.accepted for step in history.steps if step.accepted and step.campaign == str(campaign.resolve())]
    step = HistoryStep(
        what=DIAGNOSIS,
        case_key=key,
        campaign=str(campaign.resolve()),
        sentence=format_headline(result),
        finding=result.diagnosis.verdict.finding.value,
        drawn=drawn,
        accepted=before if not result.setup.added else earlier[-1] if earlier else None,
        before=before,
        candidates=[
            list_case_values(result.setup, refit)
            for refit in _list_alone(result)
            if refit.effect and refit.effect.name not in added
        ],
    )
    history = history.with_step(step)
    history.save()
    return history.steps[-1]


def _list_alone(result: Round) -> list[Refit]:
    """Fits of each effect alone: those of the finalists, and that of an effect missing besides the first."""
    pair, listed = result.diagnosis.verdict.pair, [*result.diagnosis.refits]
    if pair is not None and pair.alone.name not in {item.name for item in listed}:
        listed.append(pair.alone.refit)
    return listed


def format_full_report(diagnosed: DiagnosisResult | DataDiagnosisResult) -> str:
    """Report as text: the added effects, and the last round."""
    if isinstance(diagnosed, DataDiagnosisResult):
        return diagnosed.text()
    lines = []
    for number, result in enumerate(diagnosed.rounds[:-1]):
        assert result.best is not None
        lines.append(f"Round {number + 1}: {format_headline(result)} {result.best.name} was added to the case.")
    if lines:
        lines += ["", f"Round {len(diagnosed.rounds)}:"]
    lines += [format_report(diagnosed.last), "", *map(str, diagnosed.files)]
    return "\n".join(lines)


def make_full_document(diagnosed: DiagnosisResult | DataDiagnosisResult) -> dict[str, Any]:
    """For ``--json``."""
    if isinstance(diagnosed, DataDiagnosisResult):
        return diagnosed.document()
    return {
        **make_document(diagnosed.last),
        "rounds": [make_document(result) for result in diagnosed.rounds],
        "history": [
            make_step_document(step) for step in diagnosed.history.steps if step.what in {ADD, CALIBRATION, UNDO}
        ],
        "files": [str(file) for file in diagnosed.files],
    }


def make_step_document(step: HistoryStep) -> dict[str, Any]:
    """A step of the history."""
    return {
        "what": step.what,
        "when": step.when,
        "effect": step.effect,
        "values": {key: value for key, (value, _) in step.values.items()},
        "calibrated": {key: value for key, (value, _) in step.calibrated.items()},
        "errors_before": None if step.before is None else step.before.document,
        "errors_after": None if step.after is None else step.after.document,
        "diff": list(step.diff),
    }
