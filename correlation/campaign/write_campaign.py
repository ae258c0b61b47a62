"""Write a campaign as a folder that `read_campaign` reads: SI, peak amplitudes, e^{+i k Omega t}."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from correlation.campaign.manifest import MANIFEST, SCHEMA
from correlation.campaign.measurement import CONTACT_FORCE, SWEEPS, Campaign, MeasuredSensor
from correlation.campaign.stepped_sine import COLUMNS
from correlation.campaign.time_record import TIME


def write_campaign(campaign: Campaign, folder: Path) -> None:
    """Write manifest, one table per test, one file per time record; files of these names are replaced.

    Parameters
    ----------
    campaign
        Campaign to write; every number keeps all its digits.
    folder
        Folder, which is made if it does not exist.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    tests, records = (_file_names(each) for each in (campaign.tests, campaign.records))
    (folder / MANIFEST).write_text("\n".join(_manifest(campaign, tests, records)) + "\n", encoding="utf-8")
    for number, file in enumerate(tests):
        (folder / f"test_{file}.csv").write_text("\n".join(_table(campaign, number)) + "\n", encoding="utf-8")
    for record, file in zip(campaign.records, records, strict=True):
        rows = np.vstack([record.time, record.values]).T.tolist()
        lines = [",".join(map(_field, [TIME, *record.channels])), *(",".join(map(repr, row)) for row in rows)]
        (folder / f"record_{file}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


def _manifest(campaign: Campaign, tests: Sequence[str], records: Sequence[str]) -> Iterator[str]:
    yield f"schema = {SCHEMA}"
    yield f"title = {_text(campaign.title)}"
    yield from ("", "[convention]", 'time = "exp(+i omega t)"', 'amplitude = "peak"')
    yield from ("", "[units]", 'level = "N"', 'frequency = "Hz"')
    for sensor in campaign.sensors:
        yield from ("", "[[sensor]]", *_sensor(sensor))
    for test, file in zip(campaign.tests, tests, strict=True):
        yield from ("", "[[test]]", f"name = {_text(test.name)}", f"configuration = {_text(test.configuration)}")
        yield f"file = {_text(f'test_{file}.csv')}"
    for record, file in zip(campaign.records, records, strict=True):
        yield from ("", "[[record]]", f"name = {_text(record.name)}", f"file = {_text(f'record_{file}.csv')}")
        if record.force is not None:
            yield f"force = {_text(record.force)}"
        if record.held_out:
            yield "held_out = true"
        units = zip((TIME, *record.channels), ("s", *record.units), strict=True)
        yield f"units = {{ {', '.join(f'{_text(channel)} = {_text(unit)}' for channel, unit in units)} }}"
    if campaign.held_out.levels or campaign.held_out.repeats:
        levels, repeats = campaign.held_out.levels, campaign.held_out.repeats
        yield from ("", "[held_out]", f"levels = {[float(level) for level in levels]}", f"repeats = {[*repeats]}")


def _sensor(sensor: MeasuredSensor) -> Iterator[str]:
    yield f"name = {_text(sensor.name)}"
    yield f"quantity = {_text(sensor.quantity)}"
    if sensor.quantity == CONTACT_FORCE:
        yield f"line = {_text(sensor.line or '')}"
        yield f"component = {_text(sensor.component or '')}"
    else:
        yield f"direction = {_text(sensor.direction)}"
        if sensor.coordinates is None:
            yield f"place = {_text(sensor.place or '')}"
        else:
            yield f"coordinates = [{', '.join(_text(f'{x!r} m') for x in sensor.coordinates.tolist())}]"
    if sensor.uncertainty:
        yield f"uncertainty = {float(sensor.uncertainty)!r}"


def _table(campaign: Campaign, test: int) -> Iterator[str]:
    yield ",".join(COLUMNS)
    table = campaign.measurement.where(campaign.measurement.test == test)
    name = _field(campaign.tests[test].name)
    sensors = [(_field(sensor.name), sensor.unit) for sensor in campaign.sensors]
    columns = (table.order, table.repeat, table.sweep, table.level, table.frequency, table.sensor, table.harmonic)
    values = (table.value.real, table.value.imag)
    for order, repeat, sweep, level, frequency, number, harmonic, real, imag in zip(
        *(column.tolist() for column in (*columns, *values)), strict=True
    ):
        sensor, unit = sensors[number]
        yield (
            f"{name},{order},{repeat},{SWEEPS[sweep]},{level!r},{frequency!r},{sensor},{harmonic},{real!r},{imag!r},{unit}"
        )


def _file_names(named: Sequence[object]) -> list[str]:
    """Names that every file system takes: numbers first, so that no two are alike."""
    return [
        f"{number:02d}_"
        + "".join(letter if letter.isascii() and letter.isalnum() else "_" for letter in _name(each))[:40]
        for number, each in enumerate(named, start=1)
    ]


def _name(named: object) -> str:
    return str(getattr(named, "name", ""))


def _text(text: str) -> str:
    # Basic strings of TOML escape like JSON does.
    return json.dumps(text, ensure_ascii=False)


def _field(text: str) -> str:
    return '"' + text.replace('"', '""') + '"' if any(letter in text for letter in ',"\n') else text
