"""Errors of natural frequencies as fit parameters, where readings depend on them nonlinearly.

The error of a mesh shifts each natural frequency slightly. Near a sharp resonance a shift by a fraction of its width
changes readings so much that a linear mode of the covariance is wrong; there it is a parameter with a prior.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model
from correlation.noise.error_patterns import compute_moduli
from correlation.noise.free_mode import FreeModes
from correlation.noise.nuisance import Budget, ModelFeatures, find_highest_frequency
from diagnosis.candidate.effect import EffectParameter
from diagnosis.fit.calibration_parameter import MAX_PRIOR_RESIDUAL, CalibrationParameter
from diagnosis.fit.weighting import Measured

#: Factor on the standard deviation of a mesh error in the prior of a fit, since it is stated by rule of thumb [-].
PRIOR_WIDENING = 1.5
#: An error is fitted if one standard deviation of it changes a reading by more than this share [-].
SHARP_CHANGE = 0.1


@dataclass(frozen=True, kw_only=True, eq=False)
class FrequencyCorrection(CalibrationParameter):
    """Factor on the natural frequencies of the structure with contacts, in addition to the factors without contacts.

    It accounts for errors of all other modes and of their shapes.

    Parameters
    ----------
    n_dof
        Degrees of freedom of the model.
    """

    n_dof: int

    is_of_case = False

    @property
    def stated_deviation(self) -> float:
        """Standard deviation stated in the case [-]."""
        return self.deviation / PRIOR_WIDENING

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """Model with the factor; 1 changes nothing. A finer model has errors of its own."""
        (factor,) = values
        return model if model.system.n_dof != self.n_dof else model.with_frequency_shift("jointed", 1 / factor - 1)


@dataclass(frozen=True, kw_only=True, eq=False)
class ModeCorrection(FrequencyCorrection):
    """Factor on one natural frequency of the structure without its contacts.

    Parameters
    ----------
    number
        Index of the mode, in order of frequency.
    rate
        Derivative of the stiffness matrix with respect to the factor, shape (n, n) [N/m].
    """

    number: int
    rate: Float[NDArray[np.float64], "n n"]

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """Model with the factor; 1 changes nothing. A finer model has errors of its own."""
        (factor,) = values
        stiffness = model.system.stiffness
        if model.system.n_dof != self.n_dof:
            return model
        return model.with_system(stiffness=stiffness + (factor - 1) * self.rate)


def list_mode_corrections(measured: Measured, model: Model, budget: Budget) -> tuple[FrequencyCorrection, ...]:
    """Errors of natural frequencies that must be parameters for these measurements.

    If the structure is measured without its contacts as well, its natural frequencies with contacts have an additional
    error.

    Parameters
    ----------
    measured
        Measurements.
    model, budget
        Model with the sensors of the measurements, and its numerical error.
    """
    if not budget.frequency:
        return ()
    prediction = measured.predictor.predict(model)
    nominal = ModelFeatures(measured.predictor.share(model), measured.features, model, prediction)
    tangents = FreeModes.below(model, find_highest_frequency(measured.observed.points)).frequency_errors()
    features = measured.features
    size = compute_moduli(features, features.of_values(prediction.value))
    change = budget.frequency * np.abs(nominal.slopes(tangents)) / np.where(size > 0, size, np.inf)[:, None]
    moved = np.nan_to_num(change[features.inverse[features.row]]).max(axis=0, initial=0.0)
    deviation = PRIOR_WIDENING * budget.frequency
    most = MAX_PRIOR_RESIDUAL * deviation
    factor = EffectParameter(
        name="factor", unit="-", lower=1 - most, upper=1 + most, typical=1 + deviation, vanishes=1.0
    )
    result: list[FrequencyCorrection] = []
    for number in np.flatnonzero(moved > SHARP_CHANGE).tolist():
        rate = tangents[number].free.matrices.stiffness
        assert rate is not None
        result.append(
            ModeCorrection(
                name=f"natural frequency {number + 1}", physics="Error of a natural frequency of the model.",
                deviation=deviation, parameters=(factor,), n_dof=model.system.n_dof, number=number, rate=rate,
            )
        )  # fmt: skip
    if result and len(np.unique(measured.observed.points.free)) > 1:
        result.append(
            FrequencyCorrection(
                name="natural frequencies with contacts", physics="Error of all other modes of the model.",
                deviation=deviation, parameters=(factor,), n_dof=model.system.n_dof,
            )
        )  # fmt: skip
    return tuple(result)
