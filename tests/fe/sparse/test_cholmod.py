"""CHOLMOD's factor in tiles: the same answers, the same memory again, one thread, an order from elsewhere."""

import ctypes
import mmap
import os
import subprocess
import sys
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.typing import NDArray

from fe.allocator import return_freed_memory
from fe.assembly import assemble_compact
from fe.boundary import make_unsupported_system
from fe.element import HEX20
from fe.material import STEEL
from fe.mesh import Mesh
from fe.sparse import cholmod_library, mkl, pardiso
from fe.sparse import solver as sparse_solver
from fe.sparse.cholmod import Cholmod
from fe.sparse.factor import SingularMatrix, Symmetric, TooLarge
from fe.sparse.lower_columns import lower_columns, ordered_columns
from fe.sparse.solver import Backend, choose_backend, factorise, is_available
from fe.sparse.symmetric_part import PartView, part
from fe.sparse.upper_blocks import UpperBlocks
from fe.sparse.upper_triangle import LowerColumns, Upper

BoxMesher = Callable[..., Mesh]
pytestmark = pytest.mark.skipif(not is_available(Backend.CHOLMOD), reason="the system has no libcholmod")


@pytest.fixture(scope="module")
def held(box: BoxMesher) -> Symmetric:
    """A bar that is held at one end, in blocks of its nodes."""
    mesh = box(HEX20, counts=(14, 4, 4), size=(0.14, 0.04, 0.05), distortion=0.2)
    system = make_unsupported_system(mesh, *assemble_compact(mesh, STEEL))
    free = np.setdiff1d(np.arange(system.n_dof), system.rows(mesh.nodes("x0")))
    return part(system.stiffness, free)


def random_upper(block: int) -> Upper:
    random = np.random.default_rng(block)
    pattern = sp.csr_array(sp.triu(sp.random_array((17, 17), density=0.2, rng=random) + sp.eye_array(17)))
    values = random.standard_normal((pattern.nnz, block, block))
    return Upper(pattern.indptr.astype(np.int32), pattern.indices.astype(np.int32), values, block)


def exact(matrix: Symmetric, b: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(sp.linalg.spsolve(matrix.tocsr().tocsc(), b))


@pytest.mark.parametrize("shape", [(), (1,), (12,), (15,), (40,)])
def test_any_number_of_columns_into_fresh_memory_or_what_is_there(held: Symmetric, shape: tuple[int, ...]) -> None:
    assert isinstance(held, UpperBlocks)
    b = np.asfortranarray(np.random.default_rng(0).standard_normal((held.shape[0], *shape)))
    before, factor, place = b.copy(), Cholmod(held), np.full_like(b, np.nan)
    fresh = factor.solve(b)
    assert np.shares_memory(place, factor.solve(b, place))
    solution = exact(held, b).reshape(b.shape)
    # Round-off times a condition of about 1e5.
    np.testing.assert_allclose(fresh, solution, atol=1e-9 * np.abs(solution).max(), rtol=0)
    np.testing.assert_array_equal(place, fresh)
    np.testing.assert_array_equal(b, before)


def test_without_mkl_cholmod_orders_by_itself(held: Symmetric, monkeypatch: pytest.MonkeyPatch) -> None:
    def library() -> None:
        raise OSError("no MKL here")

    monkeypatch.setattr(pardiso, "library", library)
    b = np.ones(held.shape[0])
    solution = exact(held, b)
    np.testing.assert_allclose(Cholmod(held).solve(b), solution, atol=1e-9 * np.abs(solution).max(), rtol=0)


@pytest.mark.skipif(not is_available(Backend.PARDISO), reason="PARDISO's wheel exists for x86-64 only")
def test_the_order_from_elsewhere_fills_no_more_than_its_own(held: Symmetric, monkeypatch: pytest.MonkeyPatch) -> None:
    given = Cholmod(held).work
    monkeypatch.setattr("fe.sparse.cholmod._order", lambda _upper: None)
    own = Cholmod(held).work
    assert given is not None
    assert own is not None
    # Both are nested dissections of the same mesh; a wrong order would fill it ten times.
    assert given[0] < 1.3 * own[0]


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="Linux alone tells the memory of a process")
def test_renewing_again_and_again_takes_no_more_memory(held: Symmetric) -> None:
    def resident() -> float:
        return_freed_memory()
        return int(Path("/proc/self/statm").read_text().split()[1]) * mmap.PAGESIZE

    factor, b = Cholmod(held), np.ones(held.shape[0])
    first = factor.solve(b)
    factor.renew(held)
    before = resident()
    for _ in range(20):
        factor.renew(held)
    # A factor is 6 MB: 120 MB if none were given back.
    assert resident() - before < 40e6
    np.testing.assert_array_equal(factor.solve(b), first)


