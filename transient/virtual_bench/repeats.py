"""Repeated virtual tests of one system, each with a different loading history, as in a laboratory.

The settings of all repeats are the same. What differs is usually not recorded: how far the preload exceeded and fell
below its value as it was applied, whether it was taken off and put on again between levels, how far the excitation
overshot a level, and in which direction the frequencies were swept. Sticking contacts remember it.

References
----------
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), section 2.3.2.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from reduction.array_type import Vector
from reduction.joint_law.friction_contact import list_friction_contacts
from reduction.jointed_system import JointedSystem
from transient.equilibrium import find_quasi_static_state
from transient.state import TransientState
from transient.virtual_bench.campaign import Sweep
from transient.virtual_bench.sweep import SweepReadings, VirtualSweepTest

#: Shares of the preload that it shoots over and under to, at most so many times.
OVER, UNDER, SHOTS = (1.0, 1.6), (0.5, 1.0), 3
#: Largest share of its friction limit that a line is left with as its body is put in place.
PLACED = 0.9
#: Periods after which a point is taken as it is.
MOST_PERIODS = 6000
#: Chance that the preload is taken off in part, or that a level is overshot, before it is measured; to these levels.
CHANCE, OVERSHOOT = 0.5, (1.2, 2.2)


@dataclass(frozen=True, kw_only=True)
class LoadingHistory:
    """Loading history before a level is measured."""

    loads: tuple[float, ...]
    """Shares of the static load in their order, the last one 1; none if it is left alone [-]."""
    overshoot: float
    """Share of the level that is run before it, at the first frequency; 1 for none [-]."""


def random_history(random: np.random.Generator, *, first: bool) -> LoadingHistory:
    """A loading history; the first of a repeat always puts the preload on."""
    unloaded, overshot, size = random.uniform(size=3)
    shots = random.uniform(size=(int(random.integers(SHOTS + 1)), 2))
    loads = [part for over, under in shots for part in (_between(OVER, over), _between(UNDER, under))]
    return LoadingHistory(
        loads=(*loads, 1.0) if first or unloaded < CHANCE else (),
        overshoot=_between(OVERSHOOT, size) if overshot < CHANCE else 1.0,
    )


def repeated_tests(
    system: JointedSystem,
    sensors: Mapping[str, Vector],
    frequencies: Sequence[float],
    levels: Sequence[float],
    *,
    n_repeat: int,
    seed: int,
    steps_per_period: int = 256,
    tolerance: float = 1e-4,
) -> Iterator[Sweep]:
    """Sweeps up and down at each level of each repeat, free of noise; friction is carried from level to level.

    Parameters
    ----------
    system
        Its first joints are friction contacts, the first word of a name being the line, with one tangent each.
    sensors
        Rows by name, each of shape (r,) [-].
    frequencies
        Ascending [Hz]; points are given in this order, then in the opposite one.
    levels
        Scales of the harmonic force, in the order of the test [-].
    n_repeat, seed
        How many repeats, and of what is random in them.
    steps_per_period, tolerance
        Of the integration, and of a steady state, relative to the motion [-].

    Raises
    ------
    TransientError
        No equilibrium on the way of the preload.
    """
    random = np.random.default_rng(seed)
    bench = VirtualSweepTest(system, sensors, steps_per_period=steps_per_period)

    def settle(points: Sequence[float], level: float, start: TransientState) -> SweepReadings:
        return sweep_settled(bench, points, level, start, tolerance)

    for repeat in range(1, n_repeat + 1):
        yield from repeated_test(bench, frequencies, levels, repeat=repeat, random=random, settle=settle)


def repeated_test(
    bench: VirtualSweepTest,
    frequencies: Sequence[float],
    levels: Sequence[float],
    *,
    repeat: int,
    random: np.random.Generator,
    settle: Callable[[Sequence[float], float, TransientState], SweepReadings],
) -> Iterator[Sweep]:
    """One of them: sweeps up and down at each level, friction carried from level to level.

    Parameters
    ----------
    bench
        Bench with the system.
    frequencies, levels
        As in `repeated_tests`.
    repeat
        Number of the repeat, from 1 [-].
    random
        Generator of its histories.
    settle
        Steady states at some frequencies [Hz] and a level [N], from a state: `sweep_settled`, or the bench's search.

    Raises
    ------
    TransientError
        No equilibrium on the way of the preload.
    """
    line = [item.name.split()[0] for item in list_friction_contacts(bench.system.joints)]
    # The hand that puts a body in its place leaves each line a share of its limit.
    shares = {name: random.uniform(-PLACED, PLACED) for name in dict.fromkeys(line)}
    slider = bench.random_start(np.array([shares[name] for name in line])).slider
    for number, level in enumerate(levels):
        history = random_history(random, first=number == 0)
        state = find_quasi_static_state(bench.structure, history.loads or (1.0,), slider)
        if history.overshoot > 1:
            state = settle(frequencies[:1], history.overshoot * level, state).final
        readings = settle([*frequencies, *reversed(frequencies)], level, state)
        slider = readings.final.slider
        yield Sweep(configuration="jointed", repeat=repeat, level=float(level), readings=readings)


def sweep_settled(
    bench: VirtualSweepTest, frequencies: Sequence[float], level: float, start: TransientState, tolerance: float
) -> SweepReadings:
    """Steady states at one frequency [Hz] after the other, integrated until the motion repeats: it alone drags sliders.

    The tolerance is what may be left of the transient, relative to the motion, if it decays as slowly as the structure
    can [-].
    """
    state, points, n = start, [], bench.system.n_dof
    for frequency in frequencies:
        stepper = bench.stepper(frequency)
        stepper.level = level
        stepper.place(state)
        slowest = float(np.exp(-0.5 * np.diag(bench.structure.damping).min() / frequency))
        n_period, left = 0, np.inf
        while left > tolerance and n_period < MOST_PERIODS:
            n_period += 1
            before = stepper.vector
            record = stepper.record()
            motion = record.amplitude
            left = float(np.linalg.norm((stepper.vector - before) * bench.weight)) / motion / (1 - slowest)
        state = stepper.state
        points.append((*bench.read(record), n_period, left <= tolerance, before[2 * n :]))
    return SweepReadings.from_points(points, state)


def _between(ends: tuple[float, float], share: float) -> float:
    return float(ends[0] + share * (ends[1] - ends[0]))
