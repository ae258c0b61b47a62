"""Suspected mistakes in a campaign from its data alone, each with numerical evidence."""

from collections import Counter
from collections.abc import Iterator
from functools import partial

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from correlation.campaign.measurement import CONTACT_FORCE, SI_UNIT, SWEEPS, Campaign, Measurement, Suspicion
from correlation.data_quality.channel import find_channel_suspicions
from correlation.data_quality.dead_channel import find_dead_channels, find_dead_rows
from correlation.data_quality.drift import find_drift_suspicions
from correlation.data_quality.drive import find_drive_suspicions
from correlation.data_quality.missing_level import find_missing_levels
from correlation.data_quality.swapped_sensor import find_sensors_swapped_in_a_repeat
from correlation.data_quality.trend_suspicion import find_trend_suspicions
from correlation.data_quality.zero_reading import find_zero_readings
from correlation.row_group import group_rows
from geometry.name_list import join_first_names

#: Least ratio of two levels for a test of a channel against the level [-].
LEVEL_RATIO = 1.5
#: Least exponent of a channel that follows the level, and largest exponent of one that does not [-].
SCALES, STAYS = 0.5, 0.2
#: Ratio of imaginary to real parts that indicates phases in degrees: at a resonance it is about two [-].
IMAGINARY_RATIO = 3.0
#: Least number of rows of a run over that of the longest other run at the same levels; fewer are repeated states [-].
A_RUN = 0.5
#: Largest fraction of many repeats that agree by chance in the written digits [-].
BY_CHANCE = 0.01


def find_suspicions(campaign: Campaign) -> tuple[Suspicion, ...]:
    """Suspected mistakes in the data alone.

    Phases in the imaginary column, or without meaning; constant harmonics and dead channels; sensors at one point;
    repeats that are copies, settle, drift or are different levels; sensors swapped in a repeat; missing levels,
    frequencies, points, sensors and repeats; sweeps in the opposite direction; single readings of exactly zero; forces
    that differ from their set points.
    """
    dead = find_dead_rows(campaign)
    result = [
        item
        for check in (
            _suspect_phases,
            _suspect_constant_harmonics,
            partial(find_dead_channels, dead=dead),
            _suspect_sensors_at_one_place,
            partial(_suspect_copied_channels, dead=dead),
            _suspect_missing_levels,
            _suspect_missing_frequencies,
            _suspect_missing_points,
            _suspect_missing_sensors,
            _suspect_missing_repeats,
            _suspect_sweeps,
            find_zero_readings,
        )
        for item in check(campaign)
    ]
    levels = list(find_missing_levels(campaign))
    # Drifts are not reported for a test with undeclared levels or swapped sensors.
    others, tests = [*levels, *find_sensors_swapped_in_a_repeat(campaign)], [test.name for test in campaign.tests]
    spoiled = [where for where in map('test "{}"'.format, tests) if any(item.lies_in(where) for item in others)]
    drifts = [item for item in find_drift_suspicions(campaign) if not any(item.lies_in(where) for where in spoiled)]
    channels = find_channel_suspicions(campaign)
    # Trends are not reported for a test whose runs differ by a mistake, a gain or the settling of its first repeats.
    places = [item.where for item in (*others, *channels, *drifts)]
    trends = [item for item in find_trend_suspicions(campaign) if not any(item.where in where for where in places)]
    return (*result, *channels, *find_drive_suspicions(campaign), *levels, *drifts, *trends)


