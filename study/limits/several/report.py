"""Report of ``stickslip limits`` on all quantities: a table of text and a JSON document."""

from typing import Any

import numpy as np

from geometry.plain_number import count
from hbsolve.limits.result import SIDES
from study.limits.report import (
    describe_levels,
    describe_refinement,
    find_largest,
    format_or_dash,
    list_refinement_remarks,
)
from study.limits.several.run import SeveralLimitsResult
from study.limits.table import EVERYTHING


def document_several_limits(limited: SeveralLimitsResult) -> dict[str, Any]:
    """Make the document of ``--json``."""
    limits = limited.curves[0].limits
    return {
        "objective": EVERYTHING,
        "n_frequency": len(limits.frequency),
        "n_slider": len(limits.nominal),
        "reach_m": float(limits.reach.max()),
        "largest_residual": find_largest(np.array([item.limits.residual_norm for item in limited.curves])),
        "largest_realised_gain": find_largest(np.array([item.limits.realised for item in limited.curves])),
        **describe_refinement(limited.curves),
        "quantities": [
            {
                "quantity": item.quantity,
                "unit": item.unit,
                "objective": quantity.table.objective,
                "sensor": None if quantity.output is None else quantity.output.name,
                "contact": quantity.table.contact,
                "direction": quantity.table.direction,
                "levels": describe_levels(item),
            }
            for quantity, item in zip(limited.quantities, limited.curves, strict=True)
        ],
        "files": [str(file) for file in limited.files],
    }


def format_several_limits_report(limited: SeveralLimitsResult) -> str:
    """Format the report as a table."""
    document, limits = document_several_limits(limited), limited.curves[0].limits
    n, reach = document["n_frequency"], document["reach_m"]
    where = f"over {n} frequencies" if n > 1 else f"at {limits.frequency[0]:.6g} Hz"
    box = f"at most {1e6 * reach:.4g} um from rest" if np.isfinite(reach) else "anywhere"
    width = max(len(f"{item['quantity']} [{item['unit']}]") for item in document["quantities"])
    lines = [
        f"highest points of both limits, of a mean its lowest and highest point, {where}; "
        f"{count(document['n_slider'], 'slider')}, {box}:",
        "",
        f"  {'quantity':<{width}}  {'level':>8}  {'lower':>11}  {'at [Hz]':>10}  {'upper':>11}  {'at [Hz]':>10}  "
        f"{'jumps':>5}",
    ]
    for item in document["quantities"]:
        for row in item["levels"]:
            two = [row[side] for side in SIDES]
            cells = "  ".join(
                f"{format_or_dash(side['value'], 5):>11}  {format_or_dash(side['frequency_hz'], 7):>10}" for side in two
            )
            lines.append(
                f"  {item['quantity'] + ' [' + item['unit'] + ']':<{width}}  {row['level']:8.4g}  {cells}  "
                f"{sum(side['n_jump'] for side in two):5}"
            )
    return "\n".join([*lines, "", *_list_remarks(document), "", *document["files"]])


def _list_remarks(document: dict[str, Any]) -> list[str]:
    levels = [row for item in document["quantities"] for row in item["levels"]]
    sides = [row[name] for row in levels for name in SIDES]
    sampled = sum(row["n_sampled"] for row in document["quantities"][0]["levels"])
    remarks = [
        f"  all limits come from one search, started from the most extreme states of {sampled} random histories: none "
        "of these lies outside",
        f"  largest residual {document['largest_residual']:.1e}, largest improvement by a further step "
        f"{document['largest_realised_gain']:.1e}",
        *list_refinement_remarks(document),
    ]
    for key, words in (
        ("at_end", "lie at an end of the frequency range: more extreme values may lie beyond"),
        ("at_jump", "lie at a jump between local optima: values between their neighbours are unknown"),
    ):
        count = sum(side[key] for side in sides)
        if count:
            remarks.append(f"  {count} of {len(sides)} of these points {words}")
    missing = sum(side["n_not_found"] for side in sides)
    if missing:
        remarks.append(f"  {missing} limits were not found, because no steady state was found there")
    n_on_box = sum(side["n_on_box"] for side in sides)
    if n_on_box:
        remarks.append(
            f"  at {n_on_box} of {len(sides) * document['n_frequency']} limits a slider is at its bound: a larger "
            "reach may give wider limits there"
        )
    return remarks
