"""Signs and unknown quantities of sensors, from the phases at the peaks."""

from collections.abc import Iterator, Sequence

import numpy as np

from correlation.file.column import Column
from study.campaign.column_role import INDEX
from study.campaign.draft import ManifestDraft
from study.campaign.draft_frequency import find_force_column, list_phase_evidence
from study.campaign.phase_convention import AT_RESONANCE, PhaseEvidence, has_opposite_sign, name_motion
from study.campaign.question import Marked
from study.campaign.sensor_draft import find_direction_sign
from study.campaign.table_kind import JudgedTable


def find_sensor_signs(draft: ManifestDraft, tables: Sequence[JudgedTable], time_sign: int) -> dict[str, Marked]:
    """Find sensors whose phases at the peaks are opposite to those of a sensor at the force.

    If the file states that the sensor is at the force, its readings have the opposite sign. Otherwise the mode shape
    may be the cause, which is a suspicion.

    Parameters
    ----------
    draft
        Draft, to which the suspicions are added.
    tables
        Stepped sines and frequency responses.
    time_sign
        Sign of i Omega t.

    Returns
    -------
    Sign -1 of sensors at the force, by their names in `list_phase_evidence`, marked with the evidence.
    """
    clear: dict[tuple[str, str], list[PhaseEvidence]] = {}
    at_force: set[tuple[str, str]] = set()
    for judged in tables:
        for name, column, evidence in _list_phases_under_force(judged):
            if find_direction_sign(column) < 0:
                continue  # the file states the sign
            quantity = judged.columns[column.name].quantity
            same_point = column.response is None or column.reference is None or is_driving_point(column)
            if evidence.stands_out and quantity in AT_RESONANCE and same_point:
                clear.setdefault((name, quantity), []).append(evidence)
                at_force |= {(name, quantity)} if is_driving_point(column) else set()
    signs: dict[str, Marked] = {}
    for (name, quantity), items in clear.items():
        opposite = [item for item in items if has_opposite_sign(item, quantity, time_sign)]
        if 3 * len(opposite) < 2 * len(items):
            continue
        why = (
            f"{_tell_phase(opposite, len(items), time_sign)}, opposite to that of {quantity} at the point of excitation"
        )
        if (name, quantity) in at_force:
            signs[name] = Marked(value=-1, assumed=why)
        else:
            remedy = (
                "is it on the other side of a node of the mode shape, or mounted in the opposite direction? In the "
                "latter case add sign = -1"
            )
            draft.suspicions.append(f'sensor "{name}": {why}: {remedy}')
    return signs


def find_sensor_motions(tables: Sequence[JudgedTable], time_sign: int) -> dict[str, Marked]:
    """Find unknown quantities of sensors: their phases at the peaks are compared with those of a sensor at the force.

    All channels of one array have the quantity of most of them: beyond a node of the mode shape a displacement has the
    phase of an acceleration.

    Parameters
    ----------
    tables
        Stepped sines and frequency responses.
    time_sign
        Sign of i Omega t.

    Returns
    -------
    Quantities by the names of the sensors in `list_phase_evidence`, marked with the evidence.
    """
    clear: dict[str, list[PhaseEvidence]] = {}
    arrays: dict[str, set[str]] = {}
    for judged in tables:
        for name, column, evidence in _list_phases_under_force(judged):
            if judged.columns[column.name].quantity not in {"", "voltage"}:
                continue
            if index := INDEX.search(column.name):
                arrays.setdefault(column.name[: index.start()], set()).add(name)
            if evidence.is_passed and evidence.time_sign == time_sign:
                clear.setdefault(name, []).append(evidence)
    result: dict[str, Marked] = {}
    for name, items in clear.items():
        motions = [name_motion(item, time_sign) for item in items]
        motion = max(AT_RESONANCE, key=motions.count)
        own = [item for item, named in zip(items, motions, strict=True) if named == motion]
        if 3 * len(own) >= 2 * len(items):
            why = f"{_tell_phase(own, len(items), time_sign)}, like that of {motion} at the point of excitation"
            result[name] = Marked(value=motion, assumed=why)
    for names in arrays.values():
        named = [str(result[name].value) for name in sorted(names) if name in result]
        motion = max(AT_RESONANCE, key=named.count)
        if named and (len(set(named)) > 1 or len(named) < len(names)):
            why = (
                f"{named.count(motion)} of {len(names)} channels of its array have the phase of {motion} at the point "
                "of excitation"
            )
            result |= dict.fromkeys(names, Marked(value=motion, assumed=why))
    return result


def _tell_phase(items: Sequence[PhaseEvidence], n_peak: int, time_sign: int) -> str:
    """Sentence on the phase at some of the peaks."""
    # The mean is that of unit vectors, since phases near 180 degrees have either sign.
    at_peak = np.degrees(time_sign * np.angle(sum(np.exp(1j * item.at_peak) for item in items)))
    return f"its phase is about {at_peak:.0f} degrees at {len(items)} of {n_peak} peaks"


def _list_phases_under_force(judged: JudgedTable) -> Iterator[tuple[str, Column, PhaseEvidence]]:
    """Phases of the sensors of a table driven by a force; none for a shaken base, to which all phases are different."""
    force = find_force_column(judged)
    if force is None or judged.columns[force.name].quantity != "acceleration":
        yield from list_phase_evidence(judged)


def is_driving_point(column: Column) -> bool:
    """Whether the response and the reference of a column are at the same node."""
    response, reference = column.response, column.reference
    return response is not None and reference is not None and response.node == reference.node is not None
