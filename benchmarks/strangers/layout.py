"""Random layouts of campaigns: levels, repeats, sweeps, sensors, grids, stated noise and held-out data.

levels       2 to 6, geometric, the lowest 1/4 to 1/25 of the highest
repeats      1 to 6; with one repeat the noise is stated; with two levels at least three repeats, the last held out
held out     the second-highest level if there are more than two
sweeps       up (25 %), down (15 %), both
sensors      1 to 8, at least one motion (displacement, velocity or acceleration); load cells in half of those with
             lines
phase        missing in 12 %, then there are no load cells
harmonics    1, in 40 % 1 and 3; load cells read 0 and 1
force        constant, or in 40 % it drops by up to 30 % at the resonance and is measured at each point
free         40 % of structures with lines are also tested without contacts, at two levels
grid         16 to 36 frequencies, denser where the curves of the model are steep; in 30 % one grid per half of the
             levels
noise        0.05 to 5 % of a reading, and a floor of a fifth of the noise of the largest reading at the lowest level;
             stated in half of the campaigns, else estimated from the repeats
"""

from dataclasses import dataclass

import numpy as np

from benchmarks.random_systems import log_uniform
from benchmarks.strangers.blueprint import Blueprint
from benchmarks.strangers.response import amplitude
from benchmarks.strangers.structure import BAND
from correlation.campaign.measurement import CONTACT_FORCE, HeldOut, MeasuredSensor
from correlation.model import Model

#: Smallest number of frequencies of the curve from which a grid is chosen.
N_CURVE = 60


@dataclass(frozen=True, kw_only=True)
class Grid:
    """One test: configuration, levels [N] and frequencies [Hz]."""

    name: str
    configuration: str
    levels: tuple[float, ...]
    frequencies: tuple[float, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Layout:
    """Layout of a campaign before measurement.

    Parameters
    ----------
    grids
        Tests.
    n_repeat, ways
        Repeats, and sweeps of each level: (1,), (-1,) or (1, -1).
    sensors
        Sensors, without their stated noise.
    harmonics
        Harmonics of motions.
    droop
        Relative decrease of the force at the resonance [-]; the force is measured unless this is zero.
    noise, stated
        Relative standard deviation of a reading [-], and whether the manifest states it.
    held_out
        Data held out for the test of fits.
    """

    grids: tuple[Grid, ...]
    n_repeat: int
    ways: tuple[int, ...]
    sensors: tuple[MeasuredSensor, ...]
    harmonics: tuple[int, ...]
    droop: float
    noise: float
    stated: bool
    held_out: HeldOut


def draw_layout(plan: Blueprint, model: Model, random: np.random.Generator) -> Layout:
    """Draw a layout for a structure and its model."""
    count = int(random.integers(2, 7))
    n_repeat = int(random.integers(3 if count == 2 else 1, 7))
    levels = np.geomspace(plan.force / random.uniform(4, 25), plan.force, count)
    levels = tuple(float(f"{level:.3g}") for level in levels)
    has_phase = bool(random.uniform() > 0.12)
    ways = ((1,), (-1,), (1, -1))[int(random.choice(3, p=[0.25, 0.15, 0.6]))]
    held = HeldOut(levels=(levels[-2],)) if count > 2 else HeldOut(repeats=(n_repeat,))
    return Layout(
        grids=_grids(plan, model, levels, random),
        n_repeat=n_repeat,
        ways=ways,
        sensors=_sensors(plan, has_phase=has_phase, random=random),
        harmonics=(1, 3) if random.uniform() < 0.4 else (1,),
        droop=float(random.uniform(0.05, 0.3)) if random.uniform() < 0.4 else 0.0,
        noise=float(log_uniform(random, 5e-4, 5e-2)),
        stated=bool(random.uniform() < 0.5) or n_repeat == 1,
        held_out=held,
    )


def _sensors(plan: Blueprint, *, has_phase: bool, random: np.random.Generator) -> tuple[MeasuredSensor, ...]:
    places = [str(item) for item in random.permutation(list(plan.places))]
    quantity = str(random.choice(["displacement", "velocity", "acceleration"]))
    motions = [
        MeasuredSensor(
            name=f"at {place}", quantity=quantity, direction=plan.places[place].direction, place=place,
            has_phase=has_phase,
        )
        for place in places[: int(random.integers(1, len(places) + 1))]
    ]  # fmt: skip
    cells = [
        MeasuredSensor(name=f"{line} {what}", quantity=CONTACT_FORCE, line=line, component=what)
        for line in plan.lines
        for what in ("tangential", "normal")
    ]
    if not has_phase or random.uniform() < 0.5:
        cells = []
    return (*motions, *cells)[:8]


def _grids(plan: Blueprint, model: Model, levels: tuple[float, ...], random: np.random.Generator) -> tuple[Grid, ...]:
    stuck, free = plan.stuck / (2 * np.pi), plan.free / (2 * np.pi)
    band = min(BAND[0] * free, 0.97 * stuck), BAND[1] * stuck
    count = int(random.integers(16, 37))
    halves = (levels[: len(levels) // 2], levels[len(levels) // 2 :]) if random.uniform() < 0.3 else (levels,)
    grids = [
        Grid(
            name=f"stepped {number}", configuration="jointed", levels=half,
            frequencies=_turning(plan, model, half, band, count, free=False),
        )
        for number, half in enumerate(halves, start=1)
    ]  # fmt: skip
    if plan.lines and random.uniform() < 0.4:
        around = (
            (1 - max(0.02, 8 * plan.ratio)) * free,
            (1 + max(0.02, 8 * plan.ratio)) * max(free, stuck if plan.jenkins else 0),
        )
        chosen = levels[:2]
        grids.append(
            Grid(
                name="free", configuration="free", levels=chosen,
                frequencies=_turning(plan, model, chosen, around, count, free=True),
            )
        )  # fmt: skip
    return tuple(grids)


def _turning(
    plan: Blueprint, model: Model, levels: tuple[float, ...], band: tuple[float, float], count: int, *, free: bool
) -> tuple[float, ...]:
    """Frequencies at equal distances along the mean curve of the lowest and the highest level [Hz]."""
    # Steps of about half of the half-power width; between the resonances, contacts add damping.
    fine = np.linspace(*band, max(N_CURVE, int((band[1] - band[0]) / (plan.ratio * band[1]))))
    length = np.zeros(len(fine))
    for curve in amplitude(model, plan.drive, (levels[0], levels[-1]), fine, free=free):
        steps = np.abs(np.diff(curve, prepend=curve[0])) / max(curve.max(), 1e-300)
        length += np.cumsum(steps) / max(steps.sum(), 1e-300)
    length = length / length[-1] + np.linspace(0, 0.7, len(fine))
    chosen = np.interp(np.linspace(0, length[-1], count), length, fine)
    return tuple(float(f"{item:.7g}") for item in chosen)
