"""The stages of imported matrices: reading them, and reducing them beside the frequencies of the full system."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from fe.errors import MatrixFileError
from fe.file.imported_matrices import ImportedMatrices, Rows, Units, read_matrices
from fe.file.matrix_file import MatrixSource
from fe.mode_check import ModeCheck
from fe.system import LinearSystem
from pipeline.store import stage
from reduction.rom import ReducedModel
from reduction.rom_error import check_fixed_interface_modes
from study.reduce.comparison import ComparedReduction, compared_reduction


@stage("imported matrices")
def imported_matrices(
    mass: MatrixSource, stiffness: MatrixSource, damping: MatrixSource | None, dofs: Path | None, units: Units
) -> ImportedMatrices:
    """Read and check the matrices; the files count by their contents."""
    return read_matrices(mass, stiffness, damping=damping, dofs=dofs, units=units)


@stage("reduced matrices")
def reduced_matrices(
    system: LinearSystem,
    boundary: Mapping[str, Rows],
    n_mode: int,
    damping_ratio: float | None,
    provenance: Mapping[str, str],
) -> ComparedReduction:
    """Reduce, damp and compare with the full system.

    Arguments are those of `compared_reduction`.

    Raises
    ------
    MatrixFileError
        A mass or stiffness whose written digits leave the reduced model indefinite.
    """
    try:
        return compared_reduction(system, boundary, n_mode, damping_ratio, provenance)
    except np.linalg.LinAlgError as error:
        raise MatrixFileError(
            f"the modes of the reduced model cannot be found ({error}): check signs and units of mass and stiffness, "
            "and write them with more digits"
        ) from error


@stage("check of reduced matrices")
def checked_matrices(system: LinearSystem, rom: ReducedModel) -> ModeCheck:
    """Check the fixed-interface modes of a system's reduced model."""
    return check_fixed_interface_modes(system, rom)
