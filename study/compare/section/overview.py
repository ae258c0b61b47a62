"""Overview of the compared data, and of data that could not be compared."""

from collections.abc import Iterator

import numpy as np

from correlation.campaign.measurement import SWEEPS, Campaign
from correlation.feature.observation import arrange_campaign
from correlation.feature.settling import find_unsettled
from geometry.name_list import join_first_names
from geometry.plain_number import count
from study.compare.curve import Drawing
from study.compare.result import ComparisonResult
from study.compare.section.section import Section
from study.page.table import Table


def make_overview_sections(compared: ComparisonResult, drawing: Drawing) -> Iterator[Section]:
    """Sensors and runs of the campaign, and the data that were left out."""
    del drawing
    campaign = compared.campaign
    table = Table(
        head=("sensor", "quantity", "at", "harmonics", "levels", "readings", "remark"),
        rows=_format_sensors(campaign),
        words=3,
    )
    text = " ".join([describe_runs(campaign), *describe_left_out(compared)])
    yield Section(title="What was compared", text=text, table=table)


def describe_runs(campaign: Campaign) -> str:
    """Levels, repeats and sweeps in one sentence."""
    table = campaign.measurement
    levels = ", ".join(f"{level:g}" for level in campaign.levels)
    repeats, ways = np.unique(table.repeat), [SWEEPS[int(way)] for way in np.unique(table.sweep)[::-1] if way]
    sweeps = f", swept {' and '.join(ways)}" if ways else ""
    tests = ", ".join(f'"{test.name}" ({test.configuration})' for test in campaign.tests)
    held = [f"{level:g} {campaign.drive.unit}" for level in campaign.held_out.levels]
    held += [f"repeat {repeat}" for repeat in campaign.held_out.repeats]
    kept = f" Held out from calibration: {', '.join(held)}." if held else ""
    return (
        f"Tests {tests}; levels {levels} {campaign.drive.unit}; {count(len(repeats), 'repeat')}{sweeps}; "
        f"{count(len(campaign.sensors), 'sensor')}; {count(len(table), 'reading')}.{kept}"
    )


def describe_left_out(compared: ComparisonResult) -> list[str]:
    """Sentences on the data that could not be compared."""
    sentences = []
    sides = [compared.train] if compared.held_out is None else [compared.train, compared.held_out]
    missing = sum(int((~np.isfinite(side.predicted)).sum()) for side in sides)
    if missing:
        sentences.append(
            f"No steady state of the model was found at {missing} of {sum(map(len, sides))} points, of which each "
            "counts 10 standard deviations."
        )
    sentences += _describe_left_out_states(compared)
    without = [sensor.name for sensor in compared.campaign.sensors if not sensor.has_phase]
    if without:
        sentences.append(f"Phases of {', '.join(without)} were not measured: amplitudes alone are compared.")
    gain = [sensor.name for sensor in compared.campaign.sensors if not sensor.calibrated]
    if gain:
        sentences.append(f"The gain of {', '.join(gain)} is unknown: shapes of curves are compared, not sizes.")
    if compared.campaign.records:
        sentences.append(f"{len(compared.campaign.records)} time records are not part of this comparison.")
    return sentences


def _describe_left_out_states(compared: ComparisonResult) -> list[str]:
    """States that belong to no data set, and why each is left out."""
    sides = [compared.train] if compared.held_out is None else [compared.train, compared.held_out]
    known = {state for side in sides for state in _states(side.points.free, side.points.level, side.points.frequency)}
    everything = arrange_campaign(compared.campaign)
    points, there = everything.points, np.isfinite(everything.repeat).any(axis=1)
    read = _states(points.free[there], points.level[there], points.frequency[there])
    lost = _states(points.free, points.level, points.frequency) - read
    settled = _list_settled_states(compared.campaign)
    unit = compared.campaign.drive.unit
    reasons = {
        "there repeats, or sweeps up and down, differ far more than at neighbouring frequencies, because the response "
        "jumps from one steady state to another, contacts slip in some repeats only or it had not settled, so that "
        "their mean is not a response": lost & settled,
        "all of their readings are of repeats before the contacts settled": lost - settled,
        "their level is held out from calibration, and no held-out repeat has them": read - known,
    }
    return [f"Not compared: {_name_states(states, unit)}; {why}." for why, states in reasons.items() if states]


def _name_states(states: set[tuple[bool, float, float]], unit: str) -> str:
    """The states of lowest levels by level and frequency, and the number of further ones."""
    return join_first_names([f"{level:g} {unit} at {at:g} Hz" + " (free)" * free for free, level, at in sorted(states)])


def _list_settled_states(campaign: Campaign) -> set[tuple[bool, float, float]]:
    """States read after the contacts had settled."""
    free = campaign.is_free
    table = campaign.measurement.where(~find_unsettled(campaign))
    return _states(free[table.test], table.level, table.frequency)


def _states(free: np.ndarray, level: np.ndarray, frequency: np.ndarray) -> set[tuple[bool, float, float]]:
    states = set(zip(free.tolist(), level.tolist(), frequency.tolist(), strict=True))
    return {(at_free, at_level, float(f"{at:.5g}")) for at_free, at_level, at in states}


def _format_sensors(campaign: Campaign) -> list[list[str]]:
    rows = []
    for number, sensor in enumerate(campaign.sensors):
        table = campaign.measurement.where(campaign.measurement.sensor == number)
        if sensor.line is not None:
            place = f"line {sensor.line}, {sensor.component}"
        else:
            at = sensor.place or "as in the case"
            if sensor.coordinates is not None:
                at = f"({', '.join(f'{1e3 * x:g}' for x in sensor.coordinates)}) mm"
            place = ", ".join(filter(None, (at, sensor.direction)))
        remarks = ["" if sensor.has_phase else "no phase", "" if sensor.calibrated else "gain unknown"]
        rows.append(
            [
                sensor.name, sensor.quantity, place, ", ".join(map(str, np.unique(table.harmonic).tolist())),
                str(len(np.unique(table.level))), f"{len(table):,}", ", ".join(filter(None, remarks)),
            ]
        )  # fmt: skip
    return rows
