r"""The compiled integration: exact steps of the linear structure, implicit joint forces condensed to the joints.

With modal state y and the mean joint forces f over a step,

.. math:: y_{n+1} = A y_n + p_n - E f, \qquad u_{n+1} = u_\mathrm{free} - G f(u_n, u_{n+1}, w_n)

A, E and the increments p_n of the loads are exact (`transient.state_transition`), so only the joint forces are
approximated. The d equations for u_{n+1} are solved by Newton's method with an inverse that stays as long
as it still converges well, then by damped steps, then by short steps along the residual, which always converge where
the joint forces are monotone because G is positive.
"""

from typing import NamedTuple

import numpy as np

from fe.compiled import compiled
from reduction.array_type import Matrix, Vector
from transient.joint_arrays import JointArrays
from transient.joint_forces import joint_force, joint_forces
from transient.state_transition import Transition

#: Error of a position that is accepted, as a share of the largest position so far: some hundred times round-off.
TOLERANCE = 1e-13
#: A residual that stalls below this share is round-off as well.
STALLED_SHARE = 1e-10
#: The inverse is renewed when an iteration leaves more than this share of the residual.
SLOW = 0.25
N_NEWTON = 40
N_CAREFUL = 200


class StepEquation(NamedTuple):
    """The equation for the positions at the end of a step, and buffers that a trial fills."""

    free: Vector
    """Positions without joint forces, shape (d,) [m]."""
    flexibility: Matrix
    """G, shape (d, d) [m/N]."""
    offset: Vector
    """Springs that are part of the structure, shape (d,) [N/m]."""
    at_end: bool
    """Whether the forces at the end of the step act, in place of their mean over it."""
    before: Vector
    """Positions before the step, shape (d,) [m]."""
    slider: Vector
    """Sliders before the step, shape (s,) [m]."""
    joints: JointArrays
    step: float
    """[s]; 0 for a step of no length."""
    force: Vector
    """Joint forces beyond the springs `offset`, shape (d,) [N]."""
    mean: Vector
    end: Vector
    """Mean over the step and value at its end of the joint forces, shape (d,) [N]."""
    moved: Vector
    """Sliders after the step, shape (s,) [m]."""


@compiled
def residual(after: Vector, at: StepEquation) -> Vector:
    """u - u_free + G f of a trial position, f being the joint forces beyond the springs `offset`."""  # noqa: D403  # a symbol
    joint_forces(at.joints, at.before, after, at.slider, at.step, at.mean, at.end, at.moved)
    for i in range(after.size):
        if at.at_end:
            at.force[i] = at.end[i] - at.offset[i] * after[i]
        else:
            at.force[i] = at.mean[i] - 0.5 * at.offset[i] * (at.before[i] + after[i])
    return after - at.free + at.flexibility @ at.force


@compiled
def jacobian_inverse(after: Vector, at: StepEquation, scale: float) -> Matrix:
    """Inverse of 1 + G df/du, the slopes of each joint by differences: laws have kinks, but no noise."""
    n, joints, before, offset = after.size, at.joints, at.before, at.offset
    slope = np.zeros((n, n))
    mean, end, moved = np.zeros(n), np.zeros(n), np.zeros(at.slider.size)
    moved_end = np.zeros(n)
    probe = after.copy()
    for joint in range(joints.kind.size):
        first, last = joints.direction[joint], joints.direction[joint + 1]
        joint_force(joint, joints, before, after, at.slider, at.step, mean, end, moved)
        base = end.copy() if at.at_end else mean.copy()
        for column in range(first, last):
            delta = 1e-7 * max(abs(after[column]), abs(after[column] - before[column]), 1e-3 * scale)
            if after[column] < before[column]:
                delta = -delta
            probe[column] = after[column] + delta
            joint_force(joint, joints, before, probe, at.slider, at.step, mean, end, moved)
            moved_end[:] = end if at.at_end else mean
            for row in range(first, last):
                slope[row, column] = (moved_end[row] - base[row]) / delta
            probe[column] = after[column]
    for i in range(n):
        slope[i, i] -= offset[i] if at.at_end else 0.5 * offset[i]
    matrix = at.flexibility @ slope
    for i in range(n):
        matrix[i, i] += 1.0
    inverse: Matrix = np.linalg.inv(matrix)  # type: ignore[assignment]  # numpy says floating
    return inverse


