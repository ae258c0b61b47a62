"""A campaign without steady states on the bench: its numbers and pictures, and the diagnosis of these."""

from base64 import b64encode
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from correlation.campaign.measurement import Campaign
from correlation.sensor_placement import with_sensors
from diagnosis.fit.fit_parameter import Unknowns
from study.alike import merge_suspicions
from study.bench.own_effect import show_own_effects
from study.bench.view.comparison import show_summary
from study.bench.view.history import show_history
from study.bench.view.parameter import show_parameters
from study.bench.view.structure import show_structure
from study.case.setup import read_case
from study.compare.data import compare_data
from study.compare.data_run import summarise_data
from study.compare.data_view import show_data
from study.compare.section.section import Section
from study.compare.suspicions import find_all_suspicions
from study.diagnose.data_run import DataDiagnosed, diagnose_data
from study.diagnose.history import history_of
from study.diagnose.table import interval
from study.run_context import RunContext

Views = dict[str, Any]
Numbers = dict[str, float | str]


def compare_alone(case: Path, campaign: Campaign, run: RunContext) -> tuple[Numbers, Views]:
    """Numbers and parts of the page of a comparison, as `stickslip compare` makes it."""
    read, history = read_case(case, campaign, run), history_of(case)
    setup = read.setup
    model = with_sensors(setup.complete, campaign)
    with run.progress.step("comparison", expected=5):
        data = compare_data(model, campaign.data)
    with run.progress.step("page", expected=4):
        _, sections = show_data(model, campaign.data, data, setup.title)
    suspicions = merge_suspicions(find_all_suspicions(campaign, model))
    unknowns = Unknowns.from_effects(
        setup.model, [(item, item.deviation) for item in setup.accepted], [item.effect for item in setup.added]
    )
    values = [setup.calibrated.get(item.name, 1.0) for item in setup.accepted]
    values += [float(value) for item in setup.added for value in item.values]
    make_surfaces = read.structure.surfaces
    views: Views = {
        "verdict": show_summary(setup.title, campaign.title, summarise_data(data), suspicions) | {"is_alone": True},
        "data": [_show_section(section) for section in sections],
        "parameters": show_parameters(setup, unknowns, np.array(values, dtype=np.float64), history),
        "structure": show_structure(model, {} if make_surfaces is None else make_surfaces()),
        "history": show_history(history),
        "own": show_own_effects(case, setup.model),
    }
    errors = np.concatenate([[], *(item.error[np.isfinite(item.error)] for item in data)])
    size = float(np.sqrt(np.mean(errors**2))) if len(errors) else float("nan")
    return {"difference [standard deviations]": size}, views


def screen_alone() -> Views:
    """Effects of such data are not screened, but fitted one by one by a diagnosis."""
    nothing: Views = {"rows": [], "verdict": None, "chance": None}
    return {"candidates": nothing, "errors": None, "fitted": {}, "law": None, "next_test": None, "is_diagnosed": False}


def diagnose_alone(
    case: Path, campaign: Campaign, folder: Path, run: RunContext, without: Sequence[str]
) -> tuple[Numbers, Views]:
    """Numbers and parts of the page of a diagnosis, as `stickslip diagnose` makes it."""
    found = diagnose_data(case, campaign, folder, run, without)
    verdict = found.diagnosis.verdict
    shown = {"sentence": found.headline, "threshold": "", "finding": verdict.finding.value}
    views = {
        "candidates": {"rows": _list_candidates(found), "verdict": shown, "chance": None},
        "history": show_history(history_of(case)),
    }
    numbers: Numbers = {"finding": verdict.finding.value, "verdict": found.headline}
    return numbers | {"held-out error, calibrated [standard deviations]": verdict.before.held_error}, views


def _list_candidates(found: DataDiagnosed) -> list[dict[str, Any]]:
    """Fitted effects, those that are named first."""
    named = {each.name for each in found.diagnosis.verdict.effects}
    before, rows = found.diagnosis.before, []
    count = sum(len(item.features.value) for item in compare_data(before.fit.model, found.campaign.data))
    for refit in found.diagnosis.refits:
        effect = refit.effect
        if effect is None:
            continue
        rows.append(
            {
                "name": effect.name,
                "physics": effect.physics,
                "strength": interval(refit.strength, refit.deviation, effect.parameters[0]),
                "gain": count * (before.error**2 - refit.error**2),
                "is_fitted": True,
                "is_named": effect.name in named,
                "probability": None,
                "confused": [],
                "held_out": None,
                "held_out_deviations": refit.held_error,
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
