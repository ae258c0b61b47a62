"""What looks wrong in a campaign, each with its evidence in numbers: found in the data alone, or beside a model."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Bool, Complex, Float
from numpy.typing import ArrayLike, NDArray

from correlation.feature import FeatureTable
from correlation.measurement import CONTACT_FORCE, SWEEPS, Campaign, Measurement, Suspicion

#: Levels must differ by this factor before their ratio says something about a channel [-].
LEVEL_RATIO = 1.5
#: A channel that goes with the level does so by at least this power of it; one that does not, by less [-].
SCALES, STAYS = 0.5, 0.2
#: Imaginary parts of a resonance are about twice the real ones; degrees are far more than metres [-].
IMAGINARY_RATIO = 3.0
#: A model's resonance is a test's if they differ by less (natural logarithm) [-].
SAME_RESONANCE, SAME_AFTER_MENDING = 0.25, 0.1
#: Two sensors are suspected if their ratio is off by more than this (natural logarithm, a factor of 1.5) [-],
SWAPPED = 0.4
#: and if swapping them leaves at most this share of it [-].
AFTER_SWAPPING = 1 / 3


def suspicions(campaign: Campaign) -> tuple[Suspicion, ...]:
    """What looks wrong in the data alone.

    Phases in the imaginary column, channels that stay constant, repeats that are copies, levels and points that are
    missing, sweeps that run the other way.
    """
    found = [
        each
        for check in (_phases, _constant_harmonics, _copies, _missing_levels, _missing_points, _sweeps)
        for each in check(campaign)
    ]
    return tuple(found)


def suspicions_against(campaign: Campaign, model_frequencies: ArrayLike) -> tuple[Suspicion, ...]:
    r"""Whether a frequency column is in rad/s though the manifest says Hz, or the other way round.

    Parameters
    ----------
    campaign
        What was measured.
    model_frequencies
        Resonances of the model, with its contacts stuck and without them, shape (m,) [Hz].

    Returns
    -------
    One for each test whose resonance is none of the model's, but :math:`2\pi` times, or a :math:`2\pi`-th of, one.
    """
    model = np.asarray(model_frequencies, dtype=np.float64)
    model = model[model > 0]
    found = []
    for number, test in enumerate(campaign.tests):
        low, high, evidence = _resonance(campaign, number)
        if not evidence or not len(model) or _distance(model, low, high).min() < SAME_RESONANCE:
            continue
        for factor, words in ((2 * np.pi, "2 pi times"), (1 / (2 * np.pi), "a 2 pi-th of")):
            distance = _distance(model * factor, low, high)
            if distance.min() < SAME_AFTER_MENDING:
                at = model[int(np.argmin(distance))]
                mend = ("Hz", "rad/s") if factor > 1 else ("rad/s", "Hz")
                sentence = (
                    f"{evidence}, which is {words} the model's resonance of {at:.4g} Hz: is the column in {mend[1]}? "
                    f'If so, write units.frequency = "{mend[1]}" instead of "{mend[0]}"'
                )
                found.append(Suspicion(where=f'test "{test.name}"', sentence=sentence))
    return tuple(found)


def swapped_sensors(
    campaign: Campaign, table: FeatureTable, predicted: Complex[NDArray[np.complex128], " k"]
) -> tuple[Suspicion, ...]:
    r"""Pairs of sensors of one quantity that agree with the model only if they are swapped.

    The ratio of two channels, :math:`z = \sum \bar{x}_j x_i / \sum |x_j|^2`, is that of their mode shape and does not
    move with the resonance; swapped sensors have :math:`1/z`.

    Parameters
    ----------
    campaign
        Whose sensors these are.
    table
        Features as measured.
    predicted
        The model's, row by row, shape (k,).
    """
    found = []
    for i, first in enumerate(campaign.sensors):
        for j in range(i):
            second = campaign.sensors[j]
            if first.quantity != second.quantity or first.component != second.component:
                continue
            rows_i, rows_j = _common_rows(table, i, j)
            if len(rows_i) < 3:
                continue
            scale = 1 / table.level[rows_i]
            measured = _ratio(table.value[rows_i] * scale, table.value[rows_j] * scale)
            model = _ratio(predicted[rows_i] * scale, predicted[rows_j] * scale)
            if not (np.isfinite([measured, model]).all() and measured and model):
                continue
            own, swapped = abs(np.log(measured / model)), abs(np.log(measured * model))
            if own > SWAPPED and swapped < AFTER_SWAPPING * own:
                sentence = (
                    f'"{first.name}" reads {_polar(measured)} of "{second.name}", the model says {_polar(model)}; '
                    f"swapped, they agree within {np.expm1(swapped):.0%}: check the cables"
                )
                found.append(
                    Suspicion(where=f'sensors "{second.name}" and "{first.name}" look swapped', sentence=sentence)
                )
    return tuple(found)


def _phases(campaign: Campaign) -> Iterator[Suspicion]:
    for test, sensor, rows in _channels(campaign):
        lines = {level: _line(campaign.measurement.where(rows), level) for level in _levels(campaign, rows)}
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
            imag = np.log(np.median(np.abs(lines[high][1].imag)) / np.median(np.abs(value.imag))) / growth
            if real > SCALES and abs(imag) < STAYS:
                evidence = (
                    f"from {low:.4g} to {high:.4g} N real grows {np.exp(real * growth):.3g} times, "
                    f"imag {np.exp(imag * growth):.3g} times"
                )
        elif np.abs(value.imag).max() > IMAGINARY_RATIO * value.real.max():
            evidence = f"imag reaches {np.abs(value.imag).max() / value.real.max():.3g} times what real does"
        if evidence:
            yield Suspicion(
                where=_where(campaign, test, sensor),
                sentence=f"real is never negative and {evidence}: are these amplitude and phase? "
                "Write real = amplitude cos(phase) and imag = amplitude sin(phase)",
            )


def _constant_harmonics(campaign: Campaign) -> Iterator[Suspicion]:
    table = campaign.measurement
    for harmonic in np.unique(table.harmonic[table.harmonic != 1]):
        for test, sensor, rows in _channels(campaign, harmonic=int(harmonic), forces=True):
            value = table.value[rows]
            if len(np.unique(table.frequency[rows])) >= 3 and (value == value[0]).all():
                yield Suspicion(
                    where=_where(campaign, test, sensor),
                    sentence=f"harmonic {harmonic} reads {value[0]:.4g} {campaign.sensors[sensor].unit} at all "
                    f"{len(value)} points: a dead channel, or one that was never evaluated? Remove its rows",
                )


def _copies(campaign: Campaign) -> Iterator[Suspicion]:
    for test, sensor, rows in _channels(campaign, forces=True):
        table = campaign.measurement.where(rows)
        # Sorted by key, the repeats of a point follow each other.
        point = np.stack([table.level, table.frequency, table.sweep])
        same_point = (point[:, 1:] == point[:, :-1]).all(axis=0)
        same_value = table.value[1:] == table.value[:-1]
        pairs, copies = int(same_point.sum()), int((same_point & same_value).sum())
        if copies >= 3:
            yield Suspicion(
                where=_where(campaign, test, sensor),
                sentence=f"{copies} of {pairs} pairs of repeats agree in every digit: are they copies? "
                "Noise is taken from the repeats; measure them, or write more digits",
            )


def _missing_levels(campaign: Campaign) -> Iterator[Suspicion]:
    for number, test in enumerate(campaign.tests):
        table = campaign.measurement.where(campaign.measurement.test == number)
        levels = np.unique(table.level)
        for repeat, sweep in np.unique(np.stack([table.repeat, table.sweep]), axis=1).T:
            there = np.unique(table.level[(table.repeat == repeat) & (table.sweep == sweep)])
            missing = np.setdiff1d(levels, there)
            if len(missing):
                listed = ", ".join(f"{level:.4g}" for level in missing)
                yield Suspicion(
                    where=f'test "{test.name}"',
                    sentence=f"repeat {repeat}, sweep {SWEEPS[int(sweep)]} lacks the level {listed} N, which others "
                    "have: was a file cut short?",
                )


def _missing_points(campaign: Campaign) -> Iterator[Suspicion]:
    table = campaign.measurement
    for number in range(len(campaign.tests)):
        kinds, counts = np.unique(
            np.stack([table.sensor, table.harmonic])[:, table.test == number], axis=1, return_counts=True
        )
        for (sensor, harmonic), count in zip(kinds.T, counts, strict=True):
            if count < counts.max():
                yield Suspicion(
                    where=_where(campaign, number, int(sensor)),
                    sentence=f"harmonic {harmonic} has {count} values where others have {counts.max()}: "
                    "were some left out?",
                )


def _sweeps(campaign: Campaign) -> Iterator[Suspicion]:
    for number, test in enumerate(campaign.tests):
        for sweep in (1, -1):
            rows = (campaign.measurement.test == number) & (campaign.measurement.sweep == sweep)
            table = campaign.measurement.where(rows)
            by_order = np.lexsort((table.order, table.repeat, table.level))
            run = np.stack([table.level, table.repeat])[:, by_order]
            rise = np.diff(table.frequency[by_order])
            # Only within a run; an order that counts whole runs says nothing about the points in them.
            step = (run[:, 1:] == run[:, :-1]).all(axis=0) & (np.diff(table.order[by_order]) > 0) & (rise != 0)
            wrong = int((rise[step] * sweep < 0).sum())
            if step.sum() >= 3 and wrong > 0.5 * step.sum():
                yield Suspicion(
                    where=f'test "{test.name}"',
                    sentence=f"in sweeps {SWEEPS[sweep]} the frequency goes the other way, by the column order, "
                    f"in {wrong} of {step.sum()} steps: are up and down mixed up?",
                )


def _channels(
    campaign: Campaign, harmonic: int = 1, *, forces: bool = False
) -> Iterator[tuple[int, int, Bool[NDArray[np.bool_], " k"]]]:
    """Test, sensor and rows of every channel of a harmonic."""
    table = campaign.measurement
    for test in range(len(campaign.tests)):
        for number, sensor in enumerate(campaign.sensors):
            rows = (table.test == test) & (table.sensor == number) & (table.harmonic == harmonic)
            if rows.any() and (forces or sensor.quantity != CONTACT_FORCE):
                yield test, number, rows


def _where(campaign: Campaign, test: int, sensor: int) -> str:
    return f'test "{campaign.tests[test].name}", sensor "{campaign.sensors[sensor].name}"'


def _levels(campaign: Campaign, rows: Bool[NDArray[np.bool_], " k"]) -> list[float]:
    return [float(level) for level in np.unique(campaign.measurement.level[rows])]


def _line(table: Measurement, level: float) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """Frequencies of a level, rising, and the mean at each."""
    at = table.level == level
    frequency, index = np.unique(table.frequency[at], return_inverse=True)
    mean = np.zeros(len(frequency), dtype=np.complex128)
    np.add.at(mean, index, table.value[at])
    return frequency, mean / np.bincount(index)


def _is_smooth(values: Float[NDArray[np.float64], " f"]) -> bool:
    """Whether values run from one end of their range to the other without much ado, but for one jump (of a phase)."""
    steps = np.sort(np.abs(np.diff(values)))
    return bool(np.ptp(values) > 0 and steps[:-1].sum() <= 1.5 * np.ptp(values))


def _resonance(campaign: Campaign, test: int) -> tuple[float, float, str]:
    """Where a test resonates [Hz], at the peak of its lowest level or else somewhere in its band, and in words."""
    for _, sensor, rows in (each for each in _channels(campaign) if each[0] == test):
        table = campaign.measurement.where(rows)
        frequency, value = _line(table, float(table.level.min()))
        peak = int(np.argmax(np.abs(value)))
        if 0 < peak < len(value) - 1:
            at = float(frequency[peak])
            return at, at, f'"{campaign.sensors[sensor].name}" peaks at {at:.4g} in the column frequency'
    rows = campaign.measurement.test == test
    if not rows.any():
        return 0.0, 0.0, ""
    band = campaign.measurement.frequency[rows]
    low, high = float(band.min()), float(band.max())
    return low, high, f"the column frequency covers {low:.4g} to {high:.4g}"


def _distance(model: Float[NDArray[np.float64], " m"], low: float, high: float) -> Float[NDArray[np.float64], " m"]:
    """Natural logarithm of the factor between each resonance and a band, shape (m,) [-]."""
    return np.maximum(0.0, np.maximum(np.log(low / model), np.log(model / high)))


def _common_rows(table: FeatureTable, i: int, j: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows of two sensors at the same test, level and frequency, harmonic 1."""
    rows = [np.flatnonzero((table.sensor == sensor) & (table.harmonic == 1)) for sensor in (i, j)]
    keys = [
        {
            key: row
            for row, key in zip(
                each, zip(table.test[each], table.level[each], table.frequency[each], strict=True), strict=True
            )
        }
        for each in rows
    ]
    common = [key for key in keys[0] if key in keys[1]]
    return np.array([keys[0][key] for key in common], int), np.array([keys[1][key] for key in common], int)


def _ratio(x: Complex[NDArray[np.complex128], " f"], y: Complex[NDArray[np.complex128], " f"]) -> complex:
    with np.errstate(invalid="ignore", divide="ignore"):
        return complex(np.vdot(y, x) / np.vdot(y, y).real)


def _polar(ratio: complex) -> str:
    phase = np.degrees(np.angle(ratio))
    return f"{abs(ratio):.3g}" + (f" at {phase:.0f} deg" if abs(phase) > 20 else "")
