"""Gross misfits: distance of a model from some readings of motions, whatever its cause."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Complex, Int
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign
from correlation.model import Model
from correlation.prediction import Points, Predictor

#: Residual of predicted motions relative to the linear ones: wrong units, signs and sensors are gross [-].
ROUGH_TOLERANCE = 1e-4
#: Misfit of motions above which other levels and stiffnesses are tried: median of a logarithm [-].
GROSS = 0.7


@dataclass(frozen=True, kw_only=True, eq=False)
class MotionReadings:
    """Some readings of motions.

    Parameters
    ----------
    points
        Points, m of them.
    value
        Mean of the repeats, shape (m,) [SI].
    stated
        Prediction of the case, shape (m,) [SI].
    """

    points: Points
    value: Complex[NDArray[np.complex128], " m"]
    stated: Complex[NDArray[np.complex128], " m"]

    def where(self, rows: Bool[NDArray[np.bool_], " m"] | Int[NDArray[np.int64], " n"]) -> "MotionReadings":
        """Rows of a mask, or of indices."""
        return MotionReadings(points=self.points.where(rows), value=self.value[rows], stated=self.stated[rows])

    def some(self, most: int) -> "MotionReadings":
        """An evenly spaced selection of limited size; a constant step of rows could select one sensor alone."""
        n = len(self.value)
        return self.where(np.linspace(0, n - 1, min(n, most)).round().astype(np.int64))

    @property
    def stated_misfit(self) -> float:
        """Misfit of the case [-]."""
        return self.misfit(self.stated)

    def misfit(self, prediction: Complex[NDArray[np.complex128], " m"]) -> float:
        """Median absolute log ratio to a prediction [-]; infinite unless it has most of the readings."""
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.abs(np.log(np.abs(self.value) / np.abs(prediction)))
        there = np.isfinite(ratio)
        return float(np.median(ratio[there])) if 2 * there.sum() > len(ratio) else np.inf

    def misfit_of(self, model: Model | None) -> float:
        """Misfit of a model; infinite for None."""
        if model is None:
            return np.inf
        return self.misfit(Predictor(points=self.points, tolerance=ROUGH_TOLERANCE).predict(model).value)


def find_motions(campaign: Campaign, points: Points) -> Bool[NDArray[np.bool_], " k"]:
    """Mask of the fundamentals of motions of known size, shape (k,): none for a drive without calibration."""
    known = [sensor.name for sensor in campaign.sensors if sensor.line is None and sensor.calibrated]
    names = np.array(known if campaign.drive.calibrated else [], dtype=np.str_)
    return np.asarray(np.isin(points.sensor, names) & (points.harmonic == 1))
