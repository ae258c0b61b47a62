r"""Model error: differences between model and measurements beyond noise, friction histories and stated errors.

A real structure is never exactly its model plus one effect. Natural frequencies and damping have errors, which depend
on the slipping contacts, and each curve has an additional error. The covariance of the differences is then

.. math:: C = S + s_f^2 F F^T + s_d^2 D D^T + s_r^2 (G G^T + \operatorname{diag} g^2) + s_h^2 H H^T

with the changes F and D of all features by a relative error of natural frequencies and of damping, of each
configuration at each level, and the modulus g of each feature. A column of G is g on a quarter of one curve, since
model errors are smooth in frequency. Errors of mode shapes change a sensor's responses in the same way at all levels: a
column of H is a relative change of one sensor at all frequencies or on a quarter of them. The sizes s maximise the
posterior density

.. math:: -2 \ln p = r^T C^{-1} r + \ln \det C + \sum_i 2 \ln (1 + (s_i / s_{0i})^2)

with Cauchy priors: small errors are usual, and large ones are accepted if the data show them.

References
----------
Kennedy and O'Hagan, Bayesian calibration of computer models, J. R. Stat. Soc. B 63 (2001), 425-464: discrepancy of a
model as a part of the covariance; Gelman, Prior distributions for variance parameters, Bayesian Anal. 1 (2006),
515-534: half-Cauchy priors of standard deviations.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.noise.covariance import Whitening
from correlation.noise.error_density import estimate_error_size
from correlation.noise.error_patterns import ErrorPatterns
from correlation.noise.error_size import NO_ERROR, ErrorSize, compute_prior

Vector = Float[NDArray[np.float64], " m"]


@dataclass(frozen=True, kw_only=True, eq=False)
class ModelErrorCovariance:
    """Model error in a covariance: the covariance without it, its patterns, its usual and its estimated size."""

    without: Whitening
    patterns: ErrorPatterns
    usual: ErrorSize
    size: ErrorSize = NO_ERROR

    @property
    def whitening(self) -> Whitening:
        """Covariance with the model error."""
        return self.patterns.widen(self.without, self.size)

    def estimated(self, difference: Vector) -> "ModelErrorCovariance":
        """The same with the size estimated from a difference of measured and predicted features, shape (m,)."""
        return replace(self, size=estimate_error_size(self.without, self.patterns, self.usual, difference))

    @property
    def prior(self) -> float:
        """-2 ln of the prior density of the size; 0 without an error."""
        return compute_prior(self.size, self.usual)
