"""Measures a campaign on a specimen: sweeps on the virtual bench, then readings of the sensors with noise."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.strangers.hidden import Hidden
from benchmarks.strangers.layout import Grid, Layout
from benchmarks.strangers.specimen import Specimen, pressed
from correlation.campaign.measurement import Campaign, MeasuredSensor, Measurement, Test
from correlation.model import DERIVATIVE, Model
from transient.virtual_bench.sweep import SweepReadings, VirtualSweepTest

PRELOAD_JITTER, FREQUENCY_JITTER, HISTORY = 0.01, 3e-4, 0.9
#: Time steps per period; with half as many, motions with slip have errors of up to 0.2 %.
STEPS_PER_PERIOD = 256
#: Standard deviation of a measured force [-]; positions of harmonics in the readings of the bench.
FORCE_NOISE, MOTION, FORCE = 1e-3, {1: 0, 3: 1}, {0: 0, 1: 1}


@dataclass(frozen=True, kw_only=True)
class Sweeps:
    """Statistics of the integration."""

    n_point: int
    n_not_periodic: int
    n_period: int
    slip: dict[str, float]
    """Largest slip fraction at each level, mean over the contacts [-]."""


def measure(
    specimen: Specimen,
    layout: Layout,
    hidden: list[Hidden],
    floor: dict[str, float],
    droop: dict[str, NDArray[np.float64]],
    random: np.random.Generator,
) -> tuple[Campaign, Sweeps]:
    """Measure a campaign with noise.

    Parameters
    ----------
    specimen, layout, hidden
        Specimen, layout of the campaign, and hidden effects.
    floor
        Absolute standard deviation of each sensor [its unit].
    droop
        Fraction of the force that remains at each frequency of a test, by name of the test [-].
    random
        Generator of repeats and noise.
    """
    table: list[tuple[float, ...]] = []
    values: list[complex] = []
    slip: dict[str, float] = {}
    n_point = n_lost = n_period = 0
    systems = {grid.configuration: specimen.system(grid.configuration) for grid in layout.grids}
    for repeat in range(1, layout.n_repeat + 1):
        preload, shift = 1 + random.standard_normal(2) * [PRELOAD_JITTER, FREQUENCY_JITTER]
        benches: dict[str, VirtualSweepTest] = {}
        for test, grid in enumerate(layout.grids):
            if grid.configuration not in benches:
                system, rows = systems[grid.configuration]
                benches[grid.configuration] = VirtualSweepTest(pressed(system, float(preload)), rows, STEPS_PER_PERIOD)
            bench = benches[grid.configuration]
            count = sum(joint.normal_direction is not None for joint in bench.system.joints)
            order = [number for way in layout.ways for number in range(len(grid.frequencies))[::way]]
            ways = [way for way in layout.ways for _ in grid.frequencies]
            for level in grid.levels:
                force = level * droop[grid.name][order]
                swept = bench.sweep(
                    [float(grid.frequencies[number] * shift) for number in order], force.tolist(),
                    random.uniform(-HISTORY, HISTORY, count) if count else None,
                )  # fmt: skip
                n_point, n_lost = n_point + len(order), n_lost + int((~swept.periodic).sum())
                n_period += int(swept.n_period.sum())
                if grid.configuration == "jointed":
                    slip[f"{level:g}"] = max(slip.get(f"{level:g}", 0.0), float(swept.slip_share.max()))
                for place in np.flatnonzero(swept.periodic).tolist():
                    frequency = grid.frequencies[order[place]]
                    head = (test, repeat, ways[place], level, frequency, float(force[place]))
                    for sensor, harmonic, value in _read(specimen, layout, swept, grid, place):
                        table.append((*head, sensor, harmonic))
                        values.append(value)
    campaign = _campaign(layout, hidden, floor, np.array(table), np.array(values), random)
    return campaign, Sweeps(n_point=n_point, n_not_periodic=n_lost, n_period=n_period, slip=slip)


def _read(
    specimen: Specimen, layout: Layout, swept: SweepReadings, grid: Grid, place: int
) -> list[tuple[int, int, complex]]:
    """Sensor numbers, harmonics and readings without noise at a point."""
    model = specimen.free if grid.configuration == "free" else specimen.jointed
    gain, motions = {item.name: item.gain for item in model.sensors}, _motions(model)
    rows = []
    for number, sensor in enumerate(layout.sensors):
        if sensor.line is None:
            for harmonic in layout.harmonics:
                rate = (2j * np.pi * harmonic) ** DERIVATIVE[sensor.quantity]
                value = swept.motion[place, motions.index(sensor.name), MOTION[harmonic]]
                rows.append((number, harmonic, complex(gain[sensor.name] * rate * value)))
        elif grid.configuration == "jointed":
            line = 2 * list(model.lines).index(sensor.line) + int(sensor.component == "normal")
            for harmonic, column in FORCE.items():
                rows.append((number, harmonic, complex(gain[sensor.name] * swept.force[place, line, column])))
    return rows


def _motions(model: Model) -> list[str]:
    """Names of the motion sensors, in the order of the bench."""
    return [item.name for item in model.sensors if hasattr(item, "row")]


def _campaign(
    layout: Layout, hidden: list[Hidden], floor: dict[str, float], table: NDArray[np.float64],
    values: NDArray[np.complex128], random: np.random.Generator,
) -> Campaign:  # fmt: skip
    """Campaign of readings with derivative, delay and noise, with or without phase."""
    test, repeat, sweep, level, frequency, force, sensor, harmonic = table.T
    names = [item.name for item in layout.sensors]
    number = sensor.astype(int)
    order = np.array([DERIVATIVE.get(item.quantity, 0) for item in layout.sensors])[number]
    values = values * frequency**order
    late = np.array([sum(effect.delay(name) for effect in hidden) for name in names])[number]
    values = values * np.exp(-2j * np.pi * harmonic * frequency * late)
    noise = (random.standard_normal((2, len(values))) + 1j * random.standard_normal((2, len(values)))) / np.sqrt(2)
    absolute = np.array([floor[name] for name in names])[number]
    values = values * (1 + layout.noise * np.where(harmonic > 0, noise[0], 0)) + absolute * noise[1]
    values = np.where(harmonic > 0, values, values.real)
    if not layout.sensors[0].has_phase:
        values = np.abs(values)
    if layout.droop:
        force = force * (1 + FORCE_NOISE * random.standard_normal(len(force)))
        # One reading of the force per point for all sensors.
        _, first, inverse = np.unique(table[:, :5], axis=0, return_index=True, return_inverse=True)
        force = force[first][inverse.ravel()]
    return Campaign(
        title="stranger", folder=Path(), sensors=tuple(_stated(layout, item, floor) for item in layout.sensors),
        tests=tuple(Test(name=grid.name, configuration=grid.configuration) for grid in layout.grids),
        measurement=Measurement(
            test=test, order=np.arange(len(values)), repeat=repeat, sweep=sweep, level=level, frequency=frequency,
            sensor=sensor, harmonic=harmonic, value=values, force=force,
        ),
        held_out=layout.held_out,
    )  # fmt: skip


def _stated(layout: Layout, sensor: MeasuredSensor, floor: dict[str, float]) -> MeasuredSensor:
    """Sensor with the noise of each part of its readings, if it is stated."""
    parts = (float(layout.noise / np.sqrt(2)), float(floor[sensor.name] / np.sqrt(2)))
    return replace(sensor, noise=parts) if layout.stated else sensor