def _suspect_phases(campaign: Campaign) -> Iterator[Suspicion]:
    for test, sensor, rows in channels(campaign):
        if not campaign.sensors[sensor].has_phase:
            continue
        lines = {level: line(campaign.measurement.where(rows), level) for level in _list_levels(campaign, rows)}
        frequency, value = lines[min(lines)]
        if len(frequency) < 5 or any((line.real < 0).any() for _, line in lines.values()):
            continue
        if not all(_is_smooth(line.imag) for _, line in lines.values()):
            continue
        low, high = min(lines), max(lines)
        evidence = ""
        if high > LEVEL_RATIO * low:
            growth = np.log(high / low)
            real = np.log(np.median(lines[high][1].real) / np.median(value.real)) / growth
            # If the resonance moves with the level, the largest phase stays; other phases may change.
            imag = np.log(np.abs(lines[high][1].imag).max() / np.abs(value.imag).max()) / growth
            if real > SCALES and abs(imag) < STAYS:
                evidence = (
                    f"from {low:.4g} to {high:.4g} {campaign.drive.unit} real grows {np.exp(real * growth):.3g} times, "
                    f"imag {np.exp(imag * growth):.3g} times"
                )
        elif np.abs(value.imag).max() > IMAGINARY_RATIO * value.real.max():
            evidence = f"imag reaches {np.abs(value.imag).max() / value.real.max():.3g} times real"
        if evidence:
            yield Suspicion(
                where=_name_channel(campaign, test, sensor),
                sentence=f"real is never negative and {evidence}: are these amplitude and phase? "
                "Write real = amplitude cos(phase) and imag = amplitude sin(phase)",
                of_test=True,
            )


def _suspect_constant_harmonics(campaign: Campaign) -> Iterator[Suspicion]:
    table = campaign.measurement
    for harmonic in np.unique(table.harmonic[table.harmonic != 1]):
        for test, sensor, rows in channels(campaign, harmonic=int(harmonic), forces=True):
            value = table.value[rows]
            if len(np.unique(table.frequency[rows])) >= 3 and (value == value[0]).all():
                yield Suspicion(
                    where=_name_channel(campaign, test, sensor),
                    sentence=f"harmonic {harmonic} reads {value[0]:.4g} {campaign.sensors[sensor].unit} at all "
                    f"{len(value)} points: a dead channel, or one that was never evaluated? Remove its rows",
                )


def _suspect_sensors_at_one_place(campaign: Campaign) -> Iterator[Suspicion]:
    """Sensors of one quantity at one point along one axis: a remark if no test has two of them."""
    groups: dict[tuple[object, ...], list[str]] = {}
    for sensor in campaign.sensors:
        if sensor.quantity in SI_UNIT and sensor.direction:
            point = tuple(sensor.coordinates.tolist()) if sensor.coordinates is not None else sensor.place
            lean = (sensor.relative_to, sensor.inclination, sensor.toward)
            groups.setdefault((sensor.quantity, point, sensor.direction, *lean), []).append(sensor.name)
    for (quantity, spot, direction, *_), names in groups.items():
        if len(names) > 1:
            where = f'at "{spot}"' if isinstance(spot, str) else "at one point"
            apart = all(len(test.intersection(names)) < 2 for test in _group_sensors(campaign))
            unless = "they are one sensor in several tests" if apart else "they are mounted there"
            yield Suspicion(
                where=f"sensors {', '.join(names)}",
                sentence=f"all read the {quantity} {where} along {direction}: give each its own place or "
                f"coordinates, unless {unless}",
                remark=apart,
            )


def _group_sensors(campaign: Campaign) -> Iterator[set[str]]:
    """Names of the sensors of each test, datum and record."""
    table = campaign.measurement
    for test in range(len(campaign.tests)):
        yield {campaign.sensors[item].name for item in np.unique(table.sensor[table.test == test])}
    for datum in campaign.data:
        # A data type of a plugin may have no attribute `sensors`.
        yield set(getattr(datum, "sensors", ()))
    for record in campaign.records:
        yield set(record.channels)


def _suspect_copied_channels(campaign: Campaign, dead: Bool[NDArray[np.bool_], " k"]) -> Iterator[Suspicion]:
    for test, sensor, rows in channels(campaign, forces=True):
        rows = rows & ~dead
        table = campaign.measurement.where(rows)
        # Sorted by key, the repeats of a point follow each other.
        point = np.stack([table.level, table.frequency, table.sweep])
        same_point = (point[:, 1:] == point[:, :-1]).all(axis=0)
        same_value = table.value[1:] == table.value[:-1]
        pairs, copies = int(same_point.sum()), int((same_point & same_value).sum())
        if copies >= 3 and copies > BY_CHANCE * pairs:
            yield Suspicion(
                where=_name_channel(campaign, test, sensor),
                sentence=f"{copies} of {pairs} pairs of repeats agree in every digit: are they copies? "
                "Noise is estimated from the repeats; measure them, or write more digits",
            )


