"""A finer model for comparison with the calibrated one: the discretisation error that remains after calibration.

A coarse mesh is too stiff, and calibration compensates most of it by a softer material. The remaining error differs
from the difference at equal parameters, which is mostly a shift of resonances. The finer model is therefore calibrated
to the prediction of the model before the two are compared; the change of its parameters is a measure of the uncertainty
of those of the model.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from correlation.model import Model
from correlation.noise.covariance import Whitening
from diagnosis.candidate.effect import Effect
from diagnosis.fit.calibration import Ending, Fit, calibrate
from diagnosis.fit.comparison import EXCLUDED_FACTOR, Comparison
from diagnosis.fit.fit_parameter import Unknowns, Values


@dataclass(frozen=True, kw_only=True, eq=False)
class FinerModel:
    """A finer model.

    Parameters
    ----------
    unknowns
        Calibration parameters of the finer model, then effects with the same values as in the model.
    n_calibration
        Number of calibration parameters, which come first [-].
    shift
        Calibration parameters less those of the model at equal predictions, shape (n_calibration,); None before
        calibration.
    """

    unknowns: Unknowns
    n_calibration: int
    shift: Values | None = None

    def compose(self, values: Values) -> Model:
        """Finer model that corresponds to the model with these values."""
        shifted = np.array(values)
        if self.shift is not None:
            shifted[: self.n_calibration] += self.shift
        return self.unknowns.compose(self.unknowns.clipped(shifted))

    def with_effects(self, effects: Sequence[Effect]) -> "FinerModel":
        """The same with more effects."""
        return replace(self, unknowns=replace(self.unknowns, effects=(*self.unknowns.effects, *effects)))

    def calibrated(self, comparison: Comparison, fit: Fit) -> "FinerModel":
        """The same calibrated to the prediction of the model, from its last values; added effects are not fitted.

        Parameters
        ----------
        comparison
            Comparison with the measurements, whose noise gives the weights.
        fit
            Fit of the model.
        """
        n, predicted = self.n_calibration, comparison.features.of_values(fit.prediction.value)
        if not n:
            return replace(self, shift=np.zeros(0))
        own, added = fit.values[:n], fit.values[n:]
        # The order of the effects matters: zeta does not scale an added dashpot.
        free = replace(self.unknowns, prior=self.unknowns.prior[:n], centre=own, pinned=tuple(added.tolist()))
        # Points without a steady state of the model have no weight.
        there = np.isfinite(predicted)
        deviation = comparison.whitening.deviation * np.where(there, 1.0, EXCLUDED_FACTOR)
        target = replace(
            comparison,
            measured=np.where(there, predicted, comparison.measured),
            whitening=Whitening(deviation=deviation),
        )
        start = own if self.shift is None else own + self.shift
        return replace(self, shift=calibrate(target, free, start, fit.prediction, ending=Ending.QUICK).values - own)


def widen_by_finer_models(fit: Fit, finer: Sequence[FinerModel]) -> Fit:
    """The fit with the covariance of its calibration parameters widened by their shifts in finer models."""
    covariance = np.array(fit.covariance)
    for item in finer:
        if item.shift is not None:
            covariance[: item.n_calibration, : item.n_calibration] += np.outer(item.shift, item.shift)
    return replace(fit, covariance=covariance)
