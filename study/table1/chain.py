"""One row of the mesh study: frequencies three ways, and what they cost."""

import resource
import sys
import time
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from pipeline.store import stage
from study.kind.blade.model import BladeModel
from study.kind.blade.reduction import reduce_blade


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


@stage("mesh-study row")
def row(inputs: BladeModel) -> RowResult:
    """Compute one row of the mesh study."""
    start = time.perf_counter()
    found = reduce_blade(inputs)
    return RowResult(
        frequency=found.frequency,
        rom_frequency=found.rom_frequency,
        rom_error=found.rom_error,
        peak_natural=found.peak_natural,
        n_cell=found.mesh.n_cell,
        n_dof=found.n_dof,
        n_held=found.n_held,
        n_reduced=found.rom.n_dof,
        seconds=time.perf_counter() - start,
        memory=peak_memory(),
    )


def peak_memory() -> float:
    """Most memory that this process has held so far [byte]."""
    unit = 1 if sys.platform == "darwin" else 1024  # Linux counts kilobytes
    return float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit)
