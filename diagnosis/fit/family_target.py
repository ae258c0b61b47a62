r"""What a calibration onto families minimises: how tightly the bands of a model hold measured families.

Least squares on the mean of the repeats takes friction history for noise. Here the prediction is a band, and the score
comes from the mean width w of a band that noise widens by v in all, the mean interval score S, and the mean range r of
the readings at one frequency, of each of F families with c_f set-ups and n_f readings:

.. math:: C = \sum_f \left[\frac{2}{F} \ln \frac{w_f}{\bar x_f} + c_f \ln \frac{\bar S_{\alpha_f}}{w_f}
          + \left(c_f - \frac{2}{F}\right) \ln \frac{\max(r_f, v_f)}{\bar x_f}\right],
          \qquad \alpha_f = \frac{1}{n_f + 1} .

Readings that fill their bands evenly would have the likelihood of -c ln S in each family. But set-ups are made by the
same hands: they fill an unknown part of each band, and much the same part of all. With the ends a and b of this part
evenly distributed, and W the width of a band, many readings away from its ends have

.. math:: \int_0^W \!\! \int_a^W p(x | a, b)\, \frac{2}{W^2}\, db\, da \to W^{-2} .

A common factor of all widths is therefore told by two powers, however many families and readings there are; to take the
mean over families for this factor is a choice. The other powers are those of what the readings do fill, or of the noise
where that is wider: a model that makes its own noise wide, by steep flanks whose frequency is not sure, gains nothing.
A reading outside counts in each set-up; its curves up and down share one history. An error that all readings of a
family share, as that of the model's limits, is one draw, and widens the band as the noise of a family of one reading
would, by 0.67 standard deviations. That is a choice: in each set-up and level a larger one counts again. The score does
not depend on the size of a family, so that a static force near zero counts as much as a resonance: bands hold all
readings, and are hardly wider than that takes.

A search for limits is too slow for a fit: the band in the loop is what a population of slider states and random
histories reach, the same ones in every iteration, so that the score changes with the parameters alone. The limits
themselves judge the result.

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
from correlation.family.family import Family, common_points
from correlation.family.limit_reading import objective_of
from correlation.family.noise import RepeatErrors
from correlation.family.verdict import FamilyVerdict, compute_noise_width
from correlation.model import DERIVATIVE, Model, Sensor
from hbsolve.balance import HarmonicBalance
from hbsolve.limits.problem import LimitCurve
from hbsolve.limits.response_limits import limit_problem
from hbsolve.limits.shared_histories import share_histories
from hbsolve.limits.slider_bounds import starting_sliders

Both = Float[NDArray[np.float64], "2 n"]

#: Slider states and random histories of the band in the loop, and their seed.
POPULATION, SAMPLES, SEED = 8, 8, 5
#: Width of a band that is one line, over the mean of the readings [-].
LEAST_WIDTH = 1e-6
#: Standard deviations by which an error widens a band that all of its readings share: that of one reading.
SHARED_WIDTH = float(compute_noise_width(1 / 2))
#: Powers of a common factor of all widths.
WIDTH_POWERS = 2.0


class FamilyLimits(NamedTuple):
    """Limits at the n readings of a target, and the deviations by which a score widens them, lower then upper.

    These are standard deviations of noise, with errors that readings share as far as they widen a band.
    """

    value: Both
    """Shape (2, n) [SI unit of each sensor]; a reading of which one is NaN has no limits."""
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
        Standard deviation of the frequency, of set-ups and of the model, relative [-].
    nominal
        Centre of the box of slider positions, shape (s,) [m]; None for rest under the static load.
    numerical
        Standard deviations of the limits by the numerical error of the model, taken from a similar model, lower then
        upper, shape (2, n) [SI unit of each sensor]; 0 by default. The readings of a family share such an error.
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
        """Whether a reading is an amplitude and no mean, which may be negative."""
        harmonic = np.array([family.harmonic for family in self.families])
        return np.asarray(harmonic[self._family_number] > 0)

    def compute_limits(self, model: Model) -> FamilyLimits:
        """Limits of the sampled bands of a model at the readings.

        Raises
        ------
        BalanceError, NoSteadyState
            As `sampled_bands`.
        """
        value, deviation = [], []
        for group in self.groups:
            bands = sampled_bands(model, group.families, group.frequency, self.nominal, self.seed)
            for family in group.families:
                at = bands[family.sensor, family.harmonic, family.level].at(family.frequency, self.shift)
                noise = self.errors.noise[family.sensor, family.harmonic].deviation(family.value)
                value.append(at.value)
                # Of the readings themselves: wide limits would have more noise, of which the readings have none.
                both = np.broadcast_to(family.value, at.value.shape)
                deviation.append(np.hypot(family.widen(at.deviation, both), noise))
        # The score widens by the noise width of the family, what is shared by that of one reading.
        shared = self.numerical * SHARED_WIDTH / np.maximum(self._noise_width, SHARED_WIDTH)
        return FamilyLimits(np.concatenate(value, axis=1), np.hypot(np.concatenate(deviation, axis=1), shared))

    def score(self, limits: FamilyLimits) -> float:
        """How tightly limits hold the readings, less is better [-].

        A reading without limits, at a frequency of the bands, is outside by its own size.
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
        """Whether the frequency of a reading is one of the bands."""
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
        """Sum of the sizes of the readings of each family."""
        return np.maximum(self._sum(np.abs(self.value)), np.finfo(float).tiny)

    @cached_property
    def _spread(self) -> Float[NDArray[np.float64], " families"]:
        """Sum over the readings of each family of the range of the readings at their point."""
        result = []
        for family in self.families:
            _, point = np.unique(common_points(family.curves), return_inverse=True)
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
        Families over the limits of a model; of a family that is none of them the errors are 0.
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


def sampled_bands(
    model: Model,
    families: Sequence[Family],
    frequency: Float[NDArray[np.float64], " f"],
    nominal: Float[NDArray[np.float64], " s"] | None = None,
    seed: int = SEED,
) -> dict[tuple[str, int, float], PredictedBand]:
    """Bands that a population and random histories reach, by sensor, harmonic and level: within the limits.

    Raises
    ------
    BalanceError, NoSteadyState
        As `hbsolve.limits.response_limits.limit_problem`.
    """
    sensors = {item.name: item for item in model.sensors}
    channels = list(dict.fromkeys((family.sensor, family.harmonic) for family in families))
    objectives = [objective_of(model, sensors[name], harmonic) for name, harmonic in channels]
    balance = HarmonicBalance(system=model.system, n_harmonic=model.n_harmonic, n_sample=model.n_sample)
    problem = limit_problem(balance, objectives[0], nominal=nominal)
    problem = limit_problem(balance, objectives[0], nominal=problem.box.middle, reach=problem.box.static)
    omega = 2 * np.pi * frequency * (1 + model.frequency_shift.get("jointed", 0.0))
    population = starting_sliders(balance, balance.at(float(omega[0])), problem.sliders, problem.box, POPULATION, seed)
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
