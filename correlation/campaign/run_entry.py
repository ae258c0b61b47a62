"""``[[run]]`` of a manifest: one run of a test, in the columns of any measured file.

A run is a stepped sine (a column ``frequency``, a row per steady state) or one steady state over time (a column
``time``). Level, repeat and sweep are values of the entry if they are not columns.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from correlation.campaign.measurable import MAX_READING, MIN_READING, REMEDY
from correlation.campaign.measurement import CONTROLS, SWEEPS
from correlation.campaign.signal_entry import SignalEntry, read_signal
from correlation.campaign.toml_table import TomlTable

#: Columns of a run that are not sensors.
NON_SENSOR_COLUMNS = ("frequency", "time", "force", "level", "repeat", "order", "sweep")
#: Columns of a stepped sine only, since they differ from row to row.
STEPPED = ("level", "repeat", "order", "sweep")
BY_ORDER = "by order"
#: Default of the highest harmonic that is read from a time history.
HARMONICS = 5


@dataclass(frozen=True, kw_only=True)
class RunEntry:
    """Description of a run in the manifest.

    Parameters
    ----------
    table
        Table of the run, for messages.
    test, file
        Names of its test and of its file.
    level
        Set point of the force in the unit of the campaign's levels; None if `levels`, a column or the measured force
        defines it.
    levels
        Set points of its passes in the order of measurement, in the same unit; empty if they are not given per pass.
    repeat
        Number of its first repeat.
    sweep
        "up", "down", "none", or "by order": up where the frequency rises from row to row, down where it falls.
    control
        "force", or "response" for a test at a constant response, whose force differs from point to point: a force below
        its set point is then not suspicious.
    frequency
        Frequency of a steady state over time [Hz]; None if it is to be identified.
    harmonics
        Highest harmonic that is read from a steady state over time [-].
    own
        Columns that are not sensors, by the names in `NON_SENSOR_COLUMNS`.
    signals
        Columns by sensor; several for several harmonics.
    """

    table: TomlTable
    test: str
    file: str
    level: float | None
    levels: tuple[float, ...]
    repeat: int
    sweep: str
    control: str
    frequency: float | None
    harmonics: int
    own: Mapping[str, SignalEntry]
    signals: Mapping[str, tuple[SignalEntry, ...]]

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of all columns of the run."""
        entries = [*self.own.values(), *(entry for entries in self.signals.values() for entry in entries)]
        return tuple(dict.fromkeys(name for entry in entries for name in entry.columns.values()))


def read_run(table: TomlTable, sensors: Collection[str] | None, tests: Collection[str] | None) -> RunEntry:
    """Read one run.

    Parameters
    ----------
    table
        Table of the run.
    sensors, tests
        Names of the sensors and tests of the manifest; None if one has no name, since any unknown name may be meant for
        it.

    Raises
    ------
    CampaignError
        A key or value cannot be used, or a column is not that of a sensor.
    """
    columns = table.table("columns")
    own = {name: read_signal(columns, name) for name in NON_SENSOR_COLUMNS if name in columns.values}
    if sensors is None:
        sensors = [name for name in columns.values if name not in NON_SENSOR_COLUMNS]
    signals = {}
    for name in sensors:
        if name in columns.values:
            value = columns.values[name]
            if isinstance(value, list):
                columns.known.add(name)
                parts = [
                    replace(columns.within(f"{name}[{number + 1}]", {name: item}), at=(*columns.at, name, number))
                    for number, item in enumerate(value)
                ]
                signals[name] = tuple(read_signal(part, name) for part in parts)
            else:
                signals[name] = (read_signal(columns, name),)
    columns.known.update((*NON_SENSOR_COLUMNS, *sensors))
    columns.finish()
    if ("frequency" in own) == ("time" in own):
        raise columns.problem(
            "frequency", "name the column of the frequency (stepped sine) or of the time (steady state), one of them",
            show=False,
        )  # fmt: skip
    if "time" in own:
        _refuse_stepped(columns, own, signals)
    if not signals:
        raise table.problem("columns", f"names no sensor: add one of {', '.join(sensors)}", show=False)
    level, levels = _number(table, "level"), _read_levels(table, own)
    if level is not None and "level" in own:
        raise table.problem("level", "is also a column: remove one of them")
    control = table.choice("control", CONTROLS) if "control" in table.values else "force"
    if control == "response" and "force" not in own:
        raise table.problem("control", 'needs the measured force: add force = "COLUMN" to its columns')
    if level is None and not levels and "level" not in own and "force" not in own:
        raise table.problem("level", "is missing: give the amplitude of the force, or a column level or force")
    entry = RunEntry(
        table=table,
        test=table.take("test", str) if tests is None else table.choice("test", tests),
        file=table.take("file", str),
        level=level,
        levels=levels,
        repeat=table.take("repeat", int, 1),
        sweep=table.choice("sweep", (*SWEEPS.values(), BY_ORDER)) if "sweep" in table.values else BY_ORDER,
        control=control,
        frequency=_number(table, "frequency"),
        harmonics=table.take("harmonics", int, HARMONICS),
        own=own,
        signals=signals,
    )
    table.known.update(("rows", "missing"))  # read by `take_rows`
    table.finish()
    if entry.frequency is not None and "time" not in own:
        raise table.problem("frequency", "is for a steady state over time only; this run has a column of frequencies")
    if entry.repeat < 0:
        raise table.problem("repeat", "must be 0 or more")
    if not 1 <= entry.harmonics <= 50:
        raise table.problem("harmonics", "give the highest one, 1 to 50")
    return entry


def _refuse_stepped(
    columns: TomlTable, own: Mapping[str, SignalEntry], signals: Mapping[str, Sequence[SignalEntry]]
) -> None:
    """Refuse columns of a stepped sine in a steady state over time, which is one state with all harmonics."""
    for name in STEPPED:
        if name in own:
            remedy = "remove it" if name == "order" else f"give {name} of the run"
            raise columns.problem(name, f"is not a column of a steady state over time: {remedy}")
    for name, entries in signals.items():
        if len(entries) > 1 or entries[0].harmonic != 1:
            wanted = (
                "names a harmonic, but all are read from one column over time: give that column, and harmonics of the "
                "run"
            )
            raise columns.problem(name, wanted, show=False)


def _read_levels(table: TomlTable, own: Collection[str]) -> tuple[float, ...]:
    values = table.take("levels", list, [])
    if values and ("time" in own or "level" in own or "level" in table.values):
        why = "is for sweeps of a stepped sine without another level: remove it, or the other one"
        raise table.problem("levels", why, show=False)
    return tuple(_check_level(table, "levels", value) for value in values)


def _number(table: TomlTable, key: str) -> float | None:
    table.known.add(key)
    value = table.values.get(key)
    return None if value is None else _check_level(table, key, value)


def _check_level(table: TomlTable, key: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not value > 0:
        raise table.problem(key, "must be a number above zero, without a unit")
    if not MIN_READING <= value <= MAX_READING:
        raise table.problem(key, REMEDY)
    return float(value)
