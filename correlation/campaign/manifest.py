"""Manifest of a campaign folder, ``campaign.toml``: sensors, tests, units and conventions of its tables.

Each value is checked here, once; the message of a mistake names file, key, value and remedy.
"""

import math
import tomllib
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeVar

from correlation.campaign.load_cell import LoadCellPair, read_load_cells
from correlation.campaign.measurement import CONFIGURATIONS, CONTROLS, Drive, HeldOut, MeasuredSensor, Test
from correlation.campaign.measurement_unit import find_si_factor, read_positive_si_quantity, read_si_quantity
from correlation.campaign.run_entry import RunEntry, read_run
from correlation.campaign.run_table import RunUnits
from correlation.campaign.sensor_entry import read_sensor
from correlation.campaign.signal_entry import PEAK_OF, read_sign
from correlation.campaign.time_record import TIME
from correlation.campaign.toml_table import TomlTable
from correlation.data_type.registry import DATA_TYPES, DataType
from correlation.errors import CampaignError, CampaignMistakes
from geometry.toml_position import explain_syntax, key_lines

MANIFEST = "campaign.toml"
SCHEMA = 1
Entry = TypeVar("Entry")
#: Sign of i Omega t by the text in the manifest.
TIME_SIGNS = {"exp(+i omega t)": 1, "exp(i omega t)": 1, "exp(-i omega t)": -1}
CONVENTIONS = ("convention", "units")
#: SI unit of the levels by the quantity of the drive.
DRIVES = {"force": "N", "base acceleration": "m/s^2"}


@dataclass(frozen=True, kw_only=True)
class RecordEntry:
    """``[[record]]`` of a manifest: description of a time record.

    Parameters
    ----------
    name, file
        Name of the record and of its file.
    units
        Units of its columns.
    signs
        Signs of its columns; 1 for columns that are not listed [-].
    force
        Column of the driving force; None for a ring-down.
    held_out
        Whether it is held out of calibrations.
    rate
        Sampling rate of a file without a column of time [Hz]; None for a file with this column.
    start, end
        Limits of the time that is read [s]; infinite if not given.
    """

    name: str
    file: str
    units: Mapping[str, str]
    signs: Mapping[str, int]
    force: str | None
    held_out: bool
    rate: float | None = None
    start: float = -math.inf
    end: float = math.inf


@dataclass(frozen=True, kw_only=True, eq=False)
class Manifest:
    """Content of ``campaign.toml``.

    Parameters
    ----------
    title
        Title of the campaign.
    drive
        Quantity and unit of the levels.
    units
        Conventions of the amplitudes and units of level and frequency.
    frequency_factor
        Factor of the frequencies in tidy tables to hertz [-].
    sensors
        Sensors, load cells among them.
    load_cells
        Pairs of load cells, and the contact forces that are computed from them.
    tests, files
        Tests, and the file of each test; None for a test whose data are in files of its runs or of other data.
    runs
        Runs of the tests.
    records
        Time records.
    data
        Entries of all other types of data, each with its type.
    held_out
        Levels [N, peak] and repeats that are held out of calibrations.
    """

    title: str
    drive: Drive
    units: RunUnits
    frequency_factor: float
    sensors: tuple[MeasuredSensor, ...]
    load_cells: tuple[LoadCellPair, ...]
    tests: tuple[Test, ...]
    files: tuple[str | None, ...]
    runs: tuple[RunEntry, ...]
    records: tuple[RecordEntry, ...]
    data: tuple[tuple[DataType, TomlTable], ...]
    held_out: HeldOut

    def files_of(self, tests: Collection[int]) -> str:
        """Names of the files of the given tests, for messages."""
        names = [file for number, file in enumerate(self.files) if number in tests and file is not None]
        called = {self.tests[number].name for number in tests}
        names += [run.file for run in self.runs if run.test in called]
        return ", ".join(dict.fromkeys(names)) or MANIFEST


