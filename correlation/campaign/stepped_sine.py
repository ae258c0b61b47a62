"""Reader of stepped-sine tables: CSV, one complex amplitude with its unit per row."""

import difflib
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.typing import NDArray

from correlation.campaign.csv_table import CsvTable, read_table
from correlation.campaign.manifest import MANIFEST, Manifest
from correlation.campaign.measurable import REMEDY, is_beyond, is_too_large
from correlation.campaign.measurement import CONTACT_FORCE, SWEEPS, Measurement, number_frequencies
from correlation.campaign.measurement_unit import find_si_factor
from correlation.errors import CampaignError

COLUMNS = (
    "test", "order", "repeat", "sweep", "level", "frequency", "sensor", "harmonic", "real", "imag", "unit",
)  # fmt: skip
#: Optional column: measured amplitude of the force.
FORCE = "force"
#: Columns that identify a row; the order is not among them.
KEY = ("test", "level", "frequency", "sensor", "harmonic", "sweep", "repeat")
_POLAR = ("amplitude", "phase", "magnitude", "abs", "angle")


def read_csv(path: Path, manifest: Manifest, tests: Collection[str]) -> Measurement:
    """Read one table into SI, peak amplitudes, e^{+i k Omega t}.

    Parameters
    ----------
    path
        Path of the file.
    manifest
        Manifest with sensors, units and conventions.
    tests
        Names of the tests that the file may have.

    Returns
    -------
    Rows sorted by `KEY`.

    Raises
    ------
    CampaignError
        The file cannot be used; one sentence with file, line, value and remedy.
    """
    table = read_table(path)
    _check_header(table)
    names = [test.name for test in manifest.tests]
    sensors = [sensor.name for sensor in manifest.sensors]
    harmonic = table.integers("harmonic", least=0)
    sensor = _index(table, "sensor", {name: number for number, name in enumerate(sensors)})
    test = _index(table, "test", {name: names.index(name) for name in tests})
    with np.errstate(over="ignore", invalid="ignore"):  # too large values are refused below
        value = table.numbers("real") + 1j * manifest.units.time_sign * table.numbers("imag")
        value *= _find_unit_factors(table, manifest, sensor)
        # The convention of amplitudes does not apply to a mean.
        value[harmonic > 0] *= manifest.units.peak
    _refuse(table, "imag", (harmonic == 0) & (value.imag != 0), "a mean (harmonic 0) has no imaginary part: write 0")
    level, frequency = table.numbers("level"), table.numbers("frequency")
    force = table.numbers(FORCE) if FORCE in table.columns else level
    _refuse(table, "level", level <= 0, "must be positive: the amplitude of the force")
    _refuse(table, FORCE, (force <= 0) & (force != level), "must be positive: the amplitude that was measured")
    _refuse(table, "frequency", frequency <= 0, "must be positive")
    for name, wrong in (
        ("level", is_beyond(level)),
        (FORCE if FORCE in table.columns else "level", is_beyond(force)),
        ("frequency", is_beyond(frequency)),
        ("real", is_too_large(value.real)),
        ("imag", is_too_large(value.imag)),
    ):
        _refuse(table, name, wrong, REMEDY)
    amplitude = np.array([not item.has_phase for item in manifest.sensors])[sensor]
    _refuse(
        table, "imag", amplitude & (value.imag != 0), "its sensor has phase = false: give amplitudes, with imag = 0"
    )
    negative = amplitude & (harmonic > 0) & (value.real < 0)
    _refuse(table, "real", negative, "its sensor has phase = false: an amplitude is not negative")
    _refuse_contact_when_free(table, manifest, test, sensor)
    measurement = Measurement(
        test=test,
        order=table.integers("order", least=0),
        repeat=table.integers("repeat", least=0),
        sweep=_index(table, "sweep", {word: sign for sign, word in SWEEPS.items()}),
        level=level * manifest.units.level_factor,
        frequency=frequency * manifest.frequency_factor,
        sensor=sensor,
        harmonic=harmonic,
        value=value,
        force=force * manifest.units.level_factor,
    )
    order = find_sorting(measurement)
    _refuse_duplicates(table, measurement, order)
    return measurement.where(order)


def find_sorting(measurement: Measurement) -> Int[NDArray[np.int64], " k"]:
    """Row numbers that sort a table by `KEY`, shape (k,)."""
    return np.lexsort(_list_key_columns(measurement)[::-1])


