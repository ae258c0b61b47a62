r"""Monodromy matrix: maps a small disturbance of a periodic motion to that one period later.

The disturbance is integrated along the periodic motion of the balance, instant by instant. The structure moves exactly
between instants (`hbsolve.stability.linear_step`), and the joint forces change by the slopes of their laws, which are
implicit in the motion at the end of the step,

.. math:: \delta g_k = T_u\, \delta u_k + T_v\, \delta \dot u_k + T_b\, \delta u_{k-1} + T_w\, \delta w_{k-1} .

Sliders are part of the state: between two slips a slider carries a disturbance from one time to a later one. Hill's
method, which expands the disturbance in harmonics of the motion with the Jacobian of the balance, cannot represent
that: its forces depend on a disturbance as if it repeated every period. Sliders that never move in the period are left
out: each has the multiplier 1, since there is a steady state for any position of it.

Forces are continuous where a contact begins to slip or to lift off, so that a disturbance has no jump there.

References
----------
Leine and Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, Springer (2004), chapter 7: fundamental
solutions of non-smooth systems.
"""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from fe.compiled import compiled
from hbsolve.aft import InitialSliders
from hbsolve.balance import HarmonicBalance
from hbsolve.joint_arrays import instant_force, make_slope_table, step_slopes
from hbsolve.joint_law.registry import FORCE
from hbsolve.linear_modes import LinearModes
from hbsolve.solution import forces_at
from hbsolve.stability.linear_step import linear_step
from reduction.array_type import Real, Whole


class ActiveJoints(NamedTuple):
    """Joints and sliders through which a disturbance acts beyond the linear reference."""

    joint: Whole
    """Joints whose forces change."""
    first_direction: Whole
    """Index in `direction` of the first direction of each of these joints."""
    direction: Whole
    """Directions of these joints in the balance."""
    slider: Whole
    """Number of each slider of the balance among those that move, -1 for others."""
    n_slider: int


def monodromy(
    balance: HarmonicBalance, modes: LinearModes, angular_frequency: float, motion: Real, start: InitialSliders
) -> tuple[Float[Real, "m m"], int]:
    """Monodromy matrix of a periodic motion, and the number of its multipliers near zero that the motion does not have.

    Parameters
    ----------
    balance
        System; its samples are the instants.
    modes
        Modes of its linear reference.
    angular_frequency
        Omega [rad/s].
    motion
        Real coefficients of the joint directions, shape (d, 2 H + 1) [m].
    start
        Sliders at the first instant.

    Returns
    -------
        Matrix of modal displacements and velocities, of the sliders that move, and of the joint forces that change. The
        first values of these forces are free in the scheme, but fixed by the motion: they add multipliers near zero.
    """
    sampling = balance.sampling
    u = motion @ sampling.evaluate
    velocity = angular_frequency * motion @ sampling.differentiate
    slider = forces_at(balance, angular_frequency, motion, start, want=FORCE).slider
    step = linear_step(modes, 2 * np.pi / (angular_frequency * balance.n_sample))
    table, slopes = balance.table, make_slope_table(balance.system.joints)
    matrix, n_force = _integrate_disturbances(step, modes.rows, table, slopes, u, velocity, slider)
    return matrix, int(n_force)


@compiled
def _slopes(j: int, before: int, k: int, table: Any, slopes: Any, u: Any, velocity: Any, slider: Any) -> Any:
    """Slopes of joint j in the step to instant k, as `hbsolve.joint_law.registry.CompiledLaw.step_slopes`."""
    d0, d1 = table.direction[j], table.direction[j + 1]
    s0, s1 = table.slider[j], table.slider[j + 1]
    parameters = table.value[table.parameter[j] : table.parameter[j + 1]]
    out = np.zeros((d1 - d0 + s1 - s0, 3 * (d1 - d0) + s1 - s0))
    if slopes.has_memory[j]:
        step_slopes(
            slopes.kind[j], table.address[j], u[d0:d1, before].copy(), u[d0:d1, k].copy(), velocity[d0:d1, k].copy(),
            slider[s0:s1, before].copy(), parameters, out,
        )  # fmt: skip
    else:
        slope = np.zeros(2 + len(parameters))
        instant_force(slopes.kind[j], table.address[j], u[d0, k], velocity[d0, k], parameters, slope)
        out[0, 0], out[0, 1] = slope[0], slope[1]
    for i in range(d1 - d0):
        out[i, i] -= table.reference[d0 + i]
    return out


@compiled
def _find_active(table: Any, slopes: Any, u: Any, velocity: Any, slider: Any) -> Any:
    """Joints whose forces change beyond the linear reference at any instant, and sliders that move."""
    n, n_joint = u.shape[1], len(table.direction) - 1
    number, n_slider = np.full(len(slider), -1), 0
    joint, first_direction = np.empty(n_joint, np.int64), np.empty(n_joint, np.int64)
    direction = np.empty(len(u), np.int64)
    count, n_direction = 0, 0
    for j in range(n_joint):
        d0, d, s0 = table.direction[j], table.direction[j + 1] - table.direction[j], table.slider[j]
        changes = False
        for k in range(n):
            out = _slopes(j, (k - 1) % n, k, table, slopes, u, velocity, slider)
            for row in range(out.shape[0]):
                for column in range(out.shape[1]):
                    at_rest = 1.0 if row >= d and column == 3 * d + row - d else 0.0
                    if out[row, column] == at_rest or (row < d and column >= 3 * d):
                        continue
                    changes = True
                    if row >= d and number[s0 + row - d] < 0:
                        number[s0 + row - d] = n_slider
                        n_slider += 1
        if changes:
            joint[count], first_direction[count] = j, n_direction
            direction[n_direction : n_direction + d] = np.arange(d0, d0 + d)
            count, n_direction = count + 1, n_direction + d
    return ActiveJoints(joint[:count], first_direction[:count], direction[:n_direction], number, n_slider)