def read_manifest(folder: Path) -> Manifest:
    """Read the manifest of a campaign folder.

    Raises
    ------
    CampaignError
        The manifest is missing, not TOML, or has keys or values that cannot be used: the error lists all mistakes, one
        per line.
    """
    root = _read_toml(folder)
    schema = root.take("schema", int)
    if schema != SCHEMA:
        raise root.problem("schema", f"this version of stickslip reads schema = {SCHEMA}")
    mistakes = CampaignMistakes()
    records = mistakes.attempt(lambda: root.tables("record", required=False), ())
    runs = mistakes.attempt(lambda: root.tables("run", required=False), ())
    data = [
        (kind, table)
        for kind in DATA_TYPES
        for table in mistakes.attempt(partial(root.tables, kind.table, required=False), ())
    ]
    tables = mistakes.attempt(lambda: root.tables("test", required=not (records or data)), ())
    drive = mistakes.attempt(lambda: _read_drive(root), Drive())
    units, frequency_factor = _read_units(root, drive, bool(tables), mistakes)
    sensor_tables = mistakes.attempt(lambda: root.tables("sensor", required=bool(tables or records)), ())
    sensors = _read_all(mistakes, sensor_tables, read_sensor)
    tests = _read_all(mistakes, tables, partial(_test, has_others=bool(runs or data)))
    pairs = mistakes.attempt(lambda: root.tables("load_cells", required=False), ())
    sensor_names, test_names = _list_names(sensor_tables), _list_names(tables)
    read_own_run = partial(read_run, sensors=sensor_names, tests=test_names)
    manifest = Manifest(
        title=mistakes.attempt(lambda: root.take("title", str, ""), ""),
        drive=drive,
        units=units,
        frequency_factor=frequency_factor,
        sensors=tuple(sensors),
        load_cells=tuple(_read_all(mistakes, pairs, partial(read_load_cells, sensors=sensors, names=sensor_names))),
        tests=tuple(test for test, _ in tests),
        files=tuple(file for _, file in tests),
        runs=tuple(_read_all(mistakes, runs, read_own_run)),
        records=tuple(_read_all(mistakes, records, _read_record)),
        data=tuple(data),
        held_out=mistakes.attempt(
            lambda: _read_held_out(root.table("held_out", required=False), units.level_factor), HeldOut()
        ),
    )  # fmt: skip
    mistakes.attempt(root.finish, None)
    for with_names in (sensor_tables, tables, records):
        _check_names(with_names, mistakes)
    for test, file in zip(manifest.tests, manifest.files, strict=True):
        named = _list_texts([*runs, *(table for _, table in data)], "test")
        if file is None and test.name not in named:
            mistakes.add(
                f'{MANIFEST}: test "{test.name}" has neither a file nor a [[run]]: add one, or remove the test'
            )
    mistakes.refuse()
    return manifest


def _read_all(
    mistakes: CampaignMistakes, tables: Sequence[TomlTable], read: Callable[[TomlTable], Entry]
) -> list[Entry]:
    """Entries of the tables that can be read; the mistakes of the others are collected."""
    entries: list[Entry | None] = [mistakes.attempt(partial(read, table), None) for table in tables]
    return [entry for entry in entries if entry is not None]


def _list_names(tables: Sequence[TomlTable]) -> tuple[str, ...] | None:
    """Names of tables, also of those with a mistake; None if a table has no name: any name may be meant for it."""
    has_names = all(isinstance(table.values.get("name"), str) for table in tables)
    return _list_texts(tables, "name") if has_names else None


def _list_texts(tables: Sequence[TomlTable], key: str) -> tuple[str, ...]:
    """Texts of tables at a key, also of tables with a mistake: a reference to these is not another mistake."""
    return tuple(dict.fromkeys(text for table in tables if isinstance(text := table.values.get(key), str)))


def _read_drive(root: TomlTable) -> Drive:
    table = root.table("drive", required=False)
    quantity = table.choice("quantity", DRIVES) if "quantity" in table.values else "force"
    calibrated = table.take("calibrated", bool, True)
    table.finish()
    if calibrated:
        return Drive(quantity=quantity, unit=DRIVES[quantity])
    units = root.values.get("units")
    unit = units.get("level") if isinstance(units, dict) else None
    return Drive(quantity=quantity, unit=str(unit or "V"), calibrated=False)


def _read_units(root: TomlTable, drive: Drive, required: bool, mistakes: CampaignMistakes) -> tuple[RunUnits, float]:
    """Conventions, and the factor of frequencies to hertz; not required in a campaign without tests."""
    time_sign, peak, level_factor, frequency_factor = 1, 1.0, 1.0, 1.0
    level_unit, frequency_unit = drive.unit, "Hz"
    convention, units = (mistakes.attempt(partial(root.table, key, required=required), None) for key in CONVENTIONS)
    if convention is not None and (required or convention.values):
        time_sign = TIME_SIGNS[mistakes.attempt(partial(convention.choice, "time", TIME_SIGNS), next(iter(TIME_SIGNS)))]
        peak = PEAK_OF[mistakes.attempt(partial(convention.choice, "amplitude", PEAK_OF), "peak")]
        mistakes.attempt(convention.finish, None)
    if units is not None and (required or units.values):
        read_level = partial(units.converted, "level", partial(_find_level_factor, drive), example=drive.unit)
        read_frequency = partial(units.converted, "frequency", _find_frequency_factor, example="Hz")
        level_factor = mistakes.attempt(read_level, 1.0) * peak
        frequency_factor = mistakes.attempt(read_frequency, 1.0)
        level_unit, frequency_unit = (str(units.values.get(key, word)) for key, word in
                                      (("level", level_unit), ("frequency", frequency_unit)))  # fmt: skip
        mistakes.attempt(units.finish, None)
    run_units = RunUnits(
        time_sign=time_sign, peak=peak, level_factor=level_factor, level_unit=level_unit,
        frequency_unit=frequency_unit, level_si=DRIVES[drive.quantity] if drive.calibrated else "",
    )  # fmt: skip
    return run_units, frequency_factor


