r"""A measurement campaign on the virtual test bench: repeats with their own histories, jitter and noise, and its files.

A repeat is one set-up: its preload is off by one factor and its frequency by another, both alike in all its sweeps
(the free specimen is a set-up of its own). A sweep starts with friction forces at random shares of their limits, steps
through the frequencies up and then down. A reading y of a sensor becomes

.. math:: y \, (1 + \sigma \zeta_1) + s \, \zeta_2

with complex normal zeta of mean square 1, the static part without sigma.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from reduction.array_type import Array, Real
from transient.virtual_bench.beam import Beam, BeamParameters
from transient.virtual_bench.effect import HiddenEffect, insert_effect
from transient.virtual_bench.sweep import TOLERANCE, SweepReadings, VirtualSweepTest

#: Standard deviations of the specimen's parameters, relative to its drawing [-].
PARAMETER_DEVIATION: Mapping[str, float] = {
    "tangential_stiffness": 0.03,
    "normal_stiffness": 0.03,
    "friction_coefficient": 0.05,
    "damping_ratio": 0.10,
    "youngs_modulus": 0.005,
}
#: Standard deviations of preload and frequency from repeat to repeat, relative [-].
PRELOAD_JITTER = 0.01
FREQUENCY_JITTER = 3e-4
#: Root mean square of the relative error of a dynamic reading [-], and floors [m, N].
NOISE = 0.005
MOTION_FLOOR = 1e-9
FORCE_FLOOR = 0.02
#: Largest share of a contact's limit in which a sweep may find its friction force [-].
HISTORY = 0.9

SENSORS = ("tip", "slot", "excitation", "mid")
LINES = ("left", "right")
COMPONENTS = {"T": "tangential", "N": "normal"}
MOTION_HARMONICS = (1, 3)
FORCE_HARMONICS = (0, 1, 3)

#: Shares of the stuck first frequency 471.96 Hz, and of the free one, 91.72 Hz.
JOINTED_GRID = (
    0.90, 0.92, 0.94, 0.955, 0.965, 0.972, 0.978, 0.983, 0.987, 0.990, 0.9925, 0.995,
    0.997, 0.9985, 1.0, 1.0015, 1.003, 1.006, 1.010, 1.016, 1.024, 1.034, 1.046, 1.06,
)  # fmt: skip
FREE_GRID = (0.0004, 0.0013, 0.0023, 0.0035, 0.005, 0.007, 0.010, 0.014, 0.02, 0.03, 0.045, 0.07)

#: Levels [N] and repeats that test a model and that none is fitted to.
HELD_OUT_LEVELS, HELD_OUT_REPEATS = (5.0,), (4, 5)


#: Name of the test, and of its file, by configuration.
TESTS: Mapping[str, str] = {"jointed": "stepped", "free": "free"}


@dataclass(frozen=True, kw_only=True)
class CampaignLayout:
    """Names of sensors and lines in the files of a campaign."""

    title: str = "Beam with two contact lines"
    """Of the campaign."""
    sensors: Sequence[str] = SENSORS
    """Motions, in the order of `SweepReadings.motion`, each at the place of its name."""
    lines: Sequence[str] = LINES
    """Contact lines, in the order of `SweepReadings.force`: T and then N of each."""
    direction: str = "z"
    """Of the motions."""

    @property
    def forces(self) -> tuple[str, ...]:
        """Names of the lines' forces."""
        return tuple(f"{line}_{component}" for line in self.lines for component in COMPONENTS)


BEAM_LAYOUT = CampaignLayout()


