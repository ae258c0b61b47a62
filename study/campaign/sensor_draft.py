"""Sensors of a draft, and the columns of their readings."""

from typing import Any

import numpy as np

from correlation.campaign.measurement import LOAD_CELL, SI_UNIT
from correlation.campaign.measurement_unit import COUNT, STRAIN
from correlation.file.column import Column, Node
from correlation.file.decibel import SCALE
from correlation.file.format.wav import holds_counts
from correlation.file.quantity import MOTION_WORDS
from study.campaign.amplitude import own_amplitude
from study.campaign.column_role import MOTIONS, QUADRATURE, ComplexPart, Recognised, Role
from study.campaign.draft import ManifestDraft, without_marks
from study.campaign.question import Marked
from study.campaign.table_kind import JudgedTable, Kind
from study.campaign.unknown_unit import says_counts

#: Largest number of sensors of a table whose places are asked one by one.
FEW_SENSORS = 4
#: Reason why readings of an A/D converter have no unit.
OF_COUNTS = (
    "integer counts of an A/D converter: the file does not state their size, so the amplitudes are not calibrated"
)
#: Reason why readings of a strain gauge have no unit of a motion.
OF_STRAIN = "a strain: its ratio to a displacement is not known, so the amplitudes are not calibrated"
OF_RAW = {COUNT: OF_COUNTS, STRAIN: OF_STRAIN}
#: Reason for the question on the quantity of a sensor.
NO_QUANTITY = "neither its unit nor its name states it"
#: Counts of a converter: smallest number of samples, and smallest value of the largest; few small numbers are settings.
FEWEST_COUNTS, LEAST_COUNTS = 100, 100
AXES = ("x", "y", "z", "rx", "ry", "rz")


def find_raw_unit(column: Column, guess: Recognised) -> str:
    """Unit of readings that need a sensitivity, "count" or "strain"; empty for others.

    A channel without a unit has counts of a converter if the file states it or all values are whole numbers.

    A channel in SI units rounded to whole numbers gives the same draft: its sensitivity, one count per unit, is marked.
    """
    if guess.unit:
        return STRAIN if guess.unit == STRAIN else ""
    if holds_counts(column) or says_counts(column, column.name):
        return COUNT
    values = column.values[np.isfinite(column.values)]
    whole = not np.iscomplexobj(values) and bool((values == np.round(values)).all())
    large = len(values) >= FEWEST_COUNTS and float(np.abs(values).max()) >= LEAST_COUNTS
    return COUNT if whole and large else ""


def choose_sensor_name(judged: JudgedTable, column: Column) -> str:
    """Name of the sensor of a response: its point in the file, or the words of its column."""
    point = column.response
    if point is not None and (point.node is not None or point.name):
        return f"{point.node if point.node is not None else point.name}{point.direction.lstrip('+-').upper()}"
    guess = judged.columns[column.name]
    if guess.quantity == LOAD_CELL:
        return guess.stem.replace(" ", "").upper()
    if guess.stem and guess.quantity in MOTIONS and not set(guess.stem.split()) & MOTION_WORDS[guess.quantity]:
        # A case may have a sensor "tip" with another quantity.
        return f"{guess.stem} {guess.quantity}"
    if guess.stem.replace(" ", "").isdigit():
        return f"response {guess.stem}"
    return guess.stem or guess.quantity or "response"


