"""Measured and predicted responses with residuals, one panel per sensor and harmonic."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from correlation.campaign.measurement import SWEEPS, Campaign, name_configuration
from correlation.feature.gap import find_gaps
from correlation.metric.misfit import Misfit
from correlation.metric.response import amplitude_error, phase_error
from correlation.model import DERIVATIVE, Sensor
from figure.style import choose_family_colours, typeset
from study.compare.curve import ComparedCurve, Drawing, SensorPanel, compute_phase, name_harmonic, stands_out
from study.compare.result import DIFFERS, ComparisonResult
from study.compare.section.section import Section
from study.page.number import round_list

Numbers = NDArray[np.float64]
Values = NDArray[np.complex128]
#: Largest number of readings of single runs on the page; of more, an even selection of runs is shown.
MOST_READINGS = 60_000
TEXT = (
    "Points are means of the repeats, with their standard deviations, thin lines are single runs, thick lines are "
    "predicted. Motions are drawn per unit of the level. Below the response: the difference between the prediction and "
    "each point. In standard deviations, the band of +-2 is what noise, friction histories and numerical "
    "error explain; of F / X, the real part is stiffness and inertia, the imaginary part damping."
)


def make_response_sections(compared: ComparisonResult, drawing: Drawing) -> Iterator[Section]:
    """Section on the responses of all sensors."""
    runs = _Runs(compared.campaign)
    levels = drawing.levels
    drawn = [(free, panel) for free, listed in drawing.panels.items() for panel in listed if panel.curves]
    panels = [_show_panel(runs, drawing.misfit[free], free, panel, levels) for free, panel in drawn]
    held_out = dict.fromkeys(drawing.held_out, " (held out)")
    words = [f"{level:g} {drawing.unit}{held_out.get(level, '')}" for level in levels.tolist()]
    thinned = "" if runs.step == 1 else f" One run in {runs.step} is drawn, since there are so many."
    first = choose_first_panel(drawn, drawing.misfit)
    data = {"levels": words, "colours": choose_family_colours(len(words)), "panels": panels, "first": first}
    yield Section(title="Measured and predicted responses", text=TEXT + thinned, element="responses", data=data)


def choose_first_panel(drawn: Sequence[tuple[bool, SensorPanel]], misfit: Mapping[bool, Misfit]) -> int:
    """Number of the first panel of a page.

    Of the panels above the noise it is the one with the largest misfit. If the model fails nowhere, it is the
    fundamental of the sensor that moves most.

    Parameters
    ----------
    drawn
        Panels with curves, each with whether the contacts are absent.
    misfit
        Misfits by whether the contacts are absent.
    """
    numbers = range(len(drawn))
    heard = [number for number in numbers if stands_out(misfit[drawn[number][0]], drawn[number][1].key)]
    sizes = {number: _compute_size(misfit[drawn[number][0]], drawn[number][1]) for number in heard}
    worst = max(heard, key=lambda number: sizes[number], default=0)
    if sizes.get(worst, 0.0) > DIFFERS:
        return worst
    return max(numbers, key=lambda number: _find_motion(*drawn[number]), default=0)


def _compute_size(misfit: Misfit, panel: SensorPanel) -> float:
    """Misfit of a panel, root mean square [standard deviations]."""
    rows = np.concatenate([curve.rows for curve in panel.curves])
    return float(np.nan_to_num(np.sqrt(np.nanmean(misfit.standardised[rows] ** 2))))


def _find_motion(free: bool, panel: SensorPanel) -> tuple[bool, float]:
    """Sort key: whether the contacts are present, and the largest displacement of a fundamental, otherwise 0 [m]."""
    if panel.key[1] != 1 or not isinstance(panel.sensor, Sensor):
        return not free, 0.0
    order = DERIVATIVE[panel.sensor.quantity]
    amplitudes = [
        np.abs(curve.measured) * (curve.level if panel.per_level else 1.0) / (2 * np.pi * curve.frequency) ** order
        for curve in panel.curves
    ]
    return not free, float(np.nanmax(np.concatenate(amplitudes))) / panel.scale


class _Runs:
    """Single runs of a campaign: one sweep of one repeat of a sensor's harmonic at one level."""

    def __init__(self, campaign: Campaign) -> None:
        self.campaign = campaign
        table = campaign.measurement
        free = campaign.is_free[table.test]
        level = np.unique(table.level, return_inverse=True)[1]
        columns = [free, table.sensor, table.harmonic, level, table.test, table.repeat, table.sweep]
        order = np.lexsort([table.frequency, *reversed(columns)])
        key = np.column_stack(columns)[order]
        ends = np.flatnonzero((np.diff(key, axis=0) != 0).any(axis=1)) + 1
        self.runs: dict[tuple[bool, str, int, float], list[NDArray[np.int64]]] = {}
        for rows in np.split(order, ends) if len(order) else []:
            row = rows[0]
            name = campaign.sensors[table.sensor[row]].name
            curve = bool(free[row]), name, int(table.harmonic[row]), float(table.level[row])
            self.runs.setdefault(curve, []).append(rows)
        self.step = -(-len(order) // MOST_READINGS)

    def list_runs(self, free: bool, panel: SensorPanel, curve: ComparedCurve) -> list[dict[str, Any]]:
        """Runs of a curve as data, in the unit of its panel."""
        table, listed = self.campaign.measurement, self.runs.get((free, *panel.key, curve.level), [])
        if curve.sweep:
            listed = [rows for rows in listed if table.sweep[rows[0]] == curve.sweep]
        result = []
        for rows in listed[:: self.step]:
            frequency, value = table.frequency[rows], panel.factor(table.force[rows]) * table.value[rows]
            # The line of a run does not bridge a gap between two bands.
            after = find_gaps(frequency) + 1
            result.append(
                {
                    "name": f"repeat {table.repeat[rows[0]]}, {SWEEPS[int(table.sweep[rows[0]])]}".replace(
                        ", none", ""
                    ),
                    "frequency": round_list(np.insert(frequency, after, frequency[after]), 7),
                    **_show_values(np.insert(value, after, np.nan), panel, 0.0, 4),
                }
            )
        return result

    def has_phase(self, sensor: str) -> bool:
        """Whether a sensor's values are complex."""
        return all(item.has_phase for item in self.campaign.sensors if item.name == sensor)


def _show_panel(runs: _Runs, misfit: Misfit, free: bool, panel: SensorPanel, levels: Numbers) -> dict[str, Any]:
    sensor, harmonic = panel.key
    return {
        "configuration": name_configuration(free),
        "label": f"{sensor}, {name_harmonic(harmonic)}",
        "unit": typeset(panel.unit),
        "static": panel.is_static,
        "harmonic": harmonic,
        "phase": runs.has_phase(sensor) and not panel.is_static,
        "feature": _name_feature(panel),
        "groups": [
            {
                "level": int(np.searchsorted(levels, curve.level)),
                "sweep": curve.sweep,
                "frequency": round_list(curve.frequency, 8),
                "deviation": round_list(curve.deviation),
                **_show_values(curve.measured, panel, curve.deviation),
                "line_frequency": round_list(curve.line_frequency, 8),
                "line": _show_values(curve.line, panel, float(np.median(curve.deviation)), beside=curve.measured),
                "residual": _show_residual(curve, misfit, panel),
                "runs": runs.list_runs(free, panel, curve),
            }
            for curve in panel.curves
        ],
    }


def _name_feature(panel: SensorPanel) -> str:
    """Name of the feature with drawn standard deviations."""
    return "F / X" if panel.per_level else "the static part" if panel.is_static else "the ratio to the largest motion"


def _show_residual(curve: ComparedCurve, misfit: Misfit, panel: SensorPanel) -> dict[str, Any]:
    standardised = misfit.standardised[curve.rows]
    # A prediction below the measurement is negative, as in the other units.
    result = {"real": round_list(-standardised[:, 0], 4), "imaginary": round_list(-standardised[:, 1], 4)}
    if panel.is_static:
        return {**result, "amplitude": round_list((curve.predicted - curve.measured).real, 4)}
    with np.errstate(divide="ignore", invalid="ignore"):
        deviation = np.nan_to_num(curve.deviation / np.abs(curve.measured), posinf=0.0)
        amplitude = 100 * amplitude_error(curve.measured, curve.predicted)
        phase = np.degrees(phase_error(curve.measured, curve.predicted))
    return {
        **result,
        "amplitude": round_list(amplitude, 4),
        "amplitude_deviation": round_list(100 * deviation, 3),
        "phase": round_list(phase, 4),
        "phase_deviation": round_list(np.degrees(deviation), 3),
    }


def _show_values(
    value: Values, panel: SensorPanel, deviation: Numbers | float, digits: int = 5, beside: Values | None = None
) -> dict[str, Any]:
    """Amplitude and phase; a static part with its sign."""
    if panel.is_static:
        return {"amplitude": round_list(value.real, digits)}
    phase = compute_phase(value, deviation, panel.key[1])
    if beside is not None and panel.key[1] == 1 and len(phase):
        first = compute_phase(beside, 0.0, 1)
        there = np.flatnonzero(np.isfinite(phase))
        if len(there) and np.isfinite(first[0]):
            phase = phase + 360 * np.round((first[0] - phase[there[0]]) / 360)
    return {"amplitude": round_list(np.abs(value), digits), "phase": round_list(phase, digits)}
