"""Drafts of ring-downs, loops, steady states over time and records."""

from typing import Any

import numpy as np

from correlation.campaign.measurement import LOAD_CELL
from correlation.campaign.measurement_unit import STRAIN
from correlation.file.column import Column
from correlation.signal.record import note_rounded_time
from study.campaign.column_role import MOTIONS, Role
from study.campaign.draft import ManifestDraft, Run, without_marks
from study.campaign.draft_frequency import (
    add_test,
    ask_configuration,
    find_force_column,
    put_once,
    report_second_forces,
)
from study.campaign.drive_channel import mark_drive
from study.campaign.level import find_level_beside_columns, find_named_set_point
from study.campaign.question import Marked
from study.campaign.sensor_draft import (
    OF_RAW,
    add_sensor,
    draft_drive_reading,
    find_direction_sign,
    find_raw_unit,
    reading,
    with_sign,
)
from study.campaign.table_kind import JudgedTable, is_unnamed
from study.campaign.time_history import SECONDS, estimate_sine_amplitude, find_strongest_line, find_uniform_rate


def draft_ring_downs(draft: ManifestDraft, judged: JudgedTable) -> None:
    """Draft one ring-down per response."""
    time = judged.of_role(Role.TIME)[0]
    for column in motions(judged):
        sensor = add_sensor(draft, judged, column, has_phase=None, needs_unit=True)
        draft.entries["ring_down"].append(
            {
                "name": f"{judged.table.label} {sensor}",
                "file": judged.table.file.path.name,
                "configuration": ask_configuration(draft, judged.table.label),
                "sensor": sensor,
                "columns": {
                    "time": reading(draft, judged, time),
                    "value": reading(draft, judged, column, sensor=sensor),
                },
            }
        )


def draft_loops(draft: ManifestDraft, judged: JudgedTable) -> None:
    """Draft one loop per combination of the settings."""
    time, force = next(iter(judged.of_role(Role.TIME)), None), find_force_column(judged)
    displacement = next(one for one in motions(judged) if judged.columns[one.name].quantity == "displacement")
    assert force is not None
    for rows in judged.rows():
        mask = judged.mask(rows)
        columns = {
            "displacement": with_sign(_with_unit(draft, judged, displacement, "m"), find_direction_sign(displacement)),
            "force": with_sign(_with_unit(draft, judged, force, "N"), find_direction_sign(force)),
        }
        place = draft.ask(
            f"Where is the displacement of {judged.table.file.path.name} imposed (a place of the case)?", "joint",
            "a loop needs a place; for a vibrating structure give line, sensor and level instead",
        )  # fmt: skip
        entry: dict[str, Any] = {
            "name": _name_loop(judged, rows),
            "file": judged.table.file.path.name,
            "frequency": _find_cycles(judged, time, displacement, rows, mask),
            "place": place,
        }
        draft.entries["loop"].append({**entry, **({"rows": rows} if rows else {}), "columns": columns})


def draft_steady_states(draft: ManifestDraft, judged: JudgedTable, test: str) -> None:
    """Draft the runs of steady states over time, one per combination of the settings."""
    add_test(draft, test)
    report_second_forces(draft, judged)
    time, force = judged.of_role(Role.TIME)[0], find_force_column(judged)
    for rows in judged.rows():
        columns: dict[str, Any] = {"time": reading(draft, judged, time)}
        if force is not None:
            columns["force"] = mark_drive(judged, force, draft_drive_reading(draft, judged, force))
        cells = [one for one in judged.of_role(Role.RESPONSE) if judged.columns[one.name].quantity == LOAD_CELL]
        for column in [*motions(judged), *cells]:
            sensor = add_sensor(draft, judged, column, has_phase=True, needs_unit=False)
            entry = with_sign(reading(draft, judged, column, sensor=sensor), find_direction_sign(column))
            put_once(draft, judged, columns, sensor, column, entry)
        run: dict[str, Any] = {"test": test, "file": judged.table.file.path.name}
        if force is not None:
            size = estimate_sine_amplitude(force.values.real[judged.mask(rows)])
            run |= find_level_beside_columns(judged, size) or find_named_set_point(judged, force.name, size)
        draft.entries["run"].append(Run({**run, **({"rows": rows} if rows else {}), "columns": columns}, judged))


