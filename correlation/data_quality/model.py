"""Suspected mistakes in a campaign by comparison with a model, each with numerical evidence."""

from functools import partial
from itertools import combinations, permutations

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import ArrayLike, NDArray

from correlation.campaign.measurement import Campaign, Suspicion
from correlation.data_quality.campaign import channels, line
from correlation.data_quality.frequency_unit import find_wrong_frequency_unit
from correlation.data_quality.logarithm import wrap_phases
from correlation.feature.table import FeatureTable

Logarithms = Complex[NDArray[np.complex128], "s s"]

#: Least number of points for a ratio.
FEWEST = 3
#: Two sensors are suspected if the error of their ratio exceeds this (natural logarithm, a factor of 1.5) [-], or the
#: smaller one if all other sensors agree,
SWAPPED, SMALL = 0.4, 0.04
#: and if swapping them reduces it to at most this fraction [-].
AFTER_SWAPPING = 1 / 3


def find_model_suspicions(campaign: Campaign, model_frequencies: ArrayLike) -> tuple[Suspicion, ...]:
    """Tests whose frequency column is probably in rad/s or kHz though the manifest states Hz, or the reverse.

    Parameters
    ----------
    campaign
        Campaign.
    model_frequencies
        Resonances of the model, with its contacts stuck and without them, shape (m,) [Hz].

    Returns
    -------
    One suspicion for each test whose resonance agrees with one of the model only after such a change of the unit.
    """
    model = np.asarray(model_frequencies, dtype=np.float64)
    model = model[model > 0]
    result = []
    for number, test in enumerate(campaign.tests):
        low, high, evidence = _find_resonance(campaign, number)
        if not evidence or not len(model):
            continue
        wrong = find_wrong_frequency_unit(partial(_compute_nearest_distance, model, low, high))
        if wrong is not None:
            at = model[int(np.argmin(_compute_distance(model * wrong.factor, low, high)))]
            sentence = (
                f"{evidence}, which is {wrong.words} the model's resonance of {at:.4g} Hz: is the column in "
                f'{wrong.likely}? If so, write "{wrong.likely}" instead of "{wrong.stated}" as the unit of that '
                "column, or as units.frequency where the column has none"
            )
            result.append(Suspicion(where=f'test "{test.name}"', sentence=sentence, of_test=True))
    return tuple(result)


def find_swapped_sensors(
    campaign: Campaign, table: FeatureTable, predicted: Complex[NDArray[np.complex128], " k"]
) -> tuple[Suspicion, ...]:
    r"""Pairs of sensors of one quantity, of forces along and across a line too, that agree only if they are swapped.

    The ratio of two channels, :math:`z = \sum \bar{x}_j x_i / \sum |x_j|^2`, is that of their mode shape and does not
    move with the resonance; swapped sensors have :math:`1/z`. A small difference is evidence if the ratios to every
    other sensor confirm it.

    Parameters
    ----------
    campaign
        Campaign with its sensors.
    table
        Features as measured.
    predicted
        Prediction of the model for each row, shape (k,).
    """
    n = len(campaign.sensors)
    measured, model = np.full((2, n, n), np.nan, dtype=np.complex128)
    for i, j in permutations(range(n), 2):
        if campaign.sensors[i].quantity == campaign.sensors[j].quantity:
            measured[i, j], model[i, j] = _compute_ratios(campaign, table, predicted, i, j)
    with np.errstate(divide="ignore", invalid="ignore"):
        measured_logarithm, predicted_logarithm = np.log(measured), np.log(model)
    result: list[tuple[float, int, int, str]] = []
    for j, i in combinations(range(n), 2):
        if not np.isfinite(measured_logarithm[i, j] + predicted_logarithm[i, j]):
            continue
        own, swapped = (
            abs(wrap_phases(measured_logarithm[i, j] - predicted_logarithm[i, j])),
            abs(wrap_phases(measured_logarithm[i, j] + predicted_logarithm[i, j])),
        )
        if (
            own > (SMALL if _others_confirm(measured_logarithm, predicted_logarithm, i, j) else SWAPPED)
            and swapped < AFTER_SWAPPING * own
        ):
            first, second = campaign.sensors[i].name, campaign.sensors[j].name
            sentence = (
                f'"{first}" reads {_polar(measured[i, j])} of "{second}", the model says {_polar(model[i, j])}; '
                f"swapped, they agree within {max(np.expm1(swapped), 1e-3):.1%}: check the cables"
            )
            result.append((float(swapped / own), i, j, sentence))
    # Each of two swapped sensors also looks wrong relative to a third: only the best pair is reported.
    reported: set[int] = set()
    suspicions = []
    for _, i, j, sentence in sorted(result):
        if reported.isdisjoint({i, j}):
            reported |= {i, j}
            names = f'"{campaign.sensors[j].name}" and "{campaign.sensors[i].name}"'
            suspicions.append(Suspicion(where=f"sensors {names} look swapped", sentence=sentence))
    return tuple(suspicions)


