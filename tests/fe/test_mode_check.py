"""A mode that is missing, and one that is inexact, are noticed by what does not know how modes were found."""

from collections.abc import Callable

import numpy as np
import pytest
import scipy.sparse as sp

from fe import mode_check
from fe.assembly import assemble
from fe.boundary import Support, supported_system
from fe.element import HEX20
from fe.material import STEEL
from fe.mesh import Mesh
from fe.modal import find_lowest_eigenpairs
from fe.mode_check import GAP, check_modes, count_below
from fe.sparse.factor import UnknownInertia
from fe.sparse.solver import Backend

BoxMesher = Callable[..., Mesh]


def chains(n_chain: int, n: int) -> sp.csr_array:
    """Identical rows of masses between walls: every frequency n_chain times."""
    chain = sp.diags_array([2 * np.ones(n), -np.ones(n - 1), -np.ones(n - 1)], offsets=[0, 1, -1])
    return sp.csr_array(sp.kron(sp.eye_array(n_chain), chain))


def test_one_of_24_alike_that_is_missing_is_counted(backend: Backend) -> None:
    stiffness, mass = chains(24, 40), sp.eye_array(960, format="csr")
    lambda_, shapes = find_lowest_eigenpairs(stiffness, mass, 80)
    whole = check_modes(stiffness, mass, lambda_, shapes, backend=backend)
    assert (whole.n_missed, whole.n_found, whole.n_below) == (0, 72, 72)
    for lost in (0, 30, 70):
        kept = np.delete(np.arange(80), lost)
        assert check_modes(stiffness, mass, lambda_[kept], shapes[:, kept], backend=backend).n_missed == 1
        twice = np.insert(np.arange(80), lost, lost)
        assert check_modes(stiffness, mass, lambda_[twice], shapes[:, twice], backend=backend).n_missed == -1


def test_modes_that_are_all_alike_have_none_below_them() -> None:
    stiffness, mass = chains(24, 40), sp.eye_array(960, format="csr")
    lambda_, shapes = find_lowest_eigenpairs(stiffness, mass, 20)
    check = check_modes(stiffness, mass, lambda_, shapes)
    assert (check.n_missed, check.n_found) == (0, 0)
    assert check.shift < lambda_[0] * (1 - GAP / 2)


def test_a_square_bar_has_all_its_pairs(box: BoxMesher, backend: Backend) -> None:
    mesh = box(HEX20, counts=(12, 3, 3), size=(0.2, 0.02, 0.02))
    system = supported_system(mesh, *assemble(mesh, STEEL), [Support(nodes=mesh.nodes("x0"))])
    lambda_, shapes = find_lowest_eigenpairs(system.stiffness, system.mass, 60)
    check = check_modes(system.stiffness, system.mass, lambda_, shapes, backend=backend)
    assert check.n_missed == 0
    assert check.residual.max() < 1e-9  # what block Lanczos promises


def test_round_off_of_a_factor_is_no_error_of_exact_modes() -> None:
    chain = chains(1, 1000)
    stiffness, mass = sp.csr_array(chain @ chain), sp.eye_array(1000, format="csr")
    k = np.arange(1, 6)
    lambda_ = (2 - 2 * np.cos(k * np.pi / 1001)) ** 2
    shapes = np.sin(np.outer(np.arange(1, 1001), k * np.pi / 1001)) * np.sqrt(2 / 1001)
    # The condition is 2e11, and the solutions of a factor are good to a few 1e-6.
    assert check_modes(stiffness, mass, lambda_, shapes).residual.max() < 5e-7


def test_the_residual_of_a_mixture_of_two_modes_is_that_of_the_formula() -> None:
    stiffness, mass = chains(1, 700), sp.eye_array(700, format="csr")
    lambda_, shapes = find_lowest_eigenpairs(stiffness, mass, 2)
    part = 1e-4
    mixed = shapes[:, :1] + part * shapes[:, 1:]
    result = check_modes(stiffness, mass, lambda_[:1], mixed).residual
    exact = part * np.sqrt(lambda_[0] * lambda_[1]) * (1 / lambda_[0] - 1 / lambda_[1])
    np.testing.assert_allclose(result, exact, rtol=1e-7)  # the mixture is longer by 5e-9


def test_another_shift_is_tried_when_one_proves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    stiffness, mass = chains(1, 40), sp.eye_array(40, format="csr")
    factorise, calls = mode_check.factorise, []

    def unlucky(*arguments: object) -> object:
        calls.append(arguments)
        if len(calls) < 3:
            raise UnknownInertia("pivots prove nothing")
        return factorise(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(mode_check, "factorise", unlucky)
    shift, below = count_below(stiffness, mass, 1.0, 1.1)
    assert shift == pytest.approx(1.07)
    assert below == np.count_nonzero(2 - 2 * np.cos(np.arange(1, 41) * np.pi / 41) < shift)
    calls.clear()
    monkeypatch.setattr(mode_check, "PLACES", (0.5, 0.3))
    with pytest.raises(UnknownInertia, match="prove nothing"):
        count_below(stiffness, mass, 1.0, 1.1)