@compiled
def _propagate(step: Any, Z: Any) -> Any:
    """State of the structure after a step without forces."""
    if not step.is_diagonal:
        return np.dot(step.matrix, Z)
    r = Z.shape[0] // 2
    after = np.empty_like(Z)
    for i in range(r):
        a, b, c, d = step.matrix[0, i], step.matrix[1, i], step.matrix[2, i], step.matrix[3, i]
        for column in range(Z.shape[1]):
            q, v = Z[i, column], Z[r + i, column]
            after[i, column], after[r + i, column] = a * q + b * v, c * q + d * v
    return after


@compiled
def _add_forces(
    block: Any, p: int, number: Any, free: Any, past: Any, W: Any, near: Any, matrix: Any, right: Any
) -> None:
    """Add the forces of one joint to the equations of all of them, matrix g = right.

    `free` holds displacements and velocities without the forces at the end of the step, `near` those per unit force.
    """
    d, r = (block.shape[1] - block.shape[0]) // 2, len(past)
    for i in range(d):
        for e in range(d):
            for part in range(2):
                slope, at = block[i, part * d + e], part * r + p + e
                if slope != 0.0:
                    right[p + i] += slope * free[at]
                    matrix[p + i] -= slope * near[at]
            if block[i, 2 * d + e] != 0.0:
                right[p + i] += block[i, 2 * d + e] * past[p + e]
        for s in range(len(number)):
            if number[s] >= 0 and block[i, 3 * d + s] != 0.0:
                right[p + i] += block[i, 3 * d + s] * W[number[s]]


@compiled
def _add_sliders(block: Any, p: int, number: Any, now: Any, past: Any, W: Any, moved: Any) -> None:
    """Add the sliders of one joint after the step; `now` contains displacements and velocities."""
    d, r = (block.shape[1] - block.shape[0]) // 2, len(past)
    for s in range(len(number)):
        if number[s] < 0:
            continue
        row, target = block[d + s], moved[number[s]]
        for e in range(d):
            for part in range(2):
                if row[part * d + e] != 0.0:
                    target += row[part * d + e] * now[part * r + p + e]
            if row[2 * d + e] != 0.0:
                target += row[2 * d + e] * past[p + e]
        for other in range(len(number)):
            if number[other] >= 0 and row[3 * d + other] != 0.0:
                target += row[3 * d + other] * W[number[other]]


@compiled
def _integrate_disturbances(step: Any, rows: Any, table: Any, slopes: Any, u: Any, velocity: Any, slider: Any) -> Any:
    """Matrix of the disturbances after one period by those of the start, and its number of forces."""
    n, r = u.shape[1], rows.shape[1]
    active = _find_active(table, slopes, u, velocity, slider)
    n_active = len(active.direction)
    # Displacements, then velocities, of the active directions.
    own = np.zeros((2 * n_active, 2 * r))
    own[:n_active, :r] = own[n_active:, r:] = rows[active.direction]
    by_before, by_after = (
        step.by_force_before[:, active.direction].copy(),
        step.by_force_after[:, active.direction].copy(),
    )
    near = np.dot(own, by_after)

    m = 2 * r + active.n_slider + n_active
    state = np.eye(m)
    Z, W, g = state[: 2 * r].copy(), state[2 * r : m - n_active].copy(), state[m - n_active :].copy()
    past = np.dot(own, Z)[:n_active].copy()
    for instant in range(1, n + 1):
        Z = _propagate(step, Z) + np.dot(by_before, g)
        free, matrix, right = np.dot(own, Z), np.eye(n_active), np.zeros((n_active, m))
        blocks = [_slopes(j, instant - 1, instant % n, table, slopes, u, velocity, slider) for j in active.joint]
        for i, j in enumerate(active.joint):
            number = active.slider[table.slider[j] : table.slider[j + 1]]
            _add_forces(blocks[i], active.first_direction[i], number, free, past, W, near, matrix, right)
        g = np.ascontiguousarray(np.linalg.solve(matrix, right))
        Z += np.dot(by_after, g)
        now, moved = free + np.dot(near, g), np.zeros_like(W)
        for i, j in enumerate(active.joint):
            number = active.slider[table.slider[j] : table.slider[j + 1]]
            _add_sliders(blocks[i], active.first_direction[i], number, now, past, W, moved)
        W, past = moved, now[:n_active].copy()
    result = np.empty((m, m))
    result[: 2 * r], result[2 * r : m - n_active], result[m - n_active :] = Z, W, g
    return result, n_active
