"""A finer model beside the one that is calibrated: what a coarse mesh does that no calibration makes good.

A coarse mesh is too stiff, and calibration finds a softer material: most of the error is gone then. What is left has
little to do with the difference at the same parameters, which is a shifted resonance above all. The finer model is
therefore calibrated to what the model says before the two are compared.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from correlation.test_model import TestModel
from correlation.whitening import Whitening
from diagnosis.calibration import Fit, calibrate
from diagnosis.comparison import Comparison
from diagnosis.effect.candidate import Effect
from diagnosis.unknowns import Unknowns, Values


@dataclass(frozen=True, kw_only=True, eq=False)
class FinerModel:
    """A finer model.

    Parameters
    ----------
    unknowns
        Its accepted parameters, and effects with the values of the model's own.
    n_accepted
        So many of its values, the first ones, are accepted parameters [-].
    shift
        What its accepted parameters need beyond the model's for it to say the same, shape (a,); none before it was
        calibrated.
    """

    unknowns: Unknowns
    n_accepted: int
    shift: Values | None = None

    def compose(self, values: Values) -> TestModel:
        """The finer model beside the model with these values."""
        shifted = np.array(values)
        if self.shift is not None:
            shifted[: len(self.shift)] += self.shift
        return self.unknowns.compose(self.unknowns.clipped(shifted))

    def with_effects(self, effects: Sequence[Effect]) -> "FinerModel":
        """With more effects."""
        return replace(self, unknowns=replace(self.unknowns, effects=(*self.unknowns.effects, *effects)))

    def calibrated(self, comparison: Comparison, fit: Fit) -> "FinerModel":
        """Calibrated to what the model says, with what was added as it is; itself if it was calibrated before.

        Parameters
        ----------
        comparison
            Of the measurements; their noise says which differences matter.
        fit
            The model beside them.
        """
        if self.shift is not None:
            return self
        of, values, n_accepted = self.unknowns, fit.values, self.n_accepted
        added = Unknowns(base=of.base, effects=of.effects[n_accepted:], prior=of.prior[n_accepted:])
        base = added.compose(values[n_accepted:])
        free = Unknowns(base=base, effects=of.effects[:n_accepted], prior=np.full(n_accepted, np.inf))
        said = comparison.features.of_values(fit.prediction.value)
        target = replace(
            comparison,
            measured=np.where(np.isfinite(said), said, comparison.measured),
            whitening=Whitening(deviation=comparison.whitening.deviation),
        )
        found = calibrate(target, free, values[:n_accepted], fit.prediction, quick=True)
        return replace(self, shift=found.values - values[:n_accepted])
