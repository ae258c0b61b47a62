"""Matrices from files: what was written is what is read, and each bad file is refused in one sentence."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

from reduction.errors import MatrixError, RomError
from reduction.file.rom_hdf5 import save_rom
from reduction.file.structure_file import LARGEST, load_matrices
from reduction.rom import ReducedModel

RNG = np.random.default_rng(41)
N = 5


def definite() -> np.ndarray:
    root = RNG.standard_normal((N, N))
    return root @ root.T + N * np.eye(N)


M, C, K = definite(), definite(), 1e6 * definite()


def save(path: Path, **variables: object) -> Path:
    if path.suffix == ".npz":
        np.savez(path, **variables)  # type: ignore[arg-type]
    else:
        scipy.io.savemat(path, variables)
    return path


@pytest.mark.parametrize("ending", [".npz", ".mat"])
@pytest.mark.parametrize("names", [("M", "C", "K"), ("mass", "damping", "stiffness"), ("M", "D", "stiffness")])
def test_what_was_written_is_read_bit_by_bit(tmp_path: Path, ending: str, names: tuple[str, str, str]) -> None:
    read = load_matrices(save(tmp_path / f"m{ending}", **dict(zip(names, (M, C, K), strict=True)), note=np.ones(3)))
    np.testing.assert_array_equal(read.mass, M)
    np.testing.assert_array_equal(read.damping, C)
    np.testing.assert_array_equal(read.stiffness, K)
    assert read.has_damping
    assert read.rom is None
    assert not read.mass.flags.writeable


def test_sparse_matrices_of_a_mat_file_become_dense_and_a_missing_damping_is_zero(tmp_path: Path) -> None:
    chain = sp.diags_array([[-1.0] * (N - 1), [2.0] * N, [-1.0] * (N - 1)], offsets=[-1, 0, 1]).tocsc()
    read = load_matrices(save(tmp_path / "m.mat", M=sp.eye_array(N).tocsc(), K=chain))
    np.testing.assert_array_equal(read.stiffness, chain.toarray())
    np.testing.assert_array_equal(read.mass, np.eye(N))
    assert not read.has_damping


def test_a_free_structure_and_one_with_a_single_degree_of_freedom_are_read(tmp_path: Path) -> None:
    free = np.array([[1.0, -1.0], [-1.0, 1.0]])
    assert load_matrices(save(tmp_path / "free.npz", M=np.eye(2), K=free)).n_dof == 2
    assert load_matrices(save(tmp_path / "one.mat", M=2.0, K=3.0)).mass[0, 0] == 2.0


def test_a_reduced_model_keeps_the_names_of_its_boundary(tmp_path: Path) -> None:
    rom = ReducedModel(
        mass=M,
        damping=C,
        stiffness=K,
        boundary_node=[3],
        boundary_direction=[2],
        boundary_sets={"tip": np.array([0])},
        fixed_interface_frequency=np.arange(1.0, N),
        recovery=np.eye(N),
        free=np.arange(N),
        n_node=4,
    )
    save_rom(rom, tmp_path / "blade.h5")
    read = load_matrices(tmp_path / "blade.h5")
    np.testing.assert_array_equal(read.stiffness, K)
    assert read.rom is not None
    assert read.rom.rows("tip", 2).tolist() == [0]


def spoilt(matrix: np.ndarray, row: int, column: int, value: complex) -> np.ndarray:
    other = matrix.astype(complex) if isinstance(value, complex) else matrix.copy()
    other[row, column] = value
    return other


BAD: list[tuple[dict[str, object], str]] = [
    ({"mas": M, "K": K}, "holds no mass: call it mass or M; its variables are K, mas"),
    ({"M": M, "stiff": K}, "holds no stiffness: call it stiffness or K; its variables are M, stiff"),
    ({"M": M, "mass": M, "K": K}, "holds the mass twice, as mass and M: keep one of them"),
    ({"M": M[:3], "K": K}, "M has shape (3, 5): the mass must be square, (r, r)"),
    ({"M": M, "K": K[:4, :4]}, "the stiffness has shape (4, 4) but the mass (5, 5): give matrices of one size"),
    ({"M": M, "K": K, "C": C[:2, :2]}, "the damping has shape (2, 2) but the mass (5, 5)"),
    ({"M": spoilt(M, 1, 2, 9.5), "K": K}, "M is not symmetric: entries (1, 2) and (2, 1) are 9.5 and"),
    ({"M": M, "K": spoilt(K, 4, 0, 7.0)}, "K is not symmetric"),
    ({"M": spoilt(M, 3, 1, float("nan")), "K": K}, "M holds nan at (3, 1): give finite numbers"),
    ({"M": M, "K": K, "C": spoilt(C, 0, 1, float("inf"))}, "C holds inf at (0, 1): give finite numbers"),
    ({"M": M, "K": spoilt(K, 0, 1, 1 + 2j)}, "K holds the complex number 1+2j at (0, 1): give a real matrix"),
    ({"M": np.diag([1.0, 1, 0, 1, 1]), "K": K}, "the mass is not positive definite, its least scaled eigenvalue is 0 "
     "(M[2, 2] = 0): remove degrees of freedom without mass"),
    ({"M": np.diag([1.0, 1, -2, 1, 1]), "K": K}, "(M[2, 2] = -2)"),
    ({"M": M, "K": -K}, "the stiffness is indefinite, its least scaled eigenvalue is -"),
    ({"M": np.array(["a"] * 4).reshape(2, 2), "K": K}, "instead of numbers: give a real matrix"),
]  # fmt: skip


@pytest.mark.parametrize(("variables", "said"), BAD, ids=[said[:40] for _, said in BAD])
def test_a_bad_matrix_is_refused_with_file_variable_and_value(
    tmp_path: Path, variables: dict[str, object], said: str
) -> None:
    with pytest.raises(MatrixError, match=re.escape(said)) as refused:
        load_matrices(save(tmp_path / "m.npz", **variables))
    assert "m.npz" in str(refused.value)
    assert "\n" not in str(refused.value)


def test_an_imaginary_part_in_a_mat_file_is_seen(tmp_path: Path) -> None:
    with pytest.raises(MatrixError, match=r"K holds the complex number 1\+2j at \(0, 1\)"):
        load_matrices(save(tmp_path / "m.mat", M=M, K=spoilt(K, 0, 1, 1 + 2j)))


def cut(path: Path) -> None:
    save(path, M=M, K=K)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def version_73(path: Path) -> None:
    # The 128-byte header that MATLAB writes before the HDF5 part; version 0x0200, little endian.
    path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + b"\x89HDF\r\n\x1a\n" + bytes(400))


FILES: list[tuple[str, Callable[[Path], object], str]] = [
    ("none.npz", lambda _: None, 'there is no file ".*none.npz": check its name'),
    ("folder.npz", lambda path: path.mkdir(), "is a folder: name the file"),
    ("m.csv", lambda path: path.write_text("1"), 'ends in ".csv": give matrices as .npz or .mat'),
    ("cut.npz", cut, r"\(\d+ bytes\) is cut short, damaged or of another kind .*: write it again with np.savez"),
    ("cut.mat", cut, r"is cut short, damaged or of another kind .*: write it again with save -v7"),
    ("empty.npz", lambda path: path.write_bytes(b""), r"\(0 bytes\) is cut short"),
    ("empty.mat", lambda path: path.write_bytes(b""), r"\(0 bytes\) is cut short"),
    ("text.mat", lambda path: path.write_text("M = [1 2]; K = 3;" * 40), "is cut short, damaged or of another kind"),
    ("v73.mat", version_73, 'is a MATLAB file of version 7.3: save it with save.*"-v7"'),
    ("object.npz", lambda path: save(path, M=sp.eye_array(3), K=sp.eye_array(3)), "holds Python objects, such as"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "write", "said"), FILES, ids=[name for name, _, _ in FILES])
def test_a_bad_file_is_refused_in_one_sentence(
    tmp_path: Path, name: str, write: Callable[[Path], object], said: str
) -> None:
    write(tmp_path / name)
    with pytest.raises(MatrixError, match=said) as refused:
        load_matrices(tmp_path / name)
    assert "\n" not in str(refused.value)


def test_a_file_that_is_no_reduced_model_is_refused(tmp_path: Path) -> None:
    (tmp_path / "m.h5").write_text("no")
    with pytest.raises(RomError, match="not an HDF5 file"):
        load_matrices(tmp_path / "m.h5")


def test_a_structure_that_should_be_reduced_first_is_refused_before_it_is_made_dense(tmp_path: Path) -> None:
    large = sp.eye_array(20 * LARGEST).tocsc()
    with pytest.raises(MatrixError, match=rf"M has {20 * LARGEST} degrees of freedom, more than {LARGEST}: reduce"):
        load_matrices(save(tmp_path / "large.mat", M=large, K=large))
