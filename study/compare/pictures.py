"""Figures of a comparison: maps of the misfit, and measured beside predicted responses."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.metric.misfit import CLEAR, Misfit, configuration
from correlation.model import LineSensor, Model, Sensor
from correlation.prediction import Points, Prediction, Predictor
from figure.frf_overlay import FrfOverlay, OverlayCurve, OverlayPanel
from figure.misfit_map import MapPanel, MisfitMap
from figure.registry import pictures as drawn_pictures

Frequencies = Float[NDArray[np.float64], " f"]

#: Parts of each step between two measured frequencies where lines are predicted.
FINER = 4
#: Units that a displacement, velocity, acceleration or force may be drawn in, with their factors.
SHOWN = {
    "displacement": (("mm", 1e3), ("um", 1e6), ("nm", 1e9)),
    "velocity": (("m/s", 1.0), ("mm/s", 1e3), ("um/s", 1e6)),
    "acceleration": (("m/s^2", 1.0), ("mm/s^2", 1e3)),
    "contact force": (("N", 1.0), ("mN", 1e3)),
}
#: The largest value drawn is at least this many units.
LARGEST = 0.3
#: Responses of which fewer stand out of the noise, measured or predicted, are not drawn.
WORTH_DRAWING = 0.05
ABOUT = {
    "frf": "response per newton of the exciting force, and its phase",
    "harmonics": "amplitudes of the higher harmonics",
    "forces": "amplitudes of the contact forces, summed over each line",
}
#: Said where static parts are drawn: their lines need not meet the points.
HISTORY = (
    "contact forces, summed over each line; static parts stem from a history that no test records, and need not agree"
)


def pictures(
    model: Model, train: Misfit, held_out: Misfit | None, prediction: Prediction, title: str
) -> dict[str, bytes]:
    """Draw all of them as PNG, by name.

    Parameters
    ----------
    model
        Model of the prediction.
    train, held_out
        Misfits; of what is held out, levels are drawn that training does not have.
    prediction
        Steady states to start from.
    title
        Above each figure.
    """
    everything, new = joined(train, held_out)
    drawn: dict[str, object] = {}
    for free in np.unique(everything.points.free):
        rows = everything.where(np.asarray(everything.points.free == free))
        name = configuration(bool(free))
        levels = np.unique(rows.points.level)
        words = [f"{level:g} N{', held out' if level in new else ''}" for level in levels.tolist()]
        drawn[f"map_{name}"] = _map(rows, levels, words, f"{title}: where the model fails, {name}")
        panels = _panels(model, rows, levels, prediction)
        for kind, (chosen, columns) in _figures(model, panels).items():
            if any(_stands_out(rows, key) for key, _ in chosen):
                drawn[f"{kind}_{name}"] = FrfOverlay(
                    panels=[panel for _, panel in chosen],
                    levels=words,
                    title=f"{title}: {kind} of the {name} structure" if kind != "frf" else f"{title}, {name}",
                    subtitle=HISTORY if any(panel.is_static for _, panel in chosen) else ABOUT[kind],
                    columns=columns,
                    with_phase=kind == "frf",
                )
    return drawn_pictures(drawn)


Key = tuple[str, int]


def _figures(
    model: Model, panels: Sequence[tuple[Key, OverlayPanel]]
) -> dict[str, tuple[list[tuple[Key, OverlayPanel]], int]]:
    """Panels of each figure and how many stand side by side: fundamental motions, their harmonics, contact forces."""
    lines = {sensor.name for sensor in model.sensors if isinstance(sensor, LineSensor)}
    forces = [item for item in panels if item[0][0] in lines]
    motions = [item for item in panels if item[0][0] not in lines]
    fundamental = [item for item in motions if item[0][1] == 1]
    higher = [item for item in motions if item[0][1] != 1]
    harmonics = len({key[1] for key, _ in forces})
    return {"frf": (fundamental, 2), "harmonics": (higher, 2), "forces": (forces, max(1, min(harmonics, 4)))}


def _stands_out(misfit: Misfit, key: Key) -> bool:
    """Whether a sensor's harmonic is more than noise."""
    rows = misfit.where(np.asarray((misfit.points.sensor == key[0]) & (misfit.points.harmonic == key[1])))
    noise = CLEAR * np.nan_to_num(rows.deviation)
    return any(float(np.mean(np.abs(item) > noise)) > WORTH_DRAWING for item in (rows.measured, rows.predicted))


def joined(train: Misfit, held_out: Misfit | None) -> tuple[Misfit, set[float]]:
    """Training data, and held-out levels; and which levels those are."""
    if held_out is None:
        return train, set()
    new = set(np.setdiff1d(held_out.points.level, train.points.level).tolist())
    more = held_out.where(np.isin(held_out.points.level, list(new)))
    points = Points(
        **{
            name: np.concatenate([getattr(train.points, name), getattr(more.points, name)])
            for name in ("free", "level", "frequency", "sensor", "harmonic")
        }
    )
    columns = {
        name: np.concatenate([getattr(train, name), getattr(more, name)])
        for name in ("motion", "measured", "predicted", "deviation", "standardised", "whitened")
    }
    return Misfit(points=points, **columns), new


