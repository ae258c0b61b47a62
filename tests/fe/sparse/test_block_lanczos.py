"""No mode is missed, none is found twice, however often a frequency repeats."""

from collections.abc import Callable

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, eigsh

import fe.modal
from fe.assembly import assemble
from fe.boundary import Support, supported_system
from fe.element import HEX20
from fe.errors import SupportError
from fe.material import STEEL
from fe.mesh import Mesh
from fe.modal import find_lowest_eigenpairs
from fe.sparse.block_lanczos import NoConvergence, block_lanczos
from fe.sparse.solver import Backend, factorise
from fe.system import LinearSystem
from tests.slow import slow

BoxMesher = Callable[..., Mesh]
#: Eigenvalues err by round-off times the condition of the stiffness, below 1e5 for the springs here.
ROUND_OFF = 1e-11


def chain(n: int) -> sp.csr_array:
    """n equal masses in a row between two walls, n + 1 unit springs."""
    return sp.csr_array(sp.diags_array([2 * np.ones(n), -np.ones(n - 1), -np.ones(n - 1)], offsets=[0, 1, -1]))


def chain_lambda(n: int) -> NDArray[np.float64]:
    return np.asarray(2 - 2 * np.cos(np.arange(1, n + 1) * np.pi / (n + 1)))


def identical_chains(n_chain: int, n: int) -> sp.csr_array:
    return sp.csr_array(sp.kron(sp.eye_array(n_chain), chain(n)))


def grid(n: int) -> sp.csr_array:
    """A cube of n^3 masses: each lambda is a sum of three of a chain's, so most appear six times."""
    one, line = sp.eye_array(n), chain(n)
    plane = sp.kron(line, one) + sp.kron(one, line)
    return sp.csr_array(sp.kron(plane, one) + sp.kron(sp.eye_array(n * n), line))


def grid_lambda(n: int) -> NDArray[np.float64]:
    line = chain_lambda(n)
    return np.sort((line[:, None, None] + line[:, None] + line).ravel())


