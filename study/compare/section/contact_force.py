"""Contact forces: the largest fundamental and the static part of every line, measured and predicted."""

from collections.abc import Iterator

import numpy as np

from correlation.campaign.measurement import name_configuration
from correlation.model import LineSensor
from study.compare.curve import ComparedCurve, Drawing, SensorPanel
from study.compare.result import ComparisonResult
from study.compare.section.section import Section
from study.page.table import Table

TEXT = (
    "Forces summed over each contact line. Of the fundamental: the amplitude where it is largest in "
    "the measurement. Static parts are means over the measured frequencies; they depend on the loading history of the "
    "contacts, which no test records; the prediction begins at rest and need not agree."
)


def make_contact_force_sections(compared: ComparisonResult, drawing: Drawing) -> Iterator[Section]:
    """Section on contact forces, if the force of a line was measured."""
    del compared
    rows = [
        [
            name_configuration(free),
            panel.key[0],
            _format_harmonic(panel),
            f"{curve.level:g} {drawing.unit}",
            *_format_numbers(panel, curve),
        ]
        for free, panels in drawing.panels.items()
        for panel in panels
        if isinstance(panel.sensor, LineSensor) and panel.key[1] <= 1
        for curve in panel.curves
    ]
    if rows:
        head = ("structure", "force", "harmonic", "level", "at [Hz]", "measured [N]", "predicted [N]", "error")
        yield Section(title="Contact forces", text=TEXT, table=Table(head=head, rows=rows, words=4))


def _format_harmonic(panel: SensorPanel) -> str:
    return "static" if panel.is_static else str(panel.key[1])


def _format_numbers(panel: SensorPanel, curve: ComparedCurve) -> list[str]:
    if panel.is_static:
        measured, predicted = (float(np.nanmean(value.real)) for value in (curve.measured, curve.predicted))
        at = ""
    else:
        row = int(np.argmax(np.abs(curve.measured)))
        measured, predicted = (float(np.abs(value[row])) for value in (curve.measured, curve.predicted))
        at = f"{curve.frequency[row]:.5g}"
    error = f"{100 * (predicted / measured - 1):+.1f} %" if measured and np.isfinite(predicted) else ""
    return [at, f"{measured / panel.scale:.4g}", f"{predicted / panel.scale:.4g}", error]
