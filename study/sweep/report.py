"""Report of ``stickslip sweep``: a table of text and a JSON document."""

from typing import Any

import numpy as np

from hbsolve.limits.result import SIDES
from study.solve.result import DISPLAY_UNIT
from study.sweep.result import SampledCase, SampledLimits
from study.sweep.run import SweepResult

#: Largest number of lines of a table; the CSV file has all.
MOST_LINES = 40


def sweep_document(swept: SweepResult) -> dict[str, Any]:
    """Make the document of ``--json``."""
    sampled, grid = swept.sampled, swept.grid
    points: list[dict[str, Any]] = []
    quantities = None if sampled.curves is None else sampled.curve_quantities()
    peaks = [item.peaks() for item in sampled.limits]
    for number, values in enumerate(sampled.values):
        point: dict[str, Any] = {"values": values.tolist()}
        if quantities is not None and sampled.curves is not None:
            point["curves"] = [
                _document_curve(swept, number, curve, quantities[number, curve]) for curve in range(quantities.shape[1])
            ]
        if sampled.limits:
            point["limits"] = [
                {
                    "quantity": item.first.quantity,
                    "unit": item.first.unit,
                    "level": float(level),
                    **{
                        side: dict(zip(("value", "frequency_hz"), own[number, row, at].tolist(), strict=True))
                        for row, side in enumerate(SIDES)
                    },
                }
                for item, own in zip(sampled.limits, peaks, strict=True)
                for at, level in enumerate(item.first.limits.level)
            ]
        points.append(point)
    return {
        "parameters": [
            {"name": item.name, "unit": item.unit or "1", "is_factor": item.is_factor, "values": list(values)}
            for item, values in zip(grid.parameters, grid.values, strict=True)
        ],
        "output": None if sampled.curves is None else sampled.curves.model.outputs[0].name,
        "points": points,
        "files": [str(file) for file in swept.files],
    }


def _document_curve(
    swept: SweepResult, number: int, curve: int, quantities: np.ndarray[Any, np.dtype[np.float64]]
) -> dict[str, Any]:
    assert swept.sampled.curves is not None
    item = swept.sampled.curves.curves[number][curve]
    unit, scale = DISPLAY_UNIT[swept.sampled.curves.model.outputs[0].quantity]
    along, amplitude, damping, at_end = quantities[0].tolist()
    return {
        "label": item.curve.label,
        "peak_frequency_hz" if item.curve.parameter == "frequency" else "peak_level": along,
        "peak_amplitude": scale * amplitude,
        "unit": unit,
        "equivalent_damping": damping,
        "peak_at_end": bool(at_end == 1),
        "n_point": len(item.frequency),
        "stop_reason": item.stop_message,
    }


def format_sweep_report(swept: SweepResult) -> str:
    """Format the report as a table."""
    sampled, grid = swept.sampled, swept.grid
    lines = [f"{len(sampled.values)} points:"]
    for item, values in zip(grid.parameters, grid.values, strict=True):
        what = "factor on the case's values" if item.is_factor else "value in the case"
        lines.append(f"  {item.name}, {what}: {', '.join(f'{value:g}' for value in values)} {item.unit}".rstrip())
    if sampled.curves is not None:
        lines += ["", *_format_peak_lines(swept)]
    if sampled.limits:
        lines += _shorten([line for item in sampled.limits for line in ("", *_limit_lines(sampled, item))])
    return "\n".join([*lines, "", *map(str, swept.files)])


def _format_peak_lines(swept: SweepResult) -> list[str]:
    sampled = swept.sampled
    assert sampled.curves is not None
    model = sampled.curves.model
    unit, scale = DISPLAY_UNIT[model.outputs[0].quantity]
    place = "frequency [Hz]" if model.curves[0].parameter == "frequency" else "level [-]"
    names = [f"{item.name}{f' [{item.unit}]' if item.unit else ''}" for item in sampled.parameters]
    width = max(len("curve"), *(len(item.label) for item in model.curves))
    amplitude = f"amplitude [{unit}]"
    head = "  ".join([*(f"{name:>10}" for name in names), f"{'curve':<{width}}"])
    lines = [
        f"Highest points of {model.outputs[0].name}, and equivalent damping there:",
        "",
        f"  {head}  {place:>14}  {amplitude:>16}  damping [%]",
    ]
    rows = sampled.curve_quantities()[:, :, 0]
    for number, curve in np.ndindex(*rows.shape[:2]):
        along, height, damping, at_end = rows[number, curve]
        cells = [f"{value:{max(10, len(name))}.6g}" for value, name in zip(sampled.values[number], names, strict=True)]
        label = f"{model.curves[curve].label:<{width}}"
        end = "" if at_end == 0 else "  at the end of the curve"
        end += "" if sampled.curves.curves[number][curve].complete else ", which is not complete"
        numbers = f"{along:14.6g}  {scale * height:16.5g}  {100 * damping:11.4g}{end}"
        lines.append(f"  {'  '.join([*cells, label])}  {numbers}")
    return _shorten(lines)


def _limit_lines(sampled: SampledCase, limits: SampledLimits) -> list[str]:
    first, peaks = limits.first, limits.peaks()
    names = [f"{item.name}{f' [{item.unit}]' if item.unit else ''}" for item in sampled.parameters]
    what = "highest points of both limits" if first.has_peaks else "lowest and highest point of the band"
    head = "  ".join([*(f"{name:>10}" for name in names), f"{'level':>8}"])
    lines = [f"{first.label}: {what}:", "", f"  {head}  {'lower':>11}  {'at [Hz]':>10}  {'upper':>11}  {'at [Hz]':>10}"]
    for number, level in np.ndindex(len(peaks), peaks.shape[2]):
        cells = [f"{value:{max(10, len(name))}.6g}" for value, name in zip(sampled.values[number], names, strict=True)]
        cells.append(f"{first.limits.level[level]:8.4g}")
        cells += [f"{value:11.5g}  {at:10.6g}" for value, at in peaks[number, :, level]]
        lines.append(f"  {'  '.join(cells)}")
    return lines


def _shorten(lines: list[str]) -> list[str]:
    if len(lines) <= MOST_LINES:
        return lines
    return [*lines[:MOST_LINES], f"  ... and {len(lines) - MOST_LINES} more lines in the CSV file"]
