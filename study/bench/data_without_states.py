"""The bench for campaigns without steady states: comparison, pictures and diagnosis."""

from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from correlation.campaign.measurement import Campaign
from correlation.model import Model
from correlation.sensor_placement import with_sensors
from diagnosis.fit.fit_parameter import Unknowns, Values
from study.bench.line import list_case_unknowns, move_values
from study.bench.own_effect import show_own_effects
from study.bench.view.comparison import show_summary
from study.bench.view.history import show_history
from study.bench.view.parameter import show_parameters
from study.bench.view.structure import show_structure
from study.case.setup import ReadCase, read_case
from study.compare.data import DataComparison, compare_data
from study.compare.data_run import summarise_data
from study.compare.data_view import show_data
from study.compare.section.section import Section
from study.compare.suspicions import find_all_suspicions
from study.diagnose.data_run import DataDiagnosisResult, diagnose_data
from study.diagnose.history import history_of
from study.diagnose.table import format_interval
from study.merge_sentences import merge_suspicions
from study.run_context import RunContext

Views = dict[str, Any]
Numbers = dict[str, float | str]


@dataclass(frozen=True, kw_only=True, eq=False)
class _CaseWithData:
    """A case with a campaign without steady states, and the parameters of the case."""

    read: ReadCase
    campaign: Campaign
    unknowns: Unknowns
    values: Values

    def compare(
        self, model: Model, run: RunContext
    ) -> tuple[Numbers, list[dict[str, Any]], tuple[DataComparison, ...]]:
        """Compare a model of the case with the data; return numbers, sections of the page, and features."""
        model = with_sensors(model, self.campaign)
        with run.progress.step("comparison", expected=5):
            data = compare_data(model, self.campaign.data)
        with run.progress.step("page", expected=4):
            _, sections = show_data(model, self.campaign.data, data, self.read.setup.title)
        errors = np.concatenate([[], *(item.error[np.isfinite(item.error)] for item in data)])
        size = float(np.sqrt(np.mean(errors**2))) if len(errors) else float("nan")
        return {"difference [standard deviations]": size}, [_show_section(section) for section in sections], data


def _read_case_with_data(case: Path, campaign: Campaign, run: RunContext) -> _CaseWithData:
    read = read_case(case, campaign, run)
    unknowns, values = list_case_unknowns(read.setup)
    return _CaseWithData(read=read, campaign=campaign, unknowns=unknowns, values=values)


def compare_data_campaign(case: Path, campaign: Campaign, run: RunContext) -> tuple[Numbers, Views]:
    """Compare as `stickslip compare` does; return numbers and parts of the page."""
    alone, history = _read_case_with_data(case, campaign, run), history_of(case)
    setup, make_surfaces = alone.read.setup, alone.read.structure.surfaces
    numbers, sections, data = alone.compare(setup.complete, run)
    model = with_sensors(setup.complete, campaign)
    suspicions = merge_suspicions(find_all_suspicions(campaign, model))
    views: Views = {
        "verdict": show_summary(setup.title, campaign.title, summarise_data(data), suspicions) | {"is_alone": True},
        "data": sections,
        "parameters": show_parameters(setup, alone.unknowns, alone.values, history),
        "structure": show_structure(model, {} if make_surfaces is None else make_surfaces()),
        "history": show_history(history),
        "own": show_own_effects(case, setup.model),
    }
    return numbers, views


def move_data_parameters(
    case: Path, campaign: Campaign, run: RunContext, values: Mapping[str, float]
) -> tuple[Numbers, Views]:
    """Compare with other values of some parameters; the case is unchanged."""
    alone = _read_case_with_data(case, campaign, run)
    moved = move_values(alone.unknowns, alone.values, values, case)
    numbers, sections, _ = alone.compare(alone.unknowns.compose(alone.unknowns.clipped(moved)), run)
    return numbers, {"moved": {"values": dict(values), "data": sections}}


def screen_data_campaign() -> Views:
    """Return an empty screening: for these data a diagnosis fits the effects one by one, without screening."""
    nothing: Views = {"rows": [], "verdict": None, "chance": None}
    return {"candidates": nothing, "errors": None, "fitted": {}, "law": None, "next_test": None, "is_diagnosed": False}


def diagnose_data_campaign(
    case: Path, campaign: Campaign, folder: Path, run: RunContext, without: Sequence[str]
) -> tuple[Numbers, Views]:
    """Diagnose as `stickslip diagnose` does; return numbers and parts of the page."""
    result = diagnose_data(case, campaign, folder, run, without)
    verdict = result.diagnosis.verdict
    shown = {"sentence": result.headline, "threshold": "", "finding": verdict.finding.value}
    views = {
        "candidates": {"rows": _list_candidates(result), "verdict": shown, "chance": None},
        "history": show_history(history_of(case)),
    }
    numbers: Numbers = {"finding": verdict.finding.value, "verdict": result.headline}
    return numbers | {"held-out error, calibrated [standard deviations]": verdict.baseline.held_out_error}, views


def _list_candidates(result: DataDiagnosisResult) -> list[dict[str, Any]]:
    """List the fitted effects, those named by the verdict first."""
    named = {entry.name for entry in result.diagnosis.verdict.effects}
    baseline, rows = result.diagnosis.baseline, []
    count = sum(len(item.features.value) for item in compare_data(baseline.fit.model, result.campaign.data))
    for refit in result.diagnosis.refits:
        effect = refit.effect
        if effect is None:
            continue
        rows.append(
            {
                "name": effect.name,
                "physics": effect.physics,
                "strength": format_interval(refit.strength, refit.deviation, effect.parameters[0]),
                "gain": count * (baseline.error**2 - refit.error**2),
                "is_fitted": True,
                "is_named": effect.name in named,
                "probability": None,
                "confused": [],
                "held_out": None,
                "held_out_deviations": refit.held_out_error,
                "value": [],
            }
        )
    return sorted(rows, key=lambda row: (not row["is_named"], -row["gain"]))


def _show_section(section: Section) -> dict[str, Any]:
    table = section.table
    return {
        "title": section.title,
        "text": section.text,
        "table": None if table is None else {"head": list(table.head), "rows": [list(row) for row in table.rows],
                                             "words": table.words},
        "pictures": [[caption, b64encode(picture).decode()] for caption, picture in section.pictures.items()],
    }  # fmt: skip