def solve(
    stiffness: sp.csr_array,
    n_mode: int,
    mass: sp.csr_array | None = None,
    backend: Backend | None = None,
    **options: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The pairs, after a check that they are pairs, orthonormal in the mass."""
    if mass is None:
        mass = sp.eye_array(stiffness.shape[0], format="csr")
    factor = factorise(stiffness, backend=backend)
    lambda_, shapes = block_lanczos(factor, mass, n_mode, **options)
    np.testing.assert_allclose(shapes.T @ (mass @ shapes), np.eye(n_mode), atol=1e-11)
    # ||K x - lambda M x|| in the inverse stiffness over ||x|| in the stiffness, by way of the factor: K x itself is
    # rounded, and the factor is that of a rounded K, worth 2e-9 each in the first mode of a slender bar.
    rest = factor.solve(mass @ shapes) - shapes / lambda_
    residual = np.sqrt(lambda_ * np.einsum("nm,nm->m", rest, stiffness @ rest))
    assert residual.max() < 1e-9
    assert (np.diff(lambda_) >= 0).all()
    return lambda_, shapes


def test_a_cube_has_all_its_sixfold_frequencies(backend: Backend) -> None:
    result, _ = solve(grid(11), 90, backend=backend)
    np.testing.assert_allclose(result, grid_lambda(11)[:90], rtol=ROUND_OFF)


@pytest.mark.parametrize("n_mode", [1, 7, 24, 25, 60])
@pytest.mark.parametrize("block", [1, 4, 8])
def test_24_identical_structures_have_every_frequency_24_times(block: int, n_mode: int) -> None:
    result, _ = solve(identical_chains(24, 40), n_mode, block=block)
    np.testing.assert_allclose(result, np.repeat(chain_lambda(40), 24)[:n_mode], rtol=ROUND_OFF)


def test_a_hundred_identical_structures_have_the_first_frequency_a_hundred_times() -> None:
    result, _ = solve(identical_chains(100, 10), 120)
    np.testing.assert_allclose(result, np.repeat(chain_lambda(10), 100)[:120], rtol=ROUND_OFF)


def test_nearly_identical_structures_keep_their_own_frequencies() -> None:
    # 24 chains whose stiffnesses differ by 1e-7 from one to the next, as blades of a disk do, only closer.
    spread = 1 + 1e-7 * np.arange(24)
    stiffness = sp.csr_array(sp.kron(sp.diags_array(spread), chain(40)))
    result, _ = solve(stiffness, 60)
    np.testing.assert_allclose(result, np.sort(np.outer(chain_lambda(40), spread).ravel())[:60], rtol=ROUND_OFF)


@given(n=st.integers(1, 40), block=st.integers(1, 12), seed=st.integers(0, 2**32 - 1), data=st.data())
@settings(max_examples=60, deadline=None)
def test_small_systems_give_all_the_modes_that_are_asked_for(
    n: int, block: int, seed: int, data: st.DataObject
) -> None:
    n_mode = data.draw(st.integers(1, n))
    generator = np.random.default_rng(seed)
    spring, inertia = generator.standard_normal((2, n, n))
    stiffness, mass = spring @ spring.T + np.eye(n), 0.1 * inertia @ inertia.T + np.eye(n)
    result, _ = solve(sp.csr_array(stiffness), n_mode, sp.csr_array(mass), block=block)
    np.testing.assert_allclose(result, scipy.linalg.eigh(stiffness, mass, eigvals_only=True)[:n_mode], rtol=1e-9)


@pytest.mark.parametrize("n_mode", [1, 24, 240])
def test_a_single_frequency_is_found_as_often_as_asked(n_mode: int) -> None:
    result, _ = solve(sp.csr_array(3 * sp.eye_array(240)), n_mode)
    np.testing.assert_allclose(result, 3, rtol=1e-14)


@pytest.mark.parametrize("n_mode", [5, pytest.param(80, marks=slow)])
@pytest.mark.parametrize("stiffness", [grid(11), identical_chains(24, 100)], ids=["cube", "24 chains"])
def test_a_limit_of_memory_costs_time_alone(stiffness: sp.csr_array, n_mode: int) -> None:
    free, _ = solve(stiffness, n_mode)
    limited, _ = solve(stiffness, n_mode, max_basis=1)
    np.testing.assert_allclose(limited, free, rtol=ROUND_OFF)


def test_two_runs_agree_to_the_last_bit_and_two_seeds_to_round_off() -> None:
    first, again, other = (solve(grid(9), 30, seed=seed) for seed in (0, 0, 1))
    np.testing.assert_array_equal(first[0], again[0])
    np.testing.assert_array_equal(first[1], again[1])
    np.testing.assert_allclose(first[0], other[0], rtol=ROUND_OFF)


def bar(box: BoxMesher, counts: tuple[int, int, int], size: tuple[float, float, float]) -> LinearSystem:
    mesh = box(HEX20, counts=counts, size=size)
    return supported_system(mesh, *assemble(mesh, STEEL), [Support(nodes=mesh.nodes("x0"))])


def test_a_bar_of_square_section_has_its_bending_modes_in_pairs(box: BoxMesher) -> None:
    system = bar(box, (8, 2, 2), (0.2, 0.02, 0.02))
    result, _ = solve(system.stiffness, 40, system.mass)
    np.testing.assert_allclose(result[0], result[1], rtol=1e-9)
    dense = scipy.linalg.eigh(system.stiffness.toarray(), system.mass.toarray(), eigvals_only=True)
    # The dense solver errs by round-off times the highest lambda, some 1e7 times the first.
    np.testing.assert_allclose(result, dense[:40], atol=1e-14 * dense[-1], rtol=1e-9)


@pytest.mark.parametrize("n_mode", [1, 10, 100])
def test_a_slender_bar_agrees_with_arpack(box: BoxMesher, n_mode: int) -> None:
    system = bar(box, (40, 4, 1), (0.3, 0.03, 0.003))
    result, _ = solve(system.stiffness, n_mode, system.mass)
    n, factor = system.n_dof, factorise(system.stiffness)
    inverse = LinearOperator((n, n), matvec=factor.solve, dtype=np.float64)
    theirs = eigsh(
        system.stiffness, k=n_mode, M=system.mass, sigma=0.0, OPinv=inverse, tol=1e-13, return_eigenvectors=False
    )
    np.testing.assert_allclose(result, np.sort(theirs), rtol=1e-11)  # the same factor: its own error is in both


class NotANumber:
    """What a factor of a singular matrix may answer."""

    def solve(
        self, right_hand_side: NDArray[np.float64], out: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        return np.full_like(right_hand_side if out is None else out, np.nan)


class Useless:
    """A factor that answers with the same vector whatever it is asked."""

    def solve(
        self, right_hand_side: NDArray[np.float64], out: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        return np.ones_like(right_hand_side if out is None else out)


def test_a_factor_that_cannot_solve_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    mass = sp.eye_array(50, format="csr")
    with pytest.raises(NoConvergence, match="not finite"):
        block_lanczos(NotANumber(), mass, 3)
    with pytest.raises(NoConvergence, match="3 modes did not converge"):
        block_lanczos(Useless(), mass, 3)
    monkeypatch.setattr(fe.modal, "MAX_DENSE", 0)
    with pytest.raises(SupportError, match="singular to working accuracy"):
        find_lowest_eigenpairs(chain(50), mass, 3, NotANumber())
