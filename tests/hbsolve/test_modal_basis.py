"""A structure that differs in few directions from one whose modes are known: as dense solves give it."""

import numpy as np
import pytest
import scipy.linalg
from numpy.typing import NDArray

from fe.dense_modes import compute_dense_modes
from hbsolve.condensed import CondensedStructure
from hbsolve.diagonal_plus_low_rank import MAX_RANK, split_diagonal_plus_low_rank
from hbsolve.dynamic_stiffness import DynamicStiffness
from hbsolve.errors import ForceError
from hbsolve.modal_coordinates import ModalCoordinates

Matrix = NDArray[np.float64]
R, HARMONICS = 40, 4
OMEGA = 90.0  # rad/s, between the first natural frequencies


def drawn() -> tuple[Matrix, Matrix, Matrix]:
    """Mass, modal damping of 1 % and stiffness of a chain with springs to ground."""
    random = np.random.default_rng(1)
    mass = np.diag(random.uniform(1.0, 2.0, R))
    stiffness = 1e5 * (2.1 * np.eye(R) - np.eye(R, k=1) - np.eye(R, k=-1))
    squared, shapes = scipy.linalg.eigh(stiffness, mass)
    weighed = mass @ shapes
    return mass, (weighed * (0.02 * np.sqrt(squared))) @ weighed.T, stiffness


def changed(spring: float = 0.0, mass: float = 0.0, dashpot: float = 0.0, mode: float = 0.0) -> DynamicStiffness:
    """The same with an effect of each kind at a place, and with an error of its second natural frequency."""
    M, C, K = drawn()
    squared, shapes = scipy.linalg.eigh(K, M)
    own = M @ shapes[:, 1]
    K = 1.02 * K + mode * squared[1] * np.outer(own, own)
    K[7, 7] += spring
    M[12, 12] += mass
    C[21, 21] += dashpot
    basis = compute_dense_modes(*(drawn()[number] for number in (0, 2))).shapes
    return DynamicStiffness(mass=M, damping=0.9 * C, stiffness=K, basis=basis)


EFFECTS = [
    {"spring": 3e3}, {"mass": 0.2}, {"dashpot": 40.0}, {"spring": -2e3, "mass": 0.1, "dashpot": 5.0, "mode": 0.01},
]  # fmt: skip


@pytest.mark.parametrize("effects", EFFECTS)
def test_responses_are_those_of_dense_solves(effects: dict[str, float]) -> None:
    one = changed(**effects)
    plain = DynamicStiffness(mass=one.mass, damping=one.damping, stiffness=one.stiffness)
    assert plain.damping_couples_modes
    assert not one.damping_couples_modes
    random = np.random.default_rng(2)
    omega = OMEGA * np.arange(1, HARMONICS + 1)
    force = random.standard_normal((HARMONICS, R)) + 1j * random.standard_normal((HARMONICS, R))
    directions = random.standard_normal((3, R))
    for ours, exact in zip(
        one.condense_with_slopes(omega, directions, force), plain.condense_with_slopes(omega, directions, force),
        strict=True,
    ):  # fmt: skip
        # Round-off of matrices of a condition number of 1e3, and entries of 1e-10 that count as round-off.
        np.testing.assert_allclose(ours, exact, rtol=0, atol=1e-8 * np.abs(exact).max())
    exact = plain.response(omega, force)
    np.testing.assert_allclose(one.response(omega, force), exact, rtol=0, atol=1e-8 * np.abs(exact).max())


def test_a_structure_with_contacts_is_condensed_as_by_dense_solves() -> None:
    """Stuck contacts couple the modes; the structure without them is the one that is near."""
    one = changed(spring=3e3, dashpot=40.0)
    random = np.random.default_rng(3)
    dynamic = np.zeros((HARMONICS, R), dtype=np.complex128)
    dynamic[1, 0] = 1.0
    static = np.zeros_like(dynamic)
    static[0, 5] = 2.0
    directions, reference = np.eye(R)[[3, 30]], np.array([2e4, 5e4])
    both = [
        CondensedStructure(
            mass=one.mass, damping=one.damping, stiffness=one.stiffness, directions=directions, reference=reference,
            static=static, dynamic=dynamic, basis=basis,
        )
        for basis in (one.basis, None)
    ]  # fmt: skip
    assert [item.is_dense for item in both] == [False, True]
    result, exact = (item.at(OMEGA) for item in both)
    (condensed, recovery) = both[1].at_with_recovery(OMEGA)
    rows = random.standard_normal((2, R))
    for name in ("receptance", "static", "dynamic"):
        value = getattr(exact, name)
        np.testing.assert_allclose(getattr(result, name), value, rtol=0, atol=1e-8 * np.abs(value).max())
        np.testing.assert_allclose(getattr(condensed, name), value, rtol=0, atol=1e-12 * np.abs(value).max())
    for ours, one_solve, value in zip(
        both[0].recover_rows([result], rows)[0],
        recovery.at_rows(rows),
        both[1].recover_rows([exact], rows)[0],
        strict=True,
    ):
        np.testing.assert_allclose(ours, value, rtol=0, atol=1e-8 * np.abs(value).max())
        np.testing.assert_allclose(one_solve, value, rtol=0, atol=1e-12 * np.abs(value).max())


@pytest.mark.parametrize("count", [0, 1, 3, 6])
def test_low_rank_is_split_from_the_diagonal(count: int) -> None:
    random = np.random.default_rng(4)
    diagonal, U = random.uniform(1.0, 100.0, R), random.standard_normal((R, count))
    matrix = np.diag(diagonal) + (U * random.uniform(-1.0, 3.0, count)) @ U.T
    result = split_diagonal_plus_low_rank(matrix)
    assert result is not None
    assert len(result.strength) == count
    again = np.diag(result.diagonal) + (result.directions * result.strength) @ result.directions.T
    np.testing.assert_allclose(again, matrix, rtol=0, atol=1e-9 * np.abs(matrix).max())


def test_a_matrix_of_high_rank_is_not_split() -> None:
    random = np.random.default_rng(5)
    U = random.standard_normal((3 * MAX_RANK, MAX_RANK + 5))
    assert split_diagonal_plus_low_rank(np.eye(3 * MAX_RANK) + U @ U.T) is None
    full = random.standard_normal((R, R))
    assert split_diagonal_plus_low_rank(full + full.T + 20 * np.eye(R)) is None


@pytest.mark.parametrize("unit", [1.0, 1e-9, 1e9])
def test_an_undamped_resonance_is_refused_in_any_units(unit: float) -> None:
    """Coordinates of a basis are those of its own stiffness and mass, which are not 1."""
    stiffness, mass = unit * np.array([7e3 / 3, 4e4]), unit * np.array([1.3, 1.0])
    diagonals = np.array([stiffness, mass, [0.0, 3.0 * unit], [0.0, 0.0]])
    modal = ModalCoordinates(
        shapes=np.eye(2), diagonals=diagonals, shift=0.0, directions=np.zeros((2, 0)), strength=np.zeros((4, 0))
    )
    resonance, force = np.sqrt(stiffness[0] / mass[0]), np.array([[unit, 0.0]], dtype=complex)
    with pytest.raises(ForceError, match="is exactly at the undamped mode 1"):
        modal.response(np.array([resonance]), force)
    # A millionth beside it there is none; 1e-6 of the stiffness are left with ten digits.
    omega = resonance * (1 + 1e-6)
    result = modal.response(np.array([omega]), force)[0, 0]
    assert result == pytest.approx(unit / (stiffness[0] - mass[0] * omega**2), rel=1e-8)
