"""View of the limits of all friction histories with the measured families, in the units of the page's panels."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from study.compare.curve import SensorPanel
from study.compare.families import FamilyComparison
from study.compare.family_report import document_families
from study.page.number import round_list


def show_limits(comparison: FamilyComparison, panels: Sequence[tuple[bool, SensorPanel]]) -> dict[str, Any]:
    """Make the view of the limits.

    Parameters
    ----------
    comparison
        Comparison of measured families with their limits.
    panels
        Panels of the page, each with whether the contacts are absent.

    Returns
    -------
    "panels": for each curve of each panel its limits over frequency [Hz], or None; the verdict as "headline", and in
    detail as "sentences".
    """
    document = document_families(comparison)
    compared = [item for item in comparison.verdicts if item.n_compared]
    leaving = sum(item.leaves_band for item in compared)
    headline = f"{leaving} of {len(compared)} measured families leave the limits." if leaving else (
        "All measured families lie within the limits." if compared else "No limits were found."
    )  # fmt: skip
    return {
        "headline": headline,
        "panels": [_list_bands(comparison, free, panel) for free, panel in panels],
        "sentences": [*document["sentences"], *document["not_compared"]],
    }


def count_limits(comparison: FamilyComparison) -> dict[str, float]:
    """Return named numbers: families, families that leave their limits, and percentage of readings within limits."""
    compared = [item for item in comparison.verdicts if item.n_compared]
    count = sum(item.n_compared for item in compared)
    inside = sum(item.coverage * item.n_compared for item in compared)
    numbers = {
        "families [-]": float(len(compared)),
        "families that leave their limits [-]": float(sum(item.leaves_band for item in compared)),
    }
    return numbers | ({"readings within limits [%]": 100 * inside / count} if count else {})


def _list_bands(comparison: FamilyComparison, free: bool, panel: SensorPanel) -> list[dict[str, Any] | None]:
    limits = comparison.limits
    if free or limits is None or panel.key not in limits.bands:
        return [None] * len(panel.curves)
    result: list[dict[str, Any] | None] = []
    for curve in panel.curves:
        level = int(np.argmin(np.abs(np.array(limits.levels) - curve.level)))
        band = limits.bands[panel.key][level]
        lower, upper = panel.factor(np.full_like(band.frequency, curve.level)) * band.value
        result.append(
            {"frequency": round_list(band.frequency, 8), "lower": round_list(lower), "upper": round_list(upper)}
        )
    return result
