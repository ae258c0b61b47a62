"""Misfit of a model at every point, and split by configuration, level, frequency band, sensor and harmonic."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from numpy.typing import NDArray

from correlation.campaign.measurement import name_configuration
from correlation.feature.observation import Observation
from correlation.feature.vector import FeatureVector
from correlation.metric.response import amplitude_error, phase_error
from correlation.prediction import Points
from correlation.row_group import group_rows
from correlation.row_table import RowTable
from fe.notebook import Tabular

if TYPE_CHECKING:
    import pandas

Mask = Bool[NDArray[np.bool_], " k"]
Numbers = Float[NDArray[np.float64], " k"]
Coefficients = Complex[NDArray[np.complex128], " k"]

#: Axes along which a misfit can be split.
AXES = ("configuration", "level", "band", "sensor", "harmonic")
#: Number of frequency bands of each configuration, with equally many frequencies.
BANDS = 6
#: Least ratio of a value to its standard deviation for errors of amplitude and phase [-].
MIN_SIZE_OVER_DEVIATION = 5.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Misfit(RowTable, Tabular):
    """Differences between a model and measurements, one row per point.

    Parameters
    ----------
    points
        Points, k rows.
    motion
        Whether a row belongs to a motion sensor, shape (k,).
    measured, predicted
        Coefficients, shape (k,) [SI unit of the sensor]; predicted is NaN where the model has no steady state.
    deviation
        Standard deviation of real and imaginary part of the mean of the repeats, shape (k,) [the same]: from their
        scatter, or from the noise of a reading with a single repeat.
    standardised
        Difference of the row's features, real and imaginary part, over its total standard deviation including common
        errors, shape (k, 2) [standard deviations]; the imaginary part is NaN for harmonic 0. It is large only where the
        model fails.
    whitened
        The whitened difference, shape (k, 2). Its squares add up to chi^2, but an error at one point that a common mode
        could explain also affects the other points of that mode.
    """

    points: Points
    motion: Mask
    measured: Coefficients
    predicted: Coefficients
    deviation: Numbers
    standardised: Float[NDArray[np.float64], "k 2"]
    whitened: Float[NDArray[np.float64], "k 2"]

    def __len__(self) -> int:
        return len(self.points)

    @property
    def phased(self) -> Mask:
        """Mask of rows with a phase, shape (k,)."""
        return np.asarray(np.isfinite(self.standardised[:, 1]))

    @property
    def size(self) -> Numbers:
        """Root mean square of the standardised numbers of each row, shape (k,) [standard deviations]."""
        return np.asarray(np.sqrt(np.nanmean(self.standardised**2, axis=1)))

    @property
    def root_mean_square(self) -> float:
        """Root mean square of all standardised numbers [standard deviations]; 1 is perfect."""
        return float(np.sqrt(np.nanmean(self.standardised**2)))

    @property
    def clear(self) -> Mask:
        """Mask of rows that clearly exceed the noise and have a prediction, shape (k,)."""
        there = (np.abs(self.measured) > 0) & np.isfinite(self.predicted)
        return np.asarray(there & (np.abs(self.measured) > MIN_SIZE_OVER_DEVIATION * self.deviation))

    def to_pandas(self) -> "pandas.DataFrame":
        """One row per point: coordinates, measured and predicted value, and their difference."""
        import pandas

        points = self.points
        return pandas.DataFrame(
            {
                "without contacts": points.free,
                "level [unit of the drive]": points.level,
                "frequency [Hz]": points.frequency,
                "sensor": points.sensor,
                "harmonic": points.harmonic,
                "measured [SI]": self.measured,
                "predicted [SI]": self.predicted,
                "misfit [standard deviations]": self.size,
            }
        )


@dataclass(frozen=True, kw_only=True)
class MisfitSummary:
    """Misfit of some of the rows.

    Parameters
    ----------
    label
        Name of the rows: "10 N", "466.4 to 469.6 Hz, jointed", "tip".
    deviations
        Root mean square of the standardised differences [standard deviations]; 1 is perfect.
    whitened
        The same for the whitened differences.
    amplitude_error, phase_error
        Median of the absolute errors of the clear rows [-, rad]; NaN if none is clear.
    signed_amplitude_error, signed_phase_error
        Relative excess and phase lead of the prediction over all clear rows together [-, rad].
    n_number
        Number of compared values [-].
    """

    label: str
    deviations: float
    whitened: float
    amplitude_error: float
    phase_error: float
    signed_amplitude_error: float
    signed_phase_error: float
    n_number: int


def compute_misfit(
    observed: Observation,
    features: FeatureVector,
    predicted: Coefficients,
    standardised: Float[NDArray[np.float64], " m"],
    whitened: Float[NDArray[np.float64], " m"],
    noise: Float[NDArray[np.float64], " m"],
) -> Misfit:
    """Arrange differences of features by points.

    Parameters
    ----------
    observed
        Measurements, k points.
    features
        Features of these points, m numbers.
    predicted
        Predicted coefficients, shape (k,).
    standardised
        (measured - predicted) of the features over its standard deviations, shape (m,).
    whitened
        S^(-1/2) (measured - predicted), shape (m,).
    noise
        Standard deviation of each feature in a single repeat by noise alone, shape (m,).
    """
    k = len(observed.points)

    def pairs(numbers: Float[NDArray[np.float64], " m"]) -> Float[NDArray[np.float64], "k 2"]:
        result = np.full((k, 2), np.nan)
        result[:, 0] = numbers[:k]
        result[~features.real_only, 1] = numbers[k:]
        return result

    n = np.isfinite(observed.repeat).sum(axis=1)
    mean = np.nansum(observed.repeat, axis=1) / np.maximum(n, 1)
    squares = np.nansum(np.abs(observed.repeat - mean[:, None]) ** 2, axis=1)
    parts = np.where(features.real_only, 1.0, 2.0)
    # A single repeat has no scatter.
    single = (noise / features.per_reading(observed.mean))[:k] ** 2
    variance = np.where(n > 1, squares / parts / np.maximum(n - 1, 1), single) / np.maximum(observed.count, 1)
    return Misfit(
        points=observed.points,
        motion=observed.motion,
        measured=observed.value,
        predicted=np.where(features.amplitude, np.abs(predicted), predicted),
        deviation=np.sqrt(variance),
        standardised=pairs(standardised),
        whitened=pairs(whitened),
    )


def split_misfit(misfit: Misfit, axis: str, level_unit: str = "N") -> tuple[MisfitSummary, ...]:
    """Split along an axis of `AXES`, in its order."""
    code, labels = _number_groups(misfit, axis, level_unit)
    return tuple(summarise_misfit(misfit.where(code == number), label) for number, label in enumerate(labels))


def summarise_misfit(misfit: Misfit, label: str = "all") -> MisfitSummary:
    """Misfit of all rows together."""
    clear = misfit.clear
    measured, predicted = misfit.measured[clear], misfit.predicted[clear]
    any_clear = bool(clear.any())
    dynamic = misfit.phased[clear]
    # Rows may differ in unit and size: each is scaled by its modulus.
    scaled = predicted / np.abs(measured)
    return MisfitSummary(
        label=label,
        deviations=misfit.root_mean_square,
        whitened=float(np.sqrt(np.nanmean(misfit.whitened**2))),
        amplitude_error=float(np.median(np.abs(amplitude_error(measured, predicted)))) if any_clear else np.nan,
        phase_error=float(np.median(np.abs(phase_error(measured, predicted)[dynamic]))) if dynamic.any() else np.nan,
        signed_amplitude_error=float(np.sqrt(np.mean(np.abs(scaled) ** 2)) - 1) if any_clear else np.nan,
        signed_phase_error=_average_lead(measured[dynamic], scaled[dynamic]),
        n_number=int(np.isfinite(misfit.whitened).sum()),
    )


def find_worst(split: Sequence[MisfitSummary]) -> MisfitSummary:
    """The part with the largest misfit."""
    return max(split, key=lambda summary: summary.deviations)


def find_worst_cell(misfit: Misfit, level_unit: str = "N") -> tuple[MisfitSummary, Points]:
    """The worst of all cells level x band x sensor x harmonic, and its points."""
    coded = [_number_groups(misfit, axis, level_unit) for axis in ("level", "band", "sensor", "harmonic")]
    first, number = group_rows([code for code, _ in coded])
    squares = np.nansum(misfit.standardised**2, axis=1)
    counts = np.isfinite(misfit.standardised).sum(axis=1)
    mean = np.bincount(number, squares) / np.maximum(np.bincount(number, counts), 1)
    at = int(np.argmax(mean))
    level, band, sensor, harmonic = (labels[code[first[at]]] for code, labels in coded)
    rows = number == at
    return summarise_misfit(misfit.where(rows), f"{sensor}, {harmonic}, {level}, {band}"), misfit.points.where(rows)


def split_into_bands(points: Points) -> tuple[Int[NDArray[np.int64], " k"], list[str]]:
    """Number of the band of each row, shape (k,), and the names of the bands."""
    code = np.zeros(len(points), dtype=np.int64)
    labels: list[str] = []
    for free in np.unique(points.free):
        rows = points.free == free
        frequencies = np.unique(points.frequency[rows])
        for band in np.array_split(frequencies, min(BANDS, len(frequencies))):
            code[rows & (points.frequency >= band[0]) & (points.frequency <= band[-1])] = len(labels)
            labels.append(f"{band[0]:.5g} to {band[-1]:.5g} Hz {name_configuration(bool(free))}")
    return code, labels


def _number_groups(misfit: Misfit, axis: str, level_unit: str) -> tuple[Int[NDArray[np.int64], " k"], list[str]]:
    points = misfit.points
    if axis == "band":
        return split_into_bands(points)
    if axis == "sensor":
        names = list(dict.fromkeys(map(str, points.sensor)))
        return np.array([names.index(str(name)) for name in points.sensor]), names
    column = {"configuration": points.free, "level": points.level, "harmonic": points.harmonic}[axis]
    values, code = np.unique(column, return_inverse=True)
    return np.asarray(code).ravel(), [_name_group(axis, value, level_unit) for value in values.tolist()]


def _name_group(axis: str, value: float, level_unit: str) -> str:
    if axis == "configuration":
        return name_configuration(bool(value))
    return f"{value:g} {level_unit}" if axis == "level" else f"harmonic {value}"


def _average_lead(measured: Coefficients, scaled: Coefficients) -> float:
    """Phase lead of all predictions together [rad]; NaN without any."""
    return float(np.angle(np.sum(scaled * np.exp(-1j * np.angle(measured))))) if len(measured) else np.nan