@dataclass(frozen=True, kw_only=True)
class CampaignPoints:
    """Where a campaign measures."""

    levels: Sequence[float] = (1.0, 3.0, 5.0, 10.0)
    """Amplitudes of the force [N]."""
    frequencies: Sequence[float] = tuple(round(471.96 * item, 2) for item in JOINTED_GRID)
    free_frequencies: Sequence[float] = tuple(
        round(91.72 * (1 + item), 3) for item in (*(-step for step in reversed(FREE_GRID)), *FREE_GRID)
    )
    """Ascending, of the jointed and of the free specimen [Hz]."""
    n_repeat: int = 5
    """[-]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Sweep:
    """One sweep up and down."""

    configuration: str
    """"jointed" or "free"."""
    repeat: int
    """From 1."""
    level: float
    """[N]."""
    readings: SweepReadings
    """At the frequencies up, then down."""


def scaled(drawn: BeamParameters, **factors: float) -> BeamParameters:
    """Parameters times factors by their names, those of both lines times one."""
    changed: dict[str, Any] = {}
    for name, factor in factors.items():
        value = getattr(drawn, name)
        changed[name] = tuple(item * factor for item in value) if isinstance(value, tuple) else value * factor
    return replace(drawn, **changed)


def random_parameters(random: np.random.Generator) -> BeamParameters:
    """A specimen as it is made: its calibration parameters differ from the drawing."""
    factors = {name: 1 + sigma * random.standard_normal() for name, sigma in PARAMETER_DEVIATION.items()}
    return scaled(BeamParameters(), **factors)


def sweeps(
    beam: Beam,
    parameters: BeamParameters,
    effect: HiddenEffect,
    points: CampaignPoints,
    random: np.random.Generator,
    *,
    jitter: float = 1.0,
    tolerance: float = TOLERANCE,
) -> Iterator[Sweep]:
    """All sweeps of a campaign, free of noise.

    Parameters
    ----------
    beam, parameters, effect
        The specimen and what is hidden in it.
    points
        Where to measure.
    random
        Generator of jitter and histories; as many numbers are drawn whatever the effect.
    jitter
        Scale of both jitters [-].
    tolerance
        Tolerance of a steady state, see `transient.virtual_bench.sweep.TOLERANCE` [-].
    """
    for repeat in range(1, points.n_repeat + 1):
        load, shift, shift_free = 1 + jitter * random.standard_normal(3) * [
            PRELOAD_JITTER,
            FREQUENCY_JITTER,
            FREQUENCY_JITTER,
        ]
        left, right = parameters.preload
        set_up = replace(parameters, preload=(left * load, right * load))
        jointed, free = insert_effect(beam, set_up, effect)
        sensors = {name: beam.places[name] for name in SENSORS}
        for configuration, system, frequencies, factor in (
            ("jointed", jointed, points.frequencies, shift),
            ("free", free, points.free_frequencies, shift_free),
        ):
            bench = VirtualSweepTest(system, sensors)
            up = [float(item * factor) for item in frequencies]
            for level in points.levels:
                multipliers = random.uniform(-HISTORY, HISTORY, 2 * len(beam.station))
                start = multipliers if configuration == "jointed" else None
                readings = bench.sweep([*up, *reversed(up)], level, start, tolerance=tolerance)
                yield Sweep(configuration=configuration, repeat=repeat, level=float(level), readings=readings)


def with_noise(readings: SweepReadings, random: np.random.Generator) -> SweepReadings:
    """Readings with noise."""
    return replace(
        readings,
        motion=readings.motion * (1 + NOISE * _sample_complex_normal(random, readings.motion.shape))
        + MOTION_FLOOR * _sample_complex_normal(random, readings.motion.shape),
        force=_add_noise_to_force(readings.force, random),
    )


def write_campaign(
    folder: Path, measured: Sequence[Sweep], points: CampaignPoints, layout: CampaignLayout = BEAM_LAYOUT
) -> None:
    """Write campaign.toml, stepped.csv and, if the specimen was measured free too, free.csv."""
    folder.mkdir(parents=True, exist_ok=True)
    tests = {name: test for name, test in TESTS.items() if any(item.configuration == name for item in measured)}
    frequencies = {"jointed": points.frequencies, "free": points.free_frequencies}
    for configuration, name in tests.items():
        lines = ["test,order,repeat,sweep,level,frequency,sensor,harmonic,real,imag,unit"]
        order = 0
        for sweep in measured:
            if sweep.configuration != configuration:
                continue
            up = [(item, "up") for item in frequencies[configuration]]
            down = [(item, "down") for item in reversed(frequencies[configuration])]
            for number, (frequency, direction) in enumerate([*up, *down]):
                order += 1
                head = f"{name},{order},{sweep.repeat},{direction},{sweep.level:g},{frequency:.10g}"
                lines += _point_lines(head, sweep.readings, number, layout)
        (folder / f"{name}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / "campaign.toml").write_text(_format_manifest(points, layout, tests), encoding="utf-8")


def _point_lines(head: str, readings: SweepReadings, number: int, layout: CampaignLayout) -> Iterator[str]:
    for sensors, harmonics, values, unit in (
        (layout.sensors, MOTION_HARMONICS, readings.motion[number], "m"),
        (layout.forces, FORCE_HARMONICS, readings.force[number], "N"),
    ):
        # The free specimen has no lines: no rows.
        for sensor, row in zip(sensors, values, strict=False):
            for harmonic, value in zip(harmonics, row.tolist(), strict=True):
                yield f"{head},{sensor},{harmonic},{value.real:.9e},{value.imag:.9e},{unit}"


def _format_manifest(points: CampaignPoints, layout: CampaignLayout, tests: Mapping[str, str]) -> str:
    sensors = [
        f'[[sensor]]\nname = "{name}"\nquantity = "displacement"\ndirection = "{layout.direction}"\nplace = "{name}"\n'
        for name in layout.sensors
    ]
    sensors += [
        f'[[sensor]]\nname = "{name}"\nquantity = "contact force"\nline = "{name[:-2]}"\n'
        f'component = "{COMPONENTS[name[-1]]}"\n'
        for name in layout.forces
    ]
    levels = [level for level in points.levels if level in HELD_OUT_LEVELS and len(points.levels) > 1]
    repeats = [repeat for repeat in HELD_OUT_REPEATS if repeat <= points.n_repeat]
    return "\n".join(
        [
            f'schema = 1\ntitle = "{layout.title}"\n',
            '[convention]\ntime = "exp(+i omega t)"\namplitude = "peak"\n',
            '[units]\nlevel = "N"\nfrequency = "Hz"\n',
            *sensors,
            *(
                f'[[test]]\nname = "{name}"\nconfiguration = "{configuration}"\nfile = "{name}.csv"\n'
                for configuration, name in tests.items()
            ),
            f"[held_out]\nlevels = {levels}\nrepeats = {repeats}\n",
        ]
    )


def _add_noise_to_force(force: Array, random: np.random.Generator) -> Array:
    relative = NOISE * _sample_complex_normal(random, force.shape)
    floor = FORCE_FLOOR * _sample_complex_normal(random, force.shape)
    relative[..., 0] = 0.0
    # A real reading has its noise in the real part alone.
    floor[..., 0] = np.sqrt(2) * floor[..., 0].real
    return np.asarray(force * (1 + relative) + floor)


def _sample_complex_normal(random: np.random.Generator, shape: tuple[int, ...]) -> Array:
    parts: Float[Real, ...] = random.standard_normal((*shape, 2)) / np.sqrt(2)
    return np.asarray(parts[..., 0] + 1j * parts[..., 1])
