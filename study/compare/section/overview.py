"""What was compared, and what could not be."""

from collections.abc import Iterator

import numpy as np

from correlation.campaign.measurement import SWEEPS, Campaign
from correlation.feature.observation import arrange_campaign
from study.compare.curve import Drawing
from study.compare.result import Compared
from study.compare.section.section import Section
from study.page.table import Table


def overview_sections(compared: Compared, drawing: Drawing) -> Iterator[Section]:
    """Sensors and runs of the campaign, and what was left out."""
    del drawing
    campaign = compared.campaign
    table = Table(
        head=("sensor", "quantity", "at", "harmonics", "levels", "readings", "remark"), rows=_sensors(campaign), words=3
    )
    text = " ".join([describe_runs(campaign), *left_out(compared)])
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
    count = f"{len(repeats)} repeat{'s' if len(repeats) > 1 else ''}"
    return (
        f"Tests {tests}; levels {levels} {campaign.drive.unit}; {count}{sweeps}; {len(campaign.sensors)} sensors; "
        f"{len(table):,} readings.{kept}"
    )


def left_out(compared: Compared) -> list[str]:
    """What could not be compared, one sentence each."""
    sentences = []
    sides = [compared.train] if compared.held_out is None else [compared.train, compared.held_out]
    missing = sum(int((~np.isfinite(side.predicted)).sum()) for side in sides)
    if missing:
        sentences.append(
            f"No steady state of the model was found at {missing} of {sum(map(len, sides))} points, of which each "
            "counts 10 standard deviations."
        )
    points = [side.points for side in sides]
    known = {state for item in points for state in _states(item.free, item.level, item.frequency)}
    everything = arrange_campaign(compared.campaign).points
    jumps = len(_states(everything.free, everything.level, everything.frequency) - known)
    if jumps:
        states = "1 state" if jumps == 1 else f"{jumps} states"
        sentences.append(
            f"{states} (level and frequency) where repeats or sweeps jump between two responses, or that no set of "
            "data has, could not be compared."
        )
    without = [sensor.name for sensor in compared.campaign.sensors if not sensor.has_phase]
    if without:
        sentences.append(f"Phases of {', '.join(without)} were not measured: amplitudes alone are compared.")
    gain = [sensor.name for sensor in compared.campaign.sensors if not sensor.calibrated]
    if gain:
        sentences.append(f"The gain of {', '.join(gain)} is unknown: shapes of curves are compared, not sizes.")
    if compared.campaign.records:
        sentences.append(f"{len(compared.campaign.records)} time records are not part of this comparison.")
    return sentences


def _states(free: np.ndarray, level: np.ndarray, frequency: np.ndarray) -> set[tuple[bool, float, float]]:
    return {(bool(a), float(b), float(f"{c:.5g}")) for a, b, c in zip(free, level, frequency, strict=True)}


def _sensors(campaign: Campaign) -> list[list[str]]:
    rows = []
    for number, sensor in enumerate(campaign.sensors):
        table = campaign.measurement.where(campaign.measurement.sensor == number)
        if sensor.line is not None:
            place = f"line {sensor.line}, {sensor.component}"
        elif sensor.place is not None:
            place = f"{sensor.place}, {sensor.direction}"
        else:
            at = ", ".join(f"{1e3 * x:g}" for x in (() if sensor.coordinates is None else sensor.coordinates))
            place = f"({at}) mm, {sensor.direction}"
        remarks = ["" if sensor.has_phase else "no phase", "" if sensor.calibrated else "gain unknown"]
        rows.append(
            [
                sensor.name, sensor.quantity, place, ", ".join(map(str, np.unique(table.harmonic).tolist())),
                str(len(np.unique(table.level))), f"{len(table):,}", ", ".join(filter(None, remarks)),
            ]
        )  # fmt: skip
    return rows
