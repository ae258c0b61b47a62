"""Maps of the misfit: level by frequency, for every sensor and harmonic."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from correlation.campaign.measurement import name_configuration
from correlation.metric.misfit import Misfit
from figure.misfit_map import COLOUR_STEPS, COLOURS
from study.compare.curve import Drawing, find_rows, list_curve_keys
from study.compare.result import ComparisonResult
from study.compare.section.section import Section
from study.page.number import bin_image, round_list

TEXT = (
    "Difference of every point in standard deviations: what noise, friction histories and numerical error do not "
    "explain. Rows: sensor and harmonic, and within each the levels, rising upwards; columns: the measured "
    "frequencies, drawn evenly. Values below 2 (pale cells) are explained by chance."
)


def make_misfit_sections(compared: ComparisonResult, drawing: Drawing) -> Iterator[Section]:
    """Section with a misfit map per configuration."""
    del compared
    maps = [map_misfit(misfit, free, drawing.unit) for free, misfit in drawing.misfit.items()]
    data = {"maps": maps, "steps": list(COLOUR_STEPS), "colours": list(COLOURS)}
    yield Section(title="Where the model fails", text=TEXT, element="map", data=data)


def map_misfit(misfit: Misfit, free: bool, level_unit: str) -> dict[str, Any]:
    """Misfit of one configuration: rows are levels within sensors and harmonics, columns frequencies."""
    points, size = misfit.points, misfit.size
    frequency, levels = np.unique(points.frequency), np.unique(points.level)[::-1]
    groups: list[dict[str, Any]] = []
    places: list[dict[str, Any]] = []
    labels: list[str] = []
    rows: list[NDArray[np.float64]] = []
    for sensor, harmonic in list_curve_keys(misfit):
        words = f"{sensor} · {harmonic}" if harmonic else f"{sensor} · static"
        if rows:
            labels.append("")
            places.append({})
            rows.append(np.full(len(frequency), np.nan))
        named = [f"{level:g} {level_unit}" for level in levels.tolist()]
        groups.append({"label": words, "first": len(rows), "last": len(rows) + len(levels) - 1, "levels": named})
        labels += [f"{words}, {level}" for level in named]
        for level in levels.tolist():
            at = find_rows(points, sensor, harmonic, level)
            line = np.full(len(frequency), np.nan)
            np.fmax.at(line, np.searchsorted(frequency, points.frequency[at]), size[at])
            rows.append(line)
            places.append({"sensor": sensor, "harmonic": harmonic, "level": level})
    return {
        "configuration": name_configuration(free),
        "frequency": [f"{value:.5g}" for value in frequency],
        "labels": labels,
        "places": places,
        "groups": groups,
        "image": bin_image(np.array(rows), COLOUR_STEPS),
        "values": [round_list(line, 4) for line in rows],
        "whole": misfit.root_mean_square,
    }