@compiled
def solve_positions(after: Vector, at: StepEquation, scale: float, inverse: Matrix) -> int:
    """Solve for `after` (guess in, solution out), with forces and sliders; iterations, or -1 without convergence."""
    r = residual(after, at)
    size = np.abs(r).max()
    fresh = False
    for iteration in range(N_NEWTON):
        if size <= TOLERANCE * scale:
            return iteration
        change = inverse @ r
        damping = 1.0
        trial = after - change
        r_trial = residual(trial, at)
        size_trial = np.abs(r_trial).max()
        if not size_trial <= SLOW * size:
            if size_trial <= STALLED_SHARE * scale and size_trial >= 0.5 * size:
                break
            if not fresh:
                # Keep the better of both points, and renew the inverse there.
                if size_trial < size:
                    after[:] = trial
                    r = r_trial
                    size = size_trial
                inverse[:] = jacobian_inverse(after, at, scale)
                fresh = True
                continue
            while not size_trial < (1.0 - 0.1 * damping) * size and damping > 1e-3:
                damping *= 0.5
                trial = after - damping * change
                r_trial = residual(trial, at)
                size_trial = np.abs(r_trial).max()
            fresh = False
        after[:] = trial
        r = r_trial
        size = size_trial
    if size <= STALLED_SHARE * scale:
        residual(after, at)
        return N_NEWTON
    # Kinks are in the way: a new tangent in every iteration, first with whole steps, which may pass through larger
    # residuals, then with half steps, which break cycles between two sides of a kink.
    start = after.copy()
    for damping in (1.0, 0.5):
        after[:] = start
        for iteration in range(N_NEWTON):
            r = residual(after, at)
            if np.abs(r).max() <= STALLED_SHARE * scale:
                return N_NEWTON + iteration
            inverse[:] = jacobian_inverse(after, at, scale)
            after -= damping * (inverse @ r)
    # At last with steps that do make the residual smaller.
    after[:] = start
    r = residual(after, at)
    for iteration in range(N_CAREFUL):
        inverse[:] = jacobian_inverse(after, at, scale)
        change = inverse @ r
        damping = 1.0
        size = np.sqrt(r @ r)
        while True:
            trial = after - damping * change
            r_trial = residual(trial, at)
            size_trial = np.sqrt(r_trial @ r_trial)
            if size_trial <= (1.0 - 0.1 * damping) * size or damping < 1e-9:
                break
            damping *= 0.5
        after[:] = trial
        r = r_trial
        if size_trial <= STALLED_SHARE * scale:
            return N_NEWTON + iteration
    return -1


class IntegrationState(NamedTuple):
    """State of an integration, which updates all of these arrays in place."""

    state: Vector
    """Modal displacements and velocities, shape (2 r,)."""
    position: Vector
    """Of the directions of the joints, shape (d,) [m]."""
    slider: Vector
    """Shape (s,) [m]."""
    end: Vector
    """Joint forces, shape (d,) [N]."""
    last_force: Vector
    """Their mean over the last step, beyond the springs `offset`, shape (d,) [N]."""
    inverse: Matrix
    """Inverse Jacobian of the last equation that was solved, shape (d, d)."""


@compiled
def integrate_steps(
    now: IntegrationState, scale: float, by: Transition, joints: JointArrays, level: Vector, load: Vector,
    states: Matrix, forces: Matrix, sliders: Matrix,
) -> tuple[int, float, int]:  # fmt: skip
    """Integrate over len(level) steps.

    The rows of states, forces and sliders, unless they are empty, receive the values at the *start* of each step.
    Returns (-1 or the step that failed, scale, iterations).
    """
    state, position, slider, end = now.state, now.position, now.slider, now.end
    transition, input_factor, rows, flexibility = by.matrix, by.input_factor, by.rows, by.flexibility
    n_step, n_mode, n_direction = level.size, rows.shape[1], rows.shape[0]
    n_period = by.harmonic.shape[0]
    mean, moved = np.zeros(n_direction), slider.copy()
    force = now.last_force.copy()
    previous = now.last_force.copy()
    free, after = np.zeros(n_direction), position.copy()
    equation = StepEquation(
        free, flexibility, by.offset, False, position, slider, joints, by.step, force, mean, end, moved
    )
    new = np.zeros(2 * n_mode)
    total = 0
    for n in range(n_step):
        if states.size:
            states[n] = state
        if forces.size:
            forces[n] = end
        if sliders.size:
            sliders[n] = slider
        p, s = level[n], load[n]
        increment, static = by.harmonic[n % n_period], by.static
        if by.diagonal:
            for i in range(n_mode):
                q, v = state[i], state[n_mode + i]
                new[i] = transition[0, i] * q + transition[1, i] * v + p * increment[i] + s * static[i]
                new[n_mode + i] = (
                    transition[2, i] * q + transition[3, i] * v + p * increment[n_mode + i] + s * static[n_mode + i]
                )
        else:
            new[:] = transition @ state
            for i in range(2 * n_mode):
                new[i] += p * increment[i] + s * static[i]
        if n_direction:
            free[:] = rows @ new[:n_mode]
            for i in range(n_direction):
                if abs(free[i]) > scale:
                    scale = abs(free[i])
                force[i], previous[i] = 2.0 * force[i] - previous[i], force[i]
            after[:] = free - flexibility @ force
            done = solve_positions(after, equation, scale, now.inverse)
            if done < 0:
                return n, scale, total
            total += done
            if by.diagonal:
                modal = by.columns @ force
                for i in range(n_mode):
                    new[i] -= input_factor[0, i] * modal[i]
                    new[n_mode + i] -= input_factor[1, i] * modal[i]
            else:
                new -= by.input_matrix @ force
            position[:] = after
            slider[:] = moved
        state[:] = new
    now.last_force[:] = force
    return -1, scale, total
