"""False and correct alarms of trends between repeats: ``python -m benchmarks.repeat_trend [N]``.

Random oscillators with friction (`random_oscillators`) are measured in sweeps up and down at three levels of each
repeat, with noise. Repeats differ in preload, which is the same for all levels of a repeat, and in frequency; levels
differ in friction history. In some campaigns the friction limit or all frequencies decrease over the whole test. False
alarms are counted with many more campaigns that are linear in the differences between repeats. No constant was set with
these seeds.
"""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.random_oscillators import draw_oscillator
from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.data_quality.trend_suspicion import find_trend_suspicions

SEED = 6100
#: Number of linear campaigns for each campaign of an oscillator.
LINEAR = 100
#: Orders of measurement: all levels of a repeat, all repeats of a level, or runs in any order.
ORDERS = ("repeats", "levels", "random")
LEVELS, N_FREQUENCY = (1.0, 0.6, 0.3), 15
REPEATS = (3, 4, 5, 6, 8)
#: Standard deviations of preloads [-]; those of frequencies and histories are 3 % and 30 % of these.
PRELOADS = (0.01, 0.1)
#: Distributions of the preloads: random numbers of unit variance.
SHAPES: dict[str, Callable[[np.random.Generator], float]] = {
    "normal": lambda random: float(random.standard_normal()),
    "uniform": lambda random: float(random.uniform(-1, 1) * np.sqrt(3)),
    "heavy-tailed": lambda random: float(np.clip(random.standard_t(3) / np.sqrt(3), -5, 5)),
}
#: Decrease of the friction limit, and of frequencies, from the first reading to the last [-].
FALLS = {"friction": (0.05, 0.1, 0.2, 0.5), "frequency": (0.001, 0.003, 0.01)}


def draw_campaign(
    seed: int,
    n_repeat: int,
    *,
    preload: float = 0.01,
    shape: str = "normal",
    friction: float = 0.0,
    frequency: float = 0.0,
) -> Campaign:
    """Draw a campaign of two sensors on an oscillator whose friction limit and frequency may decrease with time."""
    random = np.random.default_rng([SEED, seed])
    one, force = draw_oscillator("friction", random)
    one = replace(one, modes=())
    width = max(6 * one.damping, 0.1 * one.strength)
    grid = one.frequency * np.linspace(1 - width, 1 + 2 * width, N_FREQUENCY)
    gain, other = float(random.uniform(0.3, 0.8)), 2 * np.pi * 1.7 * one.frequency
    noise = 10 ** random.uniform(-3, -2)
    columns: list[tuple[Any, ...]] = []
    runs, draw = n_repeat * len(LEVELS) * 2, SHAPES[shape]
    for repeat in range(n_repeat):
        limit, shift = 1 + preload * draw(random), 1 + 0.03 * preload * random.standard_normal()
        for level in LEVELS:
            for way in (1, -1):
                share = len(columns) / (2 * runs)
                slip = max(0.05, limit * (1 + 0.3 * preload * random.standard_normal()) * (1 - friction * share))
                moved = replace(one, frequency=one.frequency * shift * (1 - frequency * share))
                # The response scales with the friction limit if the force does.
                exact = slip * moved.sweep(level * force / slip, grid, way)
                beside = 0.3 * level * force / (other**2 - (2 * np.pi * grid) ** 2 + 0.01j * other**2)
                for sensor, value in enumerate((exact, gain * exact + beside)):
                    parts = random.standard_normal((2, N_FREQUENCY))
                    read = value * (1 + noise * (parts[0] + 1j * parts[1]))
                    columns.append((repeat + 1, way, level * force, sensor, grid[::way], read[::way]))
    of_run = [np.repeat([run[number] for run in columns], N_FREQUENCY) for number in range(4)]
    frequencies, values = (np.concatenate([run[number] for run in columns]) for number in (4, 5))
    k = len(values)
    return Campaign(
        title=str(seed), folder=Path("random"), tests=(Test(name="sine"),), held_out=HeldOut(),
        sensors=tuple(MeasuredSensor(name=name, quantity="displacement", direction="z") for name in ("a", "b")),
        measurement=Measurement(
            test=np.zeros(k, dtype=int), order=np.arange(k), repeat=of_run[0], sweep=of_run[1], level=of_run[2],
            frequency=frequencies, sensor=of_run[3], harmonic=np.ones(k, dtype=int), value=values,
        ),
    )  # fmt: skip


