"""Measured and predicted curves of a diagnosis, and maps of its misfit, as plain data for the page."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measurement import name_configuration
from correlation.metric.misfit import CLEAR, Misfit
from correlation.model import LineSensor
from correlation.prediction import Points, Predictor
from figure.misfit_map import STEPS
from figure.style import choose_family_colours, typeset
from study.compare.curve import find_rows, joined, keys, refine_points
from study.compare.drawn_unit import choose_unit, per_level_unit
from study.diagnose.round import Round
from study.diagnose.stages import Stage, list_sides

Numbers = Float[NDArray[np.float64], " f"]


def joined_misfit(result: Round, stage: Stage) -> tuple[Misfit, set[float]]:
    """Misfit of a stage to the training data and the held-out levels; and which levels those are."""
    train, held_out = (side.misfit for side in list_sides(result, stage))
    return joined(train, held_out)


def curves(result: Round, shown: Sequence[Stage]) -> dict[str, Any]:
    """Responses over frequency: of each configuration, sensor and harmonic, and level; amplitude, phase, deviation."""
    misfit, new = joined_misfit(result, shown[-1])
    levels = np.unique(misfit.points.level)
    sensors = {sensor.name: sensor for sensor in shown[-1].refit.fit.model.sensors}
    units, drive = {sensor.name: sensor.unit for sensor in result.campaign.sensors}, result.campaign.drive.unit
    panels = []
    for free in np.unique(misfit.points.free):
        part = misfit.where(np.asarray(misfit.points.free == free))
        fine = refine_points(part.points)
        lines = [_lines(result, stage, fine, name_configuration(bool(free))) for stage in shown]
        for sensor, harmonic in keys(part):
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
                groups.append(_group(part, rows, scale, fine.frequency[at], [line[at] for line in lines], number))
            words = f"harmonic {harmonic}" if harmonic > 1 else "fundamental" if harmonic else "static"
            panels.append(
                {
                    "configuration": name_configuration(bool(free)),
                    "sensor": sensor,
                    "harmonic": int(harmonic),
                    "label": f"{sensor}, {words}",
                    "unit": typeset(per_level_unit(unit, drive) if per_level else unit),
                    "static": not harmonic,
                    "groups": groups,
                }
            )
    return {
        "levels": [f"{level:g} {drive}{' (held out)' if level in new else ''}" for level in levels.tolist()],
        "colours": choose_family_colours(len(levels)),
        "stages": [stage.name for stage in shown],
        "panels": panels,
    }


def maps(result: Round, shown: Sequence[Stage]) -> list[dict[str, Any]]:
    """Misfit of each configuration: rows are levels within sensors and harmonics, columns frequencies."""
    parts = [joined_misfit(result, stage)[0] for stage in shown]
    listed = []
    for free in np.unique(parts[0].points.free):
        chosen = [part.where(np.asarray(part.points.free == free)) for part in parts]
        points = chosen[0].points
        frequency, groups, row = np.unique(points.frequency), [], 0
        images: list[list[Numbers]] = [[] for _ in chosen]
        labels: list[str] = []
        for sensor, harmonic in keys(chosen[0]):
            levels = [float(level) for level in np.unique(points.level)[::-1]]
            words = f"{sensor} · {harmonic}" if harmonic else f"{sensor} · static"
            named = [f"{level:g} {result.campaign.drive.unit}" for level in levels]
            groups.append({"label": words, "first": row, "last": row + len(levels) - 1, "levels": named})
            labels += [f"{words}, {level}" for level in named]
            for level in levels:
                rows = find_rows(points, sensor, harmonic, level)
                at = np.searchsorted(frequency, points.frequency[rows])
                for image, part in zip(images, chosen, strict=True):
                    line = np.full(len(frequency), np.nan)
                    line[at] = part.size[rows]
                    image.append(line)
            for image in images:
                image.append(np.full(len(frequency), np.nan))
            labels.append("")
            row += len(levels) + 1
        listed.append(
            {
                "configuration": name_configuration(bool(free)),
                "frequency": [f"{value:.5g}" for value in frequency],
                "labels": labels[:-1],
                "groups": groups,
                "images": [_binned(np.array(image[:-1])) for image in images],
                "values": [[_rounded(line) for line in image[:-1]] for image in images],
                "whole": [_rms(part) for part in chosen],
            }
        )
    return listed


def _lines(result: Round, stage: Stage, fine: Points, name: str) -> NDArray[np.complex128]:
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
    phase = np.where(part.phased[rows], _phase(measured, deviation, harmonic), np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        phase_deviation = np.degrees(np.nan_to_num(deviation / np.abs(measured), posinf=0.0))
    drawn = []
    for line in lines:
        value = scale * line
        turned = _phase(value, np.full(len(value), np.median(deviation)), harmonic)
        if harmonic == 1 and np.isfinite(phase[0]):
            turned += 360 * np.round((phase[0] - turned[0]) / 360)
        drawn.append({"amplitude": _rounded(np.abs(value) if harmonic else value.real), "phase": _rounded(turned)})
    return {
        "level": level,
        "frequency": _rounded(part.points.frequency[rows], 8),
        "amplitude": _rounded(np.abs(measured) if harmonic else measured.real),
        "deviation": _rounded(deviation),
        "phase": _rounded(phase),
        "phase_deviation": _rounded(phase_deviation),
        "line_frequency": _rounded(frequency, 8),
        "lines": drawn,
    }


def _phase(value: NDArray[np.complex128], deviation: Numbers, harmonic: int) -> Numbers:
    """Phase of a fundamental on the turn from -90 to 270; of others from -180 to 180, where there is a signal [deg]."""
    phase = np.degrees(np.angle(np.nan_to_num(value)))
    if harmonic == 1:
        phase = np.unwrap(phase, period=360)
        phase -= 360 * np.ceil((phase[0] - 270) / 360)
        return np.asarray(np.where(np.isfinite(value), phase, np.nan))
    return np.asarray(np.where(np.nan_to_num(np.abs(value)) > CLEAR * deviation, phase, np.nan))


def _rms(part: Misfit) -> float:
    return float(np.sqrt(np.nanmean(part.standardised**2)))


def _binned(image: Float[NDArray[np.float64], "r f"]) -> list[list[int | None]]:
    """Number of the step of the scale that each value is on; none where nothing was measured."""
    step = np.searchsorted(STEPS[1:], np.nan_to_num(image), side="right")
    return [
        [int(number) if np.isfinite(value) else None for number, value in zip(*both, strict=True)]
        for both in zip(step, image, strict=True)
    ]


def _rounded(values: NDArray[np.float64], digits: int = 5) -> list[float | None]:
    return [float(f"{value:.{digits}g}") if np.isfinite(value) else None for value in values.tolist()]
