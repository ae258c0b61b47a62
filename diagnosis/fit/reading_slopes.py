"""Derivatives of predicted readings with respect to the parameters of effects."""

import numpy as np
from jaxtyping import Complex
from numpy.typing import NDArray

from correlation.model import Model
from correlation.prediction import Prediction, Predictor
from diagnosis.fit.fit_parameter import Unknowns, Values
from diagnosis.fit.tangent import differentiate

#: Step of a difference of predictions, relative to the typical size of a parameter. The errors of the slope by the
#: tolerance of Newton's method and by the curvature at the onset of slip are then both about 2 %.
STEP = 0.01


def differentiate_readings(
    predictor: Predictor, unknowns: Unknowns, values: Values, model: Model, prediction: Prediction, first: int = 0
) -> Complex[NDArray[np.complex128], "k p"]:
    """Derivatives of predicted coefficients from value number `first` on, shape (k, p - first).

    By the implicit function theorem; by a difference of predictions for parameters that move points.

    Parameters
    ----------
    predictor
        Predictor of the points.
    unknowns, values
        Parameters and their values, shape (p,).
    model, prediction
        Model with these values, and its prediction.
    first
        Index of the first value to differentiate with respect to.
    """
    changes = differentiate(unknowns.compose, values, unknowns.size, unknowns.bounds, first)
    known = [change for change in changes if change is not None]
    slopes = np.zeros((len(prediction.value), len(changes)), dtype=np.complex128)
    if known:
        slopes[:, [change is not None for change in changes]] = predictor.derivatives(model, prediction, known)
    for number, change in enumerate(changes):
        if change is None:
            moved, step = unknowns.neighbour(values, first + number, STEP)
            slopes[:, number] = (predictor.predict(moved, prediction).value - prediction.value) / step
    return slopes
