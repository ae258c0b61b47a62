"""The error of a reduced assembly against the dense solution of both bodies in full."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from reduction.assembly import ReducedAssembly, reduce_bodies
from reduction.assembly_error import assembly_error, join_systems
from reduction.errors import RomError
from reduction.line_contact import (
    LineStiffness,
    make_contact_directions,
    make_fixed_tangent_stiffness,
    make_line_contacts,
)
from reduction.stuck import stuck_stiffness
from tests.reduction.two_bodies import Whole, line_on_block

SPRINGS = LineStiffness(normal=8e6, tangential=5e6)
#: Of a spring that keeps the block from turning about the line [N/m].
GROUND = 1e6
N_MODE = 8
#: Below and between the first resonances, 1.49, 1.67, 2.35 and 3.57 kHz [Hz].
BETWEEN = np.array([100.0, 1000.0, 2000.0, 3000.0])


@dataclass(frozen=True)
class Case:
    whole: Whole
    reduced: ReducedAssembly
    springs: NDArray[np.float64]
    in_full: NDArray[np.float64]


def stuck(n_dof: int, directions: NDArray[np.float64], top: NDArray[np.int64]) -> NDArray[np.float64]:
    line = line_on_block()
    contacts = make_line_contacts("pair", line, directions, SPRINGS, 0.6)
    result = stuck_stiffness(make_fixed_tangent_stiffness(line, directions, SPRINGS), contacts)
    result[top, top] += GROUND
    return result


@pytest.fixture(scope="module")
def case() -> Case:
    line = line_on_block()
    whole = Whole(line)
    reduced = reduce_bodies(whole.systems, whole.boundary, 12)
    rows = (reduced.rows(body, "contact").reshape(-1, 3) for body in ("block", "beam"))
    springs = stuck(reduced.n_dof, make_contact_directions(reduced.n_dof, line, *rows), reduced.rows("block", "top"))
    top = whole.boundary["block"]["top"] + whole.systems["beam"].n_dof
    return Case(whole, reduced, springs, stuck(whole.n_dof, whole.directions, top))


def dense(case: Case) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    systems = case.whole.systems.values()
    mass, stiffness = (sp.block_diag([getattr(s, name) for s in systems]).toarray() for name in ("mass", "stiffness"))
    return mass, stiffness + case.in_full


def test_errors_are_those_against_dense_solutions_of_the_whole(case: Case) -> None:
    mass, stiffness = dense(case)
    result = assembly_error(case.whole.systems, case.reduced, case.springs, N_MODE, BETWEEN)
    exact, shapes = scipy.linalg.eigh(stiffness, mass, subset_by_index=[0, N_MODE - 1])
    np.testing.assert_allclose(result.frequency, np.sqrt(exact) / (2 * np.pi), rtol=1e-9)

    lambda_, q = scipy.linalg.eigh(case.reduced.stiffness + case.springs, case.reduced.mass)
    error = np.sqrt(lambda_[:N_MODE] / exact) - 1
    # The dense solutions have errors of 1e-16 times the highest eigenvalue, 1e9 times the first.
    np.testing.assert_allclose(result.frequency_error, error, atol=2e-7, rtol=1e-3)
    assert error.max() > 1e-5  # so few modes are felt
    recovered = scipy.linalg.block_diag(*(rom.recovery for rom in case.reduced.bodies.values())) @ q[:, :N_MODE]
    cosine = np.einsum("nm,nm->m", recovered, shapes)
    cosine /= np.linalg.norm(recovered, axis=0) * np.linalg.norm(shapes, axis=0)
    np.testing.assert_allclose(result.mac, cosine**2, atol=1e-9)
    assert result.mac.min() > 0.99

    rows = np.flatnonzero(np.any(case.in_full != 0, axis=1))
    small = np.flatnonzero(np.any(case.springs != 0, axis=1))
    for frequency, error in zip(BETWEEN, result.receptance_error, strict=True):
        omega = 2 * np.pi * frequency
        whole = np.linalg.inv(stiffness - omega**2 * mass)
        reduced = np.linalg.inv(case.reduced.stiffness + case.springs - omega**2 * case.reduced.mass)
        # The order of rows differs between the two models, and a norm does not see it if both are sorted alike.
        order, own = np.argsort(physical(case)[small]), np.ix_(rows, rows)
        apart = reduced[np.ix_(small[order], small[order])] - whole[own]
        assert error == pytest.approx(np.linalg.norm(apart) / np.linalg.norm(whole[own]), rel=1e-3, abs=1e-9)


def physical(case: Case) -> NDArray[np.int64]:
    """Rows in full of the assembly's coordinates; modal ones have none."""
    result, start = np.full(case.reduced.n_dof, -1), 0
    for body, system in case.whole.systems.items():
        for name, rows in case.whole.boundary[body].items():
            result[case.reduced.rows(body, name)] = start + rows
        start += system.n_dof
    return result


