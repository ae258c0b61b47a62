"""`python -m benchmarks.strangers.picture FOLDER --seeds 0:6`: compare readings with harmonic balance of the specimen.

Harmonic balance uses the matrices, joints and hidden effects of the specimen, the mean preload and frequency, and
sliders at rest. The readings differ by noise, jitter, friction histories and errors of both methods. The median and the
90 % quantile of the differences are printed, relative to the largest reading of the sensor at the level.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.strangers.campaign import Stranger, make
from benchmarks.strangers.response import points_of, predict
from correlation.campaign.read_campaign import read_campaign
from figure.style import make_figure


def draw(stranger: Stranger, file: Path) -> str:
    """Draw the first sensor of all tests and compare; returns the differences as text."""
    campaign = read_campaign(stranger.folder)
    table, sensor = campaign.measurement, stranger.layout.sensors[0]
    late = sum(effect.delay(sensor.name) for effect in stranger.hidden)
    figure = make_figure(5.0 * len(stranger.layout.grids), 4.0)
    axes = figure.subplots(1, len(stranger.layout.grids), squeeze=False)[0]
    errors = []
    for test, (grid, axis) in enumerate(zip(stranger.layout.grids, axes, strict=True)):
        model = stranger.specimen.free if grid.configuration == "free" else stranger.specimen.jointed
        for level in grid.levels:
            own = (table.test == test) & (table.level == level) & (table.sensor == 0) & (table.harmonic == 1)
            frequency = np.unique(table.frequency[own])
            at = np.searchsorted(frequency, table.frequency[own])
            force = np.bincount(at, table.force[own]) / np.bincount(at)
            points = points_of([(False, level, item, sensor.name, 1) for item in frequency.tolist()])
            points = replace(points, force=force)
            value = predict(model, points).value * np.exp(-2j * np.pi * frequency * late)
            value = value if sensor.has_phase else np.abs(value)
            read = table.value[own] * force[at] / table.force[own]
            errors.append(np.abs(read - value[at]) / np.nanmax(np.abs(value)))
            (line,) = axis.plot(frequency, np.abs(value) / force, lw=1)
            axis.plot(table.frequency[own], np.abs(read) / force[at], ".", ms=2, color=line.get_color())
        axis.set_title(f"{grid.name}, {grid.levels[0]:g} to {grid.levels[-1]:g} N", fontsize=8)
        axis.set_xlabel("frequency [Hz]")
        axis.set_yscale("log")
    axes[0].set_ylabel(f"{sensor.name}, {sensor.quantity} per force [SI]")
    figure.suptitle(" + ".join(f"{item.name} {item.strength:.3g}" for item in stranger.hidden) or "nothing", fontsize=9)
    figure.savefig(file, dpi=90)
    apart = np.concatenate(errors)
    return (
        f"noise {stranger.layout.noise:.2%}, apart: median {np.nanmedian(apart):.2%}, worst tenth "
        f"{np.nanquantile(apart, 0.9):.2%}, without a steady state {np.isnan(apart).sum()} of {len(apart)}"
    )


def main() -> None:
    """Make, draw and compare strangers."""
    words = argparse.ArgumentParser(prog="python -m benchmarks.strangers.picture", description=__doc__)
    words.add_argument("folder", type=Path, help="where the pictures go")
    words.add_argument("--seeds", default="0:6", help="first:last+1")
    given = words.parse_args()
    first, last = map(int, given.seeds.split(":"))
    given.folder.mkdir(parents=True, exist_ok=True)
    for seed in range(first, last):
        with tempfile.TemporaryDirectory() as folder:
            stranger = make(seed, Path(folder))
            print(f"seed {seed}: {draw(stranger, given.folder / f'{seed}.png')}", flush=True)


if __name__ == "__main__":
    main()
