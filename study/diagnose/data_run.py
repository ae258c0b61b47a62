"""Diagnosis of a campaign without steady states: loops, ring-downs, frequency responses and modes."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from correlation.campaign.measurement import Campaign, Suspicion
from correlation.data_type.indication import Indication
from correlation.sensor_placement import with_sensors
from diagnosis.decision.verdict import Finding
from diagnosis.feature.arrangement import split_data
from diagnosis.feature.diagnose import FeatureDiagnosis, diagnose_features
from study.case.setup import Setup
from study.compare.data import compare_data, describe_coverage
from study.compare.data_view import show_data
from study.compare.page import render_sections
from study.compare.report import join_titles
from study.compare.result import Calibrated, list_calibrated
from study.compare.section.section import Section
from study.compare.sentence import Summary
from study.compare.suspicions import find_all_suspicions
from study.diagnose.add import add
from study.diagnose.advice import ADVICE
from study.diagnose.feature_data import read_setup_with_sensors, summarise_feature_errors
from study.diagnose.history import DIAGNOSIS, HistoryStep, hash_case, history_of, read_text
from study.diagnose.progress import phases
from study.diagnose.round import MOST_ADDED, Steps
from study.diagnose.table import format_fitted_strength, list_case_values
from study.json_value import to_json
from study.merge_sentences import merge_suspicions
from study.page.table import Table
from study.run_context import RunContext, silent_run

#: The next step, if it differs from that of steady states.
OWN_ADVICE = {
    Finding.UNKNOWN: (
        "look at the curves on the page; a [[joint]] of the case can have such a law (docs/case.md), or describe an "
        "effect of your own (docs/effects.md)"
    ),
    Finding.NOT_CLOSE: "check supports, masses and modes of the case, and units and places of the sensors",
}
TONE = {
    Finding.MISSING: "missing", Finding.AMBIGUOUS: "ambiguous", Finding.NOTHING: "nothing", Finding.UNKNOWN: "missing",
    Finding.NOT_CLOSE: "missing", Finding.NOT_TESTABLE: "ambiguous",
}  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class DataDiagnosisResult:
    """Result of the command.

    Parameters
    ----------
    setup
        Case, with the sensors of the campaign.
    campaign
        Measurements.
    diagnosis
        The last round.
    indications
        Direct indications of the data relative to the calibrated model.
    suspicions
        Suspicious data.
    files
        Written files.
    """

    setup: Setup
    campaign: Campaign
    diagnosis: FeatureDiagnosis
    indications: tuple[Indication, ...]
    suspicions: tuple[Suspicion, ...] = ()
    files: tuple[Path, ...] = ()

    @property
    def headline(self) -> str:
        """The verdict with strengths in suitable units."""
        verdict = self.diagnosis.verdict
        if not verdict.effects:
            return verdict.sentence
        falls = (
            f"the held-out features differ by {verdict.effects[0].held_out_error:.3g} standard deviations with it, and "
            f"by {verdict.baseline.held_out_error:.3g} without"
        )
        return verdict.name_effects(format_fitted_strength, falls, "data")

    @property
    def held_out(self) -> tuple[str, ...]:
        """Names of the data that no fit has used."""
        fitted, tested = split_data(self.campaign.data)
        return tuple(datum.name for datum in tested if datum not in fitted)

    @property
    def advice(self) -> str:
        """The next step for the user."""
        verdict = self.diagnosis.verdict
        if verdict.finding is Finding.UNKNOWN and verdict.nearest is not None:
            return (
                f'stickslip add "{verdict.nearest.name}" writes the nearest effect into the case; then diagnose the '
                "residual"
            )
        return (ADVICE | OWN_ADVICE)[verdict.finding].format(effect=verdict.effects[0].name if verdict.effects else "")

    @property
    def calibrated(self) -> tuple[Calibrated, ...]:
        """Calibration parameters."""
        fit = self.diagnosis.baseline.fit
        return list_calibrated(self.setup.calibration_parameters, fit.values, fit.deviation)

    def text(self) -> str:
        """Report as text: verdict, indications, calibration, candidates."""
        return "\n".join([*self._lines(), "", *map(str, self.files)])

    def _lines(self) -> Iterator[str]:
        yield join_titles(self.setup.title, self.campaign.title)
        yield ""
        yield self.headline
        yield f"  next: {self.advice}"
        yield ""
        if self.indications:
            yield "Trends of the data:"
            yield from (f"  {'!' if item.is_clear else ' '} {item.sentence}" for item in self.indications)
            yield ""
        fitted = [f"{item.name} x {item.factor:.4f} +- {item.half_interval:.2g}" for item in self.calibrated]
        yield f"Calibrated: {', '.join(fitted) or 'the case has no calibration parameters'}"
        baseline = self.diagnosis.baseline
        yield f"  error {baseline.error:.3g}, held out {baseline.held_out_error:.3g} standard deviations"
        yield f"  {self.tested}"
        for datum in self.campaign.data:
            if coverage := describe_coverage(datum):
                yield f"  {datum.name}: {coverage}"
        yield ""
        for refit in self.diagnosis.refits:
            error = f"error {refit.error:.3g}, held out {refit.held_out_error:.3g}"
            yield f"  with {refit.name}: {error} standard deviations; {format_fitted_strength(refit)}"
        for left in self.diagnosis.catalogue.untestable:
            yield f"  {left.name} cannot be tested: {left.reason}"

    @property
    def tested(self) -> str:
        """Data that test the fit, in words."""
        if not self.held_out:
            return "a single datum: the fit is tested on the data that were fitted"
        assumed = "" if any(datum.held_out for datum in self.campaign.data) else ", as the manifest holds out none"
        return f"held out{assumed}: {'; '.join(self.held_out)}"

    def document(self) -> dict[str, Any]:
        """Report for ``--json``."""
        verdict = self.diagnosis.verdict
        return {
            "title": self.setup.title,
            "campaign": self.campaign.title,
            "finding": verdict.finding.value,
            "verdict": self.headline,
            "effects": [entry.name for entry in verdict.effects],
            "suspicions": [str(entry) for entry in self.suspicions],
            "signs": [{**vars(indication), "clear": indication.is_clear} for indication in self.indications],
            "calibrated": {
                entry.name: {"factor": entry.factor, "deviation": entry.deviation} for entry in self.calibrated
            },
            "before": {"error": verdict.baseline.error, "held_out_error": verdict.baseline.held_out_error},
            "candidates": [
                {
                    "effect": entry.name, "strength": entry.strength, "deviation": entry.deviation,
                    "error": entry.error,
                    "held_out_error": entry.held_out_error,
                }
                for entry in self.diagnosis.refits
            ],
            "untestable": [
                {"effect": item.name, "reason": item.reason} for item in self.diagnosis.catalogue.untestable
            ],
            "files": [str(file) for file in self.files],
        }  # fmt: skip


def run_data_diagnosis(
    case: Path, campaign: Campaign, folder: Path, run: RunContext, *, without: Sequence[str] = (), auto: bool = False
) -> DataDiagnosisResult:
    """Diagnose, note it in the history of the case, and write page, figures and JSON.

    Parameters
    ----------
    case
        A case file; `auto` edits it.
    campaign, folder
        A campaign without steady states.
    run
        Output folder, store and progress.
    without, auto
        As in `study.diagnose.run.run_diagnose`.

    Raises
    ------
    CaseError, CampaignError, EffectError, OutputError
        An error in the case, the campaign, the kinds or the folders.
    """
    setup = read_setup_with_sensors(case, campaign, run)
    suspicions = _find_suspicions(setup, campaign)
    for suspicion in suspicions:
        run.warn(str(suspicion))
    n_round = 0
    while True:
        result = _diagnose(case, setup, campaign, folder, run, without, suspicions)
        n_round += 1
        verdict = result.diagnosis.verdict
        if not auto or n_round > MOST_ADDED or verdict.finding is not Finding.MISSING:
            break
        add(case, verdict.effects[0].name, run=run)
        setup = read_setup_with_sensors(case, campaign, run)
        suspicions = _find_suspicions(setup, campaign)
    with run.progress.step("page and figures", expected=5):
        contents = _draw(result, case.stem)
    return replace(result, files=run.write_files(contents))


def diagnose_data(
    case: Path, campaign: Campaign, folder: Path, run: RunContext | None = None, without: Sequence[str] = ()
) -> DataDiagnosisResult:
    """One round of `run_data_diagnosis`, noted in the history of the case, without page and files.

    Parameters
    ----------
    case, campaign, folder, without
        As in `run_data_diagnosis`.
    run
        Store and progress; none by default.
    """
    run = run or silent_run()
    setup = read_setup_with_sensors(case, campaign, run)
    return _diagnose(case, setup, campaign, folder, run, without, _find_suspicions(setup, campaign))


def _diagnose(
    case: Path, setup: Setup, campaign: Campaign, folder: Path, run: RunContext, without: Sequence[str],
    suspicions: tuple[Suspicion, ...],
) -> DataDiagnosisResult:  # fmt: skip
    key = hash_case(read_text(case))  # read first: the file may be edited during the diagnosis
    left_out = tuple(sorted({*setup.without, *without}))
    run_step = Steps(run.store, setup, campaign, left_out)
    with phases(run.progress, run_step.is_stored, len(setup.added) + 1) as shown:
        diagnosed = diagnose_features(
            setup.model, campaign.data, setup.calibration_parameters, added=setup.added, without=left_out,
            extra=setup.effect_files, run_step=shown.watched(run_step), report=shown.report,
        )  # fmt: skip
    result = DataDiagnosisResult(
        setup=setup, campaign=campaign, diagnosis=diagnosed.diagnosis, indications=diagnosed.indications,
        suspicions=suspicions,
    )  # fmt: skip
    _record(result, case, folder, key)
    return result


def _find_suspicions(setup: Setup, campaign: Campaign) -> tuple[Suspicion, ...]:
    return merge_suspicions(find_all_suspicions(campaign, with_sensors(setup.complete, campaign)))


def _record(result: DataDiagnosisResult, case: Path, folder: Path, key: str) -> None:
    """Note a diagnosis in the history of its case, from where `add` takes the strengths."""
    fitted = [
        {**list_case_values(result.setup, refit), "after": summarise_feature_errors(refit).document}
        for refit in result.diagnosis.refits
        if refit.effect is not None
    ]
    before = summarise_feature_errors(result.diagnosis.baseline)
    step = HistoryStep(
        what=DIAGNOSIS, case_key=key, campaign=str(folder.resolve()), sentence=result.headline,
        finding=result.diagnosis.verdict.finding.value, before=before, candidates=fitted,
    )  # fmt: skip
    history_of(case).with_step(step).save()


def _draw(result: DataDiagnosisResult, case: str) -> dict[str, bytes]:
    """Page, pictures and JSON by the names of their files, which begin with that of the case."""
    best = next(iter(result.diagnosis.verdict.effects), result.diagnosis.baseline)
    held_out = result.held_out
    compared = tuple(
        replace(item, held_out=item.name in held_out) for item in compare_data(best.fit.model, result.campaign.data)
    )
    title = result.setup.title if best.effect is None else f"{result.setup.title}, with {best.name}"
    drawn, sections = show_data(best.fit.model, result.campaign.data, compared, title)
    verdict = result.diagnosis.verdict
    html = render_sections(
        title=result.setup.title,
        campaign=result.campaign.title,
        summary=Summary(
            tone=TONE[verdict.finding], tag=verdict.finding.value, sentences=(result.headline,),
            next=f"Next: {result.advice}.",
            cards=(
                ("held-out error, calibrated [standard deviations]", f"{verdict.baseline.held_out_error:.3g}"),
                *((f"held-out error with {entry.name}", f"{entry.held_out_error:.3g}") for entry in verdict.effects),
            ),
        ),
        calibrated=result.calibrated,
        suspicions=result.suspicions,
        sections=[*_sections(result), *sections],
        kind="Diagnosis",
    )  # fmt: skip
    stem = f"{case}_diagnosis"
    contents = {f"{stem}.html": html.encode()}
    contents |= {f"{stem}_{name}.png": picture for name, picture in drawn.items()}
    document = json.dumps(to_json(result.document()), indent=1, ensure_ascii=False)
    return {**contents, f"{stem}.json": document.encode()}


def _sections(result: DataDiagnosisResult) -> Iterator[Section]:
    """Indications and candidates."""
    if result.indications:
        rows = [
            (item.quantity, item.measured, item.predicted, f"{item.difference:+.3g}" + (" !" if item.is_clear else ""))
            for item in result.indications
        ]
        yield Section(
            title="Trends of the data",
            text="Trends over all data, compared with those of the calibrated model; ! marks significant differences.",
            table=Table(head=("quantity", "measured", "model", "difference [standard deviations]"), rows=rows, words=3),
        )
    rows = [
        (item.name, format_fitted_strength(item), f"{item.error:.3g}", f"{item.held_out_error:.3g}")
        for item in result.diagnosis.refits
    ]
    if rows:
        baseline = result.diagnosis.baseline
        yield Section(
            title="Candidates",
            text=f"Errors without an effect: {baseline.error:.3g}, held out {baseline.held_out_error:.3g} standard "
            f"deviations. {result.tested[0].upper()}{result.tested[1:]}.",
            table=Table(
                head=("effect", "strength", "error [standard deviations]", "held out [standard deviations]"), rows=rows,
                words=2,
            ),
        )  # fmt: skip
