"""CHOLMOD's factor in tiles: the same answers, the same memory again, one thread, an order from elsewhere."""

from collections.abc import Callable

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.typing import NDArray

from fe import cholmod_library, mkl, pardiso, sparse_solver
from fe.assembly import assemble_compact
from fe.block_columns import block_columns
from fe.boundary import unsupported_system
from fe.cholmod import Cholmod
from fe.element import HEX20
from fe.factor import Symmetric
from fe.material import STEEL
from fe.mesh import Mesh
from fe.sparse_solver import Backend, default_backend, factorise, is_available
from fe.symmetric_part import part
from fe.upper_blocks import UpperBlocks
from fe.upper_triangle import Upper

BoxMesher = Callable[..., Mesh]
pytestmark = pytest.mark.skipif(not is_available(Backend.CHOLMOD), reason="the system has no libcholmod")


@pytest.fixture(scope="module")
def held(box: BoxMesher) -> Symmetric:
    """A bar that is held at one end, in blocks of its nodes."""
    mesh = box(HEX20, counts=(14, 4, 4), size=(0.14, 0.04, 0.05), distortion=0.2)
    system = unsupported_system(mesh, *assemble_compact(mesh, STEEL))
    free = np.setdiff1d(np.arange(system.n_dof), system.rows(mesh.nodes("x0")))
    return part(system.stiffness, free)


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
    monkeypatch.setattr("fe.cholmod._order", lambda _upper: None)
    own = Cholmod(held).work
    assert given is not None
    assert own is not None
    # Both are nested dissections of the same mesh; a wrong order would fill it ten times.
    assert given[0] < 1.3 * own[0]


def test_renewing_again_and_again_takes_no_more_memory(held: Symmetric) -> None:
    import resource

    factor, b = Cholmod(held), np.ones(held.shape[0])
    first = factor.solve(b)
    factor.renew(held)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(20):
        factor.renew(held)
    # A factor is 6 MB: 120 MB if none were given back.
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 40e3  # kB
    np.testing.assert_array_equal(factor.solve(b), first)


def test_threads_are_as_many_afterwards_as_before() -> None:
    import ctypes

    try:
        openmp = ctypes.CDLL("libgomp.so.1")
    except OSError:
        pytest.skip("there is no libgomp")
    before = openmp.omp_get_max_active_levels()
    with cholmod_library.one_thread():
        assert openmp.omp_get_max_active_levels() == 0
    assert openmp.omp_get_max_active_levels() == before


def test_unknown_places_are_left_alone() -> None:
    import ctypes

    common = ctypes.create_string_buffer(cholmod_library.COMMON)
    cholmod_library.try_given_order_alone(common)
    assert not any(common.raw)


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
    monkeypatch.setattr(mkl, "n_thread", lambda: threads)
    assert default_backend(n, n_column) is expected


def test_the_choice_is_the_factor_that_is_made(held: Symmetric, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mkl, "n_thread", lambda: 1)
    monkeypatch.setattr(sparse_solver, "LARGE", 1000)
    assert isinstance(factorise(held, n_column=500), Cholmod)
    assert is_available(Backend.PARDISO) == (not isinstance(factorise(held, n_column=1), Cholmod))


@pytest.mark.parametrize("block", [1, 3])
def test_columns_of_blocks_are_those_of_the_matrix(block: int) -> None:
    random = np.random.default_rng(block)
    n = 17
    pattern = sp.csr_array(sp.triu(sp.random_array((n, n), density=0.2, rng=random) + sp.eye_array(n)))
    values = random.standard_normal((pattern.nnz, block, block))
    upper = Upper(pattern.indptr.astype(np.int32), pattern.indices.astype(np.int32), values, block)
    whole = sp.bsr_array((values, pattern.indices, pattern.indptr)).toarray()
    start, row, found = block_columns(upper)
    np.testing.assert_array_equal(sp.csc_array((found, row, start), shape=whole.shape).toarray(), whole)
    assert sp.csc_array((found, row, start), shape=whole.shape).has_sorted_indices