def draw_scatter(seed: int, n_repeat: int, shape: str, order: str) -> Campaign:
    """Draw a campaign without a trend: a curve with two random deviations per repeat, one per run, and noise."""
    random = np.random.default_rng([SEED, n_repeat, seed])
    n, draw = 20, SHAPES[shape]
    n_level, share, noise = int(random.integers(1, 4)), 10 ** random.uniform(-3, -0.5), 10 ** random.uniform(-3, -1.5)
    common, own = (
        random.standard_normal((2, n_level, n, 2)) @ [1, 1j],
        random.standard_normal((n_level, n, 2)) @ [1, 1j],
    )
    sizes = share * np.array([[draw(random), 0.5 * draw(random)] for _ in range(n_repeat)])
    runs = [(repeat, level) for repeat in range(n_repeat) for level in range(n_level)]
    if order == "levels":
        runs.sort(key=lambda run: run[1])
    elif order == "random":
        runs = [runs[place] for place in random.permutation(len(runs))]
    values = [
        1 + sizes[repeat] @ common[:, level] + 0.5 * share * draw(random) * own[level]
        + noise * (random.standard_normal((n, 2)) @ [1, 1j])
        for repeat, level in runs
    ]  # fmt: skip
    repeats, levels = np.repeat(np.array(runs), n, axis=0).T
    k = n * len(runs)
    return Campaign(
        title=str(seed), folder=Path("random"), tests=(Test(name="sine"),), held_out=HeldOut(),
        sensors=(MeasuredSensor(name="a", quantity="displacement", direction="z"),),
        measurement=Measurement(
            test=np.zeros(k, dtype=int), order=np.arange(k), repeat=repeats + 1, sweep=np.ones(k, dtype=int),
            level=levels + 1.0, frequency=np.tile(np.linspace(10.0, 12.0, n), len(runs)),
            sensor=np.zeros(k, dtype=int), harmonic=np.ones(k, dtype=int), value=np.concatenate(values),
        ),
    )  # fmt: skip


def judge(campaign: Campaign) -> str:
    """Result for a campaign: "trend", "open" (a suspicion with a remark) or "none"."""
    return next(("open" if item.remark else "trend" for item in find_trend_suspicions(campaign)), "none")


def count(n: int, **traits: float | str) -> list[str]:
    """For each number of repeats, the numbers of n campaigns with a trend and with an open one."""
    cells = []
    for n_repeat in REPEATS:
        findings = [judge(draw_campaign(seed, n_repeat, **traits)) for seed in range(n)]  # type: ignore[arg-type]
        cells.append(f"{findings.count('trend')} / {findings.count('open')}")
    return cells


def main() -> None:
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    many, listed = LINEAR * n, ", ".join(map(str, REPEATS))
    print(f"trends / open ones in {many} linear campaigns without a trend, of {listed} repeats")
    for shape in SHAPES:
        for order in ORDERS:
            findings = [[judge(draw_scatter(seed, item, shape, order)) for seed in range(many)] for item in REPEATS]
            cells = [f"{item.count('trend')} / {item.count('open')}" for item in findings]
            print(f"{shape}, by {order}: ", *cells, sep="  ", flush=True)
    print(f"trends / open ones in {n} campaigns of oscillators, of {listed} repeats")
    for preload in PRELOADS:
        for shape in SHAPES:
            print(
                f"none, preloads {preload:.0%} {shape}: ", *count(n, preload=preload, shape=shape), sep="  ", flush=True
            )
    for cause, falls in FALLS.items():
        for fall in falls:
            print(f"{cause} falls by {fall:.1%}: ", *count(n, **{cause: fall}), sep="  ", flush=True)


if __name__ == "__main__":
    main()
