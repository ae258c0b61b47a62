"""Natural frequencies and mode shapes of a sparse system, supported or free, by block Lanczos on one factorisation."""

from dataclasses import dataclass, replace
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np
import scipy.linalg
from jaxtyping import Float
from numpy.typing import NDArray

from fe.blas_threads import on_one_blas_thread
from fe.errors import SupportError
from fe.material import Material
from fe.mesh import Mesh
from fe.notebook import Tabular
from fe.sparse.block_lanczos import COLUMNS_PER_MODE, NoConvergence, block_lanczos
from fe.sparse.factor import Symmetric
from fe.sparse.node_matrix import BlockProduct
from fe.sparse.solver import Definiteness, Factor, SingularMatrix, factorise
from fe.sparse.symmetry import check_symmetric
from fe.system import LinearSystem
from geometry.errors import InputError

if TYPE_CHECKING:
    import pandas

SINGULAR = (
    "the stiffness is singular to working accuracy: the supports leave a rigid-body motion or a mechanism, or are "
    "too soft; fix more nodes or stiffen the grounded springs"
)
#: Number of degrees of freedom up to which a dense solver is used, which is faster and cannot miss a mode.
MAX_DENSE = 600
#: Ratio phi^T K phi / phi^T diag(K) phi below which a mode is a motion without strain: about 1e-16 for rigid motions
#: because of round-off, 1e-9 for the first mode of a slender blade.
STRAINLESS = 1e-13
#: Number of shapes that are normalised at a time.
AT_ONCE = 16


@dataclass(frozen=True, kw_only=True, eq=False)
class ModeSet(Tabular):
    """Modes in ascending order of frequency.

    Parameters
    ----------
    angular_frequency
        Angular frequencies, shape (m,) [rad/s].
    damping_ratio
        Modal damping ratios, phi^T C phi / (2 omega), shape (m,) [-].
    mode_shapes
        Mass-normalised mode shapes, phi^T M phi = 1, shape (n, m) [kg^-1/2]; the largest component of each is positive.
    """

    angular_frequency: Float[NDArray[np.float64], " m"]
    damping_ratio: Float[NDArray[np.float64], " m"]
    mode_shapes: Float[NDArray[np.float64], "n m"]

    @property
    def frequency(self) -> Float[NDArray[np.float64], " m"]:
        """Natural frequencies, shape (m,) [Hz]."""
        return np.asarray(self.angular_frequency / (2 * np.pi))

    def to_pandas(self) -> "pandas.DataFrame":
        """Frequency and damping ratio of each mode, numbered from 1."""
        import pandas

        return pandas.DataFrame(
            {"frequency [Hz]": self.frequency, "damping ratio [-]": self.damping_ratio},
            index=pandas.RangeIndex(1, len(self.frequency) + 1, name="mode"),
        )


@on_one_blas_thread
def modes(system: LinearSystem, n_mode: int, factor: Factor | None = None) -> ModeSet:
    """Compute the lowest modes of K phi = omega^2 M phi.

    Parameters
    ----------
    system
        Supported system, with positive definite stiffness.
    n_mode
        Number of modes [-]; at most the number of degrees of freedom.
    factor
        Factor of the system's stiffness, if available.

    Raises
    ------
    InputError
        Fewer than one mode, or more modes than degrees of freedom.
    ValueError
        A matrix is complex, not finite or not symmetric.
    SupportError
        The stiffness is singular to working accuracy: a rigid-body motion or a mechanism is free, or a support is so
        soft that round-off exceeds its stiffness.
    """
    lambda_, shapes = find_lowest_eigenpairs(system.stiffness, system.mass, n_mode, factor)
    angular_frequency = np.sqrt(lambda_.clip(min=0))
    modal_damping = np.einsum("nm,nm->m", shapes, system.damping @ shapes)
    damping_ratio = np.divide(
        modal_damping, 2 * angular_frequency, out=np.zeros_like(modal_damping), where=angular_frequency > 0
    )
    return ModeSet(angular_frequency=angular_frequency, damping_ratio=damping_ratio, mode_shapes=shapes)


def find_lowest_eigenpairs(
    stiffness: Symmetric, mass: Symmetric, n_mode: int, factor: Factor | None = None
) -> tuple[Float[NDArray[np.float64], " m"], Float[NDArray[np.float64], "n m"]]:
    """Lowest eigenvalues [rad^2/s^2], ascending, and mass-normalised eigenvectors; arguments as in `modes`."""
    for item in (stiffness, mass):
        check_symmetric(item)
    n = stiffness.shape[0]
    product: Symmetric | BlockProduct = mass
    if not 1 <= n_mode <= n:
        raise InputError(f"{n_mode} modes were requested from a system with {n} degrees of freedom: give 1 to {n}")
    if n <= MAX_DENSE or n_mode > n // 3:
        dense_mass = mass.toarray()
        lambda_, shapes = scipy.linalg.eigh(stiffness.toarray(), dense_mass, subset_by_index=(0, n_mode - 1))
    else:
        try:
            if factor is None:
                factor = factorise(stiffness, Definiteness.POSITIVE, n_column=COLUMNS_PER_MODE * n_mode)
            product = BlockProduct(mass)
            lambda_, shapes = block_lanczos(factor, product, n_mode)
        except (SingularMatrix, NoConvergence) as error:
            raise SupportError(SINGULAR) from error
    # A few columns at a time and in place, because memory is short at the end of a reduction.
    for first in range(0, n_mode, AT_ONCE):
        part = shapes[:, first : first + AT_ONCE]
        part /= np.sqrt(np.einsum("nm,nm->m", part, product @ part))
        part *= np.sign(part[np.abs(part).argmax(axis=0), np.arange(part.shape[1])])
    # A singular stiffness may pass the factorisation because of round-off in the last pivots; its modes reveal it.
    lowest = shapes[:, 0]
    if lowest @ (stiffness @ lowest) < STRAINLESS * (lowest @ (stiffness.diagonal() * lowest)):
        raise SupportError(SINGULAR)
    return lambda_, shapes


#: Square root of the shift over the ratio of shear-wave speed to size: below the first elastic mode even of a slender
#: body, and far above the round-off of rigid-body modes.
SHIFT_FACTOR = 0.05
#: Squared frequency, relative to the shift, below which it is round-off: rigid-body modes have about 1e-9.
RIGID = 1e-5


def compute_free_modes(system: LinearSystem, mesh: Mesh, material: Material, n_mode: int) -> ModeSet:
    """Compute the lowest modes of a system whose supports, if any, leave rigid-body motions free.

    The mass times a shift is added to the stiffness, which makes it definite, and the shift is subtracted from the
    squared frequencies. Frequencies of rigid-body modes are exactly zero.

    Parameters
    ----------
    system
        System of the whole mesh or of a part of its degrees of freedom.
    mesh, material
        Mesh and material of the body; shear-wave speed over size is the scale of the shift.
    n_mode
        Number of modes, including rigid-body modes [-].
    """
    size = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    shift = (SHIFT_FACTOR * sqrt(material.shear / material.density) / size) ** 2
    result = modes(system.shifted(shift), n_mode)
    squared = result.angular_frequency**2 - shift
    frequency = np.sqrt(np.where(squared > RIGID * shift, squared, 0.0))
    # The ratio was computed with the shifted frequency; it is zero for rigid-body modes.
    ratio = result.damping_ratio * result.angular_frequency
    ratio = np.divide(ratio, frequency, out=np.zeros_like(ratio), where=frequency > 0)
    return replace(result, angular_frequency=frequency, damping_ratio=ratio)
