"""False and correct alarms of `correlation.data_quality` on random campaigns.

    python -m benchmarks.data_quality [N]

Clean campaigns come from random oscillators (`random_oscillators`), with noise, jitter between repeats, one or two
sweeps and one to three levels; each of the others has one planted mistake (trait). No constant of the program was set
with these seeds.
"""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.random_oscillators import draw_oscillator
from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.data_quality.channel import find_channel_suspicions

SEED = 5200
KINDS = ("linear", "hardening", "softening", "gap", "friction")
TRAITS = (
    "zero phase",
    "fixed phase",
    "turned runs",
    "swapped in a repeat",
    "swapped at a level",
    "unnamed sweeps",
    "settling",
)


def draw_campaign(seed: int) -> Campaign:
    """Draw a clean campaign: two sensors on a random oscillator, the second also on another mode."""
    random = np.random.default_rng([SEED, seed])
    one, force = draw_oscillator(str(random.choice(KINDS)), random)
    noise, jitter = 10 ** random.uniform(-3.5, -1.5), 10 ** random.uniform(-5, -3)
    n_repeat, ways = int(random.integers(1, 9)), ((1,), (1, -1))[int(random.integers(2))]
    width = max(6 * one.damping, 0.1 * one.strength)
    grid = one.frequency * np.linspace(1 - width, 1 + 2 * width, int(random.integers(12, 40)))
    share, gain = float(random.uniform(0.2, 0.8)), float(random.uniform(0.3, 0.8))
    levels = (force * np.array([1.0, 0.4, 0.1])[: random.integers(1, 4)]).tolist()
    columns = []
    for repeat in range(n_repeat):
        moved = replace(one, frequency=one.frequency * (1 + jitter * random.standard_normal()))
        amplitude = 1 + 3 * jitter * random.standard_normal()
        for level in levels:
            for way in ways:
                exact = amplitude * moved.sweep(level, grid, way)
                omega, other = 2 * np.pi * grid, 2 * np.pi * 1.7 * one.frequency
                second = gain * exact + share * level / (other**2 - omega**2 + 0.01j * other * omega)
                for sensor, value in enumerate((exact, second)):
                    parts = random.standard_normal((2, len(grid)))
                    columns += [
                        (repeat, way, level, f, sensor, x * (1 + noise * (a + 1j * b)))
                        for f, x, a, b in zip(grid[::way], value[::way], *parts, strict=True)
                    ]
    repeats, sweep, all_levels, frequency, sensors, value = (np.array(column) for column in zip(*columns, strict=True))
    k = len(value)
    return Campaign(
        title=str(seed), folder=Path("random"), tests=(Test(name="sine"),), held_out=HeldOut(),
        sensors=tuple(MeasuredSensor(name=name, quantity="displacement", direction="z") for name in ("a", "b")),
        measurement=Measurement(
            test=np.zeros(k, dtype=int), order=np.arange(k), repeat=repeats.astype(int) + 1, sweep=sweep.astype(int),
            level=all_levels, frequency=frequency, sensor=sensors.astype(int), harmonic=np.ones(k, dtype=int),
            value=value,
        ),
    )  # fmt: skip


def insert_mistake(campaign: Campaign, trait: str) -> Campaign | None:
    """Copy of the campaign with a trait; None if the campaign cannot have it."""
    table = campaign.measurement
    n_repeat = int(table.repeat.max())
    changes: dict[str, np.ndarray] = {}
    if trait == "zero phase":
        changes["value"] = np.abs(table.value).astype(complex)
    elif trait == "fixed phase":
        changes["value"] = np.abs(table.value) * np.exp(-0.4j)
    elif trait == "turned runs":
        if n_repeat < 2:
            return None
        changes["value"] = table.value * np.exp(1j * (table.repeat + 3 * table.sweep))
    elif trait == "swapped in a repeat":
        if n_repeat < 2:
            return None
        changes["sensor"] = np.where(table.repeat == 2, 1 - table.sensor, table.sensor)
    elif trait == "swapped at a level":
        if n_repeat < 2 or len(campaign.levels) < 2:
            return None
        here = (table.repeat == 2) & (table.level == campaign.levels[-1])
        changes["sensor"] = np.where(here, 1 - table.sensor, table.sensor)
    elif trait == "unnamed sweeps":
        if (table.sweep > 0).all():
            return None
        changes["sweep"] = np.zeros_like(table.sweep)
    elif n_repeat < 4:
        return None
    else:
        late = 0.05 * np.exp(-1.5 * (table.repeat - 1))
        changes["frequency"], changes["value"] = table.frequency, table.value * (1 + late)
    return replace(campaign, measurement=replace(table, **changes))


def is_found(campaign: Campaign, trait: str) -> bool:
    """Whether a suspicion names the trait."""
    word = {"zero phase": "imaginary part is zero", "fixed phase": "phase changes by", "settling": "still settle"}
    word |= {"swapped in a repeat": "columns swapped in", "swapped at a level": "columns swapped in"}
    word |= {"unnamed sweeps": "rises and falls", "turned runs": "are not relative to the force"}
    return any(word[trait] in item.sentence for item in find_channel_suspicions(campaign))


def score(n: int, report: Callable[[str], None]) -> tuple[int, dict[str, tuple[int, int]]]:
    """Number of clean campaigns with an alarm, and for each trait the numbers of found and planted ones."""
    alarms, finds = 0, dict.fromkeys(TRAITS, (0, 0))
    for seed in range(n):
        clean = draw_campaign(seed)
        raised = find_channel_suspicions(clean)
        alarms += bool(raised)
        for item in raised:
            report(f"campaign {seed}: {item}")
        for trait in TRAITS:
            planted = insert_mistake(clean, trait)
            if planted is not None:
                result, of = finds[trait]
                finds[trait] = (result + is_found(planted, trait), of + 1)
    return alarms, finds


def main() -> None:
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    alarms, finds = score(n, print)
    print(f"{alarms} of {n} clean campaigns raise an alarm")
    for trait, (result, of) in finds.items():
        print(f"{trait}: found in {result} of {of}")


if __name__ == "__main__":
    main()
