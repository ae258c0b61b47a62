"""Measured and predicted curves of a diagnosis, and maps of its misfit, as plain data for the page."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measurement import name_configuration
from correlation.metric.misfit import Misfit
from correlation.model import LineSensor
from correlation.prediction import Points, Predictor
from figure.style import choose_family_colours, typeset
from study.compare.curve import (
    blank_gaps,
    compute_phase,
    find_rows,
    join_sides,
    list_curve_keys,
    name_harmonic,
    refine_points,
)
from study.compare.drawn_unit import choose_unit, format_per_level_unit
from study.compare.section.misfit import map_misfit
from study.diagnose.round import Round
from study.diagnose.stages import FitStage, list_data_sets
from study.page.number import round_list

Numbers = Float[NDArray[np.float64], " f"]


def join_misfits(result: Round, stage: FitStage) -> tuple[Misfit, set[float]]:
    """Misfit of a stage to the training data and the held-out levels, and the set of held-out levels."""
    train, held_out = (data_set.misfit for data_set in list_data_sets(result, stage))
    return join_sides(train, held_out)


def make_curves(result: Round, stages: Sequence[FitStage]) -> dict[str, Any]:
    """Responses over frequency: of each configuration, sensor and harmonic, and level; amplitude, phase, deviation."""
    misfit, new = join_misfits(result, stages[-1])
    levels = np.unique(misfit.points.level)
    sensors = {sensor.name: sensor for sensor in stages[-1].refit.fit.model.sensors}
    units, drive = {sensor.name: sensor.unit for sensor in result.campaign.sensors}, result.campaign.drive.unit
    panels = []
    for free in np.unique(misfit.points.free):
        part = misfit.where(np.asarray(misfit.points.free == free))
        fine = refine_points(part.points)
        lines = [_compute_lines(result, stage, fine, name_configuration(bool(free))) for stage in stages]
        for sensor, harmonic in list_curve_keys(part):
            all_rows = (part.points.sensor == sensor) & (part.points.harmonic == harmonic)
            per_level = harmonic == 1 and not isinstance(sensors[sensor], LineSensor)
            size = np.abs(part.measured[all_rows]) / (part.points.level[all_rows] if per_level else 1.0)
            unit, factor = choose_unit(units[sensor], float(size.max()))
            groups = []
            for number, level in enumerate(levels.tolist()):
                rows = find_rows(part.points, sensor, harmonic, level)
                if not len(rows):
                    continue
                scale = factor / level if per_level else factor
                at = find_rows(fine, sensor, harmonic, level)
                shown_lines = [blank_gaps(fine, part.points.frequency[rows], line, at) for line in lines]
                groups.append(_group(part, rows, scale, fine.frequency[at], shown_lines, number))
            panels.append(
                {
                    "configuration": name_configuration(bool(free)),
                    "sensor": sensor,
                    "harmonic": int(harmonic),
                    "label": f"{sensor}, {name_harmonic(harmonic)}",
                    "unit": typeset(format_per_level_unit(unit, drive) if per_level else unit),
                    "static": not harmonic,
                    "groups": groups,
                }
            )
    return {
        "levels": [f"{level:g} {drive}{' (held out)' if level in new else ''}" for level in levels.tolist()],
        "colours": choose_family_colours(len(levels)),
        "stages": [stage.name for stage in stages],
        "panels": panels,
    }


def make_maps(result: Round, stages: Sequence[FitStage]) -> list[dict[str, Any]]:
    """Misfit of each configuration and stage: rows are levels within sensors and harmonics, columns frequencies."""
    parts = [join_misfits(result, stage)[0] for stage in stages]
    listed = []
    for free in np.unique(parts[0].points.free):
        chosen = [part.where(np.asarray(part.points.free == free)) for part in parts]
        maps = [map_misfit(part, bool(free), result.campaign.drive.unit) for part in chosen]
        listed.append(
            {
                **{key: maps[0][key] for key in ("configuration", "frequency", "labels", "groups")},
                "images": [item["image"] for item in maps],
                "values": [item["values"] for item in maps],
                "whole": [item["whole"] for item in maps],
            }
        )
    return listed


def _compute_lines(result: Round, stage: FitStage, fine: Points, name: str) -> NDArray[np.complex128]:
    fit = stage.refit.fit
    return result.run_step(
        f"curves, {stage.name}, {name}", lambda: Predictor(points=fine).predict(fit.model, fit.prediction).value
    )


def _group(
    part: Misfit,
    rows: NDArray[np.int64],
    scale: float,
    frequency: Numbers,
    lines: Sequence[NDArray[np.complex128]],
    level: int,
) -> dict[str, Any]:
    measured, deviation = scale * part.measured[rows], np.nan_to_num(scale * part.deviation[rows])
    harmonic = int(part.points.harmonic[rows[0]])
    phase = np.where(part.phased[rows], compute_phase(measured, deviation, harmonic), np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        phase_deviation = np.degrees(np.nan_to_num(deviation / np.abs(measured), posinf=0.0))
    drawn = []
    for line in lines:
        value = scale * line
        turned = compute_phase(value, np.full(len(value), np.median(deviation)), harmonic)
        if harmonic == 1 and np.isfinite(phase[0]):
            turned += 360 * np.round((phase[0] - turned[0]) / 360)
        drawn.append({"amplitude": round_list(np.abs(value) if harmonic else value.real), "phase": round_list(turned)})
    return {
        "level": level,
        "frequency": round_list(part.points.frequency[rows], 8),
        "amplitude": round_list(np.abs(measured) if harmonic else measured.real),
        "deviation": round_list(deviation),
        "phase": round_list(phase),
        "phase_deviation": round_list(phase_deviation),
        "line_frequency": round_list(frequency, 8),
        "lines": drawn,
    }
