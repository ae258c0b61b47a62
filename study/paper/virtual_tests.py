"""Virtual tests of a specimen by time integration: repeats with random loading histories, and instrument readings."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import cos, sin
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from pipeline.store import stage
from reduction.jointed_system import JointedSystem
from reduction.load_cell import compute_blade_contact, compute_decoupler_contact, resolve_along_line
from transient.state import TransientState
from transient.virtual_bench.campaign import Sweep, with_noise
from transient.virtual_bench.repeats import repeated_test
from transient.virtual_bench.sweep import SweepReadings, VirtualSweepTest

Row = Float[NDArray[np.float64], " r"]
Samples = Float[NDArray[np.float64], " t"]

#: Motions that the bench measures, in its order: the tip, and the right damper against the blade.
TIP, LASER = "tip", "laser"
#: Lines of the bench in the order of its forces, and those with load cells behind them.
MEASURED = ("left_decoupler", "right_decoupler")
#: Side of the measured loop.
LOOP = "right_decoupler"


@dataclass(frozen=True, kw_only=True, eq=False)
class Specimen:
    """Specimen of the virtual tests.

    Parameters
    ----------
    jointed, free
        Rig at rest under its dead weights, and blade without dampers.
    sensors
        Rows of the motions by name.
    signs
        Sign of the tangential force of each line where it acts on its other body away from the damper [-].
    dead_weight
        Upward pull on the right damper [N].
    resonance, free_resonance
        Frequency of the first mode that the force drives, stuck and free [Hz].
    """

    jointed: JointedSystem
    free: JointedSystem
    sensors: Mapping[str, Row]
    signs: Mapping[str, float]
    dead_weight: float
    resonance: float
    free_resonance: float


@dataclass(frozen=True, kw_only=True)
class TestPoints:
    """Test points and instruments.

    Parameters
    ----------
    levels
        Amplitudes of the force in the order of the tests [N].
    shares
        Frequencies over the resonance, ascending [-].
    free_level, free_shares
        The same of the free blade [N, -].
    n_repeat
        Number of repeats [-].
    theta, alpha, laser_angle
        Taper of the contact lines, angle of the arms and of the laser [rad].
    cell_error, frequency_error
        Standard deviation of the gain of a load cell, and of the frequency between repeats [-].
    seed
        Seed of histories and noise.
    """

    __test__ = False

    levels: tuple[float, ...]
    shares: tuple[float, ...]
    free_level: float
    free_shares: tuple[float, ...]
    n_repeat: int
    theta: float
    alpha: float
    laser_angle: float
    cell_error: float
    frequency_error: float
    seed: int


@dataclass(frozen=True, kw_only=True, eq=False)
class InstrumentLoop:
    """A period at resonance on the right side, as its instruments show it.

    Parameters
    ----------
    level, frequency
        Level and frequency of the test [N, Hz].
    displacement
        Damper against blade by the inclined laser, shape (t,) [m].
    tangential, normal
        Force between damper and blade by load cells and eqs (1) and (2), shape (t,) [N].
    """

    level: float
    frequency: float
    displacement: Samples
    tangential: Samples
    normal: Samples


@stage("free virtual test")
def measure_free(specimen: Specimen, points: TestPoints) -> Sweep:
    """The blade without dampers."""
    bench = VirtualSweepTest(specimen.free, specimen.sensors)
    up = [specimen.free_resonance * share for share in points.free_shares]
    readings = bench.sweep([*up, *reversed(up)], points.free_level)
    random = np.random.default_rng([points.seed, 0])
    return Sweep(configuration="free", repeat=1, level=points.free_level, readings=with_noise(readings, random))


@stage("repeat of virtual tests")
def measure_repeat(specimen: Specimen, points: TestPoints, repeat: int) -> tuple[Sweep, ...]:
    """One repeat at all levels, with its own loading history.

    Parameters
    ----------
    specimen, points
        Specimen and test points.
    repeat
        Number of the repeat, from 1 [-].
    """
    histories, noise = (np.random.default_rng([points.seed, repeat, number]) for number in (1, 2))
    bench = VirtualSweepTest(specimen.jointed, specimen.sensors)
    resonance = specimen.resonance * (1 + points.frequency_error * noise.standard_normal())
    up = [resonance * share for share in points.shares]
    return tuple(
        replace(test, readings=with_noise(_read_by_cells(test.readings, specimen, points), noise))
        for test in repeated_test(bench, up, points.levels, repeat=repeat, random=histories, settle=_search(bench))
    )


@stage("friction loops of virtual tests")
def measure_loops(specimen: Specimen, points: TestPoints) -> tuple[InstrumentLoop, ...]:
    """A period at the resonance of the lowest and of the highest level."""
    result = []
    lines = _list_lines(specimen.jointed)
    for level in (points.levels[0], points.levels[-1]):
        bench = VirtualSweepTest(specimen.jointed, specimen.sensors)
        up = [specimen.resonance * share for share in points.shares]
        readings = bench.sweep(up, level)
        peak = int(np.argmax(np.abs(readings.motion[:, 0, 0])))
        bench.sweep(up[: peak + 1], level)
        record = bench.stepper(up[peak]).record()
        motion, force = bench.waveforms(record)
        side = 2 * lines.index(LOOP)
        own = force[side] * specimen.signs[LOOP], force[side + 1]
        cells = _with_cells(own, _sample_gains(points)[LOOP], points)
        T, N = compute_blade_contact(
            compute_decoupler_contact(*cells, points.theta, points.alpha), specimen.dead_weight, points.theta
        )
        seen = motion[list(specimen.sensors).index(LASER)] * cos(points.laser_angle)
        result.append(InstrumentLoop(level=level, frequency=up[peak], displacement=seen, tangential=T, normal=N))
    return tuple(result)


def _search(bench: VirtualSweepTest) -> Callable[[Sequence[float], float, TransientState], SweepReadings]:
    """Function that settles the bench by a search for steady states, at a hundredth of the cost of integration."""

    def settle(frequencies: Sequence[float], level: float, start: TransientState) -> SweepReadings:
        return bench.sweep(frequencies, level, start=start)

    return settle


def _list_lines(system: JointedSystem) -> list[str]:
    return list(dict.fromkeys(joint.name.split()[0] for joint in system.joints))


def _sample_gains(points: TestPoints) -> Mapping[str, NDArray[np.float64]]:
    """Gains of both load cells behind each line, the same in all tests."""
    random = np.random.default_rng([points.seed, 3])
    return {line: 1 + points.cell_error * random.standard_normal(2) for line in MEASURED}


def _with_cells(
    force: tuple[NDArray[Any], NDArray[Any]], gains: NDArray[np.float64], points: TestPoints
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Readings of the cells R3 and R4 of a line for its forces T and N: the inverse of eq (1)."""
    along, up = resolve_along_line(force[0], force[1], -points.theta)
    half = along / cos(points.alpha) / 2, up / sin(points.alpha) / 2
    return gains[0] * (half[0] + half[1]), gains[1] * (half[0] - half[1])


def _read_by_cells(readings: SweepReadings, specimen: Specimen, points: TestPoints) -> SweepReadings:
    """The readings with the forces of the measured lines alone, as the load cells and eq (1) give them."""
    lines, gains, columns = _list_lines(specimen.jointed), _sample_gains(points), []
    for line in MEASURED:
        at = 2 * lines.index(line)
        own = specimen.signs[line] * readings.force[:, at], readings.force[:, at + 1]
        T, N = compute_decoupler_contact(*_with_cells(own, gains[line], points), points.theta, points.alpha)
        columns += [specimen.signs[line] * T, N]
    return replace(readings, force=np.stack(columns, axis=1))
