"""Suspected mistakes in a campaign by comparison with a model, each with its evidence in numbers."""

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import ArrayLike, NDArray

from correlation.campaign.measurement import Campaign, Suspicion
from correlation.data_quality.campaign import channels, line
from correlation.feature.table import FeatureTable

#: A model's resonance is a test's if they differ by less (natural logarithm) [-].
SAME_RESONANCE, SAME_AFTER_MENDING = 0.25, 0.1
#: Two sensors are suspected if their ratio is off by more than this (natural logarithm, a factor of 1.5) [-],
SWAPPED = 0.4
#: and if swapping them leaves at most this share of it [-].
AFTER_SWAPPING = 1 / 3


def find_model_suspicions(campaign: Campaign, model_frequencies: ArrayLike) -> tuple[Suspicion, ...]:
    r"""Whether a frequency column is in rad/s though the manifest says Hz, or the other way round.

    Parameters
    ----------
    campaign
        Campaign.
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


def find_swapped_sensors(
    campaign: Campaign, table: FeatureTable, predicted: Complex[NDArray[np.complex128], " k"]
) -> tuple[Suspicion, ...]:
    r"""Pairs of sensors of one quantity, of forces along and across a line too, that agree only if they are swapped.

    The ratio of two channels, :math:`z = \sum \bar{x}_j x_i / \sum |x_j|^2`, is that of their mode shape and does not
    move with the resonance; swapped sensors have :math:`1/z`.

    Parameters
    ----------
    campaign
        Campaign with its sensors.
    table
        Features as measured.
    predicted
        The model's, row by row, shape (k,).
    """
    found: list[tuple[float, int, int, str]] = []
    for i, first in enumerate(campaign.sensors):
        for j in range(i):
            second = campaign.sensors[j]
            rows_i, rows_j = table.common_rows(i, j, 1)
            if first.quantity != second.quantity or len(rows_i) < 3:
                continue
            seen = np.isfinite(predicted[rows_i]) & np.isfinite(predicted[rows_j])
            rows_i, rows_j = rows_i[seen], rows_j[seen]
            scale = 1 / table.level[rows_i]
            both = np.array([table.value[rows_i], table.value[rows_j], predicted[rows_i], predicted[rows_j]]) * scale
            if not (first.has_phase and second.has_phase):
                both = np.abs(both).astype(np.complex128)
            measured, model = _ratio(both[0], both[1]), _ratio(both[2], both[3])
            if not (np.isfinite([measured, model]).all() and measured and model):
                continue
            own, swapped = abs(np.log(measured / model)), abs(np.log(measured * model))
            if own > SWAPPED and swapped < AFTER_SWAPPING * own:
                sentence = (
                    f'"{first.name}" reads {_polar(measured)} of "{second.name}", the model says {_polar(model)}; '
                    f"swapped, they agree within {max(np.expm1(swapped), 1e-3):.1%}: check the cables"
                )
                found.append((swapped / own, i, j, sentence))
    # Two that are swapped make each of them look wrong beside a third: the pair that explains best stands for all.
    reported: set[int] = set()
    suspicions = []
    for _, i, j, sentence in sorted(found):
        if reported.isdisjoint({i, j}):
            reported |= {i, j}
            names = f'"{campaign.sensors[j].name}" and "{campaign.sensors[i].name}"'
            suspicions.append(Suspicion(where=f"sensors {names} look swapped", sentence=sentence))
    return tuple(suspicions)


def _resonance(campaign: Campaign, test: int) -> tuple[float, float, str]:
    """Where a test resonates [Hz], at the peak of its lowest level or else somewhere in its band, and in words."""
    for _, sensor, rows in (each for each in channels(campaign) if each[0] == test):
        table = campaign.measurement.where(rows)
        frequency, value = line(table, float(table.level.min()))
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


def _ratio(x: Complex[NDArray[np.complex128], " f"], y: Complex[NDArray[np.complex128], " f"]) -> complex:
    with np.errstate(invalid="ignore", divide="ignore"):
        return complex(np.vdot(y, x) / np.vdot(y, y).real)


def _polar(ratio: complex) -> str:
    phase = np.degrees(np.angle(ratio))
    return f"{abs(ratio):.3g}" + (f" at {phase:.0f} deg" if abs(phase) > 20 else "")
