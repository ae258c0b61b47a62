"""Figures of families over limits: one per sensor of motion, one per contact line with all of its forces."""

from collections.abc import Mapping, Sequence

import numpy as np

from correlation.campaign.measurement import MeasuredSensor
from correlation.family.verdict import FamilyVerdict
from figure.family_over_limits import FamiliesOverLimits, FamilyPanel, FamilyRow, MeasuredCurve
from figure.style import choose_evenly
from study.compare.drawn_unit import choose_unit

#: Panels in a row of a motion, and levels of a line's forces.
COLUMNS, MOST_LEVELS = 2, 4
#: Symbols of the forces of a line.
SYMBOL = {"tangential": "T", "normal": "N"}
HISTORIES = {0: "static", 1: "dynamic"}


def make_family_figures(
    verdicts: Sequence[FamilyVerdict], sensors: Mapping[str, MeasuredSensor], title: str, unit: str
) -> dict[str, FamiliesOverLimits]:
    """Figures by name.

    Parameters
    ----------
    verdicts
        Families over their bands.
    sensors
        Measured sensors by name.
    title
        Title of the case.
    unit
        Unit of the levels.
    """
    drawn: dict[str, FamiliesOverLimits] = {}
    for name in dict.fromkeys(item.family.sensor for item in verdicts):
        sensor = sensors[name]
        own = [item for item in verdicts if item.family.sensor == name]
        if sensor.line is None:
            panels, shown = _make_panels(own, sensor, unit)
            label = f"{sensor.quantity} [{shown}]"
            rows = [
                FamilyRow(label=label, panels=panels[first : first + COLUMNS])
                for first in range(0, len(panels), COLUMNS)
            ]
            drawn[f"families_{name}"] = FamiliesOverLimits(
                rows=rows, title=f"{title}: {name}", subtitle="measured amplitudes over the limits of all histories"
            )
    for line in dict.fromkeys(item.line for item in sensors.values() if item.line is not None):
        rows = _make_force_rows([item for item in verdicts if sensors[item.family.sensor].line == line], sensors, unit)
        if rows:
            drawn[f"families_{line}"] = FamiliesOverLimits(
                rows=rows, title=f"{title}: contact forces of {line}",
                subtitle="static parts and amplitudes, measured over the limits of all histories",
            )  # fmt: skip
    return drawn


def _make_force_rows(
    verdicts: Sequence[FamilyVerdict], sensors: Mapping[str, MeasuredSensor], unit: str
) -> list[FamilyRow]:
    rows = []
    for harmonic in (0, 1):
        for component, symbol in SYMBOL.items():
            own = [
                item
                for item in verdicts
                if item.family.harmonic == harmonic and sensors[item.family.sensor].component == component
            ]
            for name in dict.fromkeys(item.family.sensor for item in own):
                mine = [item for item in own if item.family.sensor == name]
                chosen = [mine[number] for number in choose_evenly(len(mine), MOST_LEVELS)]
                panels, shown = _make_panels(chosen, sensors[name], unit)
                label = f"{symbol} {HISTORIES[harmonic]} [{shown}]"
                rows.append(FamilyRow(label=label, panels=panels, share=harmonic == 0))
    return rows


def _make_panels(verdicts: Sequence[FamilyVerdict], sensor: MeasuredSensor, unit: str) -> tuple[list[FamilyPanel], str]:
    """Panels of the levels, and their unit."""
    largest = max(float(np.abs(item.family.value).max()) for item in verdicts)
    shown, factor = choose_unit(sensor.unit, largest)
    panels = []
    for verdict in verdicts:
        outside = np.split(verdict.outside, np.cumsum([len(c.frequency) for c in verdict.family.curves])[:-1])
        curves = [
            MeasuredCurve(
                repeat=curve.repeat,
                sweep=curve.sweep,
                frequency=curve.frequency,
                value=factor * curve.value,
                outside=out,
            )
            for curve, out in zip(verdict.family.curves, outside, strict=True)
        ]
        band = verdict.band
        panels.append(
            FamilyPanel(
                label=f"{verdict.family.level:g} {unit}", frequency=band.frequency, limit=factor * band.value,
                jump=band.jump, curves=curves,
            )
        )  # fmt: skip
    return panels, shown
