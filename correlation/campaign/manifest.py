"""The manifest of a campaign folder, ``campaign.toml``: what the numbers in its tables mean.

Each value is checked once, here; the message of a mistake names file, key, value and remedy.
"""

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from correlation.campaign.measurement import (
    COMPONENTS,
    CONFIGURATIONS,
    CONTACT_FORCE,
    SI_UNIT,
    HeldOut,
    MeasuredSensor,
    Test,
)
from correlation.campaign.measurement_unit import si_factor, si_quantity
from correlation.campaign.toml_table import TomlTable
from correlation.errors import CampaignError, Mistakes

MANIFEST = "campaign.toml"
SCHEMA = 1
#: Sign of i Omega t by the words of the manifest.
TIME_SIGNS = {"exp(+i omega t)": 1, "exp(i omega t)": 1, "exp(-i omega t)": -1}
#: Peak amplitude of one unit.
PEAK_OF = {"peak": 1.0, "rms": math.sqrt(2.0), "peak to peak": 0.5}
CONVENTIONS = ("convention", "units")
DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True, kw_only=True)
class RecordEntry:
    """A time record as the manifest names it: its file, the units of its columns, the channel that drives."""

    name: str
    file: str
    units: Mapping[str, str]
    force: str | None
    held_out: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class Manifest:
    """What ``campaign.toml`` says.

    Parameters
    ----------
    title
        Title of the campaign.
    time_sign
        +1 for amplitudes of e^{+i Omega t}, -1 for those of e^{-i Omega t}.
    peak
        Peak amplitude of one unit of an amplitude in the tables [-].
    level_factor, frequency_factor
        Factors to newtons (peak amplitude) and to hertz [-].
    sensors, tests, files
        Tests, and the file of each test.
    records
        Time records.
    held_out
        Levels [N, peak] and repeats that no calibration may see.
    """

    title: str
    time_sign: int
    peak: float
    level_factor: float
    frequency_factor: float
    sensors: tuple[MeasuredSensor, ...]
    tests: tuple[Test, ...]
    files: tuple[str, ...]
    records: tuple[RecordEntry, ...]
    held_out: HeldOut


def read_manifest(folder: Path) -> Manifest:
    """Read the manifest of a campaign folder.

    Raises
    ------
    CampaignError
        It is missing, no TOML, or holds keys or values that cannot be used: all of them, one per line.
    """
    root = TomlTable(file=MANIFEST, values=_toml(folder))
    schema = root.take("schema", int)
    if schema != SCHEMA:
        raise root.problem("schema", f"this version of stickslip reads schema = {SCHEMA}")
    mistakes = Mistakes()
    records = mistakes.attempt(lambda: root.tables("record", required=False), ())
    tables = mistakes.attempt(lambda: root.tables("test", required=not records), ())
    time_sign, peak, level_factor, frequency_factor = 1, 1.0, 1.0, 1.0
    # Time records alone need no convention of amplitudes.
    convention, units = (mistakes.attempt(partial(root.table, key, required=bool(tables)), None) for key in CONVENTIONS)
    if tables and convention is not None:
        time_sign = TIME_SIGNS[mistakes.attempt(partial(convention.choice, "time", TIME_SIGNS), next(iter(TIME_SIGNS)))]
        peak = PEAK_OF[mistakes.attempt(partial(convention.choice, "amplitude", PEAK_OF), "peak")]
    if tables and units is not None:
        level_factor = mistakes.attempt(partial(units.converted, "level", partial(_factor, "N")), 1.0) * peak
        frequency_factor = mistakes.attempt(partial(units.converted, "frequency", partial(_factor, "Hz")), 1.0)
    sensors = [
        mistakes.attempt(partial(_sensor, table), None) for table in mistakes.attempt(lambda: root.tables("sensor"), ())
    ]
    tests = [mistakes.attempt(partial(_test, table), None) for table in tables]
    entries = [mistakes.attempt(partial(_record, table), None) for table in records]
    manifest = Manifest(
        title=mistakes.attempt(lambda: root.take("title", str, ""), ""),
        time_sign=time_sign,
        peak=peak,
        level_factor=level_factor,
        frequency_factor=frequency_factor,
        sensors=tuple(each for each in sensors if each is not None),
        tests=tuple(each[0] for each in tests if each is not None),
        files=tuple(each[1] for each in tests if each is not None),
        records=tuple(each for each in entries if each is not None),
        held_out=mistakes.attempt(lambda: _held_out(root.table("held_out", required=False), level_factor), HeldOut()),
    )
    for table in (root, convention, units):
        if table is not None:
            mistakes.attempt(table.finish, None)
    names = {
        "sensor": [each.name for each in manifest.sensors],
        "test": [each.name for each in manifest.tests],
        "record": [each.name for each in manifest.records],
    }
    for kind, given in names.items():
        mistakes.attempt(partial(_check_names, root, kind, given), None)
    mistakes.refuse()
    return manifest


