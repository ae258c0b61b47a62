"""Reduction and damping of a linear system, and comparison with the full system, which may be unsupported."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.damping import rayleigh_damping
from fe.errors import SupportError
from fe.modal import STRAINLESS, modes
from fe.sparse.symmetric_part import find_whole_nodes
from fe.system import LinearSystem
from reduction.craig_bampton import craig_bampton
from reduction.memory_estimate import estimate_reduction_memory, refuse_beyond_memory
from reduction.rom import ReducedModel, with_rayleigh_damping
from reduction.rom_error import rom_error

#: Largest number of compared frequencies.
N_FREQUENCY = 10
#: Frequencies of a free structure below this fraction of the highest compared one count as rigid for the shift [-].
RIGID = 1e-4
#: Shift of a free structure over its first elastic eigenvalue [-]; stiffness + shift * mass is positive definite.
SHIFT = 0.1
#: Smallest shift over the largest ratio of stiffness to mass on the diagonals [-]; it is above round-off.
LEAST_SHIFT = 1e-11
#: Largest ratio of the round-off strains of two rigid motions of one structure [-].
MARGIN = 10.0

Frequencies = Float[NDArray[np.float64], " m"]
Rows = Int[NDArray[np.int64], " k"]


@dataclass(frozen=True, kw_only=True, eq=False)
class ComparedFrequencies:
    """The first natural frequencies of a model, full and reduced.

    Parameters
    ----------
    frequency, rom_frequency
        First natural frequencies (ten at most), full and reduced, shape (m,) [Hz]; 0 for rigid-body motions.
    rom_error
        Estimated relative truncation error of each reduced frequency, shape (m,) [-].
    """

    frequency: Frequencies
    rom_frequency: Frequencies
    rom_error: Frequencies


@dataclass(frozen=True, kw_only=True, eq=False)
class ComparedReduction(ComparedFrequencies):
    """Reduced model and its natural frequencies, compared with those of the full model."""

    rom: ReducedModel

    @property
    def n_dof(self) -> int:
        """Number of free degrees of freedom of the full model [-]."""
        return len(self.rom.free)


def compare_reduction(
    system: LinearSystem,
    boundary: Mapping[str, Rows],
    n_mode: int,
    damping_ratio: float | None,
    provenance: Mapping[str, str],
) -> ComparedReduction:
    """Reduce and damp a system, and compare its natural frequencies with those of the full system.

    Parameters
    ----------
    system
        System of the free degrees of freedom.
    boundary
        Retained rows of the system, by name.
    n_mode
        Number of fixed-interface modes [-].
    damping_ratio
        Damping ratio of the first elastic mode, by Rayleigh damping [-]; None keeps the damping of the system.
    provenance
        Provenance that is stored with the reduced model.

    Raises
    ------
    RomError
        If the reduction needs more memory than is free, or the interior has rigid-body motions with a fixed boundary.
    """
    n_boundary = sum(len(rows) for rows in boundary.values())
    retained = np.concatenate([np.zeros(0, dtype=np.int64), *boundary.values()])
    is_compact = find_whole_nodes(np.setdiff1d(np.arange(system.n_dof), retained)) is not None
    needed = estimate_reduction_memory(system.stiffness, n_boundary, n_mode, is_compact=is_compact)
    refuse_beyond_memory(needed, f"reducing {system.n_dof} degrees of freedom to {n_boundary} and {n_mode} modes")
    rom = craig_bampton(system, boundary, n_mode, provenance)
    n_compared = min(N_FREQUENCY, rom.n_dof)
    reduced = rom.modes(n_compared).frequency
    try:
        full = modes(system, n_compared).frequency
    except SupportError:
        full = _compute_free_frequency(system, reduced)
        reduced = np.where(full > 0, reduced, 0.0)
    if damping_ratio is not None and reduced.any():
        rom = with_rayleigh_damping(rom, rayleigh_damping(damping_ratio, float(reduced[reduced > 0][0])))
    return ComparedReduction(
        rom=rom,
        frequency=full,
        rom_frequency=reduced,
        rom_error=np.where(reduced > 0, rom_error(system, rom, n_compared), 0.0),
    )


def _compute_free_frequency(system: LinearSystem, reduced: Frequencies) -> Frequencies:
    """Natural frequencies of an unsupported structure, by a shift of its stiffness; 0 for rigid motions [Hz]."""
    stiff, heavy = system.stiffness.diagonal(), system.mass.diagonal()
    elastic = reduced[reduced > RIGID * reduced[-1]]
    shift = max(
        LEAST_SHIFT * float((stiff / heavy).max()),
        SHIFT * (2 * np.pi * float(elastic[0])) ** 2 if len(elastic) else 0.0,
    )
    result = modes(system.shifted(shift), len(reduced))
    shapes = result.mode_shapes
    strain = np.einsum("nm,nm->m", shapes, system.stiffness @ shapes)
    share = strain / np.einsum("nm,n,nm->m", shapes, stiff, shapes)
    # The first motion is rigid, since the stiffness is singular: its strain is round-off.
    rigid = share <= max(STRAINLESS, MARGIN * abs(share[0]))
    return np.where(rigid, 0.0, np.sqrt((result.angular_frequency**2 - shift).clip(min=0)) / (2 * np.pi))
