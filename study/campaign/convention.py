"""Common conventions of all steady states of a draft: drive, sign of time, units and convention of amplitudes."""

from collections.abc import Sequence

from correlation.file.quantity import OF_UNIT
from study.campaign.amplitude import draft_amplitude
from study.campaign.column_role import Role, find_ratio_quantity
from study.campaign.draft import ManifestDraft, without_marks
from study.campaign.draft_frequency import find_force_column, list_phase_evidence
from study.campaign.level import find_level_beside_columns, find_named_levels, find_unit_of_number
from study.campaign.question import Marked
from study.campaign.run_name import read_level
from study.campaign.table_kind import JudgedTable, Kind

TIMES = ("exp(+i omega t)", "exp(-i omega t)")
FORCE, BASE, VOLTAGE = "force", "base acceleration", "voltage"
#: Kind of drive in the manifest, by the quantity of the measured drive.
DRIVES = {"force": FORCE, "acceleration": BASE, "voltage": VOLTAGE}
#: Units of a drive that is not calibrated.
UNCALIBRATED = {"V", "mV", "%"}
#: Smallest fraction of the phases with a sign of time that must agree on it [-].
AGREE = 3 / 4


def find_drive(judged: JudgedTable) -> tuple[str, str]:
    """Kind of drive of a table, and its unit; both are empty if not stated in the file.

    Parameters
    ----------
    judged
        Stepped sines or steady states.
    """
    force = find_force_column(judged)
    if force is not None:
        guess = judged.columns[force.name]
        return DRIVES.get(guess.quantity, ""), guess.unit
    for column in judged.table.columns:
        guess = judged.columns[column.name]
        if guess.role is Role.LEVEL and guess.unit:
            return DRIVES.get(OF_UNIT.get(guess.unit, ""), ""), guess.unit
    if find_level_beside_columns(judged, None):
        return _drive_in(find_unit_of_number(judged.table))
    match = next(iter(find_named_levels(judged.table)), None)
    return _drive_in(read_level(match)[1]) if match else ("", "")


def _drive_in(unit: str) -> tuple[str, str]:
    """Kind of drive whose level has a unit, and the unit; both are empty if no drive has it."""
    quantity = OF_UNIT.get(unit, "voltage" if unit == "%" else "")
    return (DRIVES[quantity], unit) if quantity in DRIVES else ("", "")


def _describe_assumed_drive(judged: JudgedTable) -> str:
    """Reason why the unit of the force of a table is assumed; empty if the file states it or has no force."""
    force = find_force_column(judged)
    return judged.columns[force.name].evidence if force is not None and judged.columns[force.name].assumed else ""


def keep_one_drive(draft: ManifestDraft, tables: Sequence[JudgedTable]) -> list[JudgedTable]:
    """Leave out steady states with another drive than most of them have, since a campaign has one drive."""
    states = [table for table in tables if table.kind in {Kind.STEPPED_SINE, Kind.STEADY_STATE}]
    drives = [drive for table in states if (drive := find_drive(table)[0])]
    if len({*drives}) < 2:
        return list(tables)
    main = max(dict.fromkeys(drives), key=drives.count)
    used = []
    for table in tables:
        own = find_drive(table)[0] if table in states else ""
        if own in {"", main}:
            used.append(table)
        else:
            draft.left_out.append(
                f"{table.table.label}: driven by a {own}, most other files by a {main}: a campaign has one drive, so "
                "move the file to a separate folder"
            )
    return used


def draft_conventions(draft: ManifestDraft, tables: Sequence[JudgedTable]) -> int:
    """Draft the drive, the sign of time, the convention of amplitudes and the units.

    Parameters
    ----------
    draft
        Draft, extended in place.
    tables
        Stepped sines, steady states and frequency responses.

    Returns
    -------
    Sign of i Omega t.
    """
    states = [table for table in tables if table.kind is not Kind.FREQUENCY_RESPONSE]
    time = _time(draft, tables)
    amplitude = draft_amplitude(draft, tables)
    drives = [(table, *find_drive(table)) for table in states]
    drive = next((drive for _, drive, _ in drives if drive), "")
    stated = next((unit for table, _, unit in drives if unit and not _describe_assumed_drive(table)), "")
    assumed = "" if stated else next((why for table in states if (why := _describe_assumed_drive(table))), "")
    unit = stated or next((unit for _, _, unit in drives if unit), "")
    if not states and any("/V" not in unit and find_ratio_quantity(unit) for unit in _list_units(tables)):
        unit = "N"  # the denominator of the responses
    why = assumed or "no unit in the files for the force"
    level: str | Marked = unit if unit and not assumed else Marked(value="N", assumed=why)
    if drive == BASE:
        first = next(table for table, one, _ in drives if one == BASE)
        source = "has" if find_force_column(first) is not None else "names"
        why = f'"{first.table.file.path.name}" {source} the acceleration of the base'
        draft.single["drive"] = {"quantity": Marked(value=BASE, assumed=why)}
        level = unit or Marked(value="m/s^2", assumed="no unit in the files for the acceleration")
    elif any(table.kind is Kind.STEPPED_SINE for table in tables) and (assumed or not unit or unit in UNCALIBRATED):
        of_drive = "the drive is in percent" if unit == "%" else "the drive is in volts"
        why = assumed or (of_drive if drive == VOLTAGE else "no file contains a force in newtons")
        default = "N" if assumed else unit if unit in UNCALIBRATED else "V"
        answer = draft.ask("What is the unit of the level (N, or V for a drive that is not calibrated)?", default, why)
        level = answer
        if answer.value in UNCALIBRATED:
            draft.single["drive"] = {"calibrated": Marked(value=False, assumed=answer.assumed)}
    elif drive == VOLTAGE:
        why = "the drive is in volts: if it is a force sensor of known sensitivity, give its unit and sensitivity"
        draft.single["drive"] = {"calibrated": Marked(value=False, assumed=why)}
    draft.single["convention"] = {"time": time, "amplitude": amplitude}
    draft.single["units"] = {"level": level, "frequency": "Hz"}
    return -1 if without_marks(time) == TIMES[1] else 1


def _list_units(tables: Sequence[JudgedTable]) -> list[str]:
    """Units of all responses."""
    return [table.columns[column.name].unit for table in tables for column in table.of_role(Role.RESPONSE)]


def _time(draft: ManifestDraft, tables: Sequence[JudgedTable]) -> str | Marked:
    """Sign of time from the phases; asked of the user if they do not agree."""
    evidence = [item for table in tables if table.of_role(Role.FREQUENCY) for *_, item in list_phase_evidence(table)]
    falls, rises = (sum(item.time_sign == sign for item in evidence) for sign in (1, -1))
    if not evidence:
        return TIMES[0]  # has no effect without phases
    if max(falls, rises) < AGREE * (falls + rises) or not falls + rises:
        why = f"the phase decreases through the resonance in {falls} of {len(evidence)} curves and increases in {rises}"
        return draft.ask(
            "Is the time convention of the phases exp(+i omega t) or exp(-i omega t)?", TIMES[0], why, *TIMES
        )
    way = "falls" if falls > rises else "rises"
    why = f"the phase {way} through the resonance in {max(falls, rises)} of {len(evidence)} curves"
    return Marked(value=TIMES[0] if falls > rises else TIMES[1], assumed=why)
