r"""Objective of a calibration onto families: a score of how tightly the bands of a model contain measured families.

Least squares on the mean of the repeats treats friction history as noise. Here the prediction is a band. For each of F
families with c_f set-ups and n_f readings, the score uses the mean width w of the band, which includes a total
widening v by noise, the mean interval score S, and the mean range r of the readings at one frequency:

.. math:: C = \sum_f \left[\frac{2}{F} \ln \frac{w_f}{\bar x_f} + c_f \ln \frac{\bar S_{\alpha_f}}{w_f}
          + \left(c_f - \frac{2}{F}\right) \ln \frac{\max(r_f, v_f)}{\bar x_f}\right],
          \qquad \alpha_f = \frac{1}{n_f + 1} .

Readings uniformly distributed in their bands would have the log-likelihood -c ln S in each family. But all set-ups are
assembled in the same way: they fill an unknown part of each band, and nearly the same part of all bands. With uniformly
distributed ends a and b of this part, and W the width of a band, many readings away from its ends have

.. math:: \int_0^W \!\! \int_a^W p(x | a, b)\, \frac{2}{W^2}\, db\, da \to W^{-2} .

A common factor of all widths therefore enters with the power two, regardless of the number of families and readings;
the mean over families as this factor is a choice. The remaining powers act on the range of the readings, or on the
noise width where it is larger: a model gains nothing by a wide noise band, as from steep flanks of uncertain frequency.
A reading outside the band counts once per set-up, since its upward and downward curves share one history. An error
common to all readings of a family, such as that of the limits, is one draw: it widens the band by 0.67 standard
deviations, as noise does for a single reading. That is a choice; a larger error counts again in each set-up and level.
The score does not depend on the magnitude of a family, so that a static force near zero counts as much as a resonance.
The resulting bands contain all readings and are hardly wider than necessary.

A search for the limits is too slow for a fit. The band in the loop is the range reached by a population of slider
states and random histories. These are the same in every iteration, so that the score depends on the parameters alone.
The result is judged with the limits themselves.

References
----------
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), section 4: calibration by limits over repeated tests.
T. Gneiting and A. E. Raftery, Journal of the American Statistical Association 102 (2007), eq. 43.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.typing import NDArray

from correlation.family.band import PredictedBand, is_covered
from correlation.family.family import Family, number_points
from correlation.family.limit_reading import make_reading_objective
from correlation.family.noise import RepeatErrors
from correlation.family.verdict import FamilyVerdict, compute_noise_width
from correlation.model import DERIVATIVE, Model, Sensor
from hbsolve.balance import HarmonicBalance
from hbsolve.limits.problem import LimitCurve
from hbsolve.limits.response_limits import limit_problem
from hbsolve.limits.shared_histories import share_histories
from hbsolve.limits.slider_bounds import choose_starting_sliders

Both = Float[NDArray[np.float64], "2 n"]

#: Slider states and random histories of the band in the loop, and their seed.
POPULATION, SAMPLES, SEED = 8, 8, 5
#: Least width of a band, over the mean of the readings [-].
LEAST_WIDTH = 1e-6
#: Standard deviations by which an error common to all readings widens a band: the noise width for one reading.
SHARED_WIDTH = float(compute_noise_width(1 / 2))
#: Exponent of a common factor of all widths.
WIDTH_POWERS = 2.0


class FamilyLimits(NamedTuple):
    """Limits at the n readings of a target, and the standard deviations by which a score widens them, lower then upper.

    They contain the noise, and errors common to all readings scaled to their effect on the width of a band.
    """

    value: Both
    """Shape (2, n) [SI unit of each sensor]; a reading has no limits if one of them is NaN."""
    deviation: Both


@dataclass(frozen=True, eq=False)
class FamilyGroup:
    """Families whose bands are sampled at the same frequencies, rising, shape (f,) [Hz]."""

    families: Sequence[Family]
    frequency: Float[NDArray[np.float64], " f"]


@dataclass(frozen=True, kw_only=True, eq=False)
class FamilyTarget:
    """Measured families and their errors, with the score of a model against them; n readings of all families.

    Parameters
    ----------
    groups
        Families and the frequencies of their bands.
    errors
        Noise and frequency jitter.
    shift
        Relative standard deviation of the frequency, from set-ups and model [-].
    nominal
        Centre of the box of slider positions, shape (s,) [m]; None for rest under the static load.
    numerical
        Standard deviations of the limits by the numerical error of the model, taken from a similar model, lower then
        upper, shape (2, n) [SI unit of each sensor]; 0 by default. The error is common to the readings of a family.
    seed
        Seed of the slider states and random histories of the bands.
    """

    groups: Sequence[FamilyGroup]
    errors: RepeatErrors
    shift: float
    nominal: Float[NDArray[np.float64], " s"] | None = None
    numerical: Both | float = 0.0
    seed: int = SEED

    @property
    def families(self) -> list[Family]:
        """Families of all groups."""
        return [family for group in self.groups for family in group.families]

    @cached_property
    def value(self) -> Float[NDArray[np.float64], " n"]:
        """Readings of all families."""
        return np.concatenate([family.value for family in self.families])

    @cached_property
    def is_amplitude(self) -> Bool[NDArray[np.bool_], " n"]:
        """Whether a reading is an amplitude, rather than a mean, which may be negative."""
        harmonic = np.array([family.harmonic for family in self.families])
        return np.asarray(harmonic[self._family_number] > 0)

    def compute_limits(self, model: Model) -> FamilyLimits:
        """Limits of the sampled bands of a model at the readings.

        Raises
        ------
        BalanceError, NoSteadyState
            As `sample_bands`.
        """
        value, deviation = [], []
        for group in self.groups:
            bands = sample_bands(model, group.families, group.frequency, self.nominal, self.seed)
            for family in group.families:
                at = bands[family.sensor, family.harmonic, family.level].at(family.frequency, self.shift)
                noise = self.errors.noise[family.sensor, family.harmonic].deviation(family.value)
                value.append(at.value)
                # Widened at the readings: the noise at wide limits would be larger than that of the readings.
                both = np.broadcast_to(family.value, at.value.shape)
                deviation.append(np.hypot(family.widen(at.deviation, both), noise))
        # The score multiplies by the noise width of the family; a common error needs that of one reading.
        shared = self.numerical * SHARED_WIDTH / np.maximum(self._noise_width, SHARED_WIDTH)
        return FamilyLimits(np.concatenate(value, axis=1), np.hypot(np.concatenate(deviation, axis=1), shared))

    def score(self, limits: FamilyLimits) -> float:
        """Score of limits: how tightly they contain the readings, less is better [-].

        A reading at a frequency of the bands but without limits counts as outside by its absolute value.
        """
        covered, n_family = self._is_covered, len(self._n_set_up)
        number, x, noise_width = self._family_number[covered], self.value[covered], self._noise_width[covered]
        value, deviation = limits.value[:, covered], limits.deviation[:, covered]
        is_known = (np.isfinite(value) & np.isfinite(deviation)).all(axis=0)
        noise = noise_width * np.where(is_known, deviation, 0.0)
        low, high = np.where(is_known, value, 0.0) + np.array([-noise[0], noise[1]])
        outside = np.where(is_known, np.maximum(low - x, 0.0) + np.maximum(x - high, 0.0), np.abs(x))
        penalty = 2 * (self._n_reading[number] + 1) * outside
        size = self._size
        noise_size, width, penalty = (
            np.bincount(number, item, minlength=n_family) for item in (noise.sum(axis=0), high - low, penalty)
        )
        width = np.maximum(width / size, LEAST_WIDTH)
        filled = np.maximum(np.maximum(self._spread, noise_size) / size, LEAST_WIDTH)
        powers = WIDTH_POWERS / n_family
        evidence = powers * np.log(width) + np.maximum(self._n_set_up - powers, 0.0) * np.log(filled)
        return float(evidence.sum() + self._n_set_up @ np.log1p(penalty / size / width))

    @cached_property
    def _is_covered(self) -> Bool[NDArray[np.bool_], " n"]:
        """Whether the bands cover the frequency of a reading."""
        return np.concatenate(
            [is_covered(group.frequency, family.frequency) for group in self.groups for family in group.families]
        )

    @cached_property
    def _n_reading(self) -> Int[NDArray[np.int64], " families"]:
        """Readings of each family at frequencies of the bands."""
        return np.bincount(self._family_number[self._is_covered], minlength=len(self._n_set_up))

    @cached_property
    def _noise_width(self) -> Float[NDArray[np.float64], " n"]:
        """Standard deviations by which noise widens a band on either side."""
        return np.asarray(compute_noise_width(1 / (self._n_reading + 1))[self._family_number])

    @cached_property
    def _n_set_up(self) -> Int[NDArray[np.int64], " families"]:
        return np.array([len(set(family.set_ups)) for family in self.families])

    @cached_property
    def _family_number(self) -> Int[NDArray[np.int64], " n"]:
        return np.repeat(np.arange(len(self.families)), [family.n_point for family in self.families])

    @cached_property
    def _size(self) -> Float[NDArray[np.float64], " families"]:
        """Sum of the absolute readings of each family."""
        return np.maximum(self._sum(np.abs(self.value)), np.finfo(float).tiny)

    @cached_property
    def _spread(self) -> Float[NDArray[np.float64], " families"]:
        """Sum over the readings of each family of the range of all readings at the same point."""
        result = []
        for family in self.families:
            _, point = np.unique(number_points(family.curves), return_inverse=True)
            highest, lowest = np.full(point.max() + 1, -np.inf), np.full(point.max() + 1, np.inf)
            np.maximum.at(highest, point, family.value)
            np.minimum.at(lowest, point, family.value)
            result.append((highest - lowest)[point])
        return self._sum(np.concatenate(result))

    def _sum(self, values: Float[NDArray[np.float64], " n"]) -> Float[NDArray[np.float64], " families"]:
        """Sums over the readings of each family at frequencies of the bands."""
        covered = self._is_covered
        sums = np.bincount(self._family_number[covered], values[covered], minlength=len(self._n_set_up))
        return np.asarray(sums, dtype=np.float64)


def list_numerical_errors(families: Sequence[Family], verdicts: Sequence[FamilyVerdict]) -> Both:
    """Standard deviations of limits by numerical error at the n readings of families, shape (2, n) [unit of each].

    Parameters
    ----------
    families
        Families in the order of their target.
    verdicts
        Families with the limits of a model; the errors of a family that is not among them are 0.
    """
    bands = {(item.family.sensor, item.family.harmonic, item.family.level): item.band for item in verdicts}
    return np.concatenate(
        [
            np.zeros((2, family.n_point)) if band is None else band.interpolate_error(family.frequency)
            for family in families
            for band in [bands.get((family.sensor, family.harmonic, family.level))]
        ],
        axis=1,
    )


def sample_bands(
    model: Model,
    families: Sequence[Family],
    frequency: Float[NDArray[np.float64], " f"],
    nominal: Float[NDArray[np.float64], " s"] | None = None,
    seed: int = SEED,
) -> dict[tuple[str, int, float], PredictedBand]:
    """Bands reached by a population and random histories, by sensor, harmonic and level; they lie within the limits.

    Raises
    ------
    BalanceError, NoSteadyState
        As `hbsolve.limits.response_limits.limit_problem`.
    """
    sensors = {item.name: item for item in model.sensors}
    channels = list(dict.fromkeys((family.sensor, family.harmonic) for family in families))
    objectives = [make_reading_objective(model, sensors[name], harmonic) for name, harmonic in channels]
    balance = HarmonicBalance(system=model.system, n_harmonic=model.n_harmonic, n_sample=model.n_sample)
    problem = limit_problem(balance, objectives[0], nominal=nominal)
    problem = limit_problem(balance, objectives[0], nominal=problem.box.middle, reach=problem.box.static)
    omega = 2 * np.pi * frequency * (1 + model.frequency_shift.get("jointed", 0.0))
    population = choose_starting_sliders(
        balance, balance.at(float(omega[0])), problem.sliders, problem.box, POPULATION, seed
    )
    result = {}
    for level in sorted({family.level for family in families}):
        curve = LimitCurve(problem=problem, level=level, angular_frequency=omega)
        states = share_histories(curve, range(len(omega)), objectives, population, SAMPLES, (seed,), branches=False)
        reached = np.array([states.reached[at] for at in range(len(omega))])
        for number, (name, harmonic) in enumerate(channels):
            sensor = sensors[name]
            order = DERIVATIVE[sensor.quantity] if isinstance(sensor, Sensor) else 0
            gain = sensor.gain if harmonic == 0 else abs(sensor.gain)
            value = np.sort(gain * reached[:, :, number].T * omega**order, axis=0)
            result[name, harmonic, level] = PredictedBand(
                frequency=frequency, value=value, deviation=np.zeros_like(value), jump=np.zeros(value.shape, dtype=bool)
            )
    return result
