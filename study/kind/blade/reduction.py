"""The chain of one blade: mesh, matrices, full modes, Craig-Bampton modes, harmonic-balance peak."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.damping import rayleigh_damping
from fe.mesh import Mesh
from fe.modal import modes
from hbsolve.continuation.peak import ResonancePeak, resonance_peak, undamped_from_peak
from hbsolve.dynamic_stiffness import DynamicStiffness
from hbsolve.forced_response import HarmonicForce, forced_response
from reduction.craig_bampton import craig_bampton
from reduction.memory_estimate import reduction_memory, refuse_beyond_memory
from reduction.rom import ReducedModel, rayleigh_damped
from reduction.rom_error import rom_error
from study.kind.blade.model import BladeModel, boundary_rows, clamped
from study.reduce.comparison import N_FREQUENCY, ComparedReduction

#: Excitation and response act along y, the thickness.
THICKNESS_DIRECTION = 1
#: The peak is sought this far on each side of the reduced frequency; the second mode is farther.
BAND = 0.2


@dataclass(frozen=True, kw_only=True, eq=False)
class Reduction(ComparedReduction):
    """A reduced blade and how good it is.

    Parameters
    ----------
    mesh
        Of the blade.
    n_held
        Fixed nodes [-].
    peak_natural
        The natural frequency that the interpolated peak of the harmonic-balance response stands for, its damping shift
        taken out [Hz].
    """

    mesh: Mesh
    n_held: int
    peak_natural: float


def reduce_blade(model: BladeModel, provenance: Mapping[str, str] | None = None) -> Reduction:
    """Mesh, clamp, damp and reduce a blade, and compare with the full model.

    Parameters
    ----------
    model
        What is reduced.
    provenance
        Travels with the reduced model.
    """
    mesh, system, n_held = clamped(model)
    rows = boundary_rows(mesh, system)
    n_boundary = sum(len(each) for each in rows.values())
    needed = reduction_memory(system.stiffness, n_boundary, model.n_mode)
    refuse_beyond_memory(needed, f"reducing {system.n_dof} degrees of freedom to {n_boundary} and modes")
    full = modes(system, N_FREQUENCY)
    damping = rayleigh_damping(model.damping_ratio, float(full.frequency[0]))
    rom = rayleigh_damped(craig_bampton(system, rows, model.n_mode, provenance), damping)
    reduced = rom.modes(N_FREQUENCY)
    peak = first_peak(rom, float(reduced.frequency[0]))
    return Reduction(
        mesh=mesh,
        rom=rom,
        n_held=n_held,
        frequency=full.frequency,
        rom_frequency=reduced.frequency,
        rom_error=rom_error(system, rom, N_FREQUENCY),
        peak_natural=undamped_from_peak(peak, model.damping_ratio) / (2 * pi),
    )


def first_peak(rom: ReducedModel, frequency: float) -> ResonancePeak:
    """Peak of the tip's harmonic-balance response to a force at the excitation point, near a frequency [Hz]."""
    structure = DynamicStiffness.of(rom)
    force = unit_force(rom)
    seen = rom.rows("response", THICKNESS_DIRECTION)

    def amplitude(angular_frequency: Float[NDArray[np.float64], " p"]) -> Float[NDArray[np.float64], " p"]:
        branch = forced_response(structure, force, angular_frequency)
        return np.abs(branch.coefficients[:, 1, seen]).ravel()

    return resonance_peak(amplitude, 2 * pi * frequency * (1 - BAND), 2 * pi * frequency * (1 + BAND))


def unit_force(rom: ReducedModel) -> HarmonicForce:
    """A harmonic force of 1 N at the excitation point; the response is linear, so any amplitude would do."""
    coefficients = np.zeros((2, rom.n_dof), dtype=np.complex128)
    coefficients[1, rom.rows("excitation", THICKNESS_DIRECTION)] = 1.0
    return HarmonicForce(coefficients=coefficients)
