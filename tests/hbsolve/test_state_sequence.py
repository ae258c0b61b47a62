"""States that are followed in compiled code are those of single solves, each with the sliders of the last."""

from collections.abc import Callable

import numpy as np
import pytest

from benchmarks.random_systems import random_problem
from hbsolve.balance import HarmonicBalance
from hbsolve.sampling import real_from_complex
from hbsolve.solution import MAX_ITERATION, TOLERANCE
from hbsolve.state_sequence import StateSequence, follow, make_empty_track
from hbsolve.steady_state import steady_state

N = 12


def track_of(balance: HarmonicBalance, omega: np.ndarray, slider: np.ndarray, guess: np.ndarray, *, from_guess: bool):
    condensed = [balance.at(float(item)) for item in omega]
    linear = real_from_complex(np.array([item.static + balance.level * item.dynamic for item in condensed]))
    index = np.array([*range(len(omega)), *range(len(omega) - 1, -1, -1)])
    earlier_state = np.array([-1] * len(omega) + list(range(len(omega) - 1, -1, -1)))
    sequence = StateSequence(index, earlier_state, omega, linear, np.array([item.columns for item in condensed]), guess)
    track = make_empty_track(len(index), balance.n_direction, 2 * balance.n_harmonic - 1, balance.n_slider)
    done = follow(0, True, from_guess, sequence, balance.arrays, slider, TOLERANCE, MAX_ITERATION, track)
    return done, track, index


@pytest.mark.parametrize("seed", [3, 7, 12])
def test_a_followed_sweep_is_that_of_single_solves(seed: int) -> None:
    problem = random_problem(seed)
    balance = HarmonicBalance(system=problem.system, n_harmonic=6, n_sample=128)
    omega = np.sort(problem.angular_frequency)[:N].copy()
    guess = np.full((2 * N, balance.n_direction, 2 * balance.n_harmonic - 1), np.nan)
    done, track, index = track_of(balance, omega, problem.slider, guess, from_guess=False)
    sliders, before = problem.slider, None
    for number in range(done):
        before = steady_state(balance, float(omega[index[number]]), start=before, slider=sliders)
        sliders = before.periodic_slider
        scale = np.abs(before.motion).max()
        # Both are solutions to 1e-9 of the linear motion, which is up to a hundred times as large near a resonance.
        np.testing.assert_allclose(track.motion[number], before.motion, rtol=0, atol=1e-6 * scale)
        np.testing.assert_allclose(track.periodic_slider[number], sliders, rtol=0, atol=1e-6 * scale)
    assert done > N // 2


def test_states_that_are_guessed_right_take_no_iteration() -> None:
    problem = random_problem(12)
    balance = HarmonicBalance(system=problem.system, n_harmonic=6, n_sample=128)
    omega = np.sort(problem.angular_frequency)[:N].copy()
    unknown = np.full((2 * N, balance.n_direction, 2 * balance.n_harmonic - 1), np.nan)
    done, track, _ = track_of(balance, omega, problem.slider, unknown, from_guess=False)
    assert done == 2 * N
    again = track_of(balance, omega, problem.slider, track.motion.copy(), from_guess=True)[1]
    assert not again.iterations.any()
    np.testing.assert_array_equal(again.motion, track.motion)


@pytest.mark.parametrize("change", [lambda contact: {"preload": 1.3 * contact.preload + 1.0}, lambda _: {}])
def test_a_balance_on_the_same_structure_is_a_new_one(change: Callable[..., dict[str, float]]) -> None:
    from dataclasses import replace

    system = random_problem(7).system
    other = replace(
        system,
        joints=[joint.with_values(change(joint)) for joint in system.joints],
        static_load=system.static + 0.5,
    )
    first = HarmonicBalance(system=system, n_harmonic=6, n_sample=128)
    shared, own = first.on_same_structure(other), HarmonicBalance(system=other, n_harmonic=6, n_sample=128)
    assert shared is not None
    for one, two in zip(shared.at(50.0)[:-1], own.at(50.0)[:-1], strict=True):
        # Round-off of the same operations.
        np.testing.assert_allclose(one, two, rtol=1e-10, atol=1e-16)
    np.testing.assert_array_equal(shared.table.value, own.table.value)
    assert first.on_same_structure(replace(other, stiffness=1.01 * system.stiffness)) is None