def _suspect_missing_levels(campaign: Campaign) -> Iterator[Suspicion]:
    """Runs without a level that other runs of their sweep have; a few states that were read twice do not count."""
    for number, test in enumerate(campaign.tests):
        table = campaign.measurement.where(campaign.measurement.test == number)
        runs = table.where(group_rows([table.repeat, table.sweep]).first)
        for repeat, sweep in zip(runs.repeat, runs.sweep, strict=True):
            like, own = table.sweep == sweep, (table.sweep == sweep) & (table.repeat == repeat)
            there = np.unique(table.level[own])
            others = table.where(like & ~own & np.isin(table.level, there))
            usual = np.bincount(others.repeat).max(initial=0)
            missing = np.setdiff1d(table.level[like], there) if own.sum() > A_RUN * usual else np.zeros(0)
            if len(missing):
                listed = ", ".join(f"{level:.4g}" for level in missing)
                yield Suspicion(
                    where=f'test "{test.name}"',
                    sentence=f"repeat {repeat}, sweep {SWEEPS[int(sweep)]} lacks the level {listed} "
                    f"{campaign.drive.unit}, which others have: was a file cut short?",
                )


def _suspect_missing_frequencies(campaign: Campaign) -> Iterator[Suspicion]:
    """Runs without frequencies that are common to most runs of their level and direction."""
    for number, test in enumerate(campaign.tests):
        table = campaign.measurement.where(campaign.measurement.test == number)
        alike = group_rows([table.level, table.sweep])
        for group in range(len(alike.first)):
            own = table.where(alike.number == group)
            repeats = np.unique(own.repeat).tolist()
            grids = [frozenset(own.frequency[own.repeat == repeat].tolist()) for repeat in repeats]
            full, several = Counter(grids).most_common(1)[0]
            for repeat, grid in zip(repeats, grids, strict=True):
                if several > grids.count(grid) and grid < full:
                    yield Suspicion(
                        where=f'test "{test.name}"',
                        sentence=f"repeat {repeat}, sweep {SWEEPS[int(own.sweep[0])]} at {own.level[0]:.4g} "
                        f"{campaign.drive.unit} lacks {_describe_missing(full, grid)}",
                        remark=True,
                    )


def _describe_missing(full: frozenset[float], grid: frozenset[float]) -> str:
    """Missing frequencies of a run, and the likely cause, in words."""
    missing = sorted(full - grid)
    ends = missing[0] > max(grid) or missing[-1] < min(grid)
    where = f"{missing[0]:.5g} Hz" + (f" to {missing[-1]:.5g} Hz" if len(missing) > 1 else "")
    asked = "was it aborted" if ends else "were points left out"
    return f"{len(missing)} of {len(full)} frequencies, {where}, which others have: {asked}?"


def _suspect_missing_points(campaign: Campaign) -> Iterator[Suspicion]:
    table = campaign.measurement
    for number in range(len(campaign.tests)):
        own = table.where(table.test == number)
        groups = group_rows([own.sensor, own.harmonic])
        kinds, counts = np.stack([own.sensor, own.harmonic])[:, groups.first], np.bincount(groups.number)
        few = counts < counts.max(initial=0)
        for count in np.unique(counts[few]):
            short = kinds[:, few & (counts == count)].T
            listed = ", ".join(f'"{campaign.sensors[sensor].name}" (harmonic {harmonic})' for sensor, harmonic in short)
            lacking = _describe_short_runs(campaign, own, kinds[:, np.argmax(counts)], short[0])
            yield Suspicion(
                where=f'test "{campaign.tests[number].name}"',
                sentence=f"{count} values where others have {counts.max()}: were some left out? It concerns {listed}"
                f"{lacking}",
                remark=True,
            )


def _describe_short_runs(
    campaign: Campaign, table: Measurement, full: NDArray[np.int64], short: NDArray[np.int64]
) -> str:
    """Repeats and levels in which one sensor and harmonic has fewer values than another, as the end of a sentence."""
    runs = group_rows([table.level, table.repeat])
    of_full, of_short = (
        np.bincount(runs.number[(table.sensor == sensor) & (table.harmonic == harmonic)], minlength=len(runs.first))
        for sensor, harmonic in (full, short)
    )
    fewer = runs.first[of_short < of_full]
    named = [f"repeat {table.repeat[row]} at {table.level[row]:.4g} {campaign.drive.unit}" for row in fewer]
    return f", in {join_first_names(named)}" if named else ""


