r"""Errors of a model's resonances, mode by mode.

A band may contain several modes, and a level may show only some of them. The peaks of each level (`metric.curve_peak`)
are assigned to modes over the levels, and modes of the model are paired with measured ones (`metric.mode_pairing`);
then frequency and damping of each are estimated (`metric.peak_reading`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Int
from numpy.typing import NDArray

from correlation.campaign.measurement import name_configuration
from correlation.errors import CampaignError
from correlation.feature.observation import Observation
from correlation.feature.vector import FeatureVector
from correlation.metric.curve_peak import CurvePeak, find_curve_peaks
from correlation.metric.mode_pairing import Mode, pair_modes, track_modes
from correlation.metric.peak_reading import PeakCurve, choose_upper_branch, has_jump_at_peak, measure_noise, read_peaks
from correlation.noise.covariance import Whitening
from correlation.prediction import Points

Coefficients = Complex[NDArray[np.complex128], " k"]

#: Largest damping ratio: a broader peak is not that of a single mode, and the parabola does not apply [-].
MOST_DAMPED = 0.3


@dataclass(frozen=True, kw_only=True)
class PeakError:
    """Resonance of a mode of a configuration at a level, measured and predicted at the same frequencies.

    Parameters
    ----------
    free, level
        Configuration and level [-, N].
    sensor
        Motion sensor.
    frequency, predicted_frequency
        Resonance frequencies [Hz]; the predicted one is NaN if the model does not show this mode.
    frequency_deviation
        Standard deviation of their difference for a complete model [Hz].
    damping, predicted_damping, damping_deviation
        The same for the damping ratio [-].
    mode
        Number of the mode among the measured ones of this configuration, in ascending frequency, from 1.
    """

    free: bool
    level: float
    sensor: str
    frequency: float
    predicted_frequency: float
    frequency_deviation: float
    damping: float
    predicted_damping: float
    damping_deviation: float
    mode: int = 1

    @property
    def frequency_error(self) -> float:
        """Relative error of the predicted frequency [-]."""
        return self.predicted_frequency / self.frequency - 1

    @property
    def damping_error(self) -> float:
        """Relative error of the predicted damping ratio [-]."""
        return self.predicted_damping / self.damping - 1


@dataclass(frozen=True, kw_only=True, eq=False)
class PeakSource:
    """Measurements and a prediction from which peaks are estimated.

    Parameters
    ----------
    observed
        Measurements, k points. The inverse of the mean of F / X is used: the mean of X over repeats with slightly
        different resonances is lower and broader than each of them.
    predicted
        Predicted coefficients at the same points, shape (k,).
    features, whitening
        Features and covariance of the same points, which give the standard deviations.
    sweeps
        Directions in which the structure was swept.
    """

    observed: Observation
    predicted: Coefficients
    features: FeatureVector
    whitening: Whitening
    sweeps: tuple[int, ...] = ()


@dataclass(frozen=True, kw_only=True)
class ModePeaks:
    """Errors of resonances from the peaks of measurements and of a prediction.

    Parameters
    ----------
    errors
        Errors of resonances, by configuration, mode and level, for peaks of a single mode without a jump.
    unread
        Reasons why other peaks were not evaluated.
    """

    errors: tuple[PeakError, ...] = ()
    unread: tuple[str, ...] = ()


def compute_peak_errors(sources: Sequence[PeakSource], level_unit: str = "N") -> ModePeaks:
    """Resonances within the measured bands, by configuration, mode and level.

    Parameters
    ----------
    sources
        Sets of measurements; a level of a configuration is taken from the first set that contains it.
    level_unit
        Unit of the levels, for messages.
    """
    errors, unread = list[PeakError](), list[str]()
    for free in (False, True):
        levels = _list_levels(sources, free)
        sensors = sorted({sensor for level in levels for sensor in level.sensors})
        largest = {sensor: max(level.largest(sensor) for level in levels) for sensor in sensors}
        measured = track_modes([level.find_peaks(level.measured, largest) for level in levels])
        predicted = track_modes([level.find_peaks(level.predicted, largest) for level in levels])
        partners = pair_modes(measured, predicted)
        for number, mode in enumerate(measured):
            own = predicted[partners[number]] if number in partners else {}
            for place in sorted(mode):
                result = levels[place].read(mode[place], own.get(place), number + 1, level_unit)
                if isinstance(result, PeakError):
                    errors.append(result)
                elif result:
                    unread.append(result)
        alone = [mode for number, mode in enumerate(predicted) if number not in partners.values()]
        unread += [_name_alone(mode, levels, level_unit) for mode in alone]
    return ModePeaks(errors=tuple(errors), unread=tuple(unread))


def _name_alone(mode: Mode, levels: Sequence["_Level"], level_unit: str) -> str:
    frequency = np.mean([peak.frequency for peak in mode.values()])
    at = ", ".join(f"{levels[place].level:g}" for place in sorted(mode))
    name = name_configuration(levels[0].free)
    return f"no measured peak belongs to the model's resonance of {name} near {frequency:.4g} Hz at {at} {level_unit}"


@dataclass(frozen=True, kw_only=True, eq=False)
class _Level:
    """A level of a configuration: its source, and coefficients over the force, shape (k,)."""

    source: PeakSource
    free: bool
    level: float
    measured: Coefficients
    predicted: Coefficients
    rows: Int[NDArray[np.int64], " n"]
    """Rows of the fundamentals of its motions."""

    @property
    def points(self) -> Points:
        return self.source.observed.points

    @property
    def sensors(self) -> list[str]:
        return [str(name) for name in np.unique(self.points.sensor[self.rows])]

    def largest(self, sensor: str) -> float:
        """Largest measured motion of a sensor; 0 without any."""
        size = np.abs(self.measured[self.rows[self.points.sensor[self.rows] == sensor]])
        return float(np.max(size[np.isfinite(size)], initial=0.0))

    def find_peaks(self, value: Coefficients, largest: Mapping[str, float]) -> tuple[CurvePeak, ...]:
        """Peaks of measured or predicted coefficients, with motions relative to the largest one of each sensor."""
        finite = self.rows[np.isfinite(value[self.rows])]
        grid = np.unique(self.points.frequency[finite])
        motion = np.full((len(largest), len(grid)), np.nan, dtype=np.complex128)
        noise = np.zeros(motion.shape)
        # Without phases the relative sign of motions is unknown: moduli are compared.
        phased = not self.source.features.amplitude[self.rows].any()
        for number, (sensor, size) in enumerate(largest.items()):
            own = finite[self.points.sensor[finite] == sensor]
            if not len(own) or not size > 0:
                continue
            own = choose_upper_branch(self.points, value, own)
            read = value[own] if phased else np.abs(value[own])
            motion[number] = np.interp(grid, self.points.frequency[own], read / size, left=np.nan, right=np.nan)
            known = own[self.source.features.inverse[own]]
            if value is self.measured and len(known):
                deviation = measure_noise(value[known], known, self.source.features, self.source.whitening)
                noise[number] = np.interp(grid, self.points.frequency[known], deviation / size)
        return find_curve_peaks(grid, motion, noise)

    def read(self, measured: CurvePeak, predicted: CurvePeak | None, mode: int, level_unit: str) -> PeakError | str:
        """Error of a resonance; or the reason why it was not evaluated, empty without a suitable sensor."""
        own = self.rows[self.source.features.inverse[self.rows]]
        top = own[self.points.frequency[own] == measured.frequency]
        if not len(top):
            return ""
        sensor = str(self.points.sensor[top][np.argmax(np.abs(self.measured[top]))])
        rows = choose_upper_branch(self.points, self.measured, own[self.points.sensor[own] == sensor])
        frequency = self.points.frequency[rows]
        curves = {
            "measured": PeakCurve.around(measured, frequency, self.measured[rows]),
            "predicted": PeakCurve.around(predicted, frequency, self.predicted[rows]),
        }
        whose = [name for name, of in curves.items() if has_jump_at_peak(self.points, of, rows, self.source.sweeps)]
        where = (
            f"peak of {name_configuration(self.free)} near {measured.frequency:.4g} Hz at {self.level:g} {level_unit}"
        )
        if whose:
            return (
                f"the {' and the '.join(whose)} {where} ends in a jump, or the sweeps differ there: the width of a "
                "single branch does not give a damping ratio"
            )
        try:
            result = read_peaks(
                curves["measured"], curves["predicted"], rows, self.source.features, self.source.whitening
            )
        except CampaignError:
            result = None
        if result is None or result.damping > MOST_DAMPED:
            return (
                f"the measured {where} does not have the shape of a single mode, from which frequency and damping are "
                "read"
            )
        return PeakError(free=self.free, level=self.level, sensor=sensor, mode=mode, **vars(result))


def _list_levels(sources: Sequence[PeakSource], free: bool) -> list[_Level]:
    """Levels of a configuration, ascending."""
    result: dict[float, _Level] = {}
    for source in sources:
        points, features = source.observed.points, source.features
        own = features.fundamental & (points.free == free)
        measured = features.values(features.of_repeats(source.observed.repeat, source.observed.taken))
        # Peaks are those of the receptance, also if the response was controlled.
        ratio = points.level / points.force
        measured, predicted = measured * ratio, source.predicted * ratio
        for level in np.unique(points.level[own]).tolist():
            if level not in result:
                rows = np.flatnonzero(own & (points.level == level))
                result[level] = _Level(
                    source=source, free=free, level=level, measured=measured, predicted=predicted, rows=rows
                )
    return [result[level] for level in sorted(result)]
