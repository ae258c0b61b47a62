"""Suspected mistakes of single channels: a phase that is none, swapped sensors, sweeps without a name, settling."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, Measurement, Suspicion
from correlation.data_quality.by_repeat import Repeats, arrange_by_repeat
from correlation.data_quality.conjugate import find_conjugate_repeats
from correlation.data_quality.swapped_force import find_forces_swapped_in_a_repeat
from correlation.feature.settling import find_drifts
from geometry.plain_number import plain

#: Change of the phase over a peak below which it is constant [rad]: half of what the half-power width makes.
CONSTANT = np.pi / 8
#: A peak is so many times what both ends of the band are [-], and has so many points above half of its power.
PEAK, HALF_POWER = 3.0, 3
#: Sensors are suspected to be swapped in a repeat that is off by more than this (natural logarithm) [-] and so many
#: times what the other repeats are, and by at most this share of it if they are swapped.
SWAPPED, BESIDE_OTHERS, AFTER_SWAPPING = 0.02, 5.0, 1 / 4
#: A phase in radians that is called degrees changes by so much over a peak, in radians, once it is taken as such.
AS_RADIANS = (np.pi / 4, 1.5 * np.pi)
#: Steps of a run up and down that a sweep without a name makes.
RUN = 4


def find_channel_suspicions(campaign: Campaign) -> tuple[Suspicion, ...]:
    """Suspected mistakes, each with its evidence."""
    checks = (
        _constant_phase,
        _swapped_in_a_repeat,
        find_forces_swapped_in_a_repeat,
        find_conjugate_repeats,
        _unnamed_sweeps,
        _settling,
    )
    return tuple(item for check in checks for item in check(campaign))


def _constant_phase(campaign: Campaign) -> Iterator[Suspicion]:
    table = campaign.measurement
    for test in range(len(campaign.tests)):
        real: list[str] = []
        for number, sensor in enumerate(campaign.sensors):
            rows = (table.test == test) & (table.sensor == number) & (table.harmonic == 1)
            if not sensor.has_phase or rows.sum() < 5:
                continue
            where = f'test "{campaign.tests[test].name}", sensor "{sensor.name}"'
            if not table.value[rows].imag.any():
                real.append(f'sensor "{sensor.name}"')
                continue
            levels = [table.where(rows & (table.level == level)) for level in np.unique(table.level[rows])]
            known = [spread for spread in map(_phase_over_peak, levels) if spread is not None]
            if known and max(known) < CONSTANT:
                change = f"the phase changes by {plain(np.degrees(max(known)))} deg over the half-power width of a "
                asked = (
                    "was it read in radians that are called degrees? If so, write rad as the unit of the phase"
                    if AS_RADIANS[0] < np.degrees(max(known)) < AS_RADIANS[1]
                    else "were amplitudes written with a fixed phase? If so, write phase = false for the sensor"
                )
                yield Suspicion(where=where, sentence=f"{change}resonance, where it should by 90: {asked}")
        if real:
            yield Suspicion(
                where=f'test "{campaign.tests[test].name}", {", ".join(real)}',
                sentence="the imaginary part is zero in all rows: are these amplitudes? If so, write phase = false "
                f"for {'the sensor' if len(real) == 1 else 'these sensors'}",
            )


def _phase_over_peak(table: Measurement) -> float | None:
    """Range of the phase over the points above half of the power of a clear peak [rad]; None without one."""
    frequency, index = np.unique(table.frequency, return_inverse=True)
    mean = np.zeros(len(frequency), dtype=np.complex128)
    np.add.at(mean, index, table.value)
    size = np.abs(mean)
    if len(size) < 5 or not size.min() > 0:
        return None
    peak = int(np.argmax(size))
    above = np.flatnonzero(size > size[peak] / np.sqrt(2))
    clear = size[peak] > PEAK * max(size[0], size[-1]) and (np.diff(above) == 1).all()
    if not clear or len(above) < HALF_POWER or above[0] == 0 or above[-1] == len(size) - 1:
        return None
    # Between the points on either side lies at least the half-power width.
    return float(np.ptp(np.unwrap(np.angle(mean[above[0] - 1 : above[-1] + 2]))))


def _swapped_in_a_repeat(campaign: Campaign) -> Iterator[Suspicion]:
    for test in range(len(campaign.tests)):
        table = campaign.measurement.where(campaign.measurement.test == test)
        for i, first in enumerate(campaign.sensors):
            for j in range(i):
                second = campaign.sensors[j]
                if (first.quantity, first.component) != (second.quantity, second.component):
                    continue
                repeats, values = arrange_by_repeat(table, (i, j))
                which = "one of these repeats" if len(repeats) == 2 else "this repeat"
                for words, own, swapped, usual in _compare_repeats(repeats, values):
                    if own > max(SWAPPED, BESIDE_OTHERS * usual) and swapped < AFTER_SWAPPING * own:
                        yield Suspicion(
                            where=f'test "{campaign.tests[test].name}", {words}',
                            sentence=f'"{first.name}" and "{second.name}" differ from their other repeats by a factor '
                            f"of {np.exp(own):.3g}, and by {np.exp(swapped):.3g} if they are swapped: were their "
                            f"cables or columns swapped in {which}?",
                        )


def _compare_repeats(repeats: list[int], values: Repeats) -> Iterator[tuple[str, float, float, float]]:
    """Each repeat in words, and how far both sensors are from the other repeats in ln |X| (medians).

    Then how far they are when swapped, and how far the others are from their own middle at most. Of two repeats neither
    is known to be the right one.
    """
    size = np.abs(values)
    table = np.log(np.where(size > 0, size, np.nan))
    table = table[:, np.isfinite(table).any(axis=2).all(axis=0)]
    if len(repeats) < 2 or table.shape[1] < 3:
        return
    named = (
        [f"repeat {repeat}" for repeat in repeats] if len(repeats) > 2 else [f"repeats {repeats[0]} and {repeats[1]}"]
    )
    for column, words in enumerate(named):
        rest = np.delete(table, column, axis=2)
        rows = np.isfinite(rest).any(axis=2).all(axis=0) & np.isfinite(table[:, :, column]).all(axis=0)
        if rows.sum() >= 3:
            usual = np.nanmedian(rest[:, rows], axis=2)
            own = np.abs(table[:, rows, column] - usual)
            swapped = np.abs(table[::-1, rows, column] - usual)
            others = np.nanmedian(np.abs(rest[:, rows] - usual[:, :, None]), axis=(0, 1))
            yield words, float(np.median(own)), float(np.median(swapped)), float(np.nanmax(others))


def _unnamed_sweeps(campaign: Campaign) -> Iterator[Suspicion]:
    table = campaign.measurement
    for number, test in enumerate(campaign.tests):
        rows = table.test == number
        if not rows.any() or table.sweep[rows].any():
            continue
        turns = 0
        runs = {*zip(table.level[rows].tolist(), table.repeat[rows].tolist(), strict=True)}
        for level, repeat in runs:
            one = rows & (table.level == level) & (table.repeat == repeat)
            one &= (table.sensor == table.sensor[one][0]) & (table.harmonic == table.harmonic[one][0])
            turns += _turns(table.frequency[one][np.argsort(table.order[one], kind="stable")])
        if 2 * turns > len(runs):
            yield Suspicion(
                where=f'test "{test.name}"',
                sentence=f"the column sweep says none, but by the column order the frequency rises and falls again in "
                f"{turns} of {len(runs)} runs: write up and down, so that branches are not averaged",
            )


def _turns(frequency: Float[NDArray[np.float64], " n"]) -> bool:
    """Whether a run goes one way for some steps and then back over the same frequencies."""
    step = np.sign(np.diff(frequency))
    step = step[step != 0]
    if len(step) < 2 * RUN:
        return False
    change = np.flatnonzero(np.diff(step)) + 1
    return len(change) == 1 and bool(change[0] >= RUN and len(step) - change[0] >= RUN)


def _settling(campaign: Campaign) -> Iterator[Suspicion]:
    for drift in find_drifts(campaign):
        tests = [test for test in campaign.tests if (test.configuration == "free") == drift.free]
        if not drift.settles or all(test.settling for test in tests):
            continue
        changes = {"frequency": drift.frequency, "amplitude": drift.amplitude}
        whole = {name: 100 * float(change[-1] - change[0]) for name, change in changes.items()}
        listed = " and ".join(f"{name} by {whole[name]:+.3g} %" for name in drift.settles)
        yield Suspicion(
            where=", ".join(f'test "{test.name}"' for test in tests),
            sentence=f"from repeat {drift.repeat[0]} to {drift.repeat[-1]} the responses change in one direction, "
            f"{listed}: do they still settle? If so, they are no repeats: write settling = true for the test, and the "
            "late ones alone are used",
        )