def _find_level_factor(drive: Drive, unit: object) -> float:
    if not drive.calibrated:
        return 1.0
    try:
        return find_si_factor(str(unit), drive.unit)
    except ValueError as error:
        remedy = "for a drive that is not calibrated, such as volts, add a table [drive] with calibrated = false"
        if drive.quantity == "force":
            remedy += '; for a shaken base, one with quantity = "base acceleration"'
        raise ValueError(f"{error}; {remedy}") from None


def _find_frequency_factor(unit: object) -> float:
    return find_si_factor(str(unit), "Hz")


def _check_names(tables: Sequence[TomlTable], mistakes: CampaignMistakes) -> None:
    names: set[str] = set()
    for table in tables:
        name = table.values.get("name")
        if not isinstance(name, str):
            continue  # reported where the table is read
        if name in names:
            mistakes.add(str(table.problem("name", "two have this name; give each its own name")))
        names.add(name)


def _test(table: TomlTable, *, has_others: bool) -> tuple[Test, str | None]:
    """Read a test and the file of its tidy table; the file may be missing if there are runs or data of other types."""
    file = table.take("file", str, None) if has_others else table.take("file", str)
    test = Test(
        name=table.take("name", str),
        configuration=table.choice("configuration", CONFIGURATIONS),
        settling=table.take("settling", bool, False),
        control=table.choice("control", CONTROLS) if "control" in table.values else "force",
    )
    table.finish()
    return test, file


def _read_record(table: TomlTable) -> RecordEntry:
    units, signs = _read_channels(table)
    entry = RecordEntry(
        name=table.take("name", str),
        file=table.take("file", str),
        units=units,
        signs=signs,
        force=table.take("force", str, None),
        held_out=table.take("held_out", bool, False),
        rate=table.converted("rate", partial(read_positive_si_quantity, si="Hz")) if "rate" in table.values else None,
        start=table.converted("start", lambda value: read_si_quantity(value, "s"), -math.inf),
        end=table.converted("end", lambda value: read_si_quantity(value, "s"), math.inf),
    )
    table.finish()
    if entry.end <= entry.start:
        raise table.problem("end", f"must be after start = {entry.start:g} s")
    return entry


def _read_channels(table: TomlTable) -> tuple[dict[str, str], dict[str, int]]:
    """Units and signs of the columns of a record; the value of a column is a unit, or a table of unit and sign."""
    given, units, signs = table.table("units", required=False), dict[str, str](), dict[str, int]()
    for column, value in given.values.items():
        if isinstance(value, str):
            units[column] = value
            continue
        if not isinstance(value, dict):
            raise table.problem("units", f'the unit of "{column}" must be text, e.g. {column} = "m"')
        entry = given.within(column, value)
        units[column] = entry.take("unit", str)
        if column != TIME:
            signs[column] = read_sign(entry)
        entry.finish()
    return units, signs


def _read_held_out(table: TomlTable, level_factor: float) -> HeldOut:
    levels, repeats = table.take("levels", list, []), table.take("repeats", list, [])
    if not all(isinstance(level, int | float) and not isinstance(level, bool) for level in levels):
        raise table.problem("levels", "must be numbers in the unit of the level, e.g. [5.0]")
    if not all(type(repeat) is int for repeat in repeats):
        raise table.problem("repeats", "must be whole numbers, e.g. [4, 5]")
    table.finish()
    return HeldOut(levels=tuple(level * level_factor for level in levels), repeats=tuple(repeats))


def _read_toml(folder: Path) -> TomlTable:
    path = folder / MANIFEST
    if path.exists() and not path.is_file():
        raise CampaignError(f"{MANIFEST}: is a folder or a device; give a campaign with an ordinary file of that name")
    try:
        text = path.read_text(encoding="utf-8-sig")
        return TomlTable(file=MANIFEST, values=tomllib.loads(text), lines=key_lines(text))
    except (FileNotFoundError, NotADirectoryError):
        draft = (
            f", or draft it by: stickslip campaign new {folder}" if folder.is_dir() and any(folder.iterdir()) else ""
        )
        raise CampaignError(f'there is no {MANIFEST} in "{folder}"; give the folder of a campaign{draft}') from None
    except UnicodeDecodeError:
        raise CampaignError(f"{MANIFEST}: is not text in UTF-8; save it as UTF-8") from None
    except OSError as error:
        raise CampaignError(f"{MANIFEST}: cannot be read ({error.strerror}); check its permissions") from None
    except tomllib.TOMLDecodeError as error:
        sentence, line = explain_syntax(str(error), text)
        raise CampaignError(f"{MANIFEST}:{line}: {sentence}") from None
    except RecursionError:
        raise CampaignError(f"{MANIFEST}: its brackets are nested too deeply; correct them") from None
    except ValueError:  # Python's own limit
        raise CampaignError(f"{MANIFEST}: has a number with thousands of digits; shorten it") from None