def _factor(wanted: str, unit: object) -> float:
    return si_factor(str(unit), wanted)


def _check_names(root: TomlTable, kind: str, given: Sequence[str]) -> None:
    for name in given:
        if given.count(name) > 1:
            raise root.problem(kind, f'two are called "{name}"; give each a name of its own', show=False)


def _test(table: TomlTable) -> tuple[Test, str]:
    """A test, and its file."""
    file = table.take("file", str)
    test = Test(name=table.take("name", str), configuration=table.choice("configuration", CONFIGURATIONS))
    table.finish()
    return test, file


def _sensor(table: TomlTable) -> MeasuredSensor:
    quantity = table.choice("quantity", SI_UNIT)
    uncertainty = table.converted("uncertainty", lambda value: si_quantity(value, ""), 0.0)
    if uncertainty < 0:
        raise table.problem("uncertainty", "must not be negative")
    if quantity == CONTACT_FORCE:
        sensor = MeasuredSensor(
            name=table.take("name", str),
            quantity=quantity,
            line=table.take("line", str),
            component=table.choice("component", COMPONENTS),
            uncertainty=uncertainty,
        )
    else:
        place, point = table.take("place", str, None), table.take("coordinates", list, None)
        if (place is None) == (point is None):
            wanted = 'give place = "..." or coordinates = ["500 mm", "0 mm", "0 mm"], one of them'
            raise table.problem("place", wanted, show=False)
        if point is not None and len(point) != 3:
            raise table.problem("coordinates", 'give three, e.g. ["500 mm", "0 mm", "0 mm"]')
        sensor = MeasuredSensor(
            name=table.take("name", str),
            quantity=quantity,
            direction=table.choice("direction", DIRECTIONS),
            place=place,
            coordinates=point and table.converted("coordinates", _point),
            uncertainty=uncertainty,
        )
    table.finish()
    return sensor


def _point(values: object) -> NDArray[np.float64]:
    return np.array([si_quantity(value, "m") for value in values]) if isinstance(values, list) else np.zeros(0)


def _record(table: TomlTable) -> RecordEntry:
    units = table.take("units", dict, {})
    for column, unit in units.items():
        if not isinstance(unit, str):
            raise table.problem("units", f'the unit of "{column}" must be text, e.g. {column} = "m"')
    entry = RecordEntry(
        name=table.take("name", str),
        file=table.take("file", str),
        units=units,
        force=table.take("force", str, None),
        held_out=table.take("held_out", bool, False),
    )
    table.finish()
    return entry


def _held_out(table: TomlTable, level_factor: float) -> HeldOut:
    levels, repeats = table.take("levels", list, []), table.take("repeats", list, [])
    if not all(isinstance(level, int | float) and not isinstance(level, bool) for level in levels):
        raise table.problem("levels", "must be numbers in the unit of the level, e.g. [5.0]")
    if not all(type(repeat) is int for repeat in repeats):
        raise table.problem("repeats", "must be whole numbers, e.g. [4, 5]")
    table.finish()
    return HeldOut(levels=tuple(level * level_factor for level in levels), repeats=tuple(repeats))


def _toml(folder: Path) -> dict[str, Any]:
    path = folder / MANIFEST
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (FileNotFoundError, NotADirectoryError):
        raise CampaignError(f'there is no {MANIFEST} in "{folder}"; give the folder of a campaign') from None
    except UnicodeDecodeError:
        raise CampaignError(f"{MANIFEST}: is no text in UTF-8; save it as UTF-8") from None
    except OSError as error:
        raise CampaignError(f"{MANIFEST}: cannot be read ({error.strerror}); check its permissions") from None
    except tomllib.TOMLDecodeError as error:
        raise CampaignError(f"{MANIFEST}: is no TOML: {error}; correct what stands there") from None
