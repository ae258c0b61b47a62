"""Several steady states at one frequency: other branches, and other friction histories."""

from collections.abc import Iterator

import numpy as np

from fe.blas_threads import on_one_blas_thread
from hbsolve.aft import InitialSliders
from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.continuation_parameter import LevelPath
from hbsolve.continuation.step import Continuation
from hbsolve.errors import NoSteadyState
from hbsolve.joint_law.registry import FORCE
from hbsolve.solution import forces_at, solve_at
from hbsolve.state import SteadyState, is_same_motion, make_initial_sliders
from reduction.array_type import Real

#: Largest amplitude of random starts, relative to the linear motion.
START_REACH = 2.0
#: First and last level of an arc, relative to the level of the balance, and its largest number of points.
ARC_FIRST, ARC_LAST, ARC_POINTS = 0.05, 10.0, 400


@on_one_blas_thread
def steady_states(
    balance: HarmonicBalance, angular_frequency: float, *, n_start: int = 20, seed: int = 0, slider: Real | None = None
) -> tuple[SteadyState, ...]:
    """Distinct steady states of the same sliders from several starts, lowest vibration first.

    Starts are the points at which an arc over the level passes that of the balance, up and down round its folds, to
    ten times the level; then the motion with all contacts stuck, scaled from rest to twice itself, with random phases.
    These starts do not necessarily find all states.

    Parameters
    ----------
    balance, angular_frequency, slider
        As `hbsolve.steady_state.steady_state`.
    n_start
        Number of starts besides those of the arc [-].
    seed
        Seed of the random numbers.
    """
    condensed = balance.at(angular_frequency)
    sliders = make_initial_sliders(balance, slider)
    result: list[SteadyState] = []
    starts = [*find_motions_along_the_level(balance, angular_frequency, sliders)]
    starts += _list_scaled(balance.linear(condensed), n_start, seed)
    for start in starts:
        try:
            state = solve_at(balance, condensed, start, sliders)
        except NoSteadyState:
            continue
        if not any(is_same_motion(other.motion, state.motion) for other in result):
            result.append(state)
    return tuple(sorted(result, key=lambda state: float(np.linalg.norm(state.displacement[1:]))))


def _list_scaled(linear: Real, n_start: int, seed: int) -> Iterator[Real]:
    """The linear motion, and others of its shape with random amplitudes and phases."""
    random = np.random.default_rng(seed)
    for number in range(n_start):
        start = linear.copy()
        angle = random.uniform(-np.pi, np.pi) if number else 0.0
        scale = random.uniform(0, START_REACH) if number else 1.0
        cosine, sine = linear[:, 1::2], linear[:, 2::2]
        start[:, 1::2] = scale * (np.cos(angle) * cosine + np.sin(angle) * sine)
        start[:, 2::2] = scale * (np.cos(angle) * sine - np.sin(angle) * cosine)
        yield start


def find_motions_along_the_level(
    balance: HarmonicBalance, angular_frequency: float, sliders: InitialSliders
) -> Iterator[Real]:
    """Motions near steady states where an arc over the level, round its folds, passes that of the balance."""
    level = balance.level
    if not level or not balance.n_direction:
        return
    path = LevelPath(balance=balance, angular_frequency=angular_frequency)
    arc = Continuation(path=path, first=ARC_FIRST * level, last=ARC_LAST * level, most_points=ARC_POINTS)
    at, condensed = path.at(arc.first)
    try:
        state = arc.state_at(solve_at(at, condensed, None, sliders).motion, sliders)
    except NoSteadyState:
        return
    while state.stop_reason is None:
        before = state
        _, state = arc.advance(state)
        way = state.value - before.value
        share = (level - before.value) / way if way else -1.0
        if 0 <= share <= 1:
            yield before.motion + share * (state.motion - before.motion)


@on_one_blas_thread
def friction_history_states(
    balance: HarmonicBalance, angular_frequency: float, *, n_history: int = 20, seed: int = 0
) -> tuple[SteadyState, ...]:
    """Distinct steady states that differ in the initial positions of their sliders, lowest vibration first.

    Sliders begin at random positions within Coulomb's cone about the motion with all contacts stuck (eq. 11 with random
    m); in the first state springs begin without tension.

    Parameters
    ----------
    balance, angular_frequency
        As `hbsolve.steady_state.steady_state`.
    n_history
        Number of friction histories [-].
    seed
        Seed of the random numbers.
    """
    condensed = balance.at(angular_frequency)
    linear = balance.linear(condensed)
    random = np.random.default_rng(seed)
    result: list[SteadyState] = []
    for number in range(n_history):
        m = random.uniform(-1, 1, balance.n_slider)
        start = make_initial_sliders(balance, m, multiplier=True)
        initial = forces_at(balance, angular_frequency, linear, start, want=FORCE).slider[:, 0]
        sliders = make_initial_sliders(balance, initial if number else None)
        try:
            state = solve_at(balance, condensed, result[-1].motion if result else None, sliders)
        except NoSteadyState:
            continue
        if not any(is_same_motion(other.motion, state.motion) for other in result):
            result.append(state)
    return tuple(sorted(result, key=lambda state: float(np.linalg.norm(state.displacement[1:]))))
