"""The chain of one row: mesh, matrices, full modes, Craig-Bampton modes, harmonic-balance peak."""

import resource
import sys
import time
from dataclasses import dataclass
from math import pi

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.damping import damped, rayleigh_damping
from fe.mesh import Mesh
from fe.modal import modes
from hbsolve.dynamic_stiffness import DynamicStiffness
from hbsolve.forced_response import forced_response
from hbsolve.harmonic_force import HarmonicForce
from hbsolve.peak import Peak, resonance_peak, undamped_from_peak
from reduction.craig_bampton import craig_bampton
from reduction.rom import ReducedModel
from reduction.rom_error import rom_error
from study.blade_model import MODEL_CODE, BladeModel, boundary_rows, clamped
from study.store import stage

#: The code that a row depends on, beside this file.
CODE = (*MODEL_CODE, "reduction", "hbsolve")
#: Frequencies that each row compares; the peak is sought for the first.
N_FREQUENCY = 10
#: Excitation and response act along y, the thickness.
THICKNESS_DIRECTION = 1
#: The peak is sought this far on each side of the reduced frequency; the second mode is farther.
BAND = 0.2


@dataclass(frozen=True, kw_only=True, eq=False)
class RowResult:
    """Frequencies three ways, and what they cost.

    Parameters
    ----------
    frequency, rom_frequency
        The first ten, full and reduced, shape (10,) [Hz].
    rom_error
        Estimated relative truncation error of each reduced frequency, shape (10,) [-].
    peak_natural
        The natural frequency that the interpolated peak of the harmonic-balance response stands for, its damping shift
        taken out [Hz].
    n_cell, n_dof, n_held, n_reduced
        Cells, free degrees of freedom, held nodes, reduced degrees of freedom [-].
    seconds, memory
        Wall-clock time and peak memory of the process [s, byte].
    """

    frequency: Float[NDArray[np.float64], " m"]
    rom_frequency: Float[NDArray[np.float64], " m"]
    rom_error: Float[NDArray[np.float64], " m"]
    peak_natural: float
    n_cell: int
    n_dof: int
    n_held: int
    n_reduced: int
    seconds: float
    memory: float


@stage("mesh-study row", rooms=CODE)
def row(inputs: BladeModel) -> RowResult:
    """Compute one row of the mesh study."""
    start = time.perf_counter()
    mesh, undamped, n_held = clamped(inputs)
    full = modes(undamped, N_FREQUENCY)
    system = damped(undamped, rayleigh_damping(inputs.damping_ratio, float(full.frequency[0])))
    rom = craig_bampton(system, boundary_rows(mesh, system), inputs.n_mode)
    reduced = rom.modes(N_FREQUENCY)
    peak = first_peak(rom, float(reduced.frequency[0]))
    return RowResult(
        frequency=full.frequency,
        rom_frequency=reduced.frequency,
        rom_error=rom_error(system, rom, N_FREQUENCY),
        peak_natural=undamped_from_peak(peak, inputs.damping_ratio) / (2 * pi),
        n_cell=mesh.n_cell,
        n_dof=system.n_dof,
        n_held=n_held,
        n_reduced=len(rom.stiffness),
        seconds=time.perf_counter() - start,
        memory=peak_memory(),
    )


def first_frequency(inputs: BladeModel) -> tuple[Mesh, float, int]:
    """Mesh, first frequency [Hz] and free degrees of freedom of a model, nothing else."""
    mesh, system, _ = clamped(inputs)
    return mesh, float(modes(system, 1).frequency[0]), system.n_dof


def first_peak(rom: ReducedModel, frequency: float) -> Peak:
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


def peak_memory() -> float:
    """Most memory that this process has held so far [byte]."""
    unit = 1 if sys.platform == "darwin" else 1024  # Linux counts kilobytes
    return float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit)
