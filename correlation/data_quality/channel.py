"""Suspected mistakes of single channels: wrong phases, swapped sensors, undeclared sweeps, settling."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, Measurement, Suspicion
from correlation.data_quality.conjugate import find_conjugate_repeats
from correlation.data_quality.phase_reference import find_turned_runs
from correlation.data_quality.swapped_force import find_forces_swapped_in_a_repeat
from correlation.data_quality.swapped_sensor import find_sensors_swapped_in_a_repeat
from correlation.feature.settling import find_drifts
from geometry.plain_number import format_number

#: Change of the phase over a peak below which it is constant [rad]: half of that over the half-power width.
CONSTANT = np.pi / 8
#: Least ratio of a peak to both ends of the band [-], and least number of its points above half of its power.
PEAK, HALF_POWER = 3.0, 3
#: Change over a peak of a phase in radians that is declared as degrees, read as radians: at least half of that over the
#: half-power width, and at most one turn.
AS_RADIANS = (np.pi / 4, 2 * np.pi)
#: Least number of steps up and down of a run that indicate an unnamed sweep.
RUN = 4


def find_channel_suspicions(campaign: Campaign) -> tuple[Suspicion, ...]:
    """Suspected mistakes, each with its evidence."""
    checks = (
        _suspect_constant_phase,
        find_sensors_swapped_in_a_repeat,
        find_forces_swapped_in_a_repeat,
        _suspect_signs,
        _suspect_unnamed_sweeps,
        _suspect_settling,
    )
    return tuple(item for check in checks for item in check(campaign))


def _suspect_signs(campaign: Campaign) -> Iterator[Suspicion]:
    """Phases with another reference, or with the wrong sign."""
    turned = [*find_turned_runs(campaign)]
    yield from turned
    for suspicion in find_conjugate_repeats(campaign):
        if not any(suspicion.lies_in(item.where) for item in turned):
            yield suspicion


def _suspect_constant_phase(campaign: Campaign) -> Iterator[Suspicion]:
    table = campaign.measurement
    real: dict[int, list[str]] = {}
    for number, sensor in enumerate(campaign.sensors):
        spreads: dict[str, float] = {}
        for test in range(len(campaign.tests) if sensor.has_phase else 0):
            rows = (table.test == test) & (table.sensor == number) & (table.harmonic == 1)
            if rows.sum() < 5:
                continue
            if not table.value[rows].imag.any():
                real.setdefault(test, []).append(f'sensor "{sensor.name}"')
                continue
            levels = [table.where(rows & (table.level == level)) for level in np.unique(table.level[rows])]
            known = [spread for spread in map(_compute_phase_range, levels) if spread is not None]
            if known and max(known) < CONSTANT:
                spreads[campaign.tests[test].name] = max(known)
        if spreads:
            yield _suspect_phase(sensor.name, spreads)
    for test, names in sorted(real.items()):
        yield Suspicion(
            where=f'test "{campaign.tests[test].name}", {", ".join(names)}',
            sentence="the imaginary part is zero in all rows: are these amplitudes? If so, write phase = false "
            f"for {'the sensor' if len(names) == 1 else 'these sensors'}",
        )


def _suspect_phase(sensor: str, spreads: dict[str, float]) -> Suspicion:
    """Suspicion about phases that hardly change over the peaks of some tests, with one explanation for all."""
    degrees = [float(np.degrees(spread)) for spread in spreads.values()]
    # A phase in radians in one test is in radians in all tests, where the phase of the force may be added to it.
    in_radians = any(AS_RADIANS[0] < item < AS_RADIANS[1] for item in degrees)
    asked = (
        "is it in radians but declared in degrees? If so, write rad as the unit of the phase"
        if in_radians
        else "were amplitudes written with a fixed phase? If so, write phase = false for the sensor"
    )
    tests = ", ".join(f'"{test}"' for test in spreads)
    changes = " and ".join(format_number(item) for item in degrees)
    return Suspicion(
        where=f'test{"s" if len(spreads) > 1 else ""} {tests}, sensor "{sensor}"',
        sentence=(
            f"the phase changes by {changes} deg over the half-power width of a resonance, where about 90 deg are "
            f"expected: {asked}"
        ),
    )


def _compute_phase_range(table: Measurement) -> float | None:
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


def _suspect_unnamed_sweeps(campaign: Campaign) -> Iterator[Suspicion]:
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
    """Whether a run covers the same frequencies in both directions."""
    step = np.sign(np.diff(frequency))
    step = step[step != 0]
    if len(step) < 2 * RUN:
        return False
    change = np.flatnonzero(np.diff(step)) + 1
    return len(change) == 1 and bool(change[0] >= RUN and len(step) - change[0] >= RUN)


def _suspect_settling(campaign: Campaign) -> Iterator[Suspicion]:
    for drift in find_drifts(campaign):
        tests = [test for test in campaign.tests if (test.configuration == "free") == drift.free]
        if not drift.settles or all(test.settling for test in tests):
            continue
        changes = {"frequency": drift.frequency, "amplitude": drift.amplitude}
        whole = {name: 100 * float(change[-1] - change[0]) for name, change in changes.items()}
        listed = " and ".join(f"{name} by {whole[name]:+.3g} %" for name in drift.settles)
        where = ", ".join(f'test "{test.name}"' for test in tests)
        yield Suspicion(
            where=where, of_time=True,
            headline=f"{where} changed from repeat to repeat, which the case does not explain",
            sentence=f"from repeat {drift.repeat[0]} to {drift.repeat[-1]} the responses change in one direction, "
            f"{listed}: do they still settle? If so, they are not repeats: write settling = true for the test, and "
            "only the late ones are used",
        )  # fmt: skip
