"""Modes of small dense matrices, with the low ones accurate to their own last digits."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from jaxtyping import Float
from numpy.typing import NDArray

from fe.blas_threads import on_one_blas_thread

#: An eigenvalue this far below the highest is a rigid-body motion: a dense solve cannot distinguish it from zero.
RIGID = 1e-13


@dataclass(frozen=True, kw_only=True, eq=False)
class DenseModes:
    r"""All eigenpairs of :math:`M v = \mu (K + \sigma M) v`, which are those of K and M in another form.

    With V^T (K + sigma M) V = I and V^T M V = diag(mu),

    .. math:: V^T (K - \omega^2 M) V = I - (\sigma + \omega^2)\, \mathrm{diag}(\mu), \qquad
              \lambda = 1 / \mu - \sigma

    A dense solver errs by round-off times the largest eigenvalue it sees. In this form the largest mu are the lowest
    modes, so those are good to about 1e-15; in the form K phi = lambda M phi stiff contact nodes spoil them (a ratio
    of 1e8 between the highest and the lowest lambda costs 8 digits). What is lost instead, digits of the highest
    lambda, a compliance never sees.

    Parameters
    ----------
    shift
        sigma >= 0 [rad^2/s^2], of the size of the lowest eigenvalue that is not zero.
    mu
        Descending, shape (r,) [s^2/rad^2].
    shapes
        V, normalised as above, shape (r, r).
    """

    shift: float
    mu: Float[NDArray[np.float64], " r"]
    shapes: Float[NDArray[np.float64], "r r"]

    @property
    def lambda_(self) -> Float[NDArray[np.float64], " r"]:
        """Squared angular frequencies, ascending; those of rigid-body motions may be negative by round-off."""
        return np.asarray(1 / self.mu - self.shift)

    @property
    def frequency(self) -> Float[NDArray[np.float64], " r"]:
        """Natural frequencies, ascending; zero of rigid-body motions [Hz]."""
        return np.asarray(np.sqrt(self.lambda_.clip(min=0)) / (2 * np.pi))

    @property
    def mode_shapes(self) -> Float[NDArray[np.float64], "r r"]:
        """Mass-normalised, the largest entry of each positive, shape (r, r) [kg^-1/2]."""
        shapes = self.shapes / np.sqrt(self.mu)
        return np.asarray(shapes * np.sign(shapes[np.abs(shapes).argmax(axis=0), np.arange(len(self.mu))]))


@on_one_blas_thread
def compute_dense_modes(
    mass: Float[NDArray[np.float64], "r r"], stiffness: Float[NDArray[np.float64], "r r"]
) -> DenseModes:
    """All modes of a small system; the stiffness may be singular.

    Parameters
    ----------
    mass
        Symmetric positive definite, shape (r, r) [kg].
    stiffness
        Symmetric positive semi-definite, shape (r, r) [N/m].

    Raises
    ------
    numpy.linalg.LinAlgError
        The mass is not positive definite, or the stiffness not semi-definite.
    """
    rough = scipy.linalg.eigh(stiffness, mass, eigvals_only=True)
    if rough[0] < -1e-9 * abs(rough[-1]):
        raise np.linalg.LinAlgError(f"the stiffness is indefinite: lowest eigenvalue {rough[0]:.3g} rad^2/s^2")
    # A negative eigenvalue is the round-off of a rigid-body motion, and tells how large that of others may be.
    elastic = rough[rough > max(RIGID * rough[-1], -10 * rough[0])]
    shift = float(elastic[0]) if elastic.size else 1.0
    mu, shapes = scipy.linalg.eigh(mass, stiffness + shift * mass)
    return DenseModes(shift=shift, mu=mu[::-1], shapes=shapes[:, ::-1])