def add_sensor(
    draft: ManifestDraft,
    judged: JudgedTable,
    column: Column,
    *,
    has_phase: bool | None,
    needs_unit: bool,
    name: str = "",
) -> str:
    """Add the sensor of a response to the draft, unless it exists.

    Parameters
    ----------
    draft
        Draft, extended in place.
    judged, column
        Table and its response.
    has_phase
        Whether its values have a phase; None for a time history, which needs none.
    needs_unit
        Whether its type of data refuses uncalibrated readings.
    name
        Name from the rows; empty for the name from the column.

    Returns
    -------
    Name of the sensor.
    """
    name, guess = name or choose_sensor_name(judged, column), judged.columns[column.name]
    known = draft.named("sensor", name)
    if known is not None and guess.quantity not in {"", "voltage", without_marks(known["quantity"])}:
        name = f"{name} {guess.quantity}"
        known = draft.named("sensor", name)
    if known is not None and has_phase not in {None, without_marks(known.get("phase", True))}:
        # A sensor has phases in all tests or in none.
        name = f"{name} {'with' if has_phase else 'without'} phase"
        known = draft.named("sensor", name)
    if known is not None:
        return name
    quantity = ask_quantity(draft, name, guess)
    entry: dict[str, Any] = {"name": name, "quantity": quantity}
    entry |= {} if quantity == LOAD_CELL else _position(draft, judged, column, name)
    if has_phase is False:
        others = ", ".join(f'"{one.name}"' for one in judged.of_role(Role.PHASE))
        entry["phase"] = (
            Marked(value=False, assumed=f"no phase has a matching name (there are {others})") if others else False
        )
    raw = find_raw_unit(column, guess)
    is_known = bool(guess.quantity) and guess.quantity != "voltage" and not raw and guess.unit != "percent"
    if not needs_unit and not (is_known or guess.unit not in {"", "V", "mV", "percent", STRAIN}):
        of_unit = f"readings in {'percent' if guess.unit == 'percent' else 'volts'}: their sensitivity is unknown"
        why = of_unit if guess.unit else "the unit of its column is unknown"
        entry["calibrated"] = Marked(value=False, assumed=OF_RAW.get(raw, why))
        unknown = Marked(value="V", assumed="the file has no known unit")
        entry["reading_unit"] = guess.unit or raw or unknown
    draft.entries["sensor"].append(entry)
    return name


def ask_quantity(draft: ManifestDraft, name: str, guess: Recognised) -> str | Marked:
    """Quantity of a sensor, asked of the user if it is not known."""
    if guess.quantity in {*MOTIONS, LOAD_CELL}:
        return Marked(value=guess.quantity, assumed=guess.evidence) if guess.assumed else guess.quantity
    why = "a strain is a motion of unknown gain, in one mode" if guess.quantity == STRAIN else NO_QUANTITY
    likely = draft.motions.get(name, Marked(value="displacement", assumed=why))
    return draft.ask(f'What does "{name}" measure?', str(likely.value), likely.assumed, *MOTIONS)


def reading(
    draft: ManifestDraft,
    judged: JudgedTable,
    column: Column,
    *,
    sensor: str = "",
    phase: Column | None = None,
    per: str = "",
) -> str | dict[str, Any]:
    """Entry of the manifest for a quantity: its columns and unit.

    Parameters
    ----------
    draft, judged, column
        Draft, table and column of the values, their amplitude or real part.
    sensor
        Name of the sensor of a response; empty for other quantities.
    phase
        Column of the phase or imaginary part.
    per
        Unit of the force of a ratio; empty if the quantity is not a ratio.
    """
    guess = judged.columns[column.name]
    entry: dict[str, Any] = {}
    if guess.part is ComplexPart.REAL and phase is not None:
        entry = {"real": column.name, "imag": phase.name}
        if guess.evidence.endswith(QUADRATURE):
            entry["real"] = Marked(value=column.name, assumed=guess.evidence)
    elif phase is not None:
        entry = {"amplitude": column.name, "phase": phase.name}
        if not phase.unit:
            angle = judged.columns[phase.name].unit
            why = f'"{phase.name}" {"goes beyond" if angle == "deg" else "stays within"} 2.1 pi'
            entry["phase_unit"] = Marked(value=angle, assumed=why)
    elif guess.part is ComplexPart.AMPLITUDE:
        entry = {"amplitude": column.name}
    else:
        entry = {"column": column.name}
    if SCALE in column.facts:
        why = f'"{column.facts[SCALE]}" is taken as 20 log10 of an amplitude'
        entry = {part: Marked(value=name, assumed=why) if name == column.name else name for part, name in entry.items()}
    described = draft.named("sensor", sensor) if sensor else None
    if described is not None and "calibrated" not in described and (raw := find_raw_unit(column, guess)):
        si = SI_UNIT[str(without_marks(described["quantity"]))]
        text = f'How many units "{raw}" of {column.name} of {judged.table.file.path.name} are 1 {si}?'
        answer = draft.ask(text, "1", OF_RAW[raw])
        entry["unit"] = raw
        entry["sensitivity"] = Marked(value=f"{answer.value} {raw}/({si})", assumed=answer.assumed)
    elif described is not None and not column.unit and "calibrated" not in described:
        entry["unit"] = _choose_unit(str(without_marks(described["quantity"])), guess, per)
    elif described is None and not column.unit and guess.unit:
        entry["unit"] = Marked(value=guess.unit, assumed=guess.evidence)
    if judged.kind is Kind.STEPPED_SINE and guess.role in {Role.FORCE, Role.RESPONSE}:
        entry |= own_amplitude(draft, judged, column)
    return column.name if entry == {"column": column.name} else entry


