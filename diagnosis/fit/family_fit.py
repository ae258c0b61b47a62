r"""Calibration onto families: parameters whose limits hold the measured families as tightly as possible.

Least squares on the mean of the repeats takes friction history for noise. Here the prediction is a band, and what is
minimised over the factors p is the sum of the logarithms of the interval scores of all families, each counted once per
curve of the family, c_f times, and the prior:

.. math:: \sum_f c_f \ln \frac{\bar S_{\alpha_f}}{\bar x_f} + \frac12 \sum_i \frac{(p_i - 1)^2}{\sigma_i^2},
          \qquad \alpha_f = \frac{1}{n_f + 1} .

The logarithm is that of the likelihood of readings spread evenly over a band as wide as the score. It does not depend
on the size of a family, so that a static force near zero counts as much as a resonance. A band must be wide enough for
all n readings of a family, and no wider. A search for limits is too slow for a fit: the band in the loop is what a
population of slider states and random histories reach, the same ones in every iteration, so that the score changes with
the parameters alone. The limits themselves judge the result.

References
----------
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), section 4: calibration by limits over repeated tests.
T. Gneiting and A. E. Raftery, Journal of the American Statistical Association 102 (2007), eq. 43.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.optimize
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.family.band import PredictedBand
from correlation.family.family import Family
from correlation.family.limit_reading import objective_of
from correlation.family.noise import RepeatErrors
from correlation.family.verdict import count_readings, judge_family
from correlation.model import DERIVATIVE, Model, Sensor
from diagnosis.fit.calibration_parameter import CalibrationParameter
from hbsolve.balance import HarmonicBalance
from hbsolve.errors import BalanceError, NoSteadyState
from hbsolve.limits.problem import LimitCurve
from hbsolve.limits.response_limits import limit_problem
from hbsolve.limits.shared_histories import share_histories
from hbsolve.limits.slider_bounds import starting_sliders

Values = Float[NDArray[np.float64], " p"]

#: Slider states and random histories of the band in the loop.
POPULATION, SAMPLES, SEED = 8, 8, 5
#: Score of a model without a steady state, and of a band that is one line with all readings on it [-].
HOPELESS, LEAST_SCORE = 1e6, 1e-6
#: First step of the simplex, in standard deviations of the prior, and when it ends: in them, and in the score.
STEP, CLOSE, FLAT = 0.5, 0.02, 1e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class FamilyFit:
    """Result of a calibration onto families.

    Parameters
    ----------
    values
        Factors, shape (p,) [-].
    before, after
        Objective at the start and at the end [-].
    n_evaluation
        Models whose bands were sampled [-].
    """

    values: Values
    before: float
    after: float
    n_evaluation: int


@dataclass(frozen=True, kw_only=True, eq=False)
class FamilyTarget:
    """Measured families and their errors, with the score of a model against them.

    Parameters
    ----------
    families
        Measured families.
    errors
        Noise and frequency jitter.
    frequency
        Frequencies of the band in the loop, rising, shape (f,) [Hz].
    shift
        Standard deviation of the frequency, of set-ups and of the model, relative [-].
    nominal
        Centre of the box of slider positions, shape (s,) [m]; None for rest under the static load.
    """

    families: Sequence[Family]
    errors: RepeatErrors
    frequency: Float[NDArray[np.float64], " f"]
    shift: float
    nominal: Float[NDArray[np.float64], " s"] | None = None

    @property
    def count(self) -> int:
        """Curves of all families [-]."""
        return sum(len(family.curves) for family in self.families)

    def score(self, model: Model) -> float:
        """Logarithms of the interval scores over the sampled bands of a model, each counted once per curve."""
        bands = sampled_bands(model, self.families, self.frequency, self.nominal)
        n_reading = count_readings(self.families)
        total = 0.0
        for family in self.families:
            band = bands[family.sensor, family.harmonic, family.level]
            noise = self.errors.noise[family.sensor, family.harmonic]
            verdict = judge_family(family, band, noise, shift=self.shift, n_reading=n_reading)
            size = max(verdict.score, LEAST_SCORE) if np.isfinite(verdict.score) else HOPELESS
            total += len(family.curves) * np.log(size)
        return float(total)


def fit_families(
    compose: Callable[[Values], Model],
    calibration_parameters: Sequence[CalibrationParameter],
    start: Values,
    target: FamilyTarget,
    *,
    most: int = 150,
    report: Callable[[float, float], None] | None = None,
) -> FamilyFit:
    """Minimise score and prior by the simplex method, from a fit to the mean.

    Parameters
    ----------
    compose
        Model with some values of the parameters, which has the sensors of the families.
    calibration_parameters
        With their priors about what changes nothing.
    start
        Values to start from, shape (p,) [unit of each].
    target
        Families, and the score of a model.
    most
        Evaluations at most [-].
    report
        Called with the number of evaluations, and their largest number [-].
    """
    centre = np.array([item.parameters[0].vanishes for item in calibration_parameters])
    deviation = np.array([item.deviation for item in calibration_parameters])
    lower = np.array([item.parameters[0].lower for item in calibration_parameters])
    upper = np.array([item.parameters[0].upper for item in calibration_parameters])
    count = 0

    def cost(scaled: Values) -> float:
        nonlocal count
        count += 1
        if report is not None:
            report(count, most)
        values = np.clip(centre + deviation * scaled, lower, upper)
        try:
            score = target.score(compose(values))
        except (BalanceError, NoSteadyState):
            score = target.count * np.log(HOPELESS)
        return float(score + 0.5 * np.sum(scaled**2))

    first = (np.clip(start, lower, upper) - centre) / deviation
    simplex = np.vstack([first, first + STEP * np.eye(len(first))])
    before = cost(first)
    result = scipy.optimize.minimize(
        cost, first, method="Nelder-Mead",
        options={"initial_simplex": simplex, "maxfev": most - 1, "xatol": CLOSE, "fatol": FLAT * target.count},
    )  # fmt: skip
    values = np.clip(centre + deviation * np.asarray(result.x), lower, upper)
    return FamilyFit(values=values, before=before, after=float(result.fun), n_evaluation=count)


def sampled_bands(
    model: Model,
    families: Sequence[Family],
    frequency: Float[NDArray[np.float64], " f"],
    nominal: Float[NDArray[np.float64], " s"] | None = None,
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
    population = starting_sliders(balance, balance.at(float(omega[0])), problem.sliders, problem.box, POPULATION, SEED)
    result = {}
    for level in sorted({family.level for family in families}):
        curve = LimitCurve(problem=problem, level=level, angular_frequency=omega)
        states = share_histories(curve, range(len(omega)), objectives, population, SAMPLES, (SEED,), branches=False)
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
