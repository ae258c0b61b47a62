r"""Unknown gains: a sensor in volts, or a shaker whose force is an unknown factor times a voltage.

An uncalibrated sensor reads :math:`s` times its motion; the force of an uncalibrated drive is :math:`g` times its
level. For a given g the best ln s is the median of :math:`\ln |X_m / X_p|` over the readings of the sensor. The misfit
is then a function of g alone, which is searched over many decades and refined. If the response is proportional to the
force, the misfit does not depend on g: only the product of g and s is identifiable, and g is fixed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign
from correlation.feature.observation import Observation
from correlation.model import Model
from correlation.prediction import Predictor
from correlation.uncertainty.interval import TWO_SIDED_95
from diagnosis.candidate.effect import EffectParameter
from diagnosis.fit.calibration_parameter import CalibrationParameter
from geometry.plain_number import format_number
from hbsolve.errors import ModelError

#: Prefix of the names of gains, and name of the gain of the drive.
GAIN = "gain of "
DRIVE = f"{GAIN}drive"
#: Decades of the drive's gain searched to either side and values per decade: about the gain from the linear response of
#: calibrated sensors, and about 1 without such sensors; rounds of the golden-section search.
BESIDE_LINEAR, ANYWHERE, ROUNDS = (2, 4), (6, 4), 14
#: The gain of the drive is identifiable if the mean square of ln |X_m / X_p| away from the best gain is larger by this
#: factor, and by more than rounding.
MIN_COST_RATIO, ROUNDING = 1.2, 1e-6
#: Upper limit of the square of ln |X_m / X_p| of a reading: a factor of e^2 [-].
MAX_SQUARE = 4.0
#: Largest number of frequencies of each level used by the search.
MAX_FREQUENCIES = 40
#: Bounds of the factor by which a fit may change a gain after the search [-].
BOUNDS = (0.02, 50.0)
GOLDEN = (np.sqrt(5) - 1) / 2


@dataclass(frozen=True, kw_only=True, eq=False)
class UnknownGain(CalibrationParameter):
    """Factor on the gain of one sensor, or on the force per level, relative to the value found by the search.

    Parameters
    ----------
    sensor
        Name of the sensor; empty for the drive.
    start
        Gain for a factor of 1 [reading per SI unit, or newton per unit of the level].
    """

    sensor: str = ""
    start: float = 1.0

    is_of_case = False

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """Model with the factor; 1 changes nothing."""
        (factor,) = values
        if not self.sensor:
            return model.with_drive(factor)
        own = {sensor.name: sensor.gain for sensor in model.sensors}
        # The structure without contacts has no sensors of contact forces.
        return model.with_sensor(self.sensor, gain=factor * own[self.sensor]) if self.sensor in own else model


@dataclass(frozen=True, kw_only=True, eq=False)
class SensorGains:
    """Unknown gains of a campaign and the values that make a model fit best.

    Parameters
    ----------
    parameters
        The gains as calibration parameters without a prior.
    fixed
        Sentence about a gain that is not identifiable; empty if all are.
    """

    parameters: tuple[UnknownGain, ...] = ()
    fixed: str = ""

    def apply(self, model: Model) -> Model:
        """The model, or a finer version of it, with the gains that were found."""
        for item in self.parameters:
            model = item.apply(model, [item.start])
        return model


def has_unknown_gains(campaign: Campaign) -> bool:
    """Whether a sensor or the drive is not calibrated."""
    return not campaign.drive.calibrated or not all(sensor.calibrated for sensor in campaign.sensors)


def find_gains(model: Model, campaign: Campaign, observed: Observation, sweeps: tuple[int, ...]) -> SensorGains:
    """Search the unknown gains.

    Parameters
    ----------
    model
        Model with the sensors of the campaign.
    campaign
        Campaign, which states the unknown gains.
    observed
        Measurements from which they are estimated.
    sweeps
        Sweep directions of the measurements.

    Raises
    ------
    ModelError
        The model has no response to compare with.
    """
    if not has_unknown_gains(campaign):
        return SensorGains()
    unknown = tuple(sensor.name for sensor in campaign.sensors if not sensor.calibrated)
    search = _Search(model=model, observed=_thin_frequencies(observed), sweeps=sweeps, unknown=unknown)
    if campaign.drive.calibrated:
        return SensorGains(parameters=_make_parameters(search.fit(1.0)[1]))
    gain, is_determined = search.best()
    result = search.fit(gain)[1]
    if is_determined:
        return SensorGains(parameters=_make_parameters({"": gain} | result))
    unit = campaign.drive.unit
    fixed = (
        f"the gain of the drive [{'N' if campaign.drive.quantity == 'force' else 'm/s^2'} per {unit}] cannot be "
        "separated from those of the sensors, since the response of the model is proportional to the force, as far as "
        "these data show: it is fixed at 1, and the gains of the sensors are those of sensor and drive together; "
        "calibrate one of them"
    )
    return SensorGains(parameters=_make_parameters(result), fixed=fixed)


def _make_parameters(gains: Mapping[str, float]) -> tuple[UnknownGain, ...]:
    factor = EffectParameter(name="factor", unit="-", lower=BOUNDS[0], upper=BOUNDS[1], typical=1.05, vanishes=1.0)
    return tuple(
        UnknownGain(
            name=f"{GAIN}{name}" if name else DRIVE, sensor=name, start=gain, deviation=np.inf, parameters=(factor,),
            physics=f"Reading per unit of {name}." if name else "Force per unit of the level.",
        )
        for name, gain in gains.items()
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class _Search:
    """Fits of the sensors' gains at fixed gains of the drive."""

    model: Model
    observed: Observation
    sweeps: tuple[int, ...]
    unknown: tuple[str, ...]

    def fit(self, gain: float) -> tuple[float, dict[str, float]]:
        """Mean square of ln |X_m / X_p|, and the best gain of each unknown sensor, at a gain of the drive.

        Raises
        ------
        ModelError
            The model has no response at this gain.
        """
        driven = self.model.with_drive(gain)
        return self._misfit(Predictor(points=self.observed.points, sweeps=self.sweeps).predict(driven).value)

    def cost(self, log_gain: float) -> float:
        """Mean square of ln |X_m / X_p| at the logarithm of a gain; infinite where the model has no response."""
        try:
            return self.fit(float(np.exp(log_gain)))[0]
        except ModelError:
            return np.inf

    def _misfit(self, value: Complex[NDArray[np.complex128], " k"]) -> tuple[float, dict[str, float]]:
        points, measured = self.observed.points, np.abs(self.observed.value)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.log(measured / np.abs(value))
        there = np.isfinite(ratio)
        gains: dict[str, float] = {}
        for name in self.unknown:
            # Higher harmonics are small and noisy; a static part has its own offset.
            rows = there & (points.sensor == name) & (points.harmonic == 1)
            rows = rows if rows.any() else there & (points.sensor == name)
            mean = float(np.median(ratio[rows])) if rows.any() else 0.0
            gains[name] = float(np.exp(mean))
            ratio = np.where(points.sensor == name, ratio - mean, ratio)
        fundamental = points.harmonic == 1
        # A point without a predicted state counts with the largest square; a few outliers do not dominate.
        squares = np.where(there, np.minimum(ratio**2, MAX_SQUARE), MAX_SQUARE)[fundamental]
        return float(squares.mean()) if (there & fundamental).any() else np.inf, gains

    def best(self) -> tuple[float, bool]:
        """Best gain of the drive, and whether it is identifiable."""
        middle = self._middle()
        decades, per_decade = ANYWHERE if middle is None else BESIDE_LINEAR
        steps = np.arange(-decades * per_decade, decades * per_decade + 1) / per_decade * np.log(10)
        tried = np.log(middle or 1.0) + steps
        cost = np.array([self.cost(float(item)) for item in tried])
        at = int(np.argmin(cost))
        gain = float(np.exp(self._golden(float(tried[max(at - 1, 0)]), float(tried[min(at + 1, len(tried) - 1)]))))
        is_determined = float(np.median(cost)) > MIN_COST_RATIO * self.cost(np.log(gain)) + ROUNDING
        return (gain, True) if is_determined else (1.0, False)

    def _golden(self, low: float, high: float) -> float:
        ends = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)]
        cost = [self.cost(item) for item in ends]
        for _ in range(ROUNDS):
            if cost[0] <= cost[1]:
                high, ends[1], cost[1] = ends[1], ends[0], cost[0]
                ends[0] = high - GOLDEN * (high - low)
                cost[0] = self.cost(ends[0])
            else:
                low, ends[0], cost[0] = ends[0], ends[1], cost[1]
                ends[1] = low + GOLDEN * (high - low)
                cost[1] = self.cost(ends[1])
        return (low + high) / 2

    def _middle(self) -> float | None:
        """Gain at which the linear response of the calibrated motions is as large as measured; None without these."""
        points = self.observed.points
        rows = self.observed.motion & (points.harmonic == 1) & ~np.isin(points.sensor, self.unknown)
        if not rows.any():
            return None
        part = self.observed.where(rows)
        # At a very small force the response is proportional to it.
        small = 1e-6
        weak = self.model.with_drive(small)
        value = Predictor(points=part.points).predict(weak).value / small
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.abs(part.value / value)
        ratio = ratio[np.isfinite(ratio) & (ratio > 0)]
        return float(np.median(ratio)) if len(ratio) else None


def _thin_frequencies(observed: Observation) -> Observation:
    """At most `MAX_FREQUENCIES` frequencies of each level."""
    points = observed.points
    chosen = np.zeros(len(points), dtype=bool)
    for level in np.unique(points.level):
        here = points.level == level
        frequency = np.unique(points.frequency[here])
        if len(frequency) > MAX_FREQUENCIES:
            frequency = frequency[np.linspace(0, len(frequency) - 1, MAX_FREQUENCIES).astype(int)]
        chosen |= here & np.isin(points.frequency, frequency)
    return observed.where(chosen & (observed.count > 0))


def describe_gain(name: str, gain: float, deviation: float) -> str:
    """``gain of tip 1234 +- 5 (0.4 %)``."""
    half = TWO_SIDED_95 * deviation
    return f"{name} {gain:.4g} +- {half:.2g} ({format_number(100 * half / gain)} %)"