def test_only_the_ordered_columns_stand_beside_a_factor_while_it_is_made(
    held: Symmetric, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert isinstance(held, UpperBlocks)
    Cholmod(held)  # compiled and loaded
    taken = []
    plain = Cholmod._factorise

    def watched(self: Cholmod, columns: LowerColumns) -> None:
        taken.append((tracemalloc.get_traced_memory()[0], sum(item.nbytes for item in columns)))
        plain(self, columns)

    monkeypatch.setattr(Cholmod, "_factorise", watched)
    tracemalloc.start()
    try:
        factor = Cholmod(PartView(matrix=held, rows=np.arange(held.shape[0])))
    finally:
        tracemalloc.stop()
    (result, expected) = taken[0]
    # The part by itself is two thirds of its columns.
    assert expected <= result < 1.2 * expected
    b = np.ones(held.shape[0])
    np.testing.assert_array_equal(factor.solve(b), Cholmod(held).solve(b))


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="Linux alone tells the threads of a process")
@pytest.mark.parametrize("first", ["pardiso", "cholmod"])
def test_no_threads_are_woken_whichever_runtime_it_is_bound_to(first: str) -> None:
    """MKL that has worked before has loaded a runtime of its own, to which CHOLMOD is then bound."""
    script = f"""
import os, numpy as np, scipy.sparse as sp
from fe.sparse.solver import Backend, factorise
chain = sp.csr_array(sp.diags_array([4 * np.ones(40), -np.ones(39), -np.ones(39)], offsets=[0, 1, -1]))
grid = sp.csr_array(sp.kron(sp.kronsum(chain, chain), np.eye(3)) + 0.1 * sp.kron(sp.eye_array(1600), np.ones((3, 3))))
if "{first}" == "pardiso":
    factorise(grid).solve(np.ones(4800))
for _ in range(2):
    factor = factorise(grid, backend=Backend.CHOLMOD)
assert factor.work is not None
print(len(os.listdir("/proc/self/task")))
"""
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, env=environment)
    assert done.stdout == "1\n"


def test_threads_are_as_many_afterwards_as_before() -> None:
    Cholmod(sp.csr_array(np.eye(3)))  # its runtime is there
    loaded = [item for name in cholmod_library.OPENMP if (item := cholmod_library._find_loaded(name)) is not None]
    assert loaded
    before = [runtime.omp_get_max_active_levels() for runtime in loaded]
    with cholmod_library.one_thread():
        assert [runtime.omp_get_max_active_levels() for runtime in loaded] == [0] * len(loaded)
    assert [runtime.omp_get_max_active_levels() for runtime in loaded] == before


def test_unknown_places_are_left_alone() -> None:
    common = ctypes.create_string_buffer(cholmod_library.COMMON)
    cholmod_library.configure(common, is_ordered=True)
    assert not any(common.raw)


def test_a_singular_matrix_between_good_ones_is_told(held: Symmetric) -> None:
    assert isinstance(held, UpperBlocks)
    factor, b = Cholmod(held), np.ones(held.shape[0])
    first = factor.solve(b)
    for part_of_diagonal in (1.0, 0.9):  # noticed before anything is touched, and by CHOLMOD
        with pytest.raises(SingularMatrix):
            factor.renew(held.plus_diagonal(-part_of_diagonal * held.diagonal()))
    with pytest.raises(SingularMatrix, match="renew it with others"):
        factor.solve(b)
    factor.renew(held)
    np.testing.assert_array_equal(factor.solve(b), first)