def test_with_all_modes_nothing_is_missing(case: Case) -> None:
    block = {"block": case.whole.systems["block"]}
    every = reduce_bodies(block, case.whole.boundary, {"block": 10**6})
    springs = np.zeros((every.n_dof, every.n_dof))
    rows = np.concatenate([every.rows("block", name) for name in ("contact", "top")])
    springs[rows, rows] = 1e6
    result = assembly_error(block, every, springs, 5, np.array([100.0]))
    np.testing.assert_allclose(result.frequency_error, 0, atol=1e-7)
    np.testing.assert_allclose(result.mac, 1, atol=1e-9)
    assert result.receptance_error[0] < 1e-7


def test_shapes_of_two_equal_bodies_may_mix(case: Case) -> None:
    # Each frequency comes twice, and any mixture of the two shapes is a shape.
    systems = dict.fromkeys(("one", "other"), case.whole.systems["block"])
    few = reduce_bodies(systems, dict.fromkeys(systems, case.whole.boundary["block"]), {"one": 4, "other": 4})
    springs = np.zeros((few.n_dof, few.n_dof))
    rows = np.concatenate([few.rows(body, name) for body in systems for name in ("contact", "top")])
    springs[rows, rows] = 1e6
    result = assembly_error(systems, few, springs, 4, np.array([100.0]))
    np.testing.assert_allclose(result.frequency[::2], result.frequency[1::2], rtol=1e-6)
    assert result.mac.min() > 0.99


@pytest.mark.parametrize(
    ("n_mode", "factor", "said"), [(10**4, 1.0, "modes cannot be compared"), (2, 0.0, "springs are zero")]
)
def test_what_cannot_be_compared_is_refused(case: Case, n_mode: int, factor: float, said: str) -> None:
    with pytest.raises(RomError, match=said):
        assembly_error(case.whole.systems, case.reduced, factor * case.springs, n_mode, np.array([100.0]))


def test_results_are_copies_that_cannot_be_written(case: Case) -> None:
    between = np.array([100.0])
    result = assembly_error(case.whole.systems, case.reduced, case.springs, 2, between)
    between[0] = 0.0
    assert result.receptance_frequency[0] == 100.0
    for values in vars(result).values():
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 0.0


def test_what_does_not_belong_together_is_refused(case: Case) -> None:
    systems = case.whole.systems
    with pytest.raises(RomError, match=r"springs of shape \(3, 3\) are not those of the assembly: give \(33, 33\)"):
        join_systems(systems, case.reduced, np.zeros((3, 3)))
    modal = case.springs.copy()
    modal[-1, -1] = 1.0
    with pytest.raises(RomError, match=r"springs act on the modal coordinate 32, which the full model does not have"):
        join_systems(systems, case.reduced, modal)
    with pytest.raises(RomError, match=r"there is no full model of block, but of beam: give one for each body"):
        join_systems({"beam": systems["beam"]}, case.reduced, case.springs)
    other = {**systems, "block": replace(systems["block"], n_node=7)}
    with pytest.raises(RomError, match=r"block was not reduced from the system that is given for it"):
        join_systems(other, case.reduced, case.springs)