def _compute_ratios(
    campaign: Campaign, table: FeatureTable, predicted: Complex[NDArray[np.complex128], " k"], i: int, j: int
) -> tuple[complex, complex]:
    """Ratio of two channels as measured and as predicted; NaN where they have too few points in common."""
    first, second = campaign.sensors[i], campaign.sensors[j]
    rows_i, rows_j = table.common_rows(i, j, 1)
    seen = np.isfinite(predicted[rows_i]) & np.isfinite(predicted[rows_j])
    rows_i, rows_j = rows_i[seen], rows_j[seen]
    if len(rows_i) < FEWEST:
        return complex(np.nan), complex(np.nan)
    scale = 1 / table.level[rows_i]
    both = np.array([table.value[rows_i], table.value[rows_j], predicted[rows_i], predicted[rows_j]]) * scale
    if not (first.has_phase and second.has_phase):
        both = np.abs(both).astype(np.complex128)
    return _compute_ratio(both[0], both[1]), _compute_ratio(both[2], both[3])


def _others_confirm(measured: Logarithms, predicted: Logarithms, i: int, j: int) -> bool:
    """Whether the ratios to all other sensors confirm that two are swapped, and ratios among the others are right."""
    known = np.isfinite(measured + predicted)
    rest = [k for k in range(len(measured)) if k not in {i, j} and known[[i, j], k].all()]
    if not rest:
        return False

    def distance(row: int, k: int, other: int) -> float:
        return float(abs(wrap_phases(measured[row, k] - predicted[other, k])))

    apart = np.array(
        [[distance(one, k, one), distance(one, k, other)] for k in rest for one, other in ((i, j), (j, i))]
    )
    among = [distance(k, m, k) for k in rest for m in rest if known[k, m]]
    right = max(among, default=0.0)
    return bool((apart[:, 1] < AFTER_SWAPPING * apart[:, 0]).all() and right < AFTER_SWAPPING * apart[:, 0].min())


def _find_resonance(campaign: Campaign, test: int) -> tuple[float, float, str]:
    """Resonance frequency of a test [Hz], at the peak of its lowest level or else within its band, and in words."""
    for _, sensor, rows in (item for item in channels(campaign) if item[0] == test):
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


def _compute_distance(
    model: Float[NDArray[np.float64], " m"], low: float, high: float
) -> Float[NDArray[np.float64], " m"]:
    """Natural logarithm of the factor between each resonance and a band, shape (m,) [-]."""
    return np.maximum(0.0, np.maximum(np.log(low / model), np.log(model / high)))


def _compute_nearest_distance(
    model: Float[NDArray[np.float64], " m"], low: float, high: float, factor: float
) -> Float[NDArray[np.float64], " 1"]:
    """Distance of the nearest resonance from the band, with a factor on all resonances, shape (1,) [-]."""
    return np.asarray(_compute_distance(factor * model, low, high).min(keepdims=True))


def _compute_ratio(x: Complex[NDArray[np.complex128], " f"], y: Complex[NDArray[np.complex128], " f"]) -> complex:
    with np.errstate(invalid="ignore", divide="ignore"):
        return complex(np.vdot(y, x) / np.vdot(y, y).real)


def _polar(ratio: complex) -> str:
    phase = np.degrees(np.angle(ratio))
    return f"{abs(ratio):.3g}" + (f" at {phase:.0f} deg" if abs(phase) > 20 else "")
