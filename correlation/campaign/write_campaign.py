"""Write a campaign to a folder for `read_campaign`: SI, peak amplitudes, e^{+i k Omega t}."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from correlation.campaign.manifest import MANIFEST, SCHEMA
from correlation.campaign.measurement import CONTACT_FORCE, LOAD_CELL, SWEEPS, Campaign, Drive, MeasuredSensor
from correlation.campaign.stepped_sine import COLUMNS, FORCE
from correlation.campaign.time_record import TIME
from correlation.errors import CampaignError


def write_campaign(campaign: Campaign, folder: Path) -> None:
    """Write manifest, one table per test, one file per time record; files of these names are replaced.

    Suspicions are not written, since reading finds them again. Ring-downs, loops, modes and frequency responses cannot
    be written.

    Parameters
    ----------
    campaign
        Campaign to write; every number keeps all its digits.
    folder
        Folder, which is made if it does not exist.

    Raises
    ------
    CampaignError
        The campaign has data that cannot be written, or a test without rows, which `read_campaign` refuses.
    """
    if campaign.data:
        listed = ", ".join(dict.fromkeys(f"{datum.type} {_quote_text(datum.name)}" for datum in campaign.data))
        raise CampaignError(f"{listed}: only steady states and time records are written; copy the folder of the others")
    for number, test in enumerate(campaign.tests):
        if not (campaign.measurement.test == number).any():
            raise CampaignError(
                f"test {_quote_text(test.name)} has no rows: leave it out of the campaign to be written"
            )
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    tests, records = (_choose_file_names(item) for item in (campaign.tests, campaign.records))
    (folder / MANIFEST).write_text("\n".join(_format_manifest(campaign, tests, records)) + "\n", encoding="utf-8")
    for number, file in enumerate(tests):
        (folder / f"test_{file}.csv").write_text("\n".join(_format_table(campaign, number)) + "\n", encoding="utf-8")
    for record, file in zip(campaign.records, records, strict=True):
        rows = np.vstack([record.time, record.values]).T.tolist()
        lines = [",".join(map(_quote_field, [TIME, *record.channels])), *(",".join(map(repr, row)) for row in rows)]
        (folder / f"record_{file}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


def _format_manifest(campaign: Campaign, tests: Sequence[str], records: Sequence[str]) -> Iterator[str]:
    yield f"schema = {SCHEMA}"
    yield f"title = {_quote_text(campaign.title)}"
    drive = campaign.drive
    if drive != Drive():
        yield from ("", "[drive]", f"quantity = {_quote_text(drive.quantity)}")
        yield from () if drive.calibrated else ("calibrated = false",)
    yield from ("", "[convention]", 'time = "exp(+i omega t)"', 'amplitude = "peak"')
    yield from ("", "[units]", f"level = {_quote_text(drive.unit)}", 'frequency = "Hz"')
    for sensor in campaign.sensors:
        yield from ("", "[[sensor]]", *_format_sensor(sensor))
    for test, file in zip(campaign.tests, tests, strict=True):
        yield from (
            "",
            "[[test]]",
            f"name = {_quote_text(test.name)}",
            f"configuration = {_quote_text(test.configuration)}",
        )
        yield from ("settling = true",) if test.settling else ()
        yield from ('control = "response"',) if test.control == "response" else ()
        yield f"file = {_quote_text(f'test_{file}.csv')}"
    for record, file in zip(campaign.records, records, strict=True):
        yield from (
            "",
            "[[record]]",
            f"name = {_quote_text(record.name)}",
            f"file = {_quote_text(f'record_{file}.csv')}",
        )
        if record.force is not None:
            yield f"force = {_quote_text(record.force)}"
        if record.held_out:
            yield "held_out = true"
        units = zip((TIME, *record.channels), ("s", *record.units), strict=True)
        yield f"units = {{ {', '.join(f'{_quote_text(channel)} = {_quote_text(unit)}' for channel, unit in units)} }}"
    if campaign.held_out.levels or campaign.held_out.repeats:
        levels, repeats = campaign.held_out.levels, campaign.held_out.repeats
        yield from ("", "[held_out]", f"levels = {[float(level) for level in levels]}", f"repeats = {[*repeats]}")


def _format_sensor(sensor: MeasuredSensor) -> Iterator[str]:
    yield f"name = {_quote_text(sensor.name)}"
    yield f"quantity = {_quote_text(sensor.quantity)}"
    if sensor.quantity == CONTACT_FORCE:
        yield f"line = {_quote_text(sensor.line or '')}"
        yield f"component = {_quote_text(sensor.component or '')}"
    elif sensor.quantity == LOAD_CELL:
        yield f"cell = {_quote_text(sensor.cell or '')}"
    else:
        if sensor.direction:
            yield f"direction = {_quote_text(sensor.direction)}"
        if sensor.place is not None:
            yield f"place = {_quote_text(sensor.place)}"
        if sensor.coordinates is not None:
            yield f"coordinates = [{', '.join(_quote_text(f'{x!r} m') for x in sensor.coordinates.tolist())}]"
        if sensor.relative_to is not None:
            yield f"relative_to = {_quote_text(sensor.relative_to)}"
        if sensor.inclination:
            yield from (
                f"inclination = {_quote_text(f'{sensor.inclination!r} rad')}",
                f"toward = {_quote_text(sensor.toward)}",
            )
    if sensor.uncertainty:
        yield f"uncertainty = {float(sensor.uncertainty)!r}"
    if not sensor.calibrated:
        yield from ("calibrated = false", f"reading_unit = {_quote_text(sensor.reading_unit)}")
    if not sensor.has_phase:
        yield "phase = false"
    relative, absolute = sensor.noise
    parts = [repr(float(relative))] if relative else []
    parts += [_quote_text(f"{float(absolute)!r} {sensor.unit}")] if absolute else []
    if parts:
        yield f"noise = [{', '.join(parts)}]"


def _format_table(campaign: Campaign, test: int) -> Iterator[str]:
    table = campaign.measurement.where(campaign.measurement.test == test)
    forces = [""] * len(table)
    if np.array_equal(table.force, table.level):
        yield ",".join(COLUMNS)
    else:
        yield ",".join((*COLUMNS, FORCE))
        forces = [f",{force!r}" for force in table.force.tolist()]
    name = _quote_field(campaign.tests[test].name)
    sensors = [(_quote_field(sensor.name), sensor.unit) for sensor in campaign.sensors]
    columns = (table.order, table.repeat, table.sweep, table.level, table.frequency, table.sensor, table.harmonic)
    values = (table.value.real, table.value.imag)
    for order, repeat, sweep, level, frequency, number, harmonic, real, imag, force in zip(
        *(column.tolist() for column in (*columns, *values)), forces, strict=True
    ):
        sensor, unit = sensors[number]
        yield (
            f"{name},{order},{repeat},{SWEEPS[sweep]},{level!r},{frequency!r},{sensor},{harmonic},{real!r},{imag!r},{unit}"
            f"{force}"
        )


def _choose_file_names(named: Sequence[object]) -> list[str]:
    """Names that are valid in every file system; they begin with numbers and are therefore unique."""
    return [
        f"{number:02d}_"
        + "".join(letter if letter.isascii() and letter.isalnum() else "_" for letter in _name(item))[:40]
        for number, item in enumerate(named, start=1)
    ]


def _name(named: object) -> str:
    return str(getattr(named, "name", ""))


def _quote_text(text: str) -> str:
    # Basic strings of TOML are escaped as in JSON.
    return json.dumps(text, ensure_ascii=False)


def _quote_field(text: str) -> str:
    return '"' + text.replace('"', '""') + '"' if any(letter in text for letter in ',"\n') else text
