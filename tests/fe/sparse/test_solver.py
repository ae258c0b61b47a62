"""Every factorisation solves what it is given, and says when it cannot."""

import subprocess
import sys
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.typing import NDArray

from fe.errors import BackendError
from fe.sparse import cholmod_library, mkl
from fe.sparse.node_matrix import NodeMatrix
from fe.sparse.solver import Backend, Definiteness, SingularMatrix, choose_backend, factorise
from fe.sparse.superlu import SuperLU
from fe.sparse.symmetric_part import PartView

N = 60


def random_matrix(definiteness: Definiteness, seed: int = 0) -> sp.csr_array:
    """A banded symmetric matrix with eigenvalues of either one sign or both."""
    generator = np.random.default_rng(seed)
    lower = sp.diags_array(
        [generator.uniform(1, 2, N), generator.uniform(-1, 1, N - 1), generator.uniform(-1, 1, N - 7)],
        offsets=[0, -1, -7],
    )
    signs = np.ones(N) if definiteness is Definiteness.POSITIVE else np.where(np.arange(N) % 3, 1.0, -1.0)
    return sp.csr_array(lower @ sp.diags_array(signs) @ lower.T)


@pytest.mark.parametrize("definiteness", list(Definiteness), ids=lambda each: each.name.lower())
@pytest.mark.parametrize("columns", [(), (1,), (5,)], ids=["vector", "one column", "five columns"])
def test_the_solution_satisfies_the_equations(
    backend: Backend, definiteness: Definiteness, columns: tuple[int, ...]
) -> None:
    matrix = random_matrix(definiteness)
    b = np.random.default_rng(1).standard_normal((N, *columns))
    factor = factorise(matrix, definiteness, backend)
    for right_hand_side in (b, np.asfortranarray(b), 1e-9 * b):
        x = factor.solve(right_hand_side)
        assert x.shape == b.shape
        # Round-off times a condition number of about 1e4.
        scale = abs(matrix).max() * np.abs(x).max()
        np.testing.assert_allclose(matrix @ x, right_hand_side, atol=1e-13 * N * scale)


def test_several_factors_live_side_by_side(backend: Backend) -> None:
    b = np.ones(N)
    matrices = [random_matrix(Definiteness.POSITIVE, seed) for seed in range(3)]
    factors = [factorise(matrix, backend=backend) for matrix in matrices]
    del factors[1]
    for matrix, factor in zip([matrices[0], matrices[2]], factors, strict=True):
        np.testing.assert_allclose(matrix @ factor.solve(b), b, rtol=1e-9)


def test_the_right_hand_side_and_the_matrix_are_left_as_they_were(backend: Backend) -> None:
    matrix, b = random_matrix(Definiteness.POSITIVE), np.ones((N, 2))
    before = matrix.copy()
    factorise(matrix, backend=backend).solve(b)
    assert (b == 1).all()
    assert abs(matrix - before).max() == 0


def test_a_singular_matrix_is_refused(backend: Backend) -> None:
    matrix = sp.csr_array(sp.diags_array([1.0, 0.0, 2.0]))
    with pytest.raises(SingularMatrix, match="the matrix of 3 rows is singular"):
        factorise(matrix, Definiteness.POSITIVE, backend)


def test_pardiso_refuses_a_negative_pivot_where_none_may_be() -> None:
    pytest.importorskip("pypardiso", reason="PARDISO's wheel exists for x86-64 only")
    with pytest.raises(SingularMatrix, match="singular or not positive definite"):
        factorise(random_matrix(Definiteness.INDEFINITE), Definiteness.POSITIVE, Backend.PARDISO)


def test_an_indefinite_matrix_may_have_zeros_on_its_diagonal(backend: Backend) -> None:
    # A saddle point: one spring and the force that holds it.
    matrix = sp.csr_array(np.array([[0.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 3.0]]))
    solution = factorise(matrix, Definiteness.INDEFINITE, backend).solve(np.array([5.0, 1.0, 6.0]))
    np.testing.assert_allclose(solution, [-9, 5, 2], rtol=1e-14)


@pytest.mark.parametrize("failure", [ImportError("no wheel"), OSError("libmkl_rt.so.2 is missing")])
def test_scipy_alone_is_enough(failure: Exception, monkeypatch: pytest.MonkeyPatch) -> None:
    def library() -> None:
        raise failure

    for module in (mkl, cholmod_library):
        monkeypatch.setattr(module, "library", library)
    assert choose_backend() is Backend.SUPERLU
    b = np.ones(N)
    matrix = random_matrix(Definiteness.POSITIVE)
    np.testing.assert_allclose(matrix @ factorise(matrix).solve(b), b, rtol=1e-9)
    for absent in (Backend.PARDISO, Backend.CHOLMOD):
        with pytest.raises(BackendError, match=f'back end "{absent.value}" is not installed: .* install'):
            factorise(matrix, backend=absent)


