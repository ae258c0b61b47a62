"""Run CalculiX as an independent check: natural frequencies, mass and stiffness of a mesh."""

import os
import shutil
import struct
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.file.calculix_deck import FrequencyOutput, NodeSpring, write_calculix
from fe.material import Material
from fe.mesh import Mesh
from geometry.errors import InputError

#: Time limit for a job that hangs [s]; jobs take seconds.
TIME_LIMIT = 3600.0
JOB = "witness"


def find_ccx() -> Path | None:
    """The program `ccx`, if it is installed."""
    result = shutil.which("ccx")
    return None if result is None else Path(result)


def run_frequency(
    mesh: Mesh,
    materials: Material | Mapping[str, Material],
    fixed: Int[NDArray[np.int64], "k 2"],
    n_mode: int,
    springs: Sequence[NodeSpring] = (),
) -> Float[NDArray[np.float64], " mode"]:
    """Lowest natural frequencies by CalculiX, one thread.

    Parameters
    ----------
    mesh, materials, fixed, n_mode, springs
        As in `fe.file.calculix_deck.write_calculix`.

    Returns
    -------
    Frequencies, ascending, shape (n_mode,) [Hz], from the eigenvalues in double precision.

    Raises
    ------
    InputError
        CalculiX is not installed, or it failed; the message quotes its output.
    """
    with tempfile.TemporaryDirectory(prefix="ccx-") as folder:
        deck = Path(folder) / f"{JOB}.inp"
        write_calculix(mesh, deck, materials, fixed, n_mode, FrequencyOutput.BINARY, springs)
        _run(deck, deck.with_suffix(".eig"))
        eigenvalues = _read_eigenvalues(deck.with_suffix(".eig"))
    # A rigid motion may come out as a small negative number.
    return np.asarray(np.sqrt(eigenvalues.clip(min=0)) / (2 * np.pi))


def run_matrices(mesh: Mesh, materials: Material | Mapping[str, Material]) -> tuple[sp.csr_array, sp.csr_array]:
    """Mass and stiffness by CalculiX on all degrees of freedom, in this mesh's order 3 * node + direction.

    Returns
    -------
    Mass and stiffness, both triangles, shape (3 n_node, 3 n_node) [kg, N/m], with the 14 digits of its text files.

    Raises
    ------
    InputError
        CalculiX is not installed, or it failed; the message quotes its output.
    """
    with tempfile.TemporaryDirectory(prefix="ccx-") as folder:
        deck = Path(folder) / f"{JOB}.inp"
        nothing = np.empty((0, 2), dtype=np.int64)
        write_calculix(mesh, deck, materials, nothing, 1, FrequencyOutput.MATRICES)
        _run(deck, deck.with_suffix(".sti"))
        # Lines "node.direction", both from 1, read as text: 12.1 and 12.10 are the same number.
        names = [line.split(".") for line in deck.with_suffix(".dof").read_text().split()]
        dofs = np.array([3 * (int(node) - 1) + int(direction) - 1 for node, direction in names])
        mass, stiffness = (
            _read_symmetric(deck.with_suffix(suffix), dofs, 3 * mesh.n_node) for suffix in (".mas", ".sti")
        )
    return mass, stiffness


def _run(deck: Path, result: Path) -> None:
    program = find_ccx()
    if program is None:
        raise InputError("CalculiX (ccx) is not installed: apt-get install calculix-ccx")
    one_thread = {"OMP_NUM_THREADS": "1", "CCX_NPROC_EQUATION_SOLVER": "1"}
    done = subprocess.run(
        [program, "-i", deck.stem],
        cwd=deck.parent,
        env={**os.environ, **one_thread},
        capture_output=True,
        text=True,
        timeout=TIME_LIMIT,
        check=False,
    )
    # CalculiX ends with code 0 after most errors: the result file shows success, and "*ERROR" in the output the reason.
    if done.returncode or not result.is_file() or not result.stat().st_size:
        lines = (done.stdout + done.stderr).splitlines()
        start = next((k for k, line in enumerate(lines) if "*ERROR" in line), max(len(lines) - 3, 0))
        output = " ".join(" ".join(lines[start : start + 3]).split())
        raise InputError(f"CalculiX stopped with code {done.returncode} ({output}): check mesh, materials and supports")


def _read_eigenvalues(path: Path) -> Float[NDArray[np.float64], " mode"]:
    """Read the binary .eig file of `*FREQUENCY, STORAGE=YES`.

    It starts with four integers, the last of which is the number of modes; the eigenvalues follow as doubles. The size
    of the integers depends on how CalculiX was compiled.
    """
    content = path.read_bytes()
    for size, form in ((4, "<4i"), (8, "<4q")):
        n_mode = struct.unpack_from(form, content)[3]
        if 0 < n_mode <= (len(content) - 4 * size) // 8:
            return np.frombuffer(content, "<f8", n_mode, 4 * size).copy()
    raise InputError(f"the eigenvalue file of CalculiX ({len(content)} bytes) has no known layout: use version 2.20")


def _read_symmetric(path: Path, dofs: Int[NDArray[np.int64], " n"], size: int) -> sp.csr_array:
    """Symmetric matrix from one triangle, in lines "row column value", numbered from 1."""
    table = np.fromstring(path.read_text(), sep=" ").reshape(-1, 3)
    rows, columns = (dofs[table[:, k].astype(np.int64) - 1] for k in (0, 1))
    values = table[:, 2]
    off = rows != columns
    pairs = (np.concatenate([rows, columns[off]]), np.concatenate([columns, rows[off]]))
    return sp.csr_array(sp.coo_array((np.concatenate([values, values[off]]), pairs), shape=(size, size)))
