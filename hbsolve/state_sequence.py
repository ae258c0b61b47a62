"""A sequence of steady states, each with the sliders in which the state before ended, compiled as a whole.

A sweep of a test is such a sequence. Common quantities are prepared once: the table of the joints, the receptances at
all frequencies, and the start of each state.
"""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int

from fe.compiled import compiled
from hbsolve.aft import InitialSliders, joint_forces
from hbsolve.balance import HarmonicBalance
from hbsolve.condensed import Condensed
from hbsolve.joint_law.registry import FORCE
from hbsolve.newton import NO_LOAD, BalancePoint, apply_receptance, newton_with_forces
from hbsolve.solution import TOLERANCE
from reduction.array_type import Array, Real, Whole


class StateSequence(NamedTuple):
    """n states, each given by its frequency and a guess; F frequencies, d joint directions, nh = 2 H + 1."""

    frequency_index: Int[Whole, " n"]
    """Index of the frequency of each state, shape (n,)."""
    earlier_state: Int[Whole, " n"]
    """Index of an earlier state of the same frequency, which is the same state if its sliders are the same; -1 for
    none, shape (n,)."""
    angular_frequency: Float[Real, " F"]
    """Omega, shape (F,) [rad/s]."""
    linear: Float[Real, "F d nh"]
    """Motion of the directions with all contacts stuck, shape (F, d, nh) [m]."""
    columns: Array
    """Columns of A_k: row j has the displacements under a unit force along direction j, shape (F, H + 1, d, d) [m/N].
    """
    guess: Float[Real, "n d nh"]
    """Motion near each state; NaN where none is known, shape (n, d, nh) [m]."""


class Track(NamedTuple):
    """Sequence of states found by `follow`."""

    motion: Float[Real, "n d nh"]
    """Motion of the joint directions, shape (n, d, nh) [m]."""
    force: Float[Real, "n d nh"]
    """Joint force beyond D x, shape (n, d, nh) [N]."""
    initial_slider: Float[Real, "n s"]
    """Slider positions at the start of each state, shape (n, s) [m]."""
    periodic_slider: Float[Real, "n s"]
    """Slider positions at the start of the steady period, shape (n, s) [m]."""
    norm: Float[Real, " n"]
    """|R| relative to the linear motion; NaN where there is no state, shape (n,) [-]."""
    iterations: Int[Whole, " n"]
    """Newton iterations, shape (n,) [-]."""


def make_empty_track(n: int, n_direction: int, nh: int, n_slider: int) -> Track:
    """A track without a state."""
    return Track(
        np.full((n, n_direction, nh), np.nan),
        np.full((n, n_direction, nh), np.nan),
        np.full((n, n_slider), np.nan),
        np.full((n, n_slider), np.nan),
        np.full(n, np.nan),
        np.zeros(n, dtype=np.int64),
    )


@compiled
def follow(
    first_state: int, carried: bool, from_guess: bool, sequence: Any, arrays: Any, slider: Any, tolerance: float,
    max_iteration: int, track: Any,
) -> Any:  # fmt: skip
    """Write the states from number `first_state` on into a track, up to the first where Newton's method alone fails.

    Parameters
    ----------
    first_state
        Number of the first state; the one before it, if any, is in the track.
    carried
        Whether a state begins with the sliders at the end of the state before, and not with `slider`.
    from_guess
        Whether a state starts from its guess plus the difference of the state before from its guess; else it starts
        from the state before.
    sequence
        `StateSequence` of the states.
    arrays
        `hbsolve.aft.BalanceArrays`.
    tolerance, max_iteration
        As for `hbsolve.newton.newton`; the tolerance is relative to the linear motion.
    slider
        Slider positions at the start of the first state, shape (s,) [m].
    track
        Track into which the results are written.

    Returns
    -------
    Number of the state that failed; n if none did.
    """
    n = len(sequence.frequency_index)
    by_multiplier = np.zeros(len(slider), np.int64)
    value = slider.copy()
    for i in range(first_state, n):
        index = sequence.frequency_index[i]
        before = i - 1
        neighboured = before >= 0 and np.isfinite(track.norm[before])
        if carried and neighboured:
            value = track.periodic_slider[before].copy()
        track.initial_slider[i] = value
        known = sequence.earlier_state[i]
        if known >= 0 and np.isfinite(track.norm[known]) and np.all(track.initial_slider[known] == value):
            track.motion[i], track.force[i] = track.motion[known], track.force[known]
            track.periodic_slider[i] = track.periodic_slider[known]
            track.norm[i], track.iterations[i] = track.norm[known], 0
            continue
        linear = sequence.linear[index]
        scale = max(np.sqrt((linear * linear).sum()), NO_LOAD)
        guessed = np.isfinite(sequence.guess[i]).all()
        if from_guess and guessed:
            x = sequence.guess[i].copy()
            if neighboured and np.isfinite(sequence.guess[before]).all():
                x += track.motion[before] - sequence.guess[before]
        elif neighboured:
            x = track.motion[before].copy()
        elif guessed:
            x = sequence.guess[i].copy()
        else:
            x = linear.copy()
        point = BalancePoint(linear, sequence.angular_frequency[index], sequence.columns[index], arrays)
        start = InitialSliders(value, by_multiplier)
        norm, iteration = np.inf, 0
        if from_guess and (not neighboured or track.iterations[before] == 0):
            # Many guesses are already solutions, which need no derivatives.
            forces = joint_forces(x, point.angular_frequency, arrays.table, start, arrays.sampling, FORCE)
            R = x - linear + apply_receptance(point.columns, forces.coefficients)
            norm = np.sqrt((R * R).sum())
        if not norm <= tolerance * scale:
            x, norm, iteration, forces = newton_with_forces(x, point, start, tolerance * scale, max_iteration)
        if not norm <= tolerance * scale:
            return i
        track.motion[i], track.force[i] = x, forces.coefficients
        # The last instant of one period precedes the first of the next.
        track.periodic_slider[i] = forces.slider[:, -1]
        track.norm[i], track.iterations[i] = norm / scale, iteration
    return n


def follow_one(
    balance: HarmonicBalance,
    condensed: Condensed,
    slider: Float[Real, " s"],
    start: Float[Real, "d nh"],
    max_iteration: int,
) -> Track:
    """The state that Newton's method alone finds from a motion, as a track of one; its norm is NaN if there is none.

    Parameters
    ----------
    balance, condensed
        Harmonic balance, and its structure at the frequency.
    slider
        Slider positions at the start of the state, shape (s,) [m].
    start
        Motion of the joint directions, shape (d, nh) [m].
    max_iteration
        As for `follow`.
    """
    linear = balance.linear(condensed)[None]
    omega, columns = np.array([condensed.angular_frequency]), np.ascontiguousarray(condensed.columns)[None]
    sequence = StateSequence(np.zeros(1, dtype=np.int64), np.full(1, -1), omega, linear, columns, start[None].copy())
    track = make_empty_track(1, balance.n_direction, start.shape[1], balance.n_slider)
    follow(0, False, True, sequence, balance.arrays, slider.astype(float), TOLERANCE, max_iteration, track)
    return track
