"""Campaign of a seed: a model, measurements of a specimen with a hidden law, and the true law."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.missing_law.hidden import KINDS, Hidden, draw_hidden
from benchmarks.missing_law.structure import Structure, draw_structure, make_specimen
from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.model import Model
from reduction.array_type import Array
from transient.errors import TransientError
from transient.stepper import PeriodRecord
from transient.virtual_bench.sweep import VirtualSweepTest

#: Entropy of all random streams; numbers of frequencies, repeats and time steps per period.
ENTROPY, N_FREQUENCY, N_REPEAT, STEPS = 20261127, 24, 2, 192
#: Largest number of attempts to scale a law to the motion that was measured with it.
DRAWS = 4
#: Sets of measured harmonics.
HARMONICS = ((1,), (1, 3), (1, 2, 3))


class Bench(VirtualSweepTest):
    """Virtual bench that reads harmonics 0 to 3 of each motion."""

    def read(self, record: PeriodRecord) -> tuple[Array, Array, float]:
        """See `VirtualSweepTest.read`."""
        _, force, slip = super().read(record)
        motion = np.fft.rfft(self._rows @ record.modal_displacement.T, axis=1)[:, :4] * (2 / self.steps_per_period)
        motion[:, 0] /= 2
        return motion, force, slip


@dataclass(frozen=True, kw_only=True, eq=False)
class Trial:
    """Campaign with the hidden truth.

    Parameters
    ----------
    model, campaign
        Inputs of a diagnosis.
    hidden
        Hidden law.
    coefficients
        Harmonics 0 to 3 of the true motion at the place of the law, at the frequency of largest motion of each level,
        shape (l, 4) [m].
    angular_frequency
        Angular frequency of these points, shape (l,) [rad/s].
    n_contact
        Number of contacts of the model.
    harmonics
        Measured harmonics.
    """

    model: Model
    campaign: Campaign
    hidden: Hidden
    coefficients: NDArray[np.complex128]
    angular_frequency: NDArray[np.float64]
    n_contact: int
    harmonics: tuple[int, ...]


def make(seed: int) -> Trial:
    """Make the campaign of a seed."""
    streams = [np.random.default_rng(item) for item in np.random.SeedSequence([ENTROPY, seed]).spawn(4)]
    structure, random = draw_structure(streams[0]), streams[1]
    model, names = structure.model, list(structure.model.places)
    levels = np.geomspace(structure.force / random.uniform(5, 12), structure.force, int(random.integers(4, 6)))
    able = [name for name in names if abs(_at(structure, name)) > 0.3 * np.abs(structure.shape).max()]
    place, kind = str(random.choice(able)), str(random.choice(KINDS))
    stuck, free = structure.natural
    # Resonant motion with an added modal damping of about that of the law and the contacts.
    loss = structure.ratio + (0.02 if model.lines else 0.005)
    motion = abs(_at(structure, place) * _at(structure, structure.drive)) * structure.force / (2 * loss * stuck**2)
    modal = stuck**2 / _at(structure, place) ** 2
    hidden = draw_hidden(place, motion, modal, stuck, kind, random)
    made = make_specimen(model, streams[2])
    for _ in range(DRAWS):
        specimen = made.with_system(joints=[*made.system.joints, *hidden.joints(model.places[place])])
        share = hidden.stiffness / modal
        low, high = {"softening": (-0.6, 0.05), "drag": (-0.03, 0.03)}.get(kind, (-0.06, 0.7))
        width = 4 * structure.ratio
        frequencies = np.linspace(
            min(free, stuck) * (1 + low * share - width), stuck * (1 + high * share + width), N_FREQUENCY
        ) / (2 * np.pi)
        try:
            trial = _measured(structure, specimen, hidden, levels, frequencies, streams[3])
        except TransientError:
            levels = levels / 2  # a softening spring has become unstable
            continue
        reached = float(np.abs(trial.coefficients[:, 1]).max())
        if 0.8 < reached / hidden.motion < 1.25:
            return trial
        hidden = replace(hidden, motion=reached)
    return trial


def _at(structure: Structure, place: str) -> float:
    return float(structure.model.places[place] @ structure.shape)


def _measured(
    structure: Structure, specimen: Model, hidden: Hidden, levels: NDArray[np.float64],
    frequencies: NDArray[np.float64], random: np.random.Generator,
) -> Trial:  # fmt: skip
    model, names = structure.model, list(structure.model.places)
    bench = Bench(specimen.system, {name: specimen.places[name] for name in names}, STEPS)
    swept = [bench.sweep(frequencies.tolist(), float(level)) for level in levels]
    motion = np.array([item.motion for item in swept])
    seen = random.permutation(len(names))[: int(random.integers(1, len(names) + 1))]
    harmonics = HARMONICS[int(random.integers(len(HARMONICS)))]
    noise = float(random.uniform(0.002, 0.01))
    rows, values = [], []
    for number, level in enumerate(levels):
        for point in np.flatnonzero(swept[number].periodic).tolist():
            for sensor, name in enumerate(np.array(names)[seen]):
                for harmonic in harmonics:
                    reading = motion[number, point, names.index(name), harmonic]
                    floor = 0.002 * np.abs(motion[0, :, names.index(name), 1]).max()
                    for repeat in range(1, N_REPEAT + 1):
                        error = random.standard_normal(4) / np.sqrt(2)
                        value = reading * (1 + noise * (error[0] + 1j * error[1])) + floor * (error[2] + 1j * error[3])
                        rows.append((repeat, level, frequencies[point], sensor, harmonic))
                        values.append(value)
    repeat, level, frequency, sensor, harmonic = np.array(rows).T
    sensors = tuple(
        MeasuredSensor(name=f"at {name}", quantity="displacement", place=str(name)) for name in np.array(names)[seen]
    )
    campaign = Campaign(
        title="missing law", folder=Path(), sensors=sensors, tests=(Test(name="stepped"),),
        measurement=Measurement(
            test=0 * repeat, order=np.arange(len(values)), repeat=repeat, sweep=0 * repeat + 1, level=level,
            frequency=frequency, sensor=sensor, harmonic=harmonic, value=np.array(values),
        ),
        held_out=HeldOut(levels=(float(levels[-2]),)),
    )  # fmt: skip
    own = motion[:, :, names.index(hidden.place)]
    top = np.abs(own[:, :, 1]).argmax(axis=1)
    coefficients = own[np.arange(len(levels)), top]
    kept = tuple(item for item in model.sensors if item.name in {sensor.name for sensor in sensors})
    return Trial(
        model=replace(model, sensors=kept), campaign=campaign, hidden=hidden, coefficients=coefficients,
        angular_frequency=2 * np.pi * frequencies[top], n_contact=len(model.system.joints), harmonics=harmonics,
    )  # fmt: skip
