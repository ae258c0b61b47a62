"""Read mass, damping and stiffness of a structure from a NumPy or MATLAB file, or from a stored reduced model."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib.format import MAGIC_PREFIX

from fe.file.npz_archive import NpzError, ObjectArray, read_npz, read_npz_headings
from reduction.array_input import ASYMMETRY, freeze_arrays, refuse_asymmetric, refuse_infinite
from reduction.array_type import Matrix
from reduction.errors import MatrixError
from reduction.file.atomic_file import write_atomically
from reduction.file.matlab_elements import MatlabFileError, read_variables
from reduction.file.npz import write_npz
from reduction.file.rom_npz import MARK, load_rom_npz
from reduction.rom import ReducedModel

#: Names of each matrix that are accepted in a file.
NAMES = {"mass": ("mass", "M"), "damping": ("damping", "C", "D"), "stiffness": ("stiffness", "K")}
#: Largest eigenvalue of a matrix scaled to unit diagonal that is zero within the round-off of its entries.
ROUND_OFF = 1e-12
#: Largest number of degrees of freedom of dense matrices; larger ones exceed the memory and take hours.
LARGEST = 5000


@dataclass(frozen=True, kw_only=True, eq=False)
class StructureMatrices:
    """Matrices of a linear structure from a file; arrays are copied and read-only."""

    mass: Matrix
    damping: Matrix
    stiffness: Matrix
    """Shape (r, r) [kg, N s/m, N/m]; the damping is zero if the file has none."""
    rom: ReducedModel | None = None
    """Reduced model of the file, with the names of its boundary; None for plain matrices."""

    def __post_init__(self) -> None:
        freeze_arrays(self, *NAMES)

    @property
    def n_dof(self) -> int:
        """Number of degrees of freedom r [-]."""
        return len(self.mass)

    @property
    def has_damping(self) -> bool:
        """Whether any entry of the damping is not zero."""
        return bool(self.damping.any())


def load_matrices(path: Path | str) -> StructureMatrices:
    """Read mass, damping and stiffness of a structure.

    Parameters
    ----------
    path
        ``.npz`` or ``.mat`` file (versions 5 to 7) with the variables mass or M, stiffness or K and optionally damping
        or C or D, in SI units; or a reduced model: ``.h5`` written by `reduction.file.rom_hdf5.save_rom`, or ``.npz``
        written by `reduction.file.rom_npz.save_rom_npz`.

    Raises
    ------
    MatrixError
        The file is missing, of another kind, or damaged; a matrix is missing, not square, not finite or not symmetric,
        the mass is not positive definite, or the stiffness is indefinite.
    RomError
        A damaged reduced model, or an ``.h5`` file of other content.
    """
    path = Path(path)
    if path.is_dir():
        raise MatrixError(f'"{path}" is a folder: name the file with the matrices in it')
    if not path.is_file():
        raise MatrixError(f'there is no file "{path}": check its name and folder')
    kind = path.suffix.lower()
    if kind in {".h5", ".hdf5"}:
        from reduction.file.rom_hdf5 import load_rom  # imports the assembly of bodies

        return _of(load_rom(path))
    if kind not in {".npz", ".mat"}:
        raise MatrixError(f'"{path}" ends in "{kind}": give matrices as .npz or .mat, or a reduced model as .h5')
    variables = _read_npz_file(path) if kind == ".npz" else _read_mat_file(path)
    if kind == ".npz" and MARK in variables:
        return _of(load_rom_npz(path))
    result = {name: _check_matrix(path, name, variables) for name in NAMES}
    mass, damping, stiffness = result["mass"], result["damping"], result["stiffness"]
    if mass is None or stiffness is None:
        name = "mass" if mass is None else "stiffness"
        raise MatrixError(
            f'"{path}" holds no {name}: call it {" or ".join(NAMES[name])}; its variables are {_join_names(variables)}'
        )
    damping = np.zeros_like(mass) if damping is None else damping
    for name, matrix in (("damping", damping), ("stiffness", stiffness)):
        if matrix.shape != mass.shape:
            raise MatrixError(
                f'"{path}": the {name} has shape {matrix.shape} but the mass {mass.shape}: give matrices of one size'
            )
    _check_definite(path, mass, stiffness)
    return StructureMatrices(mass=mass, damping=damping, stiffness=stiffness)


def save_matrices(structure: StructureMatrices, path: Path | str) -> None:
    """Write mass, damping and stiffness as ``.npz``; an existing file is replaced in one step.

    Raises
    ------
    ExchangeError
        The folder does not exist, or the file cannot be written.
    """
    matrices = {name: getattr(structure, name) for name in NAMES}
    write_atomically(path, lambda file: write_npz(file, matrices))


def _of(rom: ReducedModel) -> StructureMatrices:
    return StructureMatrices(mass=rom.mass, damping=rom.damping, stiffness=rom.stiffness, rom=rom)


def _read_npz_file(path: Path) -> dict[str, Any]:
    wanted = {variable: name for name, group in NAMES.items() for variable in group}
    try:
        headings = read_npz_headings(path)
        for variable in wanted.keys() & headings:
            shape, kind = headings[variable]
            if not kind.hasobject:
                _check_shape(f'"{path}": {variable}', wanted[variable], shape)
        return {**dict.fromkeys(headings), **read_npz(path, wanted)}
    except ObjectArray:
        raise MatrixError(
            f'"{path}" holds Python objects, such as SciPy sparse matrices: save M.toarray(), or write a .mat file '
            "with scipy.io.savemat, which keeps them sparse"
        ) from None
    except NpzError as error:
        if _is_single_array(path):
            raise MatrixError(f'"{path}" holds a single array: write it with np.savez(file, M=M, C=C, K=K)') from None
        raise _make_damage_error(path, error, "np.savez") from None


def _is_single_array(path: Path) -> bool:
    with path.open("rb") as stream:
        return stream.read(len(MAGIC_PREFIX)) == MAGIC_PREFIX


def _read_mat_file(path: Path) -> dict[str, Any]:
    data = path.read_bytes()
    if data.startswith(b"MATLAB 7.3"):
        raise MatrixError(f'"{path}" is a MATLAB file of version 7.3: save it with save(file, "-v7")')
    try:
        # `content`, not `simplified`, so that a scalar remains a matrix of one row and one column.
        return {value.name: value.content for value in read_variables(data)}
    except MatlabFileError as error:
        raise _make_damage_error(path, error, "save -v7 or scipy.io.savemat") from None


def _make_damage_error(path: Path, reason: Exception, writer: str) -> MatrixError:
    size = path.stat().st_size
    return MatrixError(
        f'"{path}" ({size} bytes) is cut short, damaged or of another kind ({reason}): write it again with {writer}'
    )


def _check_matrix(path: Path, name: str, variables: Mapping[str, Any]) -> Matrix | None:
    """One matrix of the file, dense and checked on its own; None if the file does not have it."""
    present = [item for item in NAMES[name] if item in variables]
    if not present:
        return None
    if len(present) > 1:
        raise MatrixError(f'"{path}" holds the {name} twice, as {" and ".join(present)}: keep one of them')
    (variable,) = present
    label = f'"{path}": {variable}'
    value = variables[variable]
    _check_shape(label, name, tuple(np.shape(value)))
    dense = value.toarray() if hasattr(value, "toarray") else np.asarray(value)
    if dense.dtype.kind not in "fiucb":
        raise MatrixError(f"{label} holds {dense.dtype} instead of numbers: give a real matrix")
    if np.iscomplexobj(dense):
        if dense.imag.any():
            row, column = np.argwhere(dense.imag)[0]
            raise MatrixError(
                f"{label} holds the complex number {dense[row, column]:g} at ({row}, {column}): give a real matrix, "
                "and losses as damping"
            )
        dense = dense.real
    dense = dense.astype(np.float64)
    refuse_infinite(dense, label, MatrixError)
    if name != "damping":  # gyroscopic forces make the damping asymmetric
        refuse_asymmetric(dense, label, MatrixError)
    return dense


def _check_shape(label: str, name: str, shape: tuple[int, ...]) -> None:
    if len(shape) != 2 or shape[0] != shape[1] or not shape[0]:
        raise MatrixError(f"{label} has shape {shape}: the {name} must be square, (r, r)")
    if shape[0] > LARGEST:
        raise MatrixError(f"{label} has {shape[0]} degrees of freedom, more than {LARGEST}: reduce the structure first")


def _check_definite(path: Path, mass: Matrix, stiffness: Matrix) -> None:
    lowest = _find_lowest(mass)
    if not lowest > ROUND_OFF:
        dof = int(np.argmin(np.diag(mass)))
        where = f" (M[{dof}, {dof}] = {mass[dof, dof]:g})" if mass[dof, dof] <= 0 else ""
        raise MatrixError(
            f'"{path}": the mass is not positive definite, its least scaled eigenvalue is {lowest:.3g}{where}: remove '
            "degrees of freedom without mass, and check the units and signs"
        )
    lowest = _find_lowest(stiffness)
    if lowest < -ASYMMETRY:
        raise MatrixError(
            f'"{path}": the stiffness is indefinite, its least scaled eigenvalue is {lowest:.3g}: check its signs'
        )


def _find_lowest(matrix: Matrix) -> float:
    """Smallest eigenvalue of the matrix scaled to a diagonal of ones, so that it does not depend on units."""
    scale = np.sqrt(np.abs(np.diag(matrix)))
    scale[scale == 0] = np.sqrt(np.abs(matrix).max() or 1.0)
    scaled = matrix / np.outer(scale, scale)
    return float(np.linalg.eigvalsh((scaled + scaled.T) / 2)[0])


def _join_names(variables: Mapping[str, Any]) -> str:
    return ", ".join(sorted(variables)) or "none"
