"""Whether the measured structure is linear over its levels: responses per level relative to the lowest level."""

from collections.abc import Iterator

import numpy as np

from correlation.campaign.measurement import name_configuration
from correlation.metric.misfit import Misfit
from correlation.modal.linearity import check_linearity
from study.compare.curve import Drawing
from study.compare.result import ComparisonResult
from study.compare.section.section import Section
from study.page.table import Table

TEXT = (
    "Without a model: the distance of the responses per unit of force from those at the lowest level, over their size, "
    "after subtraction of what noise explains. It says that the structure is nonlinear, not why; a drift between "
    "levels looks the same unless a level is repeated. Where two steady states exist, each sweep is compared with its "
    "own kind."
)


def make_linearity_sections(compared: ComparisonResult, drawing: Drawing) -> Iterator[Section]:
    """Section on linearity, if motions were measured at two levels or more at the same frequencies."""
    del compared
    sentences, rows = [], []
    for free, misfit in drawing.misfit.items():
        responses = _list_responses(misfit)
        if responses is None:
            continue
        result = check_linearity(*responses, drawing.unit)
        name = name_configuration(free)
        sentences.append(f"{name[0].upper()}{name[1:]}: {result.sentence}.")
        rows += [
            [name, f"{level:g} {drawing.unit}", f"{index:.2g}", f"{noise:.2g}", "yes" if significant else "no"]
            for level, index, noise, significant in zip(
                result.level.tolist(), result.index.tolist(), result.noise.tolist(), result.significant.tolist(),
                strict=True,
            )
        ]  # fmt: skip
    if rows:
        head = ("structure", "level", "distance", "by noise alone", "beyond noise")
        yield Section(
            title="Linearity over levels", text=f"{' '.join(sentences)} {TEXT}", table=Table(head=head, rows=rows)
        )


def _list_responses(misfit: Misfit) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Levels, responses per level and their deviations: one row per level, one column per possible reading."""
    points = misfit.points
    known = np.isfinite(misfit.measured) & np.isfinite(misfit.deviation)
    rows = np.flatnonzero(misfit.motion & (points.harmonic == 1) & known)
    levels, level = np.unique(points.level[rows], return_inverse=True)
    keys = [(str(points.sensor[row]), int(points.sweep[row]), round(float(points.frequency[row]), 6)) for row in rows]
    places = {key: number for number, key in enumerate(dict.fromkeys(keys))}
    column = np.array([places[key] for key in keys], dtype=np.int64)
    value = np.full((len(levels), len(places)), np.nan, dtype=np.complex128)
    deviation = np.zeros(value.shape)
    value[level, column] = misfit.measured[rows] / points.force[rows]
    deviation[level, column] = misfit.deviation[rows] / points.force[rows]
    common = np.isfinite(value) & np.isfinite(value[:1])
    if len(levels) < 2 or not common.any(axis=1).all():
        return None
    return levels, value if misfit.phased[rows].all() else np.abs(value), deviation
