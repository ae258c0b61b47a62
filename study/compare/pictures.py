"""Figures of a comparison: maps of the misfit, and measured and predicted responses."""

from collections.abc import Sequence

import numpy as np

from correlation.campaign.measurement import name_configuration
from correlation.metric.misfit import Misfit
from correlation.model import LineSensor, Sensor
from figure.frf_overlay import FrfOverlay, OverlayCurve, OverlayPanel
from figure.misfit_map import MapPanel, MisfitMap
from figure.registry import pictures as drawn_pictures
from study.compare.curve import Drawing, Frequencies, SensorPanel, list_curve_keys, stands_out

ABOUT = {
    "frf": "response per unit of the level",
    "harmonics": "amplitudes of the higher harmonics",
    "forces": "amplitudes of the contact forces, summed over each line",
}
#: Note below drawn static parts: their lines need not meet the points.
HISTORY = (
    "contact forces, summed over each line; static parts depend on a loading history that no test records, and need "
    "not agree"
)


def draw_pictures(title: str, drawing: Drawing) -> dict[str, bytes]:
    """Draw all of them as PNG, by name.

    Parameters
    ----------
    title
        Above each figure.
    drawing
        Curves of all configurations.
    """
    drawn: dict[str, object] = {}
    for free, rows in drawing.misfit.items():
        name = name_configuration(free)
        levels = np.unique(rows.points.level)
        held_out = dict.fromkeys(drawing.held_out, ", held out")
        words = [f"{level:g} {drawing.unit}{held_out.get(level, '')}" for level in levels.tolist()]
        drawn[f"map_{name}"] = _map(rows, levels, words, f"{title}: where the model fails, {name}")
        for kind, (chosen, columns) in _arrange_figures(drawing.panels[free]).items():
            if any(stands_out(rows, panel.key) for panel in chosen):
                overlays = [_make_overlay(panel, levels, _has_phase(rows, panel)) for panel in chosen]
                with_phase = kind == "frf" and any(panel.has_phase for panel in overlays)
                about = ABOUT[kind] + (", and its phase" if with_phase else "")
                drawn[f"{kind}_{name}"] = FrfOverlay(
                    panels=overlays,
                    levels=words,
                    title=f"{title}: {kind} of the {name} structure" if kind != "frf" else f"{title}, {name}",
                    subtitle=HISTORY if any(panel.is_static for panel in chosen) else about,
                    columns=columns,
                    with_phase=with_phase,
                )
    return drawn_pictures(drawn)


def _arrange_figures(panels: Sequence[SensorPanel]) -> dict[str, tuple[list[SensorPanel], int]]:
    """Panels of each figure and how many stand side by side: fundamental motions, their harmonics, contact forces."""
    forces = [panel for panel in panels if isinstance(panel.sensor, LineSensor)]
    motions = [panel for panel in panels if isinstance(panel.sensor, Sensor)]
    fundamental = [panel for panel in motions if panel.key[1] == 1]
    higher = [panel for panel in motions if panel.key[1] != 1]
    harmonics = len({panel.key[1] for panel in forces})
    return {"frf": (fundamental, 2), "harmonics": (higher, 2), "forces": (forces, max(1, min(harmonics, 4)))}


def _map(misfit: Misfit, levels: Frequencies, words: Sequence[str], title: str) -> MisfitMap:
    points, size = misfit.points, misfit.size
    frequency = np.unique(points.frequency)
    panels = []
    for sensor, harmonic in list_curve_keys(misfit):
        rows = (points.sensor == sensor) & (points.harmonic == harmonic)
        image = np.full((len(levels), len(frequency)), np.nan)
        at = np.searchsorted(levels, points.level[rows]), np.searchsorted(frequency, points.frequency[rows])
        # Of two sweeps that are compared separately, draw the worse.
        np.fmax.at(image, at, size[rows])
        panels.append(MapPanel(sensor=sensor, harmonic=harmonic, size=image))
    mean = np.sqrt(np.nanmean(misfit.standardised**2))
    subtitle = f"level by frequency; all points together: {mean:.3g} standard deviations"
    return MisfitMap(panels=panels, levels=words, frequency=frequency, title=title, subtitle=subtitle)


def _has_phase(misfit: Misfit, panel: SensorPanel) -> bool:
    sensor, harmonic = panel.key
    points = misfit.points
    return bool(misfit.phased[(points.sensor == sensor) & (points.harmonic == harmonic)].any())


def _make_overlay(panel: SensorPanel, levels: Frequencies, has_phase: bool) -> OverlayPanel:
    sensor, harmonic = panel.key
    label = sensor if panel.per_level else f"{sensor}, harmonic {harmonic}"
    curves = [
        OverlayCurve(
            level=int(np.searchsorted(levels, curve.level)),
            frequency=curve.frequency,
            measured=curve.measured,
            deviation=curve.deviation,
            predicted=curve.predicted,
            line_frequency=curve.line_frequency,
            line=curve.line,
        )
        for curve in panel.curves
    ]
    return OverlayPanel(
        label=label if harmonic else f"{sensor}, static (predicted from rest)",
        unit=panel.unit,
        curves=curves,
        is_static=panel.is_static,
        has_phase=has_phase,
    )
