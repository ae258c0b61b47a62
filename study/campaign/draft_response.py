"""Drafts of frequency responses."""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from correlation.file.column import Column
from study.campaign.column_role import INDEX, Role
from study.campaign.draft import ManifestDraft, without_marks
from study.campaign.draft_frequency import (
    add_test,
    ask_configuration,
    describe_missing_values,
    find_nearest_each_other,
    pair_responses_with_phases,
    report_unused_phases,
)
from study.campaign.level import find_level_beside_columns, find_named_force
from study.campaign.question import Marked
from study.campaign.run_name import LEVEL_IN_NAME, make_naming_scheme, split_name
from study.campaign.sensor_draft import add_sensor, choose_sensor_name, find_direction_sign, reading, with_sign
from study.campaign.table_kind import JudgedTable

#: Second index of an array of responses by outputs and inputs: H(:,2,1), H(2,1,:), H[1,0].
SECOND_INDEX = re.compile(r"\d,(\d+)(?:,:)?[)\]]$")
#: Reason why an amplitude is not a frequency response.
WITHOUT_PHASE = 'has no phase with a matching name: name the two columns "acc_tip" and "phase_tip", for example'
#: Names of tests with a sine.
SINE = re.compile(r"sine|sinus|stepped|sweep|swept|dwell", re.IGNORECASE)
#: Reason why several responses of one sensor are numbered.
REPEATS = "the file has several responses of one sensor, and nothing in it distinguishes levels"


def draft_frequency_responses(draft: ManifestDraft, judged: JudgedTable, signs: Mapping[str, Marked]) -> None:
    """Draft the frequency responses of one table to its main reference; each repeat has a separate entry."""
    frequency = judged.of_role(Role.FREQUENCY)[0]
    file = judged.table.file.path.name
    named = [_name_reference(column) for column in judged.of_role(Role.RESPONSE)]
    references = list(dict.fromkeys(named))
    main = max(references, key=named.count)
    draft.left_out += [
        f"{file}: responses to a force at {reference}: a case has one load, here at {main}, so they are not used"
        for reference in references
        if reference != main
    ]
    report_unused_phases(draft, judged)
    lacking = describe_missing_values(judged, np.ones(len(frequency.values), dtype=np.bool_))
    entries: list[dict[str, Any]] = []
    for column, partner in pair_responses_with_phases(judged):
        if _name_reference(column) != main:
            continue
        if partner is None and not np.iscomplexobj(column.values):
            draft.left_out.append(f'{file}: "{column.name}" {WITHOUT_PHASE}')
            continue
        sensor = add_sensor(draft, judged, column, has_phase=True, needs_unit=False)
        value = reading(draft, judged, column, sensor=sensor, phase=partner, per="N")
        along = find_direction_sign(column)
        along *= -1 if column.reference is not None and column.reference.direction.startswith("-") else 1
        value = with_sign(value, -1 if along < 0 else signs.get(choose_sensor_name(judged, column), 1))
        entry = next((one for one in entries if sensor not in one["columns"]), None)
        if entry is None:
            entry = {
                "name": f"{judged.table.label}" + (f" repeat {len(entries) + 1}" if entries else ""),
                "file": file,
                **_test(draft, judged),
                **({"missing": Marked(value="skip", assumed=lacking)} if lacking else {}),
                "columns": {"frequency": reading(draft, judged, frequency)},
                "coherence": {},
            }
            if entries:
                entry["repeat"] = Marked(value=len(entries) + 1, assumed=REPEATS)
            entries.append(entry)
        entry["columns"][sensor] = value
        coherence = _find_coherence(judged, column, len(entries) - 1)
        if coherence is not None:
            entry["coherence"][sensor] = coherence.name
    used = {name for entry in entries for name in entry["coherence"].values()}
    draft.left_out += [
        f'{file}: the name of the coherence "{column.name}" matches no response: add it to [frf.coherence]'
        for column in judged.of_role(Role.COHERENCE)
        if column.name not in used and _name_reference(column) in {"", main}
    ]
    for entry in entries:
        if not entry["coherence"]:
            del entry["coherence"]
    draft.entries["frf"] += entries


def _test(draft: ManifestDraft, judged: JudgedTable) -> dict[str, Any]:
    """Configuration of responses; for a sine of known force, test and level instead."""
    label = judged.table.label
    value = find_named_force(judged.table)
    level = find_level_beside_columns(judged, None)
    if value is not None and not level:
        level = {"level": Marked(value=value, assumed="the level in its name")}
    if level and SINE.search(label):
        test = make_naming_scheme(split_name(label, LEVEL_IN_NAME)[0]) or "sine"
        add_test(draft, test)
        return {"test": test, **level}
    if level:
        draft.suspicions.append(
            f"{judged.table.place}: responses at a level of {without_marks(level['level']):g}: if the excitation was "
            "a sine of this force, give test and level instead of the configuration, to distinguish levels"
        )
    return {"configuration": ask_configuration(draft, label)}


def _name_reference(column: Column) -> str:
    point = column.reference
    if point is None:
        index = SECOND_INDEX.search(column.name)
        return f"input {index[1]}" if index else ""
    return f"{point.node or point.name}{point.direction.lstrip('+-')}"


def _find_coherence(judged: JudgedTable, response: Column, repeat: int) -> Column | None:
    """Coherence of a response, by the point in the file, the index or the name, or the only one; None if unknown."""
    coherences = judged.of_role(Role.COHERENCE)
    if response.response is not None:
        point = response.response
        same = [
            one for one in coherences
            if one.response is not None and (one.response.node, one.response.direction, one.response.name)
            == (point.node, point.direction, point.name) and _name_reference(one) in {"", _name_reference(response)}
        ]  # fmt: skip
        return same[repeat] if repeat < len(same) else None
    index = INDEX.search(response.name)
    if index is not None:
        return next((one for one in coherences if one.name.endswith(index[0])), None)
    named = [one for one in coherences if judged.columns[one.name].stem == judged.columns[response.name].stem]
    named = named or find_nearest_each_other(judged, response, coherences, judged.of_role(Role.RESPONSE))
    return named[0] if named else (coherences[0] if len(coherences) == 1 else None)