def _suspect_missing_sensors(campaign: Campaign) -> Iterator[Suspicion]:
    table = campaign.measurement
    for number, sensor in enumerate(campaign.sensors):
        there = [bool((table.sensor[table.test == test] == number).any()) for test in range(len(campaign.tests))]
        for test, has_sensor in zip(campaign.tests, there, strict=True):
            # A structure without contacts has no contact forces.
            if (
                not has_sensor
                and any(there)
                and not (sensor.quantity == CONTACT_FORCE and test.configuration == "free")
            ):
                others = ", ".join(f'"{item.name}"' for item, seen in zip(campaign.tests, there, strict=True) if seen)
                yield Suspicion(
                    where=f'test "{test.name}"',
                    sentence=f'it has no rows of sensor "{sensor.name}", which {others} has: were they left out?',
                )


def _suspect_missing_repeats(campaign: Campaign) -> Iterator[Suspicion]:
    """Missing repeats of a test, if later numbers exist."""
    table = campaign.measurement
    for number, test in enumerate(campaign.tests):
        there = np.unique(table.repeat[table.test == number])
        missing = np.setdiff1d(np.arange(there.min(), there.max() + 1), there) if len(there) else there
        if len(missing):
            listed = ", ".join(str(repeat) for repeat in missing)
            yield Suspicion(
                where=f'test "{test.name}"',
                sentence=f"it has the repeats {there.min()} to {there.max()} but not {listed}: was a file left out?",
            )


def _suspect_sweeps(campaign: Campaign) -> Iterator[Suspicion]:
    for number, test in enumerate(campaign.tests):
        for sweep in (1, -1):
            rows = (campaign.measurement.test == number) & (campaign.measurement.sweep == sweep)
            table = campaign.measurement.where(rows)
            by_order = np.lexsort((table.order, table.repeat, table.level))
            run = np.stack([table.level, table.repeat])[:, by_order]
            rise = np.diff(table.frequency[by_order])
            # Only within a run, and not if all points of a run have the same order.
            step = (run[:, 1:] == run[:, :-1]).all(axis=0) & (np.diff(table.order[by_order]) > 0) & (rise != 0)
            wrong = int((rise[step] * sweep < 0).sum())
            if step.sum() >= 3 and wrong > 0.5 * step.sum():
                yield Suspicion(
                    where=f'test "{test.name}"',
                    sentence=f"in sweeps {SWEEPS[sweep]} the frequency goes in the other direction, by the column "
                    f"order, in {wrong} of {step.sum()} steps: are up and down exchanged?",
                )


def channels(
    campaign: Campaign, harmonic: int = 1, *, forces: bool = False
) -> Iterator[tuple[int, int, Bool[NDArray[np.bool_], " k"]]]:
    """Test, sensor and rows of every channel of a harmonic."""
    table = campaign.measurement
    for test in range(len(campaign.tests)):
        for number, sensor in enumerate(campaign.sensors):
            rows = (table.test == test) & (table.sensor == number) & (table.harmonic == harmonic)
            if rows.any() and (forces or sensor.quantity != CONTACT_FORCE):
                yield test, number, rows


def _name_channel(campaign: Campaign, test: int, sensor: int) -> str:
    return f'test "{campaign.tests[test].name}", sensor "{campaign.sensors[sensor].name}"'


def _list_levels(campaign: Campaign, rows: Bool[NDArray[np.bool_], " k"]) -> list[float]:
    return [float(level) for level in np.unique(campaign.measurement.level[rows])]


def line(table: Measurement, level: float) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """Frequencies of a level, ascending, and the mean at each, shape (f,) each."""
    at = table.level == level
    frequency, index = np.unique(table.frequency[at], return_inverse=True)
    mean = np.zeros(len(frequency), dtype=np.complex128)
    np.add.at(mean, index, table.value[at])
    return frequency, mean / np.bincount(index)


def _is_smooth(values: Float[NDArray[np.float64], " f"]) -> bool:
    """Whether values are nearly monotone over their range, except for one jump (of a phase)."""
    steps = np.sort(np.abs(np.diff(values)))
    return bool(np.ptp(values) > 0 and steps[:-1].sum() <= 1.5 * np.ptp(values))
