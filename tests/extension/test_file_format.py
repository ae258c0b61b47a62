"""A mesh format and a matrix format, each added by one file outside the product, pass what every format must."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

from fe.element import HEX8
from fe.errors import MatrixFileError
from fe.file.imported_matrices import read_matrices
from fe.file.matrix import MATRIX_FORMATS
from fe.file.matrix_file import MatrixSource, read_matrix
from fe.file.mesh import MESH_FORMATS
from fe.file.mesh_file import read_mesh, write_mesh
from geometry.errors import RegistryError
from pipeline.code_dependencies import dependencies
from tests.extension.sweep import sweeps
from tests.fe import conftest
from tests.fe.file import test_matrix_file, test_mesh_file

HERE = Path(__file__).parent
MESH, MATRIX = HERE / "json_mesh.py", HERE / "matlab_matrix.py"

element = conftest.element


@pytest.fixture(scope="module")
def mesh_suffix() -> Iterator[str]:
    """Of the mesh format; the other tests of this process do without it."""
    (result,) = MESH_FORMATS.load(MESH)
    yield result.suffixes[0]
    MESH_FORMATS.forget(MESH)


@pytest.fixture(scope="module")
def matrix_suffix() -> Iterator[str]:
    (result,) = MATRIX_FORMATS.load(MATRIX)
    yield result.suffixes[0]
    MATRIX_FORMATS.forget(MATRIX)


globals().update(sweeps("mesh_suffix", test_mesh_file))
globals().update(sweeps("matrix_suffix", test_matrix_file))


def test_matrices_by_name_make_a_system(matrix_suffix: str, tmp_path: Path) -> None:
    file = tmp_path / f"model{matrix_suffix}"
    stiffness = sp.csc_array(test_matrix_file.CHAIN)
    scipy.io.savemat(file, {"K": stiffness, "M": sp.eye_array(3, format="csc"), "note": "of a chain"})
    result = read_matrices(MatrixSource(file=file, name="M"), MatrixSource(file=file, name="K"))
    np.testing.assert_array_equal(result.stiffness.toarray(), test_matrix_file.CHAIN)
    with pytest.raises(MatrixFileError, match="holds several matrices: name one of K, M"):
        read_matrix(MatrixSource(file=file))


def test_files_of_one_suffix_go_to_the_format_that_recognises_them(mesh_suffix: str, tmp_path: Path) -> None:
    (ours,) = (item for item in MESH_FORMATS if mesh_suffix in item.suffixes)
    mesh = test_mesh_file.bent_bar(HEX8)
    write_mesh(mesh, tmp_path / "own.msh")
    write_mesh(mesh, tmp_path / f"theirs{mesh_suffix}")
    theirs = (tmp_path / f"theirs{mesh_suffix}").rename(tmp_path / "theirs.msh")
    both = MESH_FORMATS.register(replace(ours, name="second", suffixes=(".msh",), write=None))
    try:
        assert both.recognise(theirs.read_bytes())
        for file in (theirs, tmp_path / "own.msh"):
            assert read_mesh(file).n_cell == mesh.n_cell
    finally:
        MESH_FORMATS.forget(__file__)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"suffixes": (".MSH",)}, r"suffixes \('.MSH',\): give lower-case"),
        ({"suffixes": ()}, "lower-case"),
        ({"suffixes": (".vtu",)}, r'writes \.vtu files, as "vtk" does'),
        ({"name": "gmsh"}, '"gmsh" is already registered'),
    ],
)
def test_a_format_that_another_contradicts_is_refused(
    mesh_suffix: str, change: dict[str, object], message: str
) -> None:
    (ours,) = (item for item in MESH_FORMATS if mesh_suffix in item.suffixes)
    with pytest.raises(RegistryError, match=message):
        MESH_FORMATS.register(replace(ours, **{"name": "spoilt", **change}))


def test_a_format_that_lacks_a_fact_is_refused_by_file_and_fact(tmp_path: Path) -> None:
    lines = [line for line in MESH.read_text().splitlines() if "recognise=" not in line]
    (tmp_path / "mesh.py").write_text("\n".join(lines))
    with pytest.raises(RegistryError, match=r"mesh\.py, line \d+: .*recognise"):
        MESH_FORMATS.load(tmp_path / "mesh.py")


@pytest.mark.parametrize("kind", ["mesh", "matrix"])
def test_a_stored_result_depends_on_every_format_that_its_reader_may_find(kind: str) -> None:
    formats = {"mesh": MESH_FORMATS, "matrix": MATRIX_FORMATS}[kind]
    own = {Path(formats.entry(name).file) for name in formats.names()} - {*formats.outside_files()}
    assert own <= {*dependencies(f"fe.file.{kind}_file").values()}
    assert own
