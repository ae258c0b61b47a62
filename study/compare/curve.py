"""Measured, predicted and interpolated curves of a comparison, for both its figures and its page."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.feature.gap import find_gaps
from correlation.feature.observation import find_sweep_directions
from correlation.metric.misfit import MIN_SIZE_OVER_DEVIATION, Misfit
from correlation.model import AnySensor, Model, Sensor
from correlation.prediction import Points, Prediction, Predictor
from correlation.row_group import group_rows
from correlation.row_table import join_tables
from study.compare.drawn_unit import choose_unit, format_per_level_unit
from study.compare.result import ComparisonResult

Frequencies = Float[NDArray[np.float64], " f"]
Coefficients = Complex[NDArray[np.complex128], " f"]
Rows = NDArray[np.int64]
#: Sensor and harmonic.
Key = tuple[str, int]

#: Number of points of a line over a band, and at most in each step between two measured frequencies.
LINE_POINTS, FINER = 80, 4
#: Residual of a line relative to the linear motion: far below the line width in a figure [-].
LINE_TOLERANCE = 1e-6
#: Responses with a smaller share of points above the noise, measured and predicted, are not drawn [-].
WORTH_DRAWING = 0.05


@dataclass(frozen=True, kw_only=True, eq=False)
class ComparedCurve:
    """Curve of one sensor and harmonic at one level, in its drawn unit.

    Parameters
    ----------
    level
        Level [N].
    sweep
        +1 up, -1 down, 0 for the mean of both.
    rows
        Rows of the misfit, by ascending frequency, shape (f,).
    frequency, measured, deviation, predicted
        Measured frequencies [Hz], means, their standard deviations, and the prediction there, shape (f,).
    line_frequency, line
        Predicted line, shape (p,); NaN in gaps between separately measured bands.
    """

    level: float
    sweep: int
    rows: Rows
    frequency: Frequencies
    measured: Coefficients
    deviation: Frequencies
    predicted: Coefficients
    line_frequency: Float[NDArray[np.float64], " p"]
    line: Complex[NDArray[np.complex128], " p"]


@dataclass(frozen=True, kw_only=True, eq=False)
class SensorPanel:
    """All levels of one sensor and harmonic.

    Parameters
    ----------
    key
        Sensor and harmonic.
    sensor
        Sensor of the model.
    unit, scale
        Drawn unit, and its factor on SI; per unit of the force if `per_level`.
    per_level
        Whether values are divided by the level, so that the levels of a linear structure coincide.
    curves
        Curves by level.
    """

    key: Key
    sensor: AnySensor
    unit: str
    scale: float
    per_level: bool
    curves: tuple[ComparedCurve, ...] = ()

    @property
    def is_static(self) -> bool:
        """Whether values are real."""
        return self.key[1] == 0

    def factor(self, force: Frequencies) -> Frequencies:
        """Factor on values in SI under some amplitudes of the force [N]."""
        return self.scale / force if self.per_level else np.full_like(force, self.scale)


@dataclass(frozen=True, kw_only=True, eq=False)
class Drawing:
    """All curves of a comparison, by whether the contacts are absent.

    Parameters
    ----------
    misfit
        Training data and held-out levels.
    panels
        Curves of every sensor and harmonic.
    held_out
        Held-out levels [unit].
    unit
        Unit of the levels.
    """

    misfit: Mapping[bool, Misfit]
    panels: Mapping[bool, Sequence[SensorPanel]]
    held_out: frozenset[float]
    unit: str = "N"

    @classmethod
    def of(
        cls, compared: ComparisonResult, lines: Mapping[bool, tuple[Points, Coefficients]] | None = None
    ) -> "Drawing":
        """Curves of a comparison with its predicted lines by whether the contacts are absent; predicted by default."""
        everything, new = join_sides(compared.train, compared.held_out)
        free = everything.points.free
        misfit = {bool(item): everything.where(np.asarray(free == item)) for item in np.unique(free)}
        campaign, model = compared.campaign, compared.model
        sweeps, unit = find_sweep_directions(campaign), campaign.drive.unit
        units = {sensor.name: sensor.unit for sensor in campaign.sensors}
        lines = lines or {
            item: predict_lines(model, rows, compared.prediction, sweeps) for item, rows in misfit.items()
        }
        panels = {item: make_panels(model, rows, lines[item], units, unit) for item, rows in misfit.items()}
        return cls(misfit=misfit, panels=panels, held_out=frozenset(new), unit=unit)

    @property
    def levels(self) -> Frequencies:
        """All levels, ascending [unit]."""
        return np.unique(np.concatenate([rows.points.level for rows in self.misfit.values()]))


def predict_lines(
    model: Model, misfit: Misfit, prediction: Prediction, sweeps: tuple[int, ...] = ()
) -> tuple[Points, Coefficients]:
    """Predicted lines through the points of a misfit: from rest, or swept if branches are compared separately."""
    fine = refine_points(misfit.points)
    swept = sweeps if fine.sweep.any() else ()
    return fine, Predictor(points=fine, sweeps=swept, tolerance=LINE_TOLERANCE).vary(model, prediction)


def make_panels(
    model: Model, misfit: Misfit, lines: tuple[Points, Coefficients], units: Mapping[str, str], level_unit: str = "N"
) -> list[SensorPanel]:
    """Curves of every sensor and harmonic of one configuration; `units` are those of the measured values by sensor."""
    fine, line = lines
    sensors = {sensor.name: sensor for sensor in model.sensors}
    panels, points, lines_of = [], list(_split_curves(misfit.points)), dict(_split_curves(fine))
    for key in list_curve_keys(misfit):
        sensor = sensors[key[0]]
        per_level = key[1] == 1 and isinstance(sensor, Sensor)
        own = (misfit.points.sensor == key[0]) & (misfit.points.harmonic == key[1])
        size = np.abs(misfit.measured[own]) / (misfit.points.force[own] if per_level else 1.0)
        unit, scale = choose_unit(units[key[0]], float(size.max()))
        if per_level:
            unit = format_per_level_unit(unit, level_unit)
        panel = SensorPanel(key=key, sensor=sensor, unit=unit, scale=scale, per_level=per_level)
        curves = []
        for (other, level, sweep), rows in points:
            if other != key:
                continue
            drawn, factor = lines_of[other, level, sweep], panel.factor(misfit.points.force[rows])
            curves.append(
                ComparedCurve(
                    level=level,
                    sweep=sweep,
                    rows=rows,
                    frequency=misfit.points.frequency[rows],
                    measured=factor * misfit.measured[rows],
                    deviation=factor * misfit.deviation[rows],
                    predicted=factor * misfit.predicted[rows],
                    line_frequency=fine.frequency[drawn],
                    line=blank_gaps(fine, misfit.points.frequency[rows], panel.factor(fine.force) * line, drawn),
                )
            )
        panels.append(replace(panel, curves=tuple(curves)))
    return panels


def compute_phase(value: Coefficients, deviation: Frequencies | float, harmonic: int) -> Frequencies:
    """Phase [deg]: unwrapped from -90 to 270 for a fundamental, else from -180 to 180 where above the noise."""
    phase = np.degrees(np.angle(np.nan_to_num(value)))
    if harmonic == 1:
        # Unwrap over the existing values alone.
        there = np.isfinite(value) if np.isfinite(value).any() else np.ones(len(value), dtype=bool)
        phase[there] = np.unwrap(phase[there], period=360)
        phase -= 360 * np.ceil((phase[there][0] - 270) / 360)
        return np.asarray(np.where(np.isfinite(value), phase, np.nan))
    return np.asarray(np.where(np.nan_to_num(np.abs(value)) > MIN_SIZE_OVER_DEVIATION * deviation, phase, np.nan))


def name_harmonic(harmonic: int) -> str:
    """Name of a harmonic: "static", "fundamental", "harmonic 3"."""
    return {0: "static", 1: "fundamental"}.get(harmonic, f"harmonic {harmonic}")


def stands_out(misfit: Misfit, key: Key) -> bool:
    """Whether a harmonic of a sensor is above the noise."""
    rows = misfit.where(np.asarray((misfit.points.sensor == key[0]) & (misfit.points.harmonic == key[1])))
    noise = MIN_SIZE_OVER_DEVIATION * rows.deviation
    return any(float(np.mean(np.abs(item) > noise)) > WORTH_DRAWING for item in (rows.measured, rows.predicted))


def join_sides(train: Misfit, held_out: Misfit | None) -> tuple[Misfit, set[float]]:
    """Training data, and held-out levels; and which levels those are."""
    if held_out is None:
        return train, set()
    new = set(np.setdiff1d(held_out.points.level, train.points.level).tolist())
    return join_tables([train, held_out.where(np.isin(held_out.points.level, list(new)))]), new


def list_curve_keys(misfit: Misfit) -> list[Key]:
    """Sensors in the order of the campaign, and the harmonics of each."""
    pairs = zip(map(str, misfit.points.sensor), misfit.points.harmonic.tolist(), strict=True)
    order = {name: number for number, name in enumerate(dict.fromkeys(map(str, misfit.points.sensor)))}
    # Static parts come last: few sensors have one.
    return sorted(dict.fromkeys(pairs), key=lambda key: (order[key[0]], key[1] == 0, key[1]))


def find_rows(points: Points, sensor: str, harmonic: int, level: float) -> Rows:
    """Rows of one sensor, harmonic and level by ascending frequency."""
    rows = np.flatnonzero((points.sensor == sensor) & (points.harmonic == harmonic) & (points.level == level))
    return rows[np.argsort(points.frequency[rows], kind="stable")]


def refine_points(points: Points) -> Points:
    """Refine the frequencies of curves: keep the measured ones, and add one within each gap between bands."""
    parts = []
    for _, rows in _split_curves(points):
        measured = points.frequency[rows]
        parts_of_step = int(np.clip(-(-LINE_POINTS // max(len(rows) - 1, 1)), 1, FINER))
        steps, gaps = np.arange(len(rows) - 1), find_gaps(measured)
        finer = np.setdiff1d(steps, gaps)[:, None] + np.arange(parts_of_step) / parts_of_step
        places = np.sort(np.concatenate([finer.ravel(), gaps, gaps + 0.5, [len(rows) - 1]]))
        frequency = np.interp(places, np.arange(len(rows)), measured)
        force = np.interp(frequency, measured, points.force[rows])
        parts.append(replace(points.where(np.repeat(rows[:1], len(frequency))), frequency=frequency, force=force))
    return join_tables(parts)


def blank_gaps(points: Points, measured: Frequencies, line: Coefficients, rows: Rows) -> Coefficients:
    """Values of some rows of a line, NaN in the gaps of the measured frequencies, so that no line bridges them.

    Parameters
    ----------
    points, line
        Points of lines and their values, shape (p,).
    measured
        Measured frequencies of one curve, ascending, shape (f,) [Hz].
    rows
        Rows of the line of that curve, shape (n,).
    """
    frequency, value = points.frequency[rows], line[rows].copy()
    for gap in find_gaps(measured):
        value[(frequency > measured[gap]) & (frequency < measured[gap + 1])] = np.nan
    return value


def _split_curves(points: Points) -> Iterator[tuple[tuple[Key, float, int], Rows]]:
    """Rows of each curve by ascending frequency: of one sensor, harmonic, level and direction of sweep."""
    number = group_rows([points.level, points.sweep, points.sensor, points.harmonic]).number
    order = np.lexsort([points.frequency, number])
    for rows in np.split(order, np.flatnonzero(np.diff(number[order])) + 1) if len(order) else []:
        key = str(points.sensor[rows[0]]), int(points.harmonic[rows[0]])
        yield (key, float(points.level[rows[0]]), int(points.sweep[rows[0]])), rows
