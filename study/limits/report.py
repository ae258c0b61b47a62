"""Report of ``stickslip limits``: a table of text and a JSON document."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from geometry.plain_number import count
from hbsolve.limits.result import SIDES
from study.limits.result import LimitCurves
from study.limits.run import LimitsResult


def document_limits(limited: LimitsResult) -> dict[str, Any]:
    """Make the document of ``--json``."""
    limits = limited.curves.limits
    return {
        "objective": limited.objective,
        "quantity": limited.curves.quantity,
        "unit": limited.curves.unit,
        "n_frequency": len(limits.frequency),
        "n_slider": len(limits.nominal),
        "reach_m": float(limits.reach.max()),
        "largest_residual": find_largest(limits.residual_norm),
        "largest_realised_gain": find_largest(limits.realised),
        **describe_refinement([limited.curves]),
        "levels": describe_levels(limited.curves),
        "files": [str(file) for file in limited.files],
    }


def describe_refinement(curves: Sequence[LimitCurves]) -> dict[str, Any]:
    """Describe the change of the limits by more harmonics, if they were refined."""
    if not any(item.is_refined for item in curves):
        return {}
    change = []
    for item in curves:
        largest = np.nan_to_num(np.abs(item.value)).max(axis=(0, 2), keepdims=True)
        change.append(np.abs(item.value - item.searched) / np.where(largest > 0, largest, 1.0))
    return {
        "highest_harmonic": max(int(item.limits.refined_harmonic.max()) for item in curves),
        "largest_refinement": find_largest(np.array(change)),
        "largest_estimated_error": find_largest(np.array([item.limits.refined_error for item in curves])),
        "n_refined_moved": sum(int(item.limits.refined_moved.sum()) for item in curves),
    }


def list_refinement_remarks(document: Mapping[str, Any]) -> list[str]:
    """Format the result of `describe_refinement` as lines of a report."""
    if "highest_harmonic" not in document:
        return []
    remarks = [
        f"  with up to {document['highest_harmonic']} harmonics the limits change by at most "
        f'{document["largest_refinement"]:.2%} of the largest of their level; the columns "searched" contain the '
        "limits before"
    ]
    if document["n_refined_moved"]:
        remarks.append(
            f'  {document["n_refined_moved"]} limits move by more than twice the tolerance (column "moved"): with '
            "these harmonics other slider positions may be extreme; raise highest of [harmonics]"
        )
    return remarks


def describe_levels(curves: LimitCurves) -> list[dict[str, Any]]:
    """Summarise the limits of each level."""
    limits = curves.limits
    last = len(limits.frequency) - 1
    levels = []
    for level, scale in enumerate(limits.level):
        entry: dict[str, Any] = {
            "level": float(scale),
            "n_sampled": int(limits.n_sampled[level].sum()),
            "widest_ratio": _compute_widest(curves.value[:, level]),
        }
        for side, name in enumerate(SIDES):
            row, at = curves.order[side], curves.extreme(side, level)
            entry[name] = {
                "value": None if at is None else float(curves.value[side, level, at]),
                "frequency_hz": None if at is None else float(limits.frequency[at]),
                "at_end": last > 0 and at in {0, last},
                "at_jump": at is not None and bool(curves.jump[side, level, at]),
                "n_jump": int(curves.jump[side, level].sum()),
                "n_repaired": int(curves.repaired[side, level].sum()),
                "n_outside": int(limits.n_outside[row, level].sum()),
                "n_not_found": int(np.isnan(curves.value[side, level]).sum()),
                "n_on_box": int((limits.on_bound[row, level] > 0).sum()),
            }
        levels.append(entry)
    return levels


def format_limits_report(limited: LimitsResult) -> str:
    """Format the report as a table."""
    document = document_limits(limited)
    reach = float(limited.curves.limits.reach.max())
    box = f"at most {1e6 * reach:.4g} um from rest" if np.isfinite(reach) else "anywhere"
    what = "highest points of both limits" if limited.curves.has_peaks else "lowest and highest point of the band"
    n, only = document["n_frequency"], limited.curves.limits.frequency[0]
    lines = [
        f"{limited.curves.label}: {what} {f'over {n} frequencies' if n > 1 else f'at {only:.6g} Hz'}; "
        f"{count(document['n_slider'], 'slider')}, {box}:",
        "",
        f"  {'level':>8}  {'lower':>11}  {'at [Hz]':>10}  {'upper':>11}  {'at [Hz]':>10}  {'widest':>8}  "
        f"{'jumps':>5}  {'repaired':>8}  outside of sampled",
    ]
    for row in document["levels"]:
        two = [row[name] for name in SIDES]
        cells = "  ".join(
            f"{format_or_dash(item['value'], 5):>11}  {format_or_dash(item['frequency_hz'], 7):>10}" for item in two
        )
        sums = {key: sum(item[key] for item in two) for key in ("n_jump", "n_repaired", "n_outside")}
        lines.append(
            f"  {row['level']:8.4g}  {cells}  {format_or_dash(row['widest_ratio'], 4):>8}  {sums['n_jump']:5}  "
            f"{sums['n_repaired']:8}  {sums['n_outside']} of {row['n_sampled']}"
        )
    lines += ["", *_list_remarks(document), "", *document["files"]]
    return "\n".join(lines)


def _list_remarks(document: dict[str, Any]) -> list[str]:
    sides = [(row["level"], name, row[name]) for row in document["levels"] for name in SIDES]
    remarks = [
        "  widest: largest ratio of upper to lower limit at one frequency; outside: histories beyond a limit by more "
        "than 0.1 % before repair",
        f"  largest residual {document['largest_residual']:.1e}, largest improvement by a further step "
        f"{document['largest_realised_gain']:.1e}",
        *list_refinement_remarks(document),
    ]
    for key, words in (
        ("at_end", "lies at an end of the frequency range: a more extreme value may lie beyond"),
        ("at_jump", "lies at a jump between local optima: values between its neighbours are unknown"),
    ):
        for level, name, side in sides:
            if side[key]:
                remarks.append(f"  level {level:g}: the {name} one {words}")
    missing = sum(side["n_not_found"] for _, _, side in sides)
    if missing:
        remarks.append(f"  {missing} limits were not found, because no steady state was found there")
    n_on_box = sum(side["n_on_box"] for _, _, side in sides)
    if n_on_box:
        total = len(sides) * document["n_frequency"]
        remarks.append(
            f"  at {n_on_box} of {total} limits a slider is at its bound: a larger reach may give wider limits there"
        )
    return remarks


def _compute_widest(value: np.ndarray[Any, np.dtype[np.float64]]) -> float | None:
    """Largest ratio of upper to lower limit where the lower one is positive; None if it never is."""
    there = value[0] > 0
    return float(np.max(value[1][there] / value[0][there])) if there.any() else None


def find_largest(values: np.ndarray[Any, np.dtype[np.float64]]) -> float:
    """Largest of the known values; NaN if all are unknown."""
    return float(np.nanmax(values)) if np.isfinite(values).any() else float("nan")


def format_or_dash(value: float | None, digits: int) -> str:
    """Format a value with a number of digits; a dash for None."""
    return "-" if value is None else f"{value:.{digits}g}"
