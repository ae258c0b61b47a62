"""Rows of a run: steady states from the columns of any measured file, in SI and in the convention of a `Campaign`."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int
from numpy.typing import NDArray

from correlation.campaign.measurable import MAX_READING, MIN_READING, REMEDY, is_beyond
from correlation.campaign.measured_files import MeasuredFiles, take_rows, with_rows, without_padding
from correlation.campaign.measurement import CONTACT_FORCE, SWEEPS, MeasuredSensor, Measurement, Suspicion
from correlation.campaign.passes import (
    SWEEP_WORDS,
    count_repeats,
    find_passes,
    name_branches,
    number_stated_passes,
    reverse_listed_sweeps,
)
from correlation.campaign.run_entry import BY_ORDER, RunEntry
from correlation.campaign.signal_entry import SignalEntry
from correlation.errors import CampaignError
from correlation.file.column import MeasuredFile
from correlation.row_table import RowTable
from correlation.signal.harmonics import Harmonics
from correlation.signal.record import note_rounded_time
from correlation.signal.steady_state import fit_steady_state

Real = Float[NDArray[np.float64], " n"]
Whole = Int[NDArray[np.int64], " n"]

#: Ratio of a higher harmonic of the force to its fundamental above which the force is suspected of distortion [-].
DISTORTED = 0.05
#: Significant digits of the level of a run without a set point: the median of its measured force, rounded.
DIGITS = 3


@dataclass(frozen=True, kw_only=True)
class RunUnits:
    """Units and conventions that the runs of a campaign share.

    Parameters
    ----------
    time_sign
        +1 for amplitudes of e^{+i Omega t}, -1 for those of e^{-i Omega t}.
    peak
        Factor from amplitudes to peak amplitudes [-].
    level_factor
        Factor from a level in the manifest to SI and peak amplitude.
    level_unit, frequency_unit
        Units of columns that state no unit.
    level_si
        SI unit of the levels; empty where the drive is not calibrated.
    """

    time_sign: int = 1
    peak: float = 1.0
    level_factor: float = 1.0
    level_unit: str = "N"
    frequency_unit: str = "Hz"
    level_si: str = "N"


@dataclass(frozen=True, kw_only=True, eq=False)
class _States(RowTable):
    """Steady states of a run and the amplitudes of their forces, one per row of its file."""

    frequency: Real
    level: Real
    force: Real
    order: Whole
    sweep: Whole
    repeat: Whole


def read_run_rows(
    entry: RunEntry, files: MeasuredFiles, sensors: Sequence[MeasuredSensor], test: int, units: RunUnits, first: int = 0
) -> tuple[Measurement, tuple[Suspicion, ...]]:
    """Read the rows of one run, unsorted, and suspicions about them.

    Parameters
    ----------
    entry
        Description of the run.
    files
        Files of the campaign.
    sensors
        All sensors of the campaign; rows hold their indices.
    test
        Index of the test of the run.
    units
        Units and conventions.
    first
        Order of its first state, unless the run has a column of orders.

    Raises
    ------
    CampaignError
        The file, columns or values of the run cannot be used; one sentence with file, key, value and remedy.
    """
    needed = None if "time" in entry.own else [name for own in entry.own.values() for name in own.columns.values()]
    file = take_rows(entry.table, files.read(entry.file), entry.columns, needed=needed)
    if "time" in entry.own:
        return _read_steady_state(entry, file, sensors, test, units, first)
    frequency = entry.own["frequency"].or_unit(file, units.frequency_unit).positive_values(file, "Hz")
    sweep, of_pass = _split_passes(entry, file, frequency)
    order = _read_whole_numbers(entry, file, "order") if "order" in entry.own else first + np.arange(len(frequency))
    force = _force(entry, file, units)
    level = _read_level(entry, file, force, of_pass, units)
    phase_reference = np.ones(len(frequency), dtype=np.complex128) if force is None else np.exp(-1j * np.angle(force))
    suspicions: list[Suspicion] = []
    read = list(_read_signals(entry, file, sensors, units, phase_reference, suspicions))
    if entry.sweep == BY_ORDER and not {"sweep", "order"} & {*entry.own}:
        motions = [one for one in read if sensors[one.sensor].quantity != CONTACT_FORCE]
        named = name_branches(sweep, of_pass, level, frequency, _find_fundamental_amplitude(motions, len(frequency)))
        if (named != sweep).any():
            suspicions.append(_note_branches(entry, level[named != sweep]))
        sweep = named
    if not {"sweep", "order"} & {*entry.own}:  # sweeps in columns beside one frequency are listed one way
        order = reverse_listed_sweeps(order, of_pass, frequency, sweep)
    given = "repeat" in entry.own
    repeat = (
        _read_whole_numbers(entry, file, "repeat") if given else count_repeats(frequency, sweep, level) + entry.repeat
    )
    states = _States(
        frequency=frequency, level=level, force=np.abs(force) if force is not None else level, order=order,
        sweep=sweep, repeat=repeat,
    )  # fmt: skip
    tables = [_make_rows(states.where(one.there), one.sensor, one.harmonic, one.value, test) for one in read]
    return join_rows(tables), tuple(suspicions)


class _Signal(NamedTuple):
    """Values of one harmonic of one sensor."""

    there: NDArray[np.bool_]
    """Mask of the rows of the file that have a value."""
    sensor: int
    harmonic: int
    value: Complex[NDArray[np.complex128], " n"]


def _read_signals(
    entry: RunEntry,
    file: MeasuredFile,
    sensors: Sequence[MeasuredSensor],
    units: RunUnits,
    phase_reference: Complex[NDArray[np.complex128], " n"],
    suspicions: list[Suspicion],
) -> Iterator[_Signal]:
    """Yield the values of all sensors in the rows of a file, and append suspicions.

    Phases are multiplied by `phase_reference` to the power of the harmonic, so that they refer to the force.
    """
    for number, sensor in enumerate(sensors):
        for signal in entry.signals.get(sensor.name, ()):
            _require(
                all(len(file.column(name).values) == len(phase_reference) for name in signal.columns.values()),
                signal.problem("its column is not as long as that of the frequency"),
            )
            present, there, found_suspicions = _select_present(entry, file, signal)
            value = signal.complex_values(present, sensor.unit if sensor.calibrated else "")
            suspicions += found_suspicions
            _require(
                sensor.has_phase or "phase" not in signal.columns,
                signal.problem(
                    f'names a phase, but sensor "{sensor.name}" has phase = false: remove that from the sensor, or the '
                    "phase here"
                ),
            )
            _require(
                signal.has_phase or not sensor.has_phase,
                signal.problem(f'has no phase: add phase = false to sensor "{sensor.name}", or name its phase'),
            )
            if signal.harmonic:
                peak = signal.peak(units.peak)
                value = (
                    (np.conj(value) if units.time_sign < 0 else value)
                    * peak
                    * phase_reference[there] ** signal.harmonic
                )
            if signal.harmonic and not sensor.has_phase:
                value = np.abs(value).astype(np.complex128)
            yield _Signal(there, number, signal.harmonic, value)


def _find_fundamental_amplitude(read: Sequence[_Signal], n_row: int) -> Real:
    """Amplitudes of the first signal of harmonic 1, shape (n_row,); NaN in rows without a value."""
    size = np.full(n_row, np.nan)
    for one in read:
        if one.harmonic == 1:
            size[one.there] = np.abs(one.value)
            break
    return size


def _note_branches(entry: RunEntry, levels: Real) -> Suspicion:
    listed = ", ".join(f"{level:g}" for level in np.unique(levels))
    return Suspicion(
        where=entry.file, remark=True,
        sentence=(
            f"two passes at the level {listed} differ where they overlap: they are read as branches, the one that "
            "begins at lower frequencies as the sweep up, the other one as the sweep down; if this is wrong, name a "
            "column of sweeps"
        ),
    )  # fmt: skip


def _select_present(
    entry: RunEntry, file: MeasuredFile, signal: SignalEntry
) -> tuple[MeasuredFile, NDArray[np.bool_], list[Suspicion]]:
    """Rows of a file that have a value of a signal, the mask of these rows, and suspicions about them."""
    columns = {name: file.column(name) for name in signal.columns.values()}
    there = np.all([np.isfinite(column.values) for column in columns.values()], axis=0)
    if there.all() or not there.any() or entry.table.values.get("missing") != "skip":
        there, present, result = np.ones(len(there), dtype=np.bool_), file, []
    else:
        present = with_rows(file, columns, there)
        listed = ", ".join(f'"{name}"' for name in columns)
        gaps = f"{(~there).sum()} of {len(there)} rows have no number in {listed}, and are left out of it"
        result = [Suspicion(where=entry.file, sentence=gaps, remark=True)]
    if degrees := signal.suspect_degrees(present):
        result.append(Suspicion(where=entry.file, sentence=degrees))
    return present, there, result


def join_rows(tables: Sequence[Measurement]) -> Measurement:
    """Concatenate the rows of tables; the result is empty without tables."""
    columns = [column.name for column in fields(Measurement)]
    return Measurement(**{name: np.concatenate([[], *(getattr(table, name) for table in tables)]) for name in columns})


def _make_rows(
    states: _States, sensor: int, harmonic: int, value: Complex[NDArray[np.complex128], " n"], test: int
) -> Measurement:
    n = len(value)
    return Measurement(
        test=np.full(n, test), order=states.order, repeat=states.repeat, sweep=states.sweep, level=states.level,
        frequency=states.frequency, sensor=np.full(n, sensor), harmonic=np.full(n, harmonic), value=value,
        force=states.force,
    )  # fmt: skip


def _read_steady_state(
    entry: RunEntry, file: MeasuredFile, sensors: Sequence[MeasuredSensor], test: int, units: RunUnits, order: int
) -> tuple[Measurement, tuple[Suspicion, ...]]:
    """Read the harmonics of one steady state over time, and suspicions about them."""
    file = without_padding(file, entry.own["time"].columns.values())
    time = entry.own["time"].or_unit(file, "s").real_values(file, "s")
    measured = [(number, sensor) for number, sensor in enumerate(sensors) if sensor.name in entry.signals]
    values = np.array(
        [
            entry.signals[sensor.name][0].real_values(file, sensor.unit if sensor.calibrated else "")
            for _, sensor in measured
        ]
    )
    if "force" not in entry.own:
        raise entry.table.problem(
            "columns.force", 'is missing: a response over time has its phase from the force; add force = "COLUMN"',
            show=False,
        )  # fmt: skip
    force = entry.own["force"].or_unit(file, units.level_unit).real_values(file, units.level_si)
    with entry.table.reading(file.path.name):
        names = [f'sensor "{sensor.name}"' for _, sensor in measured]
        result = fit_steady_state(time, values, force, entry.harmonics, frequency=entry.frequency, names=names)
    assert result.reference is not None
    amplitude = float(np.abs(result.reference[1]))
    if not MIN_READING <= amplitude <= MAX_READING:
        raise entry.own["force"].problem(f"has the amplitude {amplitude:g} in {file.path.name}: {REMEDY}")
    level = entry.level * units.level_factor if entry.level is not None else float(f"{amplitude:.{DIGITS}g}")
    one = np.ones(1)
    states = _States(
        frequency=result.frequency * one, level=level * one, force=amplitude * one, order=np.array([order]),
        sweep=np.array([next((sign for sign, word in SWEEPS.items() if word == entry.sweep), 0)]),
        repeat=np.array([entry.repeat]),
    )  # fmt: skip
    tables = []
    for (number, sensor), coefficients in zip(measured, result.coefficients, strict=True):
        # The mean of a velocity or acceleration is zero in any steady state: a mean reading is the sensor's offset.
        for harmonic in range(1 if sensor.quantity in {"velocity", "acceleration"} else 0, entry.harmonics + 1):
            value = coefficients[harmonic : harmonic + 1].astype(np.complex128)
            keeps_sign = sensor.has_phase or harmonic == 0
            tables.append(_make_rows(states, number, harmonic, value if keeps_sign else np.abs(value), test))
    remarks = [Suspicion(where=entry.file, sentence=words, remark=True) for words in note_rounded_time(time)]
    return join_rows(tables), (*remarks, *_suspect_steady_state(entry, result, amplitude))


def _suspect_steady_state(entry: RunEntry, result: Harmonics, amplitude: float) -> tuple[Suspicion, ...]:
    """Suspicions about one steady state over time."""
    assert result.reference is not None
    suspicions = [Suspicion(where=entry.file, sentence=sentence) for sentence in result.suspicions]
    share = np.abs(result.reference[2:]) / amplitude
    if len(share) and share.max() > DISTORTED:
        order = int(np.argmax(share)) + 2
        sentence = (
            f"the force has {100 * share.max():.0f} % of harmonic {order}: the drive clips, or the stinger reacts; the "
            "model has the fundamental of the force only"
        )
        suspicions.append(Suspicion(where=entry.file, sentence=sentence))
    if not result.settled:
        sentence = (
            "has not settled at its end: its harmonics are those of the last part; record longer, or leave it out"
        )
        suspicions.append(Suspicion(where=entry.file, sentence=sentence))
    return tuple(suspicions)


def _split_passes(entry: RunEntry, file: MeasuredFile, frequency: Real) -> tuple[Whole, Whole]:
    """Sweep and number of the pass of each row, shape (n,) each: stated, or from the order of the rows."""
    if "sweep" in entry.own:
        column = file.column(next(iter(entry.own["sweep"].columns.values())))
        for word in column.words or ("numbers",):
            if word.lower() not in SWEEP_WORDS:
                raise entry.own["sweep"].problem(f'"{word}" is not a sweep: write up, down or none')
        sweep = np.array([SWEEP_WORDS[word.lower()] for word in column.words])[column.values.astype(np.int64)]
        return sweep, number_stated_passes(frequency, sweep)
    sweep, of_pass = find_passes(frequency)
    stated = SWEEP_WORDS.get(entry.sweep)
    if stated == 0:  # readings in any order
        return np.zeros_like(sweep), np.zeros_like(of_pass)
    return (sweep if stated is None else np.full_like(sweep, stated)), of_pass


def _read_whole_numbers(entry: RunEntry, file: MeasuredFile, name: str) -> Whole:
    values = entry.own[name].real_values(file, "")
    wrong = np.flatnonzero((values != np.round(values)) | (values < 0))
    if len(wrong):
        raise entry.own[name].problem(f"is {values[wrong[0]]:g} at row {wrong[0] + 1}: give whole numbers from 0 on")
    return values.astype(np.int64)


def _force(entry: RunEntry, file: MeasuredFile, units: RunUnits) -> Complex[NDArray[np.complex128], " n"] | None:
    if "force" not in entry.own:
        return None
    force = entry.own["force"].or_unit(file, units.level_unit)
    value = force.complex_values(file, units.level_si) * force.peak(units.peak)
    if (np.abs(value) == 0).any():
        row = int(np.argmax(np.abs(value) == 0))
        raise entry.own["force"].problem(f"is 0 at row {row + 1} of {file.path.name}: leave out rows without a drive")
    if (beyond := is_beyond(value)).any():
        row = int(np.argmax(beyond))
        raise entry.own["force"].problem(f"is {abs(value[row]):g} at row {row + 1} of {file.path.name}: {REMEDY}")
    return np.conj(value) if units.time_sign < 0 else value


def _read_level(
    entry: RunEntry,
    file: MeasuredFile,
    force: Complex[NDArray[np.complex128], " n"] | None,
    of_pass: Whole,
    units: RunUnits,
) -> Real:
    if "level" in entry.own:
        signal = entry.own["level"].or_unit(file, units.level_unit)
        return signal.positive_values(file, units.level_si) * signal.peak(units.peak)
    if entry.levels:
        n_pass = int(of_pass.max(initial=-1)) + 1
        if len(entry.levels) != n_pass:
            text = f"has {len(entry.levels)} numbers, but {file.path.name} has {n_pass} sweeps: give one for each"
            raise entry.table.problem("levels", text, show=False)
        return np.array(entry.levels)[of_pass] * units.level_factor
    if entry.level is not None:
        return np.full(len(of_pass), entry.level * units.level_factor)
    assert force is not None
    return np.full(len(of_pass), float(f"{np.median(np.abs(force)):.{DIGITS}g}"))


def _require(condition: bool, problem: CampaignError) -> None:
    if not condition:
        raise problem
