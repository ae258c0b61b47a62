"""Branches through kinks: contacts that change their state turn the branch by any angle."""

import numpy as np
import pytest

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.continuation_parameter import FrequencyPath
from hbsolve.continuation.response import begin, frequency_response
from hbsolve.continuation.step import Continuation
from hbsolve.continuation.stop_reason import StopReason
from hbsolve.steady_state import steady_state
from reduction.jointed_system import CubicSpring, ElasticStop, FrictionContact, JointedSystem, along, between
from tests.slow import slow


def wedge_chain(level: float) -> HarmonicBalance:
    """Three masses; the further the last one moves, the harder it presses on what rubs."""
    stiffness = 4e4 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    wedge = along(3, {2: 0.5})
    rub = FrictionContact(
        name="rub",
        tangents=between(3, 2),
        normal=wedge,
        tangential_stiffness=3e4,
        normal_stiffness=4e4,
        friction_coefficient=0.4,
        preload=8.0,
    )
    system = JointedSystem(
        mass=np.eye(3),
        damping=1e-4 * stiffness,
        stiffness=stiffness,
        joints=[rub, CubicSpring(name="cubic", direction=between(3, 0), stiffness=2e11)],
        static_load=8.0 * wedge,
        harmonic_force=[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]],
    )
    return HarmonicBalance(system=system, n_harmonic=10, level=level)


def stopped(level: float) -> HarmonicBalance:
    """One mass, before a stop a hundred times stiffer than its spring: sharp folds where they touch."""
    system = JointedSystem(
        mass=[[1.0]],
        damping=[[0.02]],
        stiffness=[[1.0]],
        joints=[ElasticStop(name="stop", direction=along(1, {0: 1.0}), stiffness=100.0, gap=1.0)],
        harmonic_force=[[0.0], [0.1]],
    )
    return HarmonicBalance(system=system, n_harmonic=6, level=level)


@pytest.mark.parametrize("level", [8.0, *(pytest.param(level, marks=slow) for level in (6.0, 14.0))])
def test_a_branch_passes_the_kinks_of_a_wedge_to_its_last_value(level: float) -> None:
    balance = wedge_chain(level)
    branch = frequency_response(balance, 2 * np.pi * 12, 2 * np.pi * 32)

    assert branch.stop_reason is StopReason.REACHED
    # Each point solves the balance by itself, to Newton's own tolerance of 1e-9 and a margin for the recovery.
    assert branch.residual_norm.max() < 1e-8
    # Folds hide nothing: on the way the branch meets the single states at its two ends.
    assert branch.frequency[0] == pytest.approx(12)
    assert branch.frequency[-1] == pytest.approx(32)


@pytest.mark.parametrize(
    "balance",
    [wedge_chain(4.0), pytest.param(wedge_chain(10.0), marks=slow), stopped(1.0)],
    ids=["4 N", "10 N", "stop"],
)
def test_the_orientation_is_kept_round_folds_and_kinks(balance: HarmonicBalance) -> None:
    # A branch without branch points keeps the sign of its bordered determinant from end to end.
    natural = 1.0 if balance.n_direction == 1 else 2 * np.pi * 16
    continuation = Continuation(path=FrequencyPath(balance=balance), first=0.75 * natural, last=2 * natural)
    _, state = begin(continuation)
    signs, turns, last = set(), 0, 1.0
    while state.stop_reason is None:
        point, state = continuation.advance(state)
        if point is not None and not state.stop_reason:
            signs.add(state.orientation)
            turns += np.sign(state.tangent.value) != last
            last = np.sign(state.tangent.value)

    assert state.stop_reason is StopReason.REACHED
    assert signs == {1}
    assert turns >= 2  # or it says nothing about folds


@pytest.mark.parametrize("omega", [2.4, pytest.param(0.8, marks=slow)])
def test_both_directions_of_travel_meet_at_a_stop(omega: float) -> None:
    # Away from its folds a stop has one state a frequency, whichever way the branch came.
    balance = stopped(1.0)
    path = FrequencyPath(balance=balance)
    result = []
    for first in (0.6, 3.0):
        continuation = Continuation(path=path, first=first, last=omega)
        _, state = begin(continuation)
        while state.stop_reason is None:
            _, state = continuation.advance(state)
        assert state.stop_reason is StopReason.REACHED
        result.append(state.motion)
    alone = steady_state(balance, omega)
    np.testing.assert_allclose(result[0], alone.motion, atol=1e-7 * np.abs(alone.motion).max())
    np.testing.assert_allclose(result[1], alone.motion, atol=1e-7 * np.abs(alone.motion).max())
