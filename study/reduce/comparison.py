"""A linear system reduced, damped, and compared with itself in full; what holds it may be nothing."""

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
Rows = Int[NDArray[np.int64], " k"]


@dataclass(frozen=True, kw_only=True, eq=False)
class ComparedFrequencies:
    """The first natural frequencies of a model, full and reduced.

    Parameters
    ----------
    frequency, rom_frequency
        The first ones (ten at most), full and reduced, shape (m,) [Hz]; rigid-body motions are 0.
    rom_error
        Estimated relative truncation error of each reduced frequency, shape (m,) [-].
    """

    frequency: Frequencies
    rom_frequency: Frequencies
    rom_error: Frequencies


@dataclass(frozen=True, kw_only=True, eq=False)
class ComparedReduction(ComparedFrequencies):
    """A reduced model and how good it is."""

    rom: ReducedModel

    @property
    def n_dof(self) -> int:
        """Free degrees of freedom of the full model [-]."""
        return len(self.rom.free)


def compare_reduction(
    system: LinearSystem,
    boundary: Mapping[str, Rows],
    n_mode: int,
    damping_ratio: float | None,
    provenance: Mapping[str, str],
) -> ComparedReduction:
    """Reduce, damp and compare with the full system.

    Parameters
    ----------
    system
        System of the free degrees of freedom.
    boundary
        Retained rows of the system, by name.
    n_mode
        Fixed-interface modes [-].
    damping_ratio
        Ratio of Rayleigh damping on the first elastic mode [-]; None keeps the damping of the system.
    provenance
        Travels with the reduced model.

    Raises
    ------
    RomError
        It would take more memory than is free, or the boundary leaves the interior loose.
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
    """Frequencies of a structure that nothing holds, by a shift; 0 of motions without strain [Hz]."""
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
    # The first motion is rigid, for the stiffness was found singular: what strain it has is round-off.
    rigid = share <= max(STRAINLESS, MARGIN * abs(share[0]))
    return np.where(rigid, 0.0, np.sqrt((result.angular_frequency**2 - shift).clip(min=0)) / (2 * np.pi))
