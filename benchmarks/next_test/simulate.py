"""Simulates a further test on the specimen of a stranger by time integration."""

from dataclasses import replace

import numpy as np

from benchmarks.strangers.campaign import Stranger
from benchmarks.strangers.layout import Grid
from benchmarks.strangers.measure import measure
from benchmarks.strangers.specimen import Specimen
from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor
from correlation.model import Model, Sensor
from diagnosis.next_test.next_test import FURTHER, NextTest

#: Entropy of the random streams of further tests.
ENTROPY = 20270302


def simulate(stranger: Stranger, test: NextTest, seed: int) -> Campaign:
    """Simulate a campaign of one further test."""
    layout, specimen, floor = stranger.layout, stranger.specimen, dict(stranger.floor)
    sensors = [item for item in layout.sensors if item.name in test.sensors]
    if test.place is not None:
        first = next(item for item in layout.sensors if item.line is None)
        name = f"{FURTHER}{test.place}"
        direction = stranger.plan.places[test.place].direction
        sensors.append(
            MeasuredSensor(
                name=name, quantity=first.quantity, direction=direction, place=test.place, has_phase=first.has_phase
            )
        )
        floor[name] = max(floor[item.name] for item in layout.sensors if item.line is None)
        specimen = _with_sensor(specimen, name, test.place, first.quantity)
    grid = Grid(
        name="further", configuration=test.configuration, levels=test.levels, frequencies=test.frequencies,
    )  # fmt: skip
    planned = replace(
        layout, grids=(grid,), sensors=tuple(sensors), ways=test.sweeps or layout.ways, n_repeat=test.n_repeat,
        harmonics=tuple(item for item in test.harmonics if item in (1, 3)), droop=0.0, held_out=HeldOut(),
    )  # fmt: skip
    random = np.random.default_rng(np.random.SeedSequence([ENTROPY, seed]))
    droop = {grid.name: np.ones(len(test.frequencies))}
    campaign, _ = measure(specimen, planned, list(stranger.hidden), floor, droop, random)
    return campaign


def _with_sensor(specimen: Specimen, name: str, place: str, quantity: str) -> Specimen:
    def see(model: Model) -> Model:
        sensor = Sensor(name=name, row=model.places[place], quantity=quantity)
        return replace(model, sensors=(*model.sensors, sensor))

    return replace(specimen, jointed=see(specimen.jointed), free=see(specimen.free))