def draft_drive_reading(
    draft: ManifestDraft, judged: JudgedTable, force: Column, *, phase: Column | None = None
) -> str | dict[str, Any]:
    """Entry of the manifest for the drive: its columns, unit and sign; a drive that is not calibrated has no unit.

    Parameters
    ----------
    draft, judged, force
        Draft with its units and drive, table and column.
    phase
        Column of the phase or imaginary part.
    """
    entry = reading(draft, judged, force, phase=phase)
    if isinstance(entry, dict):
        if without_marks(draft.single.get("drive", {})).get("calibrated") is False:
            entry.pop("unit", None)
        elif judged.columns[force.name].assumed:
            entry["unit"] = draft.single["units"]["level"]
        entry = entry if {*entry} != {"column"} else force.name
    return with_sign(entry, find_direction_sign(force))


def as_amplitude(entry: str | dict[str, Any]) -> dict[str, Any]:
    """Reading as an amplitude without a phase."""
    if isinstance(entry, str):
        return {"amplitude": entry}
    return {"amplitude" if key == "column" else key: value for key, value in entry.items()}


def find_direction_sign(column: Column) -> int:
    """Sign of a channel: -1 if it measures against its axis, "-z"; `add_sensor` writes the axis without the sign."""
    return -1 if column.response is not None and column.response.direction.startswith("-") else 1


def with_sign(entry: str | dict[str, Any], sign: int | Marked) -> str | dict[str, Any]:
    """Reading with its sign, which is omitted if it is 1."""
    if sign == 1:
        return entry
    return {**({"column": entry} if isinstance(entry, str) else entry), "sign": sign}


def _choose_unit(quantity: str, guess: Recognised, per: str) -> Marked:
    if guess.unit:
        unit = guess.unit if not per or "/(" in guess.unit or guess.unit.endswith("/N") else f"({guess.unit})/({per})"
        return Marked(value=unit, assumed=guess.evidence)
    si = SI_UNIT[quantity]
    return Marked(value=f"({si})/({per})" if per else si, assumed="no unit in the file: SI assumed")


def _position(draft: ManifestDraft, judged: JudgedTable, column: Column, name: str) -> dict[str, Any]:
    """Direction and place of a sensor, from the file or asked of the user."""
    point, nodes = column.response, judged.table.file.nodes
    count = len([one for one in judged.table.columns if judged.columns[one.name].role is Role.RESPONSE])
    which = f'sensor "{name}"' if count <= FEW_SENSORS else f"the sensors of {judged.table.file.path.name}"
    axis = point.direction.lstrip("+-") if point is not None else ""
    return draft_position(draft, which, axis, None if point is None or point.node is None else nodes.get(point.node))


def draft_position(draft: ManifestDraft, which: str, axis: str, node: Node | None) -> dict[str, Any]:
    """Direction and place of a sensor, as stated in its file, else asked of the user.

    Parameters
    ----------
    draft
        Draft, for questions.
    which
        Sensor, or all sensors of the question, in words.
    axis
        Axis of `AXES`; empty if not stated in the file.
    node
        Coordinates in the file, shape (3,) [m]; None without any.
    """
    if axis and node is not None:
        return {"direction": axis, "coordinates": [f"{coordinate:.9g} m" for coordinate in node.tolist()]}
    so_far = {str(without_marks(one["place"])) for one in draft.entries["sensor"] if "place" in one}
    known = f" (so far: {', '.join(sorted(so_far))})" if so_far else ""
    why = (
        f"not stated in the file; give the name of a place of the case{known}, or coordinates such as 0.5 m, 0 m, 0 "
        "m, and an axis"
    )
    answer = draft.ask(f"Where is {which}, and in which direction does it measure?", f"tip {axis or 'z'}", why)
    place, _, given = str(answer.value).rpartition(" ")
    place, given = (place, given) if given in AXES else (str(answer.value), axis or "z")
    direction = axis or Marked(value=given, assumed=answer.assumed and "not stated in the file")
    coordinates = [part.strip() for part in place.split(",")]
    if len(coordinates) == 3:
        return {"direction": direction, "coordinates": coordinates}
    reason = answer.assumed and "the location of the sensor is not stated in the file"
    return {"direction": direction, "place": Marked(value=place, assumed=reason)}
