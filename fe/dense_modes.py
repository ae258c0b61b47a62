"""Modes of small dense matrices, with low modes accurate to round-off of their own size."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from jaxtyping import Float
from numpy.typing import NDArray

from fe.blas_threads import on_one_blas_thread

#: Eigenvalue, relative to the highest, below which a mode is a rigid-body motion: a dense solver cannot distinguish it
#: from zero.
RIGID = 1e-13


@dataclass(frozen=True, kw_only=True, eq=False)
class DenseModes:
    r"""All eigenpairs of :math:`M v = \mu (K + \sigma M) v`, which are those of K and M in another form.

    With V^T (K + sigma M) V = I and V^T M V = diag(mu),

    .. math:: V^T (K - \omega^2 M) V = I - (\sigma + \omega^2)\, \mathrm{diag}(\mu), \qquad
              \lambda = 1 / \mu - \sigma

    The error of a dense solver is round-off times the largest eigenvalue. In this form the largest mu belong to the
    lowest modes, which are accurate to about 1e-15; in the form K phi = lambda M phi stiff contact nodes reduce their
    accuracy (a ratio of 1e8 between the highest and the lowest lambda costs 8 digits). The highest lambda lose digits
    instead, which does not affect compliances.

    Parameters
    ----------
    shift
        Shift sigma >= 0, of the size of the lowest eigenvalue that is not zero [rad^2/s^2].
    mu
        Eigenvalues, descending, shape (r,) [s^2/rad^2].
    shapes
        Eigenvectors V, normalised as above, shape (r, r).
    """

    shift: float
    mu: Float[NDArray[np.float64], " r"]
    shapes: Float[NDArray[np.float64], "r r"]

    @property
    def lambda_(self) -> Float[NDArray[np.float64], " r"]:
        """Squared angular frequencies, ascending [rad^2/s^2]; negative round-off is possible for rigid-body motions."""
        return np.asarray(1 / self.mu - self.shift)

    @property
    def frequency(self) -> Float[NDArray[np.float64], " r"]:
        """Natural frequencies, ascending; zero within round-off for rigid-body motions [Hz]."""
        return np.asarray(np.sqrt(self.lambda_.clip(min=0)) / (2 * np.pi))

    @property
    def mode_shapes(self) -> Float[NDArray[np.float64], "r r"]:
        """Mass-normalised mode shapes, the largest entry of each positive, shape (r, r) [kg^-1/2]."""
        shapes = self.shapes / np.sqrt(self.mu)
        return np.asarray(shapes * np.sign(shapes[np.abs(shapes).argmax(axis=0), np.arange(len(self.mu))]))


@on_one_blas_thread
def compute_dense_modes(
    mass: Float[NDArray[np.float64], "r r"], stiffness: Float[NDArray[np.float64], "r r"]
) -> DenseModes:
    """Compute all modes of a small system; the stiffness may be singular.

    Parameters
    ----------
    mass
        Mass matrix, symmetric positive definite, shape (r, r) [kg].
    stiffness
        Stiffness matrix, symmetric positive semi-definite, shape (r, r) [N/m].

    Raises
    ------
    numpy.linalg.LinAlgError
        The mass is not positive definite, or the stiffness not semi-definite.
    """
    rough = scipy.linalg.eigh(stiffness, mass, eigvals_only=True)
    if rough[0] < -1e-9 * abs(rough[-1]):
        raise np.linalg.LinAlgError(f"the stiffness is indefinite: lowest eigenvalue {rough[0]:.3g} rad^2/s^2")
    # A negative eigenvalue is the round-off of a rigid-body motion, and bounds that of other rigid-body motions.
    elastic = rough[rough > max(RIGID * rough[-1], -10 * rough[0])]
    shift = float(elastic[0]) if elastic.size else 1.0
    mu, shapes = scipy.linalg.eigh(mass, stiffness + shift * mass)
    return DenseModes(shift=shift, mu=mu[::-1], shapes=shapes[:, ::-1])
