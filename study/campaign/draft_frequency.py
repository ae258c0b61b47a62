"""Drafts of stepped-sine runs, and the responses, forces and phases of tables over frequency."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from correlation.campaign.passes import SWEEP_WORDS
from correlation.file.column import Column
from correlation.file.quantity import MOTION_WORDS
from study.campaign.column_role import RATIOS, WORDS, ComplexPart, Role, name_words
from study.campaign.draft import ManifestDraft, Run
from study.campaign.level import (
    ask_levels,
    find_level_beside_columns,
    find_level_in_name,
    find_levels_of_force,
    find_named_set_point,
    number_passes,
)
from study.campaign.phase_convention import PhaseEvidence, judge_phase
from study.campaign.question import Marked
from study.campaign.run_name import WAY_OF_COLUMN, WITH_CONTACTS, WITHOUT_CONTACTS
from study.campaign.sensor_draft import (
    add_sensor,
    as_amplitude,
    choose_sensor_name,
    draft_drive_reading,
    find_direction_sign,
    reading,
    with_sign,
)
from study.campaign.table_kind import JudgedTable

#: Response control: smallest ratio of the largest to the smallest force, largest relative spread of the response [-].
CONTROL_FORCE, CONTROL_RESPONSE = 1.5, 0.1
#: Assumption for a force without a phase in a table of responses with phases.
PHASES = "it has no phase; the phases of the responses are taken as relative to it"


def pair_responses_with_phases(judged: JudgedTable) -> list[tuple[Column, Column | None]]:
    """Pair each response with the column of its phase or imaginary part, or None."""
    columns = judged.of_role(Role.RESPONSE)
    of_force = find_force_partner(judged)
    phases = [one for one in judged.of_role(Role.PHASE) if one is not of_force and not is_of_force(judged, one)]
    pairs: list[tuple[Column, Column | None]] = []
    main = [column for column in columns if judged.columns[column.name].part is not ComplexPart.IMAGINARY]
    alone = [
        one for one in main if judged.columns[one.name].part is not ComplexPart.REAL and not np.iscomplexobj(one.values)
    ]
    for column in main:
        guess = judged.columns[column.name]
        if guess.part is ComplexPart.REAL:
            candidates = [one for one in columns if judged.columns[one.name].part is ComplexPart.IMAGINARY]
        else:
            candidates = phases if column in alone else []
        same = [one for one in candidates if judged.columns[one.name].stem == guess.stem]
        if not same and column in alone:
            same = find_nearest_each_other(judged, column, phases, alone)
        partner = same[0] if same else (candidates[0] if len(candidates) == len(main) == 1 else None)
        pairs.append((column, partner))
    return pairs


def find_nearest_each_other(
    judged: JudgedTable, column: Column, others: Sequence[Column], like: Sequence[Column]
) -> list[Column]:
    """Column among `others` with the nearest name to a column, if that column is its nearest in `like`; else empty."""
    nearest = _find_nearest(judged, column, others, like)
    return [nearest] if nearest is not None and _find_nearest(judged, nearest, like, others) is column else []


def _find_nearest(
    judged: JudgedTable, column: Column, others: Sequence[Column], like: Sequence[Column]
) -> Column | None:
    """Column whose name differs least, and only in words for motions or ratios: "acc tip" and "phase tip"."""
    own, of_others = _list_telling_words(judged, like), _list_telling_words(judged, others)
    result: dict[int, list[Column]] = {}
    for other in others:
        different = own[column.name] ^ of_others[other.name]
        if own[column.name] & of_others[other.name] and different <= RATIOS.union(*MOTION_WORDS.values()):
            result.setdefault(len(different), []).append(other)
    least = result[min(result)] if result else []
    return least[0] if len(least) == 1 else None


def _list_telling_words(judged: JudgedTable, columns: Sequence[Column]) -> dict[str, set[str]]:
    """Words of the names of columns that are not in all of these names: "tip" and "root" for "H1 tip", "H1 root"."""
    words = {one.name: set(judged.columns[one.name].stem.split()) for one in columns}
    shared = set.intersection(*words.values()) if len(words) > 1 else set()
    return {name: own - shared for name, own in words.items()}


def is_of_force(judged: JudgedTable, column: Column) -> bool:
    """Whether a phase is that of the force: its name has a word for a force that is in no name of a response."""
    responses = [word for one in judged.of_role(Role.RESPONSE) for word in judged.columns[one.name].stem.split()]
    words = set(name_words(judged.table.short_name(column)))
    return bool(words & WORDS[Role.FORCE] - set(responses))


def make_complex_response(judged: JudgedTable, column: Column, partner: Column | None) -> NDArray[Any] | None:
    """Complex values of a response; None without a phase."""
    if np.iscomplexobj(column.values):
        return np.asarray(column.values)
    if partner is None:
        return None
    if judged.columns[column.name].part is ComplexPart.REAL:
        return np.asarray(column.values + 1j * partner.values)
    degrees = judged.columns[partner.name].unit == "deg"
    return np.asarray(column.values * np.exp(1j * (np.radians(partner.values) if degrees else partner.values)))


def find_force_column(judged: JudgedTable) -> Column | None:
    """Column of the driving force: the one with the shortest stem, a voltage only if no other force has a unit."""
    forces = [one for one in judged.of_role(Role.FORCE) if judged.columns[one.name].part is not ComplexPart.IMAGINARY]
    measured = [one for one in forces if judged.columns[one.name].unit and not _is_voltage(judged, one)]
    return min(measured or forces, key=lambda column: len(judged.columns[column.name].stem), default=None)


def _is_voltage(judged: JudgedTable, column: Column) -> bool:
    return judged.columns[column.name].quantity == "voltage"


def find_force_partner(judged: JudgedTable) -> Column | None:
    """Column of the imaginary part or of the phase of the driving force; None if there is none."""
    force = find_force_column(judged)
    if force is None or np.iscomplexobj(force.values):
        return None
    guess = judged.columns[force.name]
    if guess.part is ComplexPart.REAL:
        return next(
            (one for one in judged.of_role(Role.FORCE) if judged.columns[one.name].part is ComplexPart.IMAGINARY), None
        )
    phases = judged.of_role(Role.PHASE)
    # A phase without further words, such as "phase" with a force "amplitude [N]", belongs to the response.
    same = [one for one in phases if guess.stem and judged.columns[one.name].stem == guess.stem]
    return next(iter([*same, *(one for one in phases if is_of_force(judged, one))]), None)


def make_complex_force(judged: JudgedTable) -> NDArray[Any] | None:
    """Driving force along its axis, complex if its phase was measured; None without a force."""
    force = find_force_column(judged)
    if force is None:
        return None
    values = make_complex_response(judged, force, find_force_partner(judged))
    return np.asarray(find_direction_sign(force) * (force.values if values is None else values))


def report_unused_phases(draft: ManifestDraft, judged: JudgedTable) -> None:
    """Report phases that match no response or force, and are not read, in the `left_out` sentences of the draft."""
    used = {partner.name for _, partner in pair_responses_with_phases(judged) if partner is not None}
    of_force = find_force_partner(judged)
    used |= {of_force.name} if of_force is not None else set()
    draft.left_out += [
        f'{judged.table.file.path.name}: the name of the phase "{column.name}" matches no column: if it belongs to a '
        f'response or force, write {{ amplitude = "...", phase = "{column.name}", phase_unit = '
        f'"{judged.columns[column.name].unit}" }} there, and remove phase = false of the sensor'
        for column in judged.of_role(Role.PHASE)
        if column.name not in used
    ]


def report_second_forces(draft: ManifestDraft, judged: JudgedTable) -> None:
    """Report forces that are not read, since another one is the drive, in the `left_out` sentences of the draft."""
    force, partner = find_force_column(judged), find_force_partner(judged)
    draft.left_out += [
        f'{judged.table.file.path.name}: "{column.name}" is not used: '
        + (
            f'it is the voltage of a shaker, and "{force.name}" is used as the drive'
            if _is_voltage(judged, column)
            else f'it may be a drive, but "{force.name}" is used as the drive; if it is a motion, add it to '
            "[run.columns] with a separate sensor"
        )
        for column in judged.of_role(Role.FORCE)
        if force is not None and column not in (force, partner)
    ]


def list_phase_evidence(judged: JudgedTable) -> list[tuple[str, Column, PhaseEvidence]]:
    """Evidence from the phases of each sensor, with its name and column, one item per pass.

    Each pass is judged separately, since its level may differ from that of others: all responses of a low level are
    small compared with those of a high one.
    """
    frequency, force = judged.of_role(Role.FREQUENCY)[0].values, make_complex_force(judged)
    # With a constant response only the ratio to the force has a peak; phases may be relative to another signal.
    drive = np.ones(len(frequency)) if force is None else np.where(force == 0, np.nan, force)
    evidence = []
    for rows in judged.rows():
        if find_harmonic_of_rows(judged, rows) != 1:
            continue
        own = np.flatnonzero(
            judged.mask(rows) & np.isfinite(frequency) & (frequency > 0)
        )  # a spectrum may have two sides
        of_pass = number_passes(frequency[own], _find_stated_sweep(judged, own))
        passes = [own[of_pass == number] for number in range(int(of_pass.max(initial=-1)) + 1)]
        for column, partner in pair_responses_with_phases(judged):
            values = make_complex_response(judged, column, partner)
            if values is None:
                continue
            ratio = values / drive
            judgements = [judge_phase(frequency[one], ratio[one]) for one in passes]
            if all(item is None for item in judgements):  # passes of unordered frequencies have few points each
                judgements = [judge_phase(frequency[own], ratio[own])]
            name = _find_row_name(judged, rows) or choose_sensor_name(judged, column)
            evidence += [(name, column, item) for item in judgements if item is not None]
    return evidence


def find_harmonic_of_rows(judged: JudgedTable, rows: Mapping[str, Any]) -> int:
    """Harmonic of the responses in some rows of a table [-]."""
    column = next((one for one in judged.settings if judged.columns[one.name].role is Role.HARMONIC), None)
    return judged.table.harmonic if column is None else int(rows[column.name])


def _find_row_name(judged: JudgedTable, rows: Mapping[str, Any]) -> str:
    """Name of the sensor in the rows of a series; empty if they have none."""
    return next((str(rows[one.name]) for one in judged.settings if one.words), "")


def _find_stated_sweep(judged: JudgedTable, rows: NDArray[Any]) -> NDArray[np.int64] | None:
    """Sweep (+1 up, -1 down, 0 none) of some rows, shape (n,), if the file states it in words; else None."""
    for column in judged.of_role(Role.SWEEP):
        if column.words:
            signs = np.array([SWEEP_WORDS.get(word.lower(), 0) for word in column.words])
            return np.asarray(signs[column.values[rows].astype(np.int64)])
    return None


def draft_stepped_sine(draft: ManifestDraft, judged: JudgedTable, test: str, signs: Mapping[str, Marked]) -> None:
    """Draft the runs of a stepped sine, one per combination of the settings.

    Parameters
    ----------
    draft
        Draft, extended in place.
    judged
        Table.
    test
        Name of its test.
    signs
        Signs of sensors that measure against their axis, by their names in `list_phase_evidence`.
    """
    add_test(draft, test)
    report_unused_phases(draft, judged)
    report_second_forces(draft, judged)
    frequency, force = judged.of_role(Role.FREQUENCY)[0], find_force_column(judged)
    pairs = pair_responses_with_phases(judged)
    for rows in judged.rows():
        columns: dict[str, Any] = {"frequency": reading(draft, judged, frequency)}
        if force is not None:
            partner = find_force_partner(judged)
            columns["force"] = draft_drive_reading(draft, judged, force, phase=partner)
            if partner is None and not np.iscomplexobj(force.values):
                columns["force"] = as_amplitude(columns["force"])
                if any(phase is not None or np.iscomplexobj(column.values) for column, phase in pairs):
                    columns["force"]["amplitude"] = Marked(value=force.name, assumed=PHASES)
        for role in (Role.SWEEP, Role.ORDER, Role.REPEAT):
            for column in judged.of_role(role)[:1]:
                columns[role.value] = column.name
        for column, partner in pairs:
            sensor, entry = _draft_sensor_reading(draft, judged, column, partner, rows, signs)
            put_once(draft, judged, columns, sensor, column, entry)
        run: dict[str, Any] = {"test": test, "file": judged.table.file.path.name}
        run |= _draft_level(draft, judged, rows, force)
        if "sweep" not in columns and (way := WAY_OF_COLUMN.search(judged.table.of_set)):
            way_word = "up" if SWEEP_WORDS[way[0].lower()] > 0 else "down"
            run["sweep"] = Marked(value=way_word, assumed=f'named "{way[0]}" in its columns')
        run |= {"rows": rows} if rows else {}
        drive = make_complex_force(judged)
        if drive is not None and is_response_controlled(judged, drive, pairs[0][0], rows):
            why = "the force varies with frequency, but the response does not"
            run["control"] = Marked(value="response", assumed=why)
        lacking = describe_missing_values(judged, judged.mask(rows))
        if lacking:
            run["missing"] = Marked(value="skip", assumed=lacking)
        draft.entries["run"].append(Run({**run, "columns": columns}, judged))


def _draft_sensor_reading(
    draft: ManifestDraft, judged: JudgedTable, column: Column, phase: Column | None, rows: Mapping[str, Any],
    signs: Mapping[str, Marked],
) -> tuple[str, str | dict[str, Any]]:  # fmt: skip
    """Draft the sensor of a response: its name, and the entry of its reading in some rows."""
    real_only = phase is None and not np.iscomplexobj(column.values)
    word = _find_row_name(judged, rows)
    sensor = add_sensor(draft, judged, column, has_phase=not real_only, needs_unit=False, name=word)
    entry = reading(draft, judged, column, sensor=sensor, phase=phase)
    if real_only:
        rest = entry if isinstance(entry, dict) else {}
        entry = {"amplitude": column.name, **{key: rest[key] for key in rest if key in {"unit", "convention"}}}
    else:
        sign = -1 if find_direction_sign(column) < 0 else signs.get(word or choose_sensor_name(judged, column), 1)
        entry = with_sign(entry, sign)
    harmonic = find_harmonic_of_rows(judged, rows)
    if harmonic != 1:
        entry = {**({"column": entry} if isinstance(entry, str) else entry), "harmonic": harmonic}
    return sensor, entry


def put_once(
    draft: ManifestDraft, judged: JudgedTable, columns: dict[str, Any], sensor: str, column: Column, entry: Any
) -> None:
    """Add the reading of a sensor to the columns of a run; a second reading of the same sensor is left out by name."""
    if sensor in columns:
        draft.left_out.append(
            f'{judged.table.file.path.name}: "{column.name}" is not used: sensor "{sensor}" already reads another '
            "column of this run; give it a separate sensor, or a separate run with the force that belongs to it"
        )
    else:
        columns[sensor] = entry


def describe_missing_values(judged: JudgedTable, mask: NDArray[np.bool_]) -> str:
    """Sentence on columns without a number in some rows of a series, and the count of these rows; empty if none."""
    others = judged.of_role(Role.RESPONSE, Role.FORCE, Role.PHASE, Role.COHERENCE)
    used = [*judged.of_role(Role.FREQUENCY)[:1], *others]
    missing = {column.name: int((~np.isfinite(column.values[mask])).sum()) for column in used}
    listed = [f'"{name}" has no number in {count} of {mask.sum()} rows' for name, count in missing.items() if count]
    return f"{', '.join(listed)}; all other values are used" if listed else ""


def says_free(name: str) -> bool:
    """Whether a name states that a structure was measured without its contacts."""
    words = " ".join(name_words(name))
    return WITHOUT_CONTACTS.search(words) is not None and not WITH_CONTACTS.search(words)


def ask_configuration(draft: ManifestDraft, name: str) -> Marked:
    """Configuration of a structure, from a name such as "free blade", else asked of the user."""
    if says_free(name):
        return Marked(value="free", assumed=f'called "{name}"')
    if WITH_CONTACTS.search(" ".join(name_words(name))):
        return Marked(value="jointed", assumed=f'called "{name}"')
    why = "not stated in the file; most tests have all contacts"
    return draft.ask(
        "Was the structure tested with all contacts (jointed) or without (free)?", "jointed", why, "jointed", "free"
    )


def add_test(draft: ManifestDraft, test: str) -> None:
    """Add a test to the draft, unless it exists."""
    if draft.named("test", test) is None:
        draft.entries["test"].append({"name": test, "configuration": ask_configuration(draft, test)})


def _draft_level(
    draft: ManifestDraft, judged: JudgedTable, rows: Mapping[str, Any], force: Column | None
) -> dict[str, Any]:
    """Level of a run: from a setting, a scalar of the file, the name or the measured force, else asked of the user."""
    for column in judged.settings:
        guess = judged.columns[column.name]
        if guess.role is Role.LEVEL:
            stated, why = float(rows[column.name]), f'"{column.name}": {guess.evidence}'
            return {"level": Marked(value=stated, assumed=why) if guess.assumed else stated}
    mask = judged.mask(rows)
    size = None if force is None else np.abs(force.values[mask])
    if beside := find_level_beside_columns(judged, size):
        return beside
    value, _ = find_level_in_name(judged)
    if value is not None and force is None:
        return {"level": Marked(value=value, assumed="the level in its name")}
    if judged.of_role(Role.LEVEL):
        return {}
    frequency = judged.of_role(Role.FREQUENCY)[0].values[mask]
    sweep = _find_stated_sweep(judged, mask)
    if force is not None and size is not None:
        return find_levels_of_force(frequency, sweep, size) or find_named_set_point(judged, force.name, size)
    sizes = [np.abs(column.values[mask]) for column, _ in pair_responses_with_phases(judged)]
    return ask_levels(draft, judged.table.label, frequency, sweep, sizes)


def is_response_controlled(judged: JudgedTable, force: NDArray[Any], response: Column, rows: Mapping[str, Any]) -> bool:
    """Whether the force varies over the frequencies of a series while the response is constant."""
    mask = judged.mask(dict(rows))
    drive, answer = np.abs(force[mask]), np.abs(response.values[mask])
    if not len(drive) or not (drive > 0).all() or not (answer > 0).all():
        return False
    spread = float((np.quantile(answer, 0.9) - np.quantile(answer, 0.1)) / np.median(answer))
    return bool(drive.max() / drive.min() > CONTROL_FORCE and spread < CONTROL_RESPONSE)
