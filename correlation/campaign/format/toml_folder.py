"""Reader of a folder with ``campaign.toml``: manifest, tables and time records, with a check that they fit together."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Int
from numpy.typing import NDArray

from correlation.campaign.campaign_path import find_file
from correlation.campaign.format import FORMATS, CampaignFormat
from correlation.campaign.load_cell import combine_load_cells
from correlation.campaign.manifest import MANIFEST, Manifest, RecordEntry, read_manifest
from correlation.campaign.measured_files import MeasuredFiles, without_padding
from correlation.campaign.measurement import (
    LOAD_CELL,
    Campaign,
    Measurement,
    Suspicion,
    advise_held_out,
    match_level,
)
from correlation.campaign.measurement_unit import find_base_unit
from correlation.campaign.run_table import join_rows, read_run_rows
from correlation.campaign.stepped_sine import find_same, find_sorting, read_csv
from correlation.campaign.time_record import TIME, TimeRecord, make_record_of_columns
from correlation.campaign.toml_table import TomlTable
from correlation.campaign.write_campaign import write_campaign
from correlation.data_type.registry import DATA_TYPES, Analyse, DataContext, DataType, Datum, analyse_uncached
from correlation.errors import CampaignError, CampaignMistakes
from correlation.row_group import group_rows


def read_folder(folder: Path, analyse: Analyse = analyse_uncached) -> Campaign:
    """Read a campaign folder as described in ``docs/campaign.md``.

    Parameters
    ----------
    folder
        Folder with ``campaign.toml``.
    analyse
        As in `DataContext`.

    Raises
    ------
    CampaignError
        One sentence with file, line or key, value and remedy; independent mistakes are listed one per line.
    """
    return _read(MeasuredFiles(folder=folder), lambda kind: kind.read, analyse)


def check_folder(files: MeasuredFiles, analyse: Analyse = analyse_uncached) -> Campaign:
    """Read a campaign folder without the slow analyses that are not needed to decide whether its data can be read.

    Parameters
    ----------
    files
        Folder, with the files of it that were read before.
    analyse
        As in `DataContext`.
    """
    return _read(files, lambda kind: kind.check or kind.read, analyse)


def _read(
    files: MeasuredFiles,
    reader: Callable[[DataType], Callable[[TomlTable, DataContext], Datum]],
    analyse: Analyse,
) -> Campaign:
    folder, manifest = files.folder, read_manifest(files.folder)
    mistakes = CampaignMistakes()
    context = DataContext(
        files=files, sensors=manifest.sensors, tests=manifest.tests, units=manifest.units, analyse=analyse
    )
    data = [mistakes.attempt(partial(reader(kind), table, context), None) for kind, table in manifest.data]
    measurement, suspicions = mistakes.attempt(
        partial(_read_tables, folder, manifest, files, [item for item in data if item is not None]), (join_rows([]), ())
    )
    mistakes.refuse()
    records = [mistakes.attempt(partial(_read_record, files, entry), None) for entry in manifest.records]
    suspicions += tuple(
        Suspicion(where=f'record "{item.name}"', sentence=text, remark=True)
        for item in records if item is not None for text in item.remarks
    )  # fmt: skip
    named = {name for item in data if item is not None for name in getattr(item, "sensors", ())}
    for number in range(len(manifest.sensors)):
        mistakes.attempt(partial(_check_sensor, manifest, measurement, number, named), None)
    mistakes.attempt(partial(_check_held_out, manifest, measurement), None)
    mistakes.attempt(partial(_check_records, manifest, [item for item in records if item is not None]), None)
    mistakes.refuse()
    measurement, sensors = combine_load_cells(measurement, manifest.sensors, manifest.load_cells)
    controlled = {run.test for run in manifest.runs if run.control == "response"}
    return Campaign(
        title=manifest.title,
        folder=folder,
        sensors=sensors,
        tests=tuple(replace(test, control="response") if test.name in controlled else test for test in manifest.tests),
        measurement=measurement.where(find_sorting(measurement)),
        held_out=manifest.held_out,
        records=tuple(item for item in records if item is not None),
        drive=manifest.drive,
        data=tuple(data),
        level_factor=manifest.units.level_factor,
        suspicions=suspicions,
    )


def _read_record(files: MeasuredFiles, entry: RecordEntry) -> TimeRecord:
    file = without_padding(files.read(entry.file), [name for name in entry.units if name != TIME])
    record = make_record_of_columns(
        file, name=entry.name, units=entry.units, signs=entry.signs, force=entry.force,
        held_out=entry.held_out, rate=entry.rate,
    )  # fmt: skip
    return record.between(entry.start, entry.end)


def _read_tables(
    folder: Path, manifest: Manifest, files: MeasuredFiles, data: Sequence[Datum]
) -> tuple[Measurement, tuple[Suspicion, ...]]:
    """Rows of all tidy tables, runs and data that have steady states, unsorted, and suspicions about them."""
    tidy: dict[str, list[str]] = {}
    for test, file in zip(manifest.tests, manifest.files, strict=True):
        if file is not None:
            tidy.setdefault(file, []).append(test.name)
    mistakes = CampaignMistakes()
    number = {test.name: place for place, test in enumerate(manifest.tests)}
    tables = [
        mistakes.attempt(partial(_read_tidy, folder, file, manifest, names), None) for file, names in tidy.items()
    ]
    run_of_row = [np.zeros(0 if table is None else len(table), dtype=np.int64) for table in tables]
    suspicions: list[Suspicion] = []
    first = 0
    for place, run in enumerate(manifest.runs, start=1):
        read = partial(read_run_rows, run, files, manifest.sensors, number[run.test], manifest.units, first)
        rows = mistakes.attempt(read, None)
        if rows is not None:
            tables.append(rows[0])
            run_of_row.append(np.full(len(rows[0]), place))
            suspicions += rows[1]
            # Runs were measured in the order of the manifest, unless they have a column of orders.
            first = first if "order" in run.own else int(rows[0].order.max()) + 1
    names = [sensor.name for sensor in manifest.sensors]
    for datum in data:
        states = DATA_TYPES[datum.type].states
        if states is not None and (of_datum := states(datum, names)) is not None:
            tables.append(of_datum)
            run_of_row.append(np.zeros(len(of_datum), dtype=np.int64))
        suspicions += [Suspicion(where=datum.name, sentence=text) for text in getattr(datum, "suspicions", ())]
        remarks = getattr(datum, "remarks", ())
        suspicions += [Suspicion(where=datum.name, sentence=text, remark=True) for text in remarks]
    mistakes.refuse()
    measurement = join_rows([table for table in tables if table is not None])
    for place, (test, file) in enumerate(zip(manifest.tests, manifest.files, strict=True)):
        if not (measurement.test == place).any():
            mistakes.add(
                f'{file or MANIFEST}: has no rows of test "{test.name}"; add them, or remove the test in {MANIFEST}'
            )
    all_runs = np.concatenate([np.zeros(0, dtype=np.int64), *run_of_row])
    mistakes.attempt(partial(_check_runs, manifest, measurement, all_runs), None)
    mistakes.refuse()
    return measurement, tuple(suspicions)


def _read_tidy(folder: Path, file: str, manifest: Manifest, tests: Collection[str]) -> Measurement:
    return read_csv(find_file(folder, file), manifest, tests)


def _check_runs(manifest: Manifest, measurement: Measurement, run_of_row: Int[NDArray[np.int64], " k"]) -> None:
    """Refuse a point that two runs give; the message names the run with fewer rows first.

    Duplicates within a table are refused where it is read. Rows that are not of a run have the number 0.
    """
    if not manifest.runs:
        return
    order = find_sorting(measurement)
    table, same = measurement.where(order), find_same(measurement, order)
    if same.any():
        row = int(np.argmax(same))
        size = np.bincount(run_of_row)
        both = sorted(run_of_row[order][row : row + 2].tolist(), key=lambda run: (run == 0, size[run], -run))
        one, other = (f"run[{number}]" if number else "other data" for number in both)
        raise CampaignError(
            f'{MANIFEST}: {one}: two runs of test "{manifest.tests[table.test[row]].name}", it and {other}, give '
            f'sensor "{manifest.sensors[table.sensor[row]].name}" at {table.level[row]:g}, '
            f"{table.frequency[row]:g} Hz as repeat {table.repeat[row]}: give each run its own repeat, or its level if "
            "these are levels"
        )


def _check_sensor(manifest: Manifest, measurement: Measurement, number: int, named: Collection[str]) -> None:
    sensor, rows = manifest.sensors[number], measurement.sensor == number
    recorded = {name for record in manifest.records for name in record.units}
    made = {name for pair in manifest.load_cells for name in (pair.tangential, pair.normal)}
    if not rows.any() and sensor.name not in recorded | made | set(named):
        raise CampaignError(
            f'{MANIFEST}: sensor "{sensor.name}" has no rows in {manifest.files_of(range(len(manifest.tests)))}; '
            "add them, or remove the sensor"
        )
    paired = {name for pair in manifest.load_cells for name in pair.cells}
    if rows.any() and sensor.quantity == LOAD_CELL and sensor.cell is None and sensor.name not in paired:
        raise CampaignError(
            f'{MANIFEST}: sensor "{sensor.name}" is a load cell with {rows.sum()} rows, but no [[load_cells]] names '
            "it: name it in the cells of one, give it cell = the model's own, or remove the sensor and its rows"
        )
    for test in np.unique(measurement.test[rows]):
        _check_constant(manifest, measurement, int(test), number)


def _check_constant(manifest: Manifest, measurement: Measurement, test: int, sensor: int) -> None:
    rows = (measurement.test == test) & (measurement.sensor == sensor) & (measurement.harmonic == 1)
    value = measurement.value[rows]
    points = len(group_rows([measurement.level[rows], measurement.frequency[rows]]).first)
    if points >= 3 and (value == value[0]).all():
        raise CampaignError(
            f'{manifest.files_of([test])}: sensor "{manifest.sensors[sensor].name}" reads {value[0]:.4g} '
            f"{manifest.sensors[sensor].unit} at all {points} points of harmonic 1: a dead channel; remove its rows"
        )


def _check_held_out(manifest: Manifest, measurement: Measurement) -> None:
    for level in manifest.held_out.levels:
        if not match_level(measurement.level, level).any():
            measured = ", ".join(f"{item / manifest.units.level_factor:g}" for item in np.unique(measurement.level))
            raise CampaignError(
                f"{MANIFEST}: held_out.levels = {level / manifest.units.level_factor:g} was not measured; "
                f"hold out some of {measured}"
            )
    for repeat in manifest.held_out.repeats:
        if not (measurement.repeat == repeat).any():
            measured = ", ".join(map(str, np.unique(measurement.repeat)))
            raise CampaignError(
                f"{MANIFEST}: held_out.repeats = {repeat} was not measured; hold out some of {measured}"
            )
    if len(measurement) and manifest.held_out.rows(measurement).all():
        advice = advise_held_out(measurement, manifest.units.level_factor)
        remedy = f"hold out a part, e.g. {advice}" if advice else "remove it, and measure another level or repeat"
        raise CampaignError(f"{MANIFEST}: held_out holds out everything, so that nothing is left to train on: {remedy}")


def _check_records(manifest: Manifest, records: Sequence[TimeRecord]) -> None:
    sensors = {sensor.name: sensor for sensor in manifest.sensors}
    for record in records:
        for channel, unit in zip(record.channels, record.units, strict=True):
            sensor = sensors.get(channel)
            if channel != record.force and sensor is None:
                raise CampaignError(
                    f'{MANIFEST}: record "{record.name}" has a channel "{channel}", which is not a sensor; '
                    f'add the sensor, or force = "{channel}" if it is the driving force'
                )
            # A channel in volts is not calibrated: it is compared up to a factor.
            wanted = {"V", find_base_unit(sensor.unit)[1] if sensor else "N"}
            if unit not in wanted:
                raise CampaignError(
                    f'{MANIFEST}: record "{record.name}": channel "{channel}" is in {unit}, '
                    f"give {' or '.join(sorted(wanted))}"
                )


FORMATS.register(
    CampaignFormat(
        name="campaign folder",
        holds=f"a folder with {MANIFEST}",
        recognise=lambda path: (path / MANIFEST).is_file(),
        read=read_folder,
        write=write_campaign,
    )
)
