"""The stages of imported matrices: reading them, and reducing them beside the frequencies of the full system."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from numpy.typing import NDArray

from fe.damping import damped, rayleigh_damping
from fe.errors import MatrixFileError, SupportError
from fe.imported_matrices import ImportedMatrices, Rows, Units, read_matrices
from fe.matrix_file import MatrixSource
from fe.modal import STRAINLESS, modes
from fe.system import LinearSystem
from reduction.craig_bampton import craig_bampton
from reduction.rom import ReducedModel
from reduction.rom_error import rom_error
from study.store import stage

#: Frequencies that are compared.
N_FREQUENCY = 10
#: In a free structure, a frequency below this share of the highest compared one is no measure for a shift.
RIGID = 1e-4
#: Share of the first elastic eigenvalue that, times the mass, makes the stiffness of a free structure definite.
SHIFT = 0.1
#: Least shift as a share of the largest ratio of stiffness to mass on the diagonals: above round-off.
LEAST_SHIFT = 1e-11
#: Round-off in the strain of one rigid motion of a structure over that of another, at most.
MARGIN = 10.0

Frequencies = Float[NDArray[np.float64], " m"]


@dataclass(frozen=True, kw_only=True, eq=False)
class MatricesReduction:
    """A reduced model of imported matrices and how good it is.

    Parameters
    ----------
    rom
        The reduced model.
    frequency, rom_frequency
        The first ones (ten at most), full and reduced, shape (m,) [Hz]; rigid-body motions are 0.
    rom_error
        Estimated relative truncation error of each reduced frequency, shape (m,) [-].
    """

    rom: ReducedModel
    frequency: Frequencies
    rom_frequency: Frequencies
    rom_error: Frequencies

    @property
    def n_dof(self) -> int:
        """Free degrees of freedom of the full model [-]."""
        return len(self.rom.free)


@stage("imported matrices", rooms=("fe", "study.matrices_reduction"))
def imported_matrices(
    mass: MatrixSource, stiffness: MatrixSource, damping: MatrixSource | None, dofs: Path | None, units: Units
) -> ImportedMatrices:
    """Read and check the matrices; the files count by their contents."""
    return read_matrices(mass, stiffness, damping=damping, dofs=dofs, units=units)


@stage("reduced matrices", rooms=("fe", "reduction", "study.matrices_reduction"))
def reduced_matrices(
    system: LinearSystem,
    boundary: Mapping[str, Rows],
    n_mode: int,
    damping_ratio: float | None,
    provenance: Mapping[str, str],
) -> MatricesReduction:
    """Reduce, damp and compare with the full system.

    Parameters
    ----------
    system
        What the supports leave free.
    boundary
        Its rows by name.
    n_mode
        Fixed-interface modes [-].
    damping_ratio
        Of Rayleigh damping on the first elastic mode [-]; None keeps the damping of the system.
    provenance
        Travels with the reduced model.

    Raises
    ------
    MatrixFileError
        A mass or stiffness whose written digits leave the reduced model indefinite.
    """
    try:
        return _reduced(system, boundary, n_mode, damping_ratio, provenance)
    except np.linalg.LinAlgError as error:
        raise MatrixFileError(
            f"the modes of the reduced model cannot be found ({error}): check signs and units of mass and stiffness, "
            "and write them with more digits"
        ) from error


def _reduced(
    system: LinearSystem,
    boundary: Mapping[str, Rows],
    n_mode: int,
    damping_ratio: float | None,
    provenance: Mapping[str, str],
) -> MatricesReduction:
    rom = craig_bampton(system, boundary, n_mode, provenance)
    n_compared = min(N_FREQUENCY, rom.n_dof)
    reduced = rom.modes(n_compared).frequency
    try:
        full = modes(system, n_compared).frequency
    except SupportError:
        full = _free_frequency(system, reduced)
        reduced = np.where(full > 0, reduced, 0.0)
    if damping_ratio is not None and reduced.any():
        system = damped(system, rayleigh_damping(damping_ratio, float(reduced[reduced > 0][0])))
        projected = rom.recovery.T @ (system.damping @ rom.recovery)
        rom = replace(rom, damping=(projected + projected.T) / 2)
    return MatricesReduction(
        rom=rom,
        frequency=full,
        rom_frequency=reduced,
        rom_error=np.where(reduced > 0, rom_error(system, rom, n_compared), 0.0),
    )


def _free_frequency(system: LinearSystem, reduced: Frequencies) -> Frequencies:
    """Frequencies of a structure that nothing holds, by a shift; 0 of motions without strain [Hz]."""
    stiff, heavy = system.stiffness.diagonal(), system.mass.diagonal()
    elastic = reduced[reduced > RIGID * reduced[-1]]
    shift = max(
        LEAST_SHIFT * float((stiff / heavy).max()),
        SHIFT * (2 * np.pi * float(elastic[0])) ** 2 if len(elastic) else 0.0,
    )
    found = modes(replace(system, stiffness=sp.csr_array(system.stiffness + shift * system.mass)), len(reduced))
    shapes = found.mode_shapes
    strain = np.einsum("nm,nm->m", shapes, system.stiffness @ shapes)
    share = strain / np.einsum("nm,n,nm->m", shapes, stiff, shapes)
    # The first motion is rigid, for the stiffness was found singular: what strain it has is round-off.
    rigid = share <= max(STRAINLESS, MARGIN * abs(share[0]))
    return np.where(rigid, 0.0, np.sqrt((found.angular_frequency**2 - shift).clip(min=0)) / (2 * np.pi))
