"""A folder with ``campaign.toml``: its manifest, its tables, its time records, and whether they fit together."""

from dataclasses import fields
from functools import partial
from pathlib import Path

import numpy as np

from correlation.campaign.format import FORMATS, CampaignFormat
from correlation.campaign.manifest import MANIFEST, Manifest, read_manifest
from correlation.campaign.measurement import Campaign, Measurement, same_level
from correlation.campaign.measurement_unit import base_unit
from correlation.campaign.stepped_sine import read_csv, sorting
from correlation.campaign.time_record import TimeRecord, read_time_record
from correlation.campaign.write_campaign import write_campaign
from correlation.errors import CampaignError, Mistakes


def read_folder(folder: Path) -> Campaign:
    """Read the files that ``docs/campaign.md`` describes.

    Raises
    ------
    CampaignError
        One sentence with file, line or key, value and remedy; several that do not follow from each other, one per line.
    """
    manifest = read_manifest(folder)
    measurement = _tables(folder, manifest)
    mistakes = Mistakes()
    for number in range(len(manifest.sensors)):
        mistakes.attempt(partial(_check_sensor, manifest, measurement, number), None)
    mistakes.attempt(partial(_check_held_out, manifest, measurement), None)
    found = [
        mistakes.attempt(
            partial(
                read_time_record, folder / entry.file,
                name=entry.name, units=entry.units, force=entry.force, held_out=entry.held_out,
            ),
            None,
        )
        for entry in manifest.records
    ]  # fmt: skip
    records = tuple(each for each in found if each is not None)
    mistakes.attempt(partial(_check_records, manifest, records), None)
    mistakes.refuse()
    return Campaign(
        title=manifest.title,
        folder=folder,
        sensors=manifest.sensors,
        tests=manifest.tests,
        measurement=measurement,
        held_out=manifest.held_out,
        records=records,
    )


def _tables(folder: Path, manifest: Manifest) -> Measurement:
    tests: dict[str, list[str]] = {}
    for test, file in zip(manifest.tests, manifest.files, strict=True):
        tests.setdefault(file, []).append(test.name)
    mistakes = Mistakes()
    found = [mistakes.attempt(partial(read_csv, folder / file, manifest, names), None) for file, names in tests.items()]
    mistakes.refuse()
    tables = [each for each in found if each is not None]
    columns = [each.name for each in fields(Measurement)]
    measurement = Measurement(
        **{name: np.concatenate([[], *(getattr(table, name) for table in tables)]) for name in columns}
    )
    for number, (test, file) in enumerate(zip(manifest.tests, manifest.files, strict=True)):
        if not (measurement.test == number).any():
            mistakes.add(f'{file}: has no rows of test "{test.name}"; add them, or remove the test in {MANIFEST}')
    mistakes.refuse()
    return measurement.where(sorting(measurement)) if len(tables) > 1 else measurement


def _check_sensor(manifest: Manifest, measurement: Measurement, number: int) -> None:
    sensor, rows = manifest.sensors[number], measurement.sensor == number
    recorded = {name for record in manifest.records for name in record.units}
    if not rows.any() and sensor.name not in recorded:
        raise CampaignError(
            f'{MANIFEST}: sensor "{sensor.name}" has no rows in {", ".join(dict.fromkeys(manifest.files))}; '
            "add them, or remove the sensor"
        )
    for test in np.unique(measurement.test[rows]):
        _check_constant(manifest, measurement, int(test), number)


def _check_constant(manifest: Manifest, measurement: Measurement, test: int, sensor: int) -> None:
    rows = (measurement.test == test) & (measurement.sensor == sensor) & (measurement.harmonic == 1)
    value = measurement.value[rows]
    points = len(np.unique(np.stack([measurement.level[rows], measurement.frequency[rows]]), axis=1).T)
    if points >= 3 and (value == value[0]).all():
        raise CampaignError(
            f'{manifest.files[test]}: sensor "{manifest.sensors[sensor].name}" reads {value[0]:.4g} '
            f"{manifest.sensors[sensor].unit} at all {points} points of harmonic 1: a dead channel; remove its rows"
        )


def _check_held_out(manifest: Manifest, measurement: Measurement) -> None:
    for level in manifest.held_out.levels:
        if not same_level(measurement.level, level).any():
            measured = ", ".join(f"{each / manifest.level_factor:g}" for each in np.unique(measurement.level))
            raise CampaignError(
                f"{MANIFEST}: held_out.levels = {level / manifest.level_factor:g} was not measured; "
                f"hold out some of {measured}"
            )
    for repeat in manifest.held_out.repeats:
        if not (measurement.repeat == repeat).any():
            measured = ", ".join(map(str, np.unique(measurement.repeat)))
            raise CampaignError(
                f"{MANIFEST}: held_out.repeats = {repeat} was not measured; hold out some of {measured}"
            )
    if len(measurement) and manifest.held_out.rows(measurement).all():
        raise CampaignError(f"{MANIFEST}: held_out holds out everything; leave levels and repeats to train on")


def _check_records(manifest: Manifest, records: tuple[TimeRecord, ...]) -> None:
    sensors = {sensor.name: sensor for sensor in manifest.sensors}
    for record in records:
        for channel, unit in zip(record.channels, record.units, strict=True):
            sensor = sensors.get(channel)
            if channel != record.force and sensor is None:
                raise CampaignError(
                    f'{MANIFEST}: record "{record.name}" has a channel "{channel}", which is no sensor; '
                    f'add the sensor, or force = "{channel}" if it is what drives'
                )
            # A voltage is a channel that has not been calibrated: it is compared up to its scale.
            wanted = {"V", base_unit(sensor.unit)[1] if sensor else "N"}
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