def find_same(measurement: Measurement, order: Sequence[int] | NDArray[np.int64]) -> Bool[NDArray[np.bool_], " k-1"]:
    """Mask of the rows with the same `KEY` as the next row, in the order of `find_sorting`, shape (k - 1,)."""
    return np.asarray(np.all([np.diff(column[order]) == 0 for column in _list_key_columns(measurement)], axis=0))


def _list_key_columns(measurement: Measurement) -> list[NDArray[Any]]:
    """Columns of `KEY`; frequencies that differ only by rounding are equal, as in a campaign."""
    columns = {name: getattr(measurement, name) for name in KEY}
    return [*(columns | {"frequency": number_frequencies(measurement.frequency)}).values()]


def _check_header(table: CsvTable) -> None:
    where = f"{table.file}:1: "
    polar = [name for name in table.columns if name.lower().startswith(_POLAR)]
    if polar:
        raise CampaignError(
            f'{where}column "{polar[0]}" is polar: give columns real and imag, '
            "real = amplitude cos(phase) and imag = amplitude sin(phase)"
        )
    for name in COLUMNS:
        if name not in table.columns:
            raise CampaignError(f'{where}there is no column "{name}"; the header must be {",".join(COLUMNS)}')
    for name in table.columns:
        if name not in (*COLUMNS, FORCE):
            raise CampaignError(
                f'{where}column "{name}" is not known; remove it: the header must be {",".join(COLUMNS)}'
            )


def _index(table: CsvTable, name: str, known: Mapping[str, int]) -> Int[NDArray[np.int64], " k"]:
    """Number of the word in each row of a column, shape (k,)."""
    column = table.columns[name]
    for word in dict.fromkeys(column):
        if word not in known:
            close = difflib.get_close_matches(word, known, 1)
            where = "" if name == "sweep" else f" of {MANIFEST} for this file"
            hint = f'; did you mean "{close[0]}"?' if close else f": give one of {', '.join(known)}"
            raise table.problem(column.index(word), f'{name} = "{word}" is not a {name}{where}{hint}')
    return np.array([known[word] for word in column], dtype=np.int64)


def _find_unit_factors(
    table: CsvTable, manifest: Manifest, sensor: Int[NDArray[np.int64], " k"]
) -> Float[NDArray[np.float64], " k"]:
    """Factor to SI of each row, shape (k,)."""
    factors: dict[tuple[str, int], float] = {}
    pairs = list(zip(table.columns["unit"], sensor.tolist(), strict=True))
    for pair in dict.fromkeys(pairs):
        unit, number = pair
        measured = manifest.sensors[number]
        if not measured.calibrated:
            factors[pair] = 1.0
            continue
        row = pairs.index(pair)
        if not unit:
            raise table.problem(row, f'unit is missing; write "{measured.unit}"')
        try:
            factors[pair] = find_si_factor(unit, measured.unit)
        except ValueError as error:
            article = "an" if measured.quantity.startswith("a") else "a"
            reads = f'for sensor "{measured.name}", which measures {article} {measured.quantity}'
            raise table.problem(row, f'unit = "{unit}" {reads}: {error}') from None
    return np.array([factors[pair] for pair in pairs])


def _refuse(table: CsvTable, name: str, wrong: Bool[NDArray[np.bool_], " k"], text: str) -> None:
    if wrong.any():
        row = int(np.argmax(wrong))
        raise table.problem(row, f"{name} = {table.columns[name][row]}: {text}")


def _refuse_contact_when_free(
    table: CsvTable, manifest: Manifest, test: Int[NDArray[np.int64], " k"], sensor: Int[NDArray[np.int64], " k"]
) -> None:
    free = np.array([item.configuration == "free" for item in manifest.tests])
    contact = np.array([item.quantity == CONTACT_FORCE for item in manifest.sensors])
    wrong = free[test] & contact[sensor]
    _refuse(table, "sensor", wrong, "measures a contact, but the test is of the structure without contacts: remove it")


def _refuse_duplicates(table: CsvTable, measurement: Measurement, order: Sequence[int] | NDArray[np.int64]) -> None:
    same = find_same(measurement, order)
    if same.any():
        at = int(np.argmax(same))
        first, second = sorted((int(order[at]), int(order[at + 1])))
        raise table.problem(
            second,
            f"measures the same as line {table.lines[first]} (test, repeat, sweep, level, frequency, sensor, "
            "harmonic): remove one, or number its repeat",
        )