def draft_record(draft: ManifestDraft, judged: JudgedTable) -> None:
    """Draft one record of all channels, with its sampling rate."""
    time, force = next(iter(judged.of_role(Role.TIME)), None), find_force_column(judged)
    file = judged.table.file.path.name
    channels = [one for one in judged.of_role(Role.RESPONSE, Role.FORCE) if _is_read(judged, one, force)]
    report_second_forces(draft, judged)
    rate: str | Marked | None = None
    if time is not None:
        found_rate = find_uniform_rate(time.values)
        factor = SECONDS.get(judged.columns[time.name].unit, 1.0)
        if found_rate is None:
            draft.left_out.append(f'{file}: the step of "{time.name}" varies: resample the record to a uniform step')
            return
        rate = f"{found_rate / factor:.9g} Hz"
        draft.suspicions += [f"{file}: {sentence}" for sentence in note_rounded_time(factor * time.values)]
    else:
        answer = draft.ask(
            f"Sampling rate of {file}?", "1000 Hz", "the file has no time; all frequencies depend on the sampling rate"
        )
        text = str(answer.value)
        rate = Marked(value=text if "Hz" in text else f"{text} Hz", assumed=answer.assumed)
    drive: str | Marked | None = None
    if force is not None:
        drive = force.name
    elif len(channels) > 1 and (names := [one.name for one in channels if is_unnamed(judged.columns[one.name])]):
        answer = draft.ask(
            f"Which channel of {file} drives the structure ({', '.join(names[:6])})?", names[0],
            "not stated in the file; usually the first",
        )  # fmt: skip
        drive = answer if answer.value in names else Marked(value=names[0], assumed="the first channel")
    units: dict[str, Any] = {}
    for column in channels:
        guess = judged.columns[column.name]
        # The quantity of the drive is unknown if only the name of the file states it.
        raw = find_raw_unit(column, guess)
        unknown = bool((column.name == without_marks(drive) and is_unnamed(guess)) or raw)
        quantity = "" if unknown else guess.quantity
        si = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2", "force": "N"}.get(quantity, "V")
        reason = OF_RAW.get(raw) or (guess.evidence if guess.unit else "no unit in the file")
        unit = column.unit or Marked(value=si if raw else guess.unit or si, assumed=reason)
        sign = find_direction_sign(column)
        units[column.name] = unit if sign == 1 else {"unit": unit, "sign": sign}
        if column.name != without_marks(drive):
            _add_channel(draft, judged, column)
    entry: dict[str, Any] = {"name": judged.table.label, "file": file, "rate": rate}
    draft.entries["record"].append({**entry, **({"force": drive} if drive else {}), "units": units})


def _is_read(judged: JudgedTable, column: Column, force: Column | None) -> bool:
    """Whether a channel is part of a record; of several forces only the drive is."""
    return judged.columns[column.name].role is not Role.FORCE or column is force


def motions(judged: JudgedTable) -> list[Column]:
    """Responses that are motions, voltages, strains or of unknown quantity."""
    known = {*MOTIONS, "", "voltage", STRAIN}
    return [column for column in judged.of_role(Role.RESPONSE) if judged.columns[column.name].quantity in known]


def _add_channel(draft: ManifestDraft, judged: JudgedTable, column: Column) -> None:
    """Add the sensor of a channel of a record, with the name of its column, unless there is a sensor of this name."""
    if draft.named("sensor", column.name) is not None:
        return
    name = add_sensor(draft, judged, column, has_phase=None, needs_unit=True)
    entry = draft.named("sensor", name)
    if entry is not None and draft.named("sensor", column.name) is None:
        if any(name in run["columns"] for run in draft.entries["run"]) or any(
            decay["sensor"] == name for decay in draft.entries["ring_down"]
        ):
            draft.entries["sensor"].append({**entry, "name": column.name})
        else:
            entry["name"] = column.name


def _with_unit(draft: ManifestDraft, judged: JudgedTable, column: Column, si: str) -> str | dict[str, Any]:
    entry = reading(draft, judged, column)
    if isinstance(entry, str) and not column.unit and si:
        return {"column": column.name, "unit": Marked(value=si, assumed="no unit in the file: SI assumed")}
    return entry


def _name_loop(judged: JudgedTable, rows: dict[str, Any]) -> str:
    """Name of the table with the settings that distinguish its loops: ``loops 12.7 mm, 0.5 Hz``."""
    series = judged.rows()
    settings = [
        f"{value:g} {unit}" if (unit := judged.columns[name].unit) else f"{name} {value}"
        for name, value in rows.items()
        if any(other[name] != value for other in series)
    ]
    return f"{judged.table.label} {', '.join(settings)}".rstrip()


def _find_cycles(
    judged: JudgedTable, time: Column | None, displacement: Column, rows: dict[str, Any], mask: np.ndarray
) -> str | Marked:
    """Frequency of the cycles: a setting in hertz, or the strongest frequency of the displacement."""
    for column in judged.settings:
        if judged.columns[column.name].unit == "Hz":
            return f"{rows[column.name]:g} Hz"
    if time is None:
        return Marked(
            value="1 Hz", assumed="the file has no time; friction does not depend on the frequency, a dashpot does"
        )
    instants = time.values[mask]
    signal = displacement.values[mask] - displacement.values[mask].mean()
    step = float(np.median(np.diff(instants))) * SECONDS.get(judged.columns[time.name].unit, 1.0)
    frequency = find_strongest_line(signal)[0] / step
    return Marked(value=f"{frequency:.4g} Hz", assumed="the strongest frequency of the displacement")
