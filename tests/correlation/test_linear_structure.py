"""What is stored of a linear structure is made again where it was freed."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest

import correlation.linear_structure as module
from correlation.linear_structure import LinearStructure
from hbsolve.balance import HarmonicBalance
from reduction.jointed_system import FrictionContact, JointedSystem

FREQUENCIES = [3.0, 4.0, 5.0]


#: More than a damping of low rank beside a diagonal one has.
N = 40


def dense_structure(stiffness: float) -> LinearStructure:
    """Masses on springs, whose damping no modes uncouple."""
    spread = np.random.default_rng(2).standard_normal((N, N))
    normal, tangent = np.eye(N)[:2]
    contact = FrictionContact(
        name="pad", normal=normal, tangents=tangent[None], normal_stiffness=1e3, tangential_stiffness=5e2,
        friction_coefficient=0.4, preload=5.0,
    )  # fmt: skip
    system = JointedSystem(
        mass=np.eye(N), damping=spread @ spread.T, stiffness=stiffness * np.diag(np.linspace(1.0, 3.0, N)),
        joints=[contact], static_load=5.0 * normal, harmonic_force=np.array([np.zeros(N), np.eye(N)[2]]),
    )  # fmt: skip
    balance = HarmonicBalance(system=system, n_harmonic=3, n_sample=32)
    assert balance.is_dense
    return LinearStructure(balance=balance, frequency_shift=0.0)


def test_older_structures_lose_their_recoveries_and_make_them_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    first, second = dense_structure(1e3), dense_structure(2e3)
    first.condense(FREQUENCIES)
    contact = first.contact(4.0).copy()
    monkeypatch.setattr(module, "DENSE_RECOVERY", first.recovery_size)
    second.condense(FREQUENCIES)
    assert first.recovery_size == 0
    assert second.recovery_size == measure(second)
    # Solved again from the same matrices: round-off alone.
    np.testing.assert_allclose(first.contact(4.0), contact, rtol=1e-12)
    assert first.recovery_size > 0


def measure(structure: LinearStructure) -> int:
    balance = structure.balance
    return 16 * balance.n_harmonic * balance.n_direction * balance.system.n_dof * len(FREQUENCIES)


@pytest.mark.parametrize("asymmetry", [0.0, 1.0])
def test_a_structure_is_freed_without_the_garbage_collector(asymmetry: float) -> None:
    turned = dense_structure(1e3)
    system = turned.balance.system
    damping = np.array(system.damping)
    damping[0, 1] += asymmetry
    balance = HarmonicBalance(system=replace(system, damping=damping), n_harmonic=3, n_sample=32)
    structure = LinearStructure(balance=balance, frequency_shift=0.0)
    structure.condense(FREQUENCIES)
    assert (structure.reciprocal is structure) == (asymmetry == 0.0)
    reference = weakref.ref(structure)
    gc.disable()
    try:
        del structure, turned
        assert reference() is None
    finally:
        gc.enable()


def test_structures_that_are_gone_take_no_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    gone, stays = dense_structure(1e3), dense_structure(2e3)
    gone.condense(FREQUENCIES)
    monkeypatch.setattr(module, "DENSE_RECOVERY", 2 * gone.recovery_size)
    del gone
    stays.condense(FREQUENCIES)
    last = dense_structure(3e3)
    last.condense(FREQUENCIES)
    assert stays.recovery_size == last.recovery_size > 0
