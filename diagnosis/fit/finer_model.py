"""A finer model beside the one that is calibrated: what a coarse mesh does that no calibration makes good.

A coarse mesh is too stiff, and calibration finds a softer material: most of the error is gone then. What is left has
little to do with the difference at the same parameters, which is a shifted resonance above all. The finer model is
therefore calibrated to what the model says before the two are compared, and what its parameters need for it tells how
uncertain those of the model are.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from correlation.model import Model
from correlation.noise.whitening import Whitening
from diagnosis.candidate.effect import Effect
from diagnosis.fit.calibration import Fit, calibrate
from diagnosis.fit.comparison import FAINT, Comparison
from diagnosis.fit.unknowns import Unknowns, Values


@dataclass(frozen=True, kw_only=True, eq=False)
class FinerModel:
    """A finer model.

    Parameters
    ----------
    unknowns
        Its calibration parameters, and effects with the values of the model's own.
    n_calibration
        So many of its values, the first ones, are calibration parameters [-].
    shift
        What its calibration parameters need beyond the model's for it to say the same, shape (n_calibration,); none
        before it was calibrated.
    """

    unknowns: Unknowns
    n_calibration: int
    shift: Values | None = None

    def compose(self, values: Values) -> Model:
        """The finer model beside the model with these values."""
        shifted = np.array(values)
        if self.shift is not None:
            shifted[: self.n_calibration] += self.shift
        return self.unknowns.compose(self.unknowns.clipped(shifted))

    def with_effects(self, effects: Sequence[Effect]) -> "FinerModel":
        """With more effects."""
        return replace(self, unknowns=replace(self.unknowns, effects=(*self.unknowns.effects, *effects)))

    def calibrated(self, comparison: Comparison, fit: Fit) -> "FinerModel":
        """Calibrated to what the model says, from where it was calibrated before; what was added is as it is.

        Parameters
        ----------
        comparison
            Of the measurements; their noise says which differences matter.
        fit
            The model beside them.
        """
        n, said = self.n_calibration, comparison.features.of_values(fit.prediction.value)
        if not n:
            return replace(self, shift=np.zeros(0))
        own, added = fit.values[:n], fit.values[n:]
        # The order of the effects matters: damping does not scale a dashpot that was added.
        free = replace(self.unknowns, prior=self.unknowns.prior[:n], centre=own, pinned=tuple(added.tolist()))
        # What the model does not find tells nothing, whatever was measured there.
        there = np.isfinite(said)
        deviation = comparison.whitening.deviation * np.where(there, 1.0, FAINT)
        target = replace(
            comparison, measured=np.where(there, said, comparison.measured), whitening=Whitening(deviation=deviation)
        )
        start = own if self.shift is None else own + self.shift
        return replace(self, shift=calibrate(target, free, start, fit.prediction, quick=True).values - own)


def widen_by_finer_models(fit: Fit, finer: Sequence[FinerModel]) -> Fit:
    """The fit with calibration parameters that are as uncertain as finer models, which need others, say."""
    covariance = np.array(fit.covariance)
    for each in finer:
        if each.shift is not None:
            covariance[: each.n_calibration, : each.n_calibration] += np.outer(each.shift, each.shift)
    return replace(fit, covariance=covariance)
