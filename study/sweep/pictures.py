"""Figures of a sweep: curves coloured by a parameter, and peaks and limits over the parameter."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from figure.force_limits import ForceLimits, LineForceLimits
from figure.limit_levels import LimitsByLevel
from figure.parameter_curves import LINES, ParameterCurve, ParameterCurves
from figure.parameter_trends import ParameterTrends, TrendLine
from figure.style import choose_evenly
from reduction.array_type import Real
from study.limits.several.pictures import name_stems
from study.solve.result import DISPLAY_UNIT
from study.sweep.grid import Grid
from study.sweep.result import SampledCase, SampledLimits

#: Largest numbers of panels, of curves of a trend and of figures of limits; the files have all results.
MOST_PANELS, MOST_GROUPS, MOST_FIGURES = 4, 6, 6


@dataclass(frozen=True, kw_only=True)
class _Slice:
    """Points of a grid along one parameter, at one value of each of the others."""

    label: str
    points: tuple[int, ...]


def draw_sweep(grid: Grid, sampled: SampledCase, title: str) -> dict[str, object]:
    """Make the figures by name, for each parameter with several values, or for the first parameter."""
    varied = [number for number, count in enumerate(grid.shape) if count > 1] or [0]
    drawn: dict[str, object] = {}
    for number in varied:
        suffix = f"_{number + 1}" if len(varied) > 1 else ""
        slices = list(_list_slices(grid, number))
        if sampled.curves is not None:
            drawn[f"sweep_curves{suffix}"] = _make_curves(grid, number, slices, sampled, title)
            drawn[f"sweep_peaks{suffix}"] = _make_trends(grid, number, slices, sampled, title)
        if sampled.limits and grid.shape[number] > 1:
            drawn |= _make_all_limits(grid, number, slices, sampled, title, suffix)
    return drawn


def _list_slices(grid: Grid, number: int) -> Iterator[_Slice]:
    """Yield at most as many slices as there are line styles, with the first and the last."""
    others = [item for item in range(len(grid.shape)) if item != number]
    combinations = list(itertools.product(*(range(grid.shape[item]) for item in others)))
    for place in choose_evenly(len(combinations), len(LINES)):
        at = dict(zip(others, combinations[place], strict=True))
        label = ", ".join(grid.parameters[item].text(grid.values[item][at[item]]) for item in others)
        along = sorted(range(grid.shape[number]), key=lambda value: grid.values[number][value])
        points = [
            int(np.ravel_multi_index([at.get(item, value) for item in range(len(grid.shape))], grid.shape))
            for value in along
        ]
        yield _Slice(label=label, points=tuple(points))


def _make_curves(grid: Grid, number: int, slices: list[_Slice], sampled: SampledCase, title: str) -> ParameterCurves:
    assert sampled.curves is not None
    model = sampled.curves.model
    unit, scale = DISPLAY_UNIT[model.outputs[0].quantity]
    panels = []
    for place in choose_evenly(len(model.curves), MOST_PANELS):
        own = [
            (sampled.curves.curves[point][place], float(sampled.values[point, number]), line)
            for line, item in enumerate(slices)
            for point in item.points
        ]
        curves = [
            ParameterCurve(value=value, line=line, along=item.parameter, amplitude=scale * np.abs(item.response[0]))
            for item, value, line in own
        ]
        panels.append((model.curves[place].label, curves))
    over_frequency = model.curves[0].parameter == "frequency"
    return ParameterCurves(
        panels=panels,
        colour_label=grid.parameters[number].label,
        lines=[item.label for item in slices],
        along_label="frequency [Hz]" if over_frequency else "level of the harmonic force [-]",
        amplitude_label=f"amplitude [{unit}]",
        title=title,
        subtitle=f"{model.outputs[0].quantity} of {model.outputs[0].name} over {grid.parameters[number].name}",
    )


def _make_trends(grid: Grid, number: int, slices: list[_Slice], sampled: SampledCase, title: str) -> ParameterTrends:
    assert sampled.curves is not None
    model, quantities = sampled.curves.model, sampled.curve_quantities()[:, :, 0]
    unit, scale = DISPLAY_UNIT[model.outputs[0].quantity]
    trends, shown = [], choose_evenly(len(model.curves), MOST_GROUPS)
    for group, place in enumerate(shown):
        for line, item in enumerate(slices):
            own = quantities[list(item.points), place]
            trends.append(
                TrendLine(
                    group=group,
                    line=line,
                    value=sampled.values[list(item.points), number],
                    quantity=np.array([own[:, 0], scale * own[:, 1], 100 * own[:, 2]]),
                    doubtful=own[:, 3] == 1,
                )
            )
    over_frequency = model.curves[0].parameter == "frequency"
    return ParameterTrends(
        trends=trends,
        groups=[model.curves[place].label for place in shown],
        lines=[item.label for item in slices],
        quantity_labels=(
            "peak frequency [Hz]" if over_frequency else "level of the peak [-]",
            f"peak amplitude [{unit}]",
            "equivalent damping ratio [%]",
        ),
        parameter_label=grid.parameters[number].label,
        title=title,
        subtitle=f"highest {model.outputs[0].quantity} of {model.outputs[0].name}, and damping there",
    )


def _make_all_limits(
    grid: Grid, number: int, slices: list[_Slice], sampled: SampledCase, title: str, suffix: str
) -> dict[str, object]:
    """Make figures of limits over a parameter, of each motion and of all forces, at some levels and other values."""
    levels = sampled.limits[0].first.limits.level
    cases = [(level, item) for level in range(len(levels)) for item in slices]
    motions = [item for item in sampled.limits if item.quantity.output is not None or len(sampled.limits) == 1]
    forces = [item for item in sampled.limits if item not in motions]
    stems = name_stems(item.quantity for item in motions)
    values, label = sampled.values[:, number], grid.parameters[number].label
    drawn: dict[str, object] = {}
    for count, place in enumerate(choose_evenly(len(cases), max(MOST_FIGURES // max(len(motions), 1), 2))):
        level, item = cases[place]
        points = list(item.points)
        where = f"{title}: limits at {', '.join(filter(None, (f'level {levels[level]:g}', item.label)))}"
        for own in motions:
            stem = f"_{stems[own.quantity.place]}" if len(sampled.limits) > 1 else ""
            drawn[f"sweep_limits{suffix}{stem}_{count + 1}"] = _limits(own, points, level, values[points], where, label)
        if forces:
            panels = [
                ForceLimits(
                    line=own.quantity.place, force=own.quantity.force, level=values[points],
                    value=own.peaks()[points, :, level, 0].T, sampled=np.zeros((0, len(points))),
                )
                for own in forces
            ]  # fmt: skip
            drawn[f"sweep_limit_forces{suffix}_{count + 1}"] = LineForceLimits(
                panels=panels, title=where, level_label=label
            )
    return drawn


def _limits(
    limits: SampledLimits, points: list[int], level: int, values: Real, title: str, label: str
) -> LimitsByLevel:
    """Make the figure of the peaks of both limits of a quantity at some points."""
    last = len(limits.first.limits.frequency) - 1
    value, frequency = np.moveaxis(limits.peaks()[points, :, level], (0, 1, 2), (2, 1, 0))
    doubtful = np.zeros(value.shape, dtype=bool)
    for column, point in enumerate(points):
        own = limits.points[point]
        for side in range(2):
            at = own.extreme(side, level)
            at_end = last > 0 and at in {0, last}
            doubtful[side, column] = at is not None and bool(own.jump[side, level, at] or at_end)
    return LimitsByLevel(
        level=values, value=value, frequency=frequency, doubtful=doubtful, title=title,
        amplitude_label=limits.first.label, level_label=label,
    )  # fmt: skip