def keys(misfit: Misfit) -> list[Key]:
    """Sensors in the order of the campaign, and the harmonics of each."""
    pairs = zip(map(str, misfit.points.sensor), misfit.points.harmonic.tolist(), strict=True)
    order = {name: number for number, name in enumerate(dict.fromkeys(map(str, misfit.points.sensor)))}
    # Static parts come last: few sensors have one.
    return sorted(dict.fromkeys(pairs), key=lambda key: (order[key[0]], key[1] == 0, key[1]))


def _map(misfit: Misfit, levels: Frequencies, words: Sequence[str], title: str) -> MisfitMap:
    points, size = misfit.points, misfit.size
    frequency = np.unique(points.frequency)
    panels = []
    for sensor, harmonic in keys(misfit):
        rows = (points.sensor == sensor) & (points.harmonic == harmonic)
        image = np.full((len(levels), len(frequency)), np.nan)
        at = np.searchsorted(levels, points.level[rows]), np.searchsorted(frequency, points.frequency[rows])
        image[at] = size[rows]
        panels.append(MapPanel(sensor=sensor, harmonic=harmonic, size=image))
    mean = np.sqrt(np.nanmean(misfit.standardised**2))
    subtitle = f"level by frequency; all points together: {mean:.3g} standard deviations"
    return MisfitMap(panels=panels, levels=words, frequency=frequency, title=title, subtitle=subtitle)


def _panels(
    model: Model, misfit: Misfit, levels: Frequencies, prediction: Prediction
) -> list[tuple[Key, OverlayPanel]]:
    fine = refine_points(misfit.points)
    lines = Predictor(points=fine).predict(model, prediction).value
    sensors = {sensor.name: sensor for sensor in model.sensors}
    panels = []
    for sensor, harmonic in keys(misfit):
        # Fundamental motions are drawn per newton: levels that agree lie on each other.
        per_level = harmonic == 1 and isinstance(sensors[sensor], Sensor)
        all_rows = np.flatnonzero((misfit.points.sensor == sensor) & (misfit.points.harmonic == harmonic))
        size = np.abs(misfit.measured[all_rows]) / (misfit.points.level[all_rows] if per_level else 1.0)
        unit, factor = choose_unit(sensors[sensor], float(size.max()))
        curves = []
        for number, level in enumerate(levels.tolist()):
            rows, drawn = (find_rows(points, sensor, harmonic, level) for points in (misfit.points, fine))
            if not len(rows):
                continue
            scale = factor / level if per_level else factor
            curves.append(
                OverlayCurve(
                    level=number,
                    frequency=misfit.points.frequency[rows],
                    measured=scale * misfit.measured[rows],
                    deviation=scale * misfit.deviation[rows],
                    line_frequency=fine.frequency[drawn],
                    line=scale * lines[drawn],
                )
            )
        label = (
            sensor
            if per_level
            else f"{sensor}, harmonic {harmonic}"
            if harmonic
            else f"{sensor}, static (predicted from rest)"
        )
        unit = f"{unit}/N" if per_level else unit
        panels.append(((sensor, harmonic), OverlayPanel(label=label, unit=unit, curves=curves, is_static=not harmonic)))
    return panels


def choose_unit(sensor: Sensor | LineSensor, largest: float) -> tuple[str, float]:
    """Unit that a sensor's largest value is drawn in, and its factor."""
    units = SHOWN["contact force" if isinstance(sensor, LineSensor) else sensor.quantity]
    return next((item for item in units if largest * item[1] >= LARGEST), units[-1])


def find_rows(points: Points, sensor: str, harmonic: int, level: float) -> NDArray[np.int64]:
    """Rows of one curve by ascending frequency."""
    rows = np.flatnonzero((points.sensor == sensor) & (points.harmonic == harmonic) & (points.level == level))
    return rows[np.argsort(points.frequency[rows], kind="stable")]


def refine_points(points: Points) -> Points:
    """The same curves at more frequencies, the measured ones among them."""
    columns: dict[str, list[NDArray[np.generic]]] = {
        name: [] for name in ("free", "level", "frequency", "sensor", "harmonic")
    }
    for sensor, harmonic in dict.fromkeys(zip(map(str, points.sensor), points.harmonic.tolist(), strict=True)):
        for level in np.unique(points.level).tolist():
            rows = find_rows(points, sensor, harmonic, level)
            if not len(rows):
                continue
            measured = points.frequency[rows]
            steps = np.arange(len(rows) - 1)[:, None] + np.arange(FINER) / FINER
            frequency = np.interp(np.append(steps.ravel(), len(rows) - 1), np.arange(len(rows)), measured)
            one = np.ones(len(frequency))
            columns["free"].append(np.full(len(one), points.free[rows[0]]))
            columns["level"].append(level * one)
            columns["frequency"].append(frequency)
            columns["sensor"].append(np.full(len(one), sensor))
            columns["harmonic"].append(np.full(len(one), harmonic, dtype=np.int64))
    return Points(**{name: np.concatenate(parts) for name, parts in columns.items()})