@pytest.mark.parametrize("diagonal", [-4.0, 1.0, np.nan])
def test_negative_pivots_of_a_sparse_matrix_without_supernodes_are_told(diagonal: float) -> None:
    n = 5000
    chain = sp.diags_array([diagonal * np.ones(n), -np.ones(n - 1), -np.ones(n - 1)], offsets=[0, 1, -1])
    with pytest.raises(SingularMatrix):
        Cholmod(sp.csr_array(chain))


def test_what_32_bits_do_not_count_goes_to_another_library(held: Symmetric, monkeypatch: pytest.MonkeyPatch) -> None:
    def too_large(_upper: Upper, *, is_pattern: bool) -> None:
        raise TooLarge("3000000000 entries exceed the range of 32-bit indices")

    monkeypatch.setattr(mkl, "count_threads", lambda: 1)
    monkeypatch.setattr(sparse_solver, "LARGE", 1000)
    monkeypatch.setattr("fe.sparse.lower_columns.lower_columns", too_large)
    with pytest.raises(TooLarge):
        factorise(held, backend=Backend.CHOLMOD)
    if is_available(Backend.PARDISO):
        assert not isinstance(factorise(held, n_column=500), Cholmod)


@pytest.mark.parametrize(
    ("n", "n_column", "threads", "expected"),
    [
        (100_000, 600, 1, Backend.CHOLMOD),
        (100_000, 600, 2, Backend.CHOLMOD),
        (100_000, 600, 16, Backend.PARDISO),
        (100_000, 3, 1, Backend.PARDISO),
        (500, 600, 1, Backend.PARDISO),
    ],
    ids=["many columns", "two threads", "many threads", "few columns", "small"],
)
@pytest.mark.skipif(not is_available(Backend.PARDISO), reason="PARDISO's wheel exists for x86-64 only")
def test_the_work_to_come_chooses_the_library(
    n: int, n_column: int, threads: int, expected: Backend, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mkl, "count_threads", lambda: threads)
    assert choose_backend(n, n_column) is expected


def test_the_choice_is_the_factor_that_is_made(held: Symmetric, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mkl, "count_threads", lambda: 1)
    monkeypatch.setattr(sparse_solver, "LARGE", 1000)
    assert isinstance(factorise(held, n_column=500), Cholmod)
    assert is_available(Backend.PARDISO) == (not isinstance(factorise(held, n_column=1), Cholmod))


@pytest.mark.parametrize("block", [1, 3])
def test_columns_of_blocks_are_those_of_the_matrix(block: int) -> None:
    upper = random_upper(block)
    whole = sp.bsr_array((upper.values, upper.column, upper.row_start)).toarray()
    start, row, result = lower_columns(upper)
    np.testing.assert_array_equal(sp.csc_array((result, row, start), shape=whole.shape).toarray(), whole.T)
    assert sp.csc_array((result, row, start), shape=whole.shape).has_sorted_indices
    pattern = lower_columns(upper, is_pattern=True)
    assert not pattern.values.size
    np.testing.assert_array_equal(pattern.row, row)


@pytest.mark.parametrize("block", [1, 3])
def test_columns_in_another_order_are_those_of_the_ordered_matrix(block: int) -> None:
    upper = random_upper(block)
    whole = sp.bsr_array((upper.values, upper.column, upper.row_start)).toarray()
    symmetric = np.triu(whole) + np.triu(whole, 1).T
    n = len(whole)
    order = np.random.default_rng(7).permutation(n).astype(np.int32)
    start, row, result = ordered_columns(upper, order)
    ordered = sp.csc_array((result, row, start), shape=whole.shape).toarray()
    np.testing.assert_array_equal(ordered, np.tril(symmetric[np.ix_(order, order)]))