def test_a_factor_that_lives_until_the_end_of_the_process_says_nothing_there(backend: Backend) -> None:
    script = (
        "import numpy, scipy.sparse as sp; from fe.sparse.solver import Backend, factorise; "
        f"numpy.kept_to_the_last = factorise(sp.eye_array(3, format='csr'), backend=Backend.{backend.name})"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert not [line for line in (run.stdout + run.stderr).splitlines() if "compiling" not in line]


def test_pardiso_gives_its_memory_back() -> None:
    pytest.importorskip("pypardiso", reason="PARDISO's wheel exists for x86-64 only")
    import resource

    # A dense factor of 4 MB, 20 times: 80 MB if none were released; allocators keep a few spare.
    matrix = sp.csr_array(np.eye(1000) * 1000 + 1)
    factorise(matrix, backend=Backend.PARDISO)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(20):
        factorise(matrix, backend=Backend.PARDISO)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 40e3  # kB


def test_a_library_may_be_named() -> None:
    assert isinstance(factorise(sp.csr_array(np.eye(3)), backend="superlu"), SuperLU)
    with pytest.raises(BackendError, match='there is no back end "mumps": take one of "pardiso", "cholmod", "superlu"'):
        factorise(sp.csr_array(np.eye(3)), backend="mumps")


PENALTY = np.array([[2.0, 1.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 1e12]])


@pytest.mark.parametrize(
    ("matrix", "said"),
    [
        (np.array([[2.0, 1.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]]), "not symmetric, most clearly in row [01],"),
        (PENALTY, "not symmetric, most clearly in row [01],"),
        (np.array([[2.0, np.inf], [np.inf, 2.0]]), "not finite in row 0"),
        (np.array([[2.0, 0.0], [0.0, np.nan]]), "not finite in row 1"),
        (np.eye(3) * (1 + 1j), "the matrix is complex"),
        (np.ones((2, 3)), r"the matrix has shape \(2, 3\): it must be square"),
        (np.ones((0, 0)), r"the matrix has shape \(0, 0\): it must be square and not empty"),
    ],
    ids=["one triangle", "with a penalty spring", "infinite", "no number", "complex", "not square", "empty"],
)
def test_what_is_not_real_and_symmetric_is_refused(matrix: NDArray[Any], said: str, backend: Backend) -> None:
    with pytest.raises(ValueError, match=said):
        factorise(sp.csr_array(matrix), backend=backend)


def test_a_part_of_what_is_not_symmetric_is_refused(backend: Backend) -> None:
    with pytest.raises(ValueError, match="not symmetric"):
        factorise(PartView(matrix=sp.csr_array(PENALTY), rows=np.arange(2)), backend=backend)
    with pytest.raises(ValueError, match="not symmetric"):
        factorise(NodeMatrix(nodes=sp.csr_array(PENALTY)), backend=backend)


def test_other_values_are_looked_at_as_the_first_ones(backend: Backend) -> None:
    matrix = random_matrix(Definiteness.POSITIVE)
    factor = factorise(matrix, backend=backend)
    other = matrix.copy()
    other.data = other.data + np.arange(other.nnz)
    with pytest.raises(ValueError, match="not symmetric"):
        factor.renew(other)


@pytest.mark.parametrize("kind", ["csr", "csc", "coo", "lil", "dok", "dia", "bsr"])
def test_any_sparse_matrix_is_taken(kind: str, backend: Backend) -> None:
    matrix = random_matrix(Definiteness.POSITIVE)
    b = np.ones(N)
    np.testing.assert_allclose(matrix @ factorise(matrix.asformat(kind), backend=backend).solve(b), b, rtol=1e-9)


def test_what_cannot_be_solved_with_or_for_is_said(backend: Backend) -> None:
    matrix = random_matrix(Definiteness.POSITIVE)
    whole: Any = matrix.toarray()
    with pytest.raises(ValueError, match=r"ndarray is not a sparse matrix: give scipy\.sparse\.csr_array of it"):
        factorise(whole, backend=backend)
    with pytest.raises(ValueError, match="right-hand sides are complex"):
        factorise(matrix, backend=backend).solve(1j * np.ones(N))


def test_entries_that_stand_for_a_sum_are_summed(backend: Backend) -> None:
    twice = sp.csr_array((np.array([1.0, 1.0, 3.0]), np.array([0, 0, 1]), np.array([0, 2, 3])))
    np.testing.assert_allclose(factorise(twice, backend=backend).solve(np.ones(2)), [1 / 2, 1 / 3])
    assert twice.nnz == 3


def test_no_columns_have_no_solutions(backend: Backend) -> None:
    assert factorise(random_matrix(Definiteness.POSITIVE), backend=backend).solve(np.ones((N, 0))).shape == (N, 0)


def test_asymmetry_that_is_round_off_is_none() -> None:
    matrix = random_matrix(Definiteness.POSITIVE).tolil()
    matrix[3, 4] *= 1 + 1e-13
    factorise(sp.csr_array(matrix))
    matrix[3, 4] *= 1 + 1e-6
    with pytest.raises(ValueError, match="not symmetric"):
        factorise(sp.csr_array(matrix))
