r"""Time integration over a record, compiled: exact for the linear part, implicit in the forces of the joints.

With x = [q, dq/dt] and the inputs w = [force, 1, forces of the joints],

.. math:: x_{k+1} = \Phi x_k + \Gamma_0 w_k + \Gamma_1 w_{k+1}

is exact where w is linear between two instants; each instant's joint forces are found by Newton's method. The rates
with parameters obey the same recursion, differentiated.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.time_record.propagator import BEFORE, Propagator
from fe.compiled import compiled
from hbsolve.joint_arrays import instant_force

Array = Float[NDArray[np.float64], "..."]

#: Newton steps an instant at most, and the last one relative to the largest force.
MOST_STEPS, CONVERGED = 30, 1e-12


class JointState(NamedTuple):
    """Joints at an instant, and workspace to solve for their forces; j joints of m parameters each."""

    motion: Float[NDArray[np.float64], " jj"]
    """Displacements of all joints, then velocities, shape (2 j,)."""
    free_motion: Float[NDArray[np.float64], " jj"]
    """The same without the joints' forces at the instant, shape (2 j,)."""
    force: Float[NDArray[np.float64], " j"]
    """Forces by the laws, shape (j,)."""
    slope: Float[NDArray[np.float64], " jj"]
    """Slopes of the forces with displacements, then velocities, shape (2 j,)."""
    rates: Float[NDArray[np.float64], "j m2"]
    """Rates of the forces with displacement, velocity and each parameter, shape (j, 2 + m)."""
    flexibility: Float[NDArray[np.float64], "jj j"]
    """Motions of the joints by unit forces of the joints at the end of a step, shape (2 j, j)."""
    matrix: Float[NDArray[np.float64], "j j"]
    """I - d laws / d forces, shape (j, j)."""
    right_side: Float[NDArray[np.float64], "j p1"]
    """Right-hand sides, then solutions, shape (j, p + 1)."""


@compiled
def integrate(propagator: Propagator, start: Array, force: Array, stride: int, value: Array) -> bool:
    """Fill the sensors' values and their rates; False where the response diverges.

    Parameters
    ----------
    propagator
        Matrices over one step: except for `joint_rows` and `table`, row 0 has the matrix itself, rows 1 to p its rates
        with each parameter.
    start
        State at the first instant, and its rates, shape (p + 1, n).
    force
        Force at all instants, shape (t,).
    stride
        Number of integration steps per sample.
    value
        Filled: row 0 values, then rates, shape (p + 1, s, n_sample).
    """
    n_joint, n_all, n, m = (
        len(propagator.table.kind),
        len(propagator.phi),
        propagator.phi.shape[1],
        propagator.gamma0.shape[2],
    )
    x, new = start.copy(), np.zeros_like(start)
    w, w_new = np.zeros((n_all, m)), np.zeros((n_all, m))
    joints = JointState(
        np.zeros(2 * n_joint),
        np.zeros(2 * n_joint),
        np.zeros(n_joint),
        np.zeros(2 * n_joint),
        np.zeros((n_joint, 2 + propagator.law.shape[2])),
        np.zeros((2 * n_joint, n_joint)),  # zero at the first instant, where the motion is given
        np.zeros((n_joint, n_joint)),
        np.zeros((n_joint, n_all)),
    )
    w[0, 0], w[0, 1], w_new[0, 1] = force[0], 1.0, 1.0
    for i in range(2 * n_joint):
        for a in range(n):
            joints.motion[i] += propagator.joint_rows[i, a] * x[0, a]
    _joint_forces(propagator, joints, w[0, BEFORE:])
    _joint_matrix(joints)
    _force_rates(propagator, joints, x, w)
    for i in range(2 * n_joint):
        for j in range(n_joint):
            for a in range(n):
                joints.flexibility[i, j] += propagator.joint_rows[i, a] * propagator.gamma1[0, a, BEFORE + j]
    _read(propagator, x, w, value, 0)
    for k in range(1, len(force)):
        w_new[0, 0] = force[k]
        _linear(propagator, x, w, w_new, new)
        if n_joint:
            for i in range(2 * n_joint):
                joints.free_motion[i] = 0.0
                for a in range(n):
                    joints.free_motion[i] += propagator.joint_rows[i, a] * new[0, a]
            for j in range(n_joint):
                w_new[0, BEFORE + j] = w[0, BEFORE + j]
            if not _newton(propagator, joints, w_new[0, BEFORE:]):
                return False
            for a in range(n):
                for j in range(n_joint):
                    new[0, a] += propagator.gamma1[0, a, BEFORE + j] * w_new[0, BEFORE + j]
        if n_all > 1:
            _linear_rates(propagator, x, w, w_new, new)
            if n_joint:
                _joint_matrix(joints)
                _force_rates(propagator, joints, new, w_new)
                for p in range(1, n_all):
                    for a in range(n):
                        for j in range(n_joint):
                            new[p, a] += propagator.gamma1[0, a, BEFORE + j] * w_new[p, BEFORE + j]
        x, new = new, x
        w, w_new = w_new, w
        if k % stride == 0:
            for a in range(n):
                if not np.isfinite(x[0, a]):
                    return False
            _read(propagator, x, w, value, k // stride)
    return True


@compiled
def _linear(propagator: Propagator, x: Array, w: Array, w_new: Array, new: Array) -> None:
    """Fill the next state but for the joints' forces there."""
    for a in range(propagator.phi.shape[1]):
        total = 0.0
        for b in range(propagator.phi.shape[1]):
            total += propagator.phi[0, a, b] * x[0, b]
        for b in range(w.shape[1]):
            total += propagator.gamma0[0, a, b] * w[0, b]
        for b in range(BEFORE):
            total += propagator.gamma1[0, a, b] * w_new[0, b]
        new[0, a] = total


@compiled
def _linear_rates(propagator: Propagator, x: Array, w: Array, w_new: Array, new: Array) -> None:
    """Fill the rates of the next state but for those of the joints' forces there."""
    for p in range(1, len(propagator.phi)):
        for a in range(propagator.phi.shape[1]):
            total = 0.0
            for b in range(propagator.phi.shape[1]):
                total += propagator.phi[0, a, b] * x[p, b] + propagator.phi[p, a, b] * x[0, b]
            for b in range(w.shape[1]):
                total += (
                    propagator.gamma0[0, a, b] * w[p, b]
                    + propagator.gamma0[p, a, b] * w[0, b]
                    + propagator.gamma1[p, a, b] * w_new[0, b]
                )
            new[p, a] = total


@compiled
def _newton(propagator: Propagator, joints: JointState, forces: Array) -> bool:
    """Solve for the joints' forces; motions and slopes are those of the solution."""
    for _ in range(MOST_STEPS):
        for i in range(len(joints.free_motion)):
            joints.motion[i] = joints.free_motion[i]
            for j in range(len(forces)):
                joints.motion[i] += joints.flexibility[i, j] * forces[j]
        _joint_forces(propagator, joints, joints.force)
        largest, change = 0.0, 0.0
        for j in range(len(forces)):
            joints.right_side[j, 0] = joints.force[j] - forces[j]
        _joint_matrix(joints)
        _solve(joints, 1)
        for j in range(len(forces)):
            forces[j] += joints.right_side[j, 0]
            largest, change = max(largest, abs(forces[j])), max(change, abs(joints.right_side[j, 0]))
        if not np.isfinite(change):
            return False
        if change <= CONVERGED * largest:
            return True
    return False


@compiled
def _joint_forces(propagator: Propagator, joints: JointState, force: Array) -> None:
    """Fill the forces of all joints, their slopes and their rates."""
    table, motion, rates, n_joint = propagator.table, joints.motion, joints.rates, len(force)
    for j in range(n_joint):
        force[j] = instant_force(
            table.kind[j], table.address[j], motion[j], motion[n_joint + j], propagator.law[0, j], rates[j]
        )
        joints.slope[j], joints.slope[n_joint + j] = rates[j, 0], rates[j, 1]


@compiled
def _joint_matrix(joints: JointState) -> None:
    """Fill I - d laws / d forces."""
    slope, flexibility, matrix, n_joint = joints.slope, joints.flexibility, joints.matrix, len(joints.matrix)
    for j in range(n_joint):
        for i in range(n_joint):
            matrix[j, i] = -slope[j] * flexibility[j, i] - slope[n_joint + j] * flexibility[n_joint + j, i]
        matrix[j, j] += 1.0


@compiled
def _force_rates(propagator: Propagator, joints: JointState, x: Array, w: Array) -> None:
    """Fill the rates of the joints' forces; x holds the states' rates without their share."""
    slope, joint_rows, n_joint, n_rate = joints.slope, propagator.joint_rows, len(joints.rates), len(x) - 1
    for p in range(n_rate):
        for j in range(n_joint):
            rate = 0.0
            for i in range(propagator.law.shape[2]):
                rate += joints.rates[j, 2 + i] * propagator.law[p + 1, j, i]
            for a in range(x.shape[1]):
                rate += (slope[j] * joint_rows[j, a] + slope[n_joint + j] * joint_rows[n_joint + j, a]) * x[p + 1, a]
            joints.right_side[j, p] = rate
    _solve(joints, n_rate)
    for p in range(n_rate):
        for j in range(n_joint):
            w[p + 1, BEFORE + j] = joints.right_side[j, p]


@compiled
def _solve(joints: JointState, count: int) -> None:
    """Solve for the first `count` columns by Gauss's elimination with pivots; the matrix is used up."""
    matrix, right_side, n = joints.matrix, joints.right_side, len(joints.matrix)
    for i in range(n):
        pivot = i
        for r in range(i + 1, n):
            if abs(matrix[r, i]) > abs(matrix[pivot, i]):
                pivot = r
        if pivot != i:
            for c in range(n):
                matrix[i, c], matrix[pivot, c] = matrix[pivot, c], matrix[i, c]
            for c in range(count):
                right_side[i, c], right_side[pivot, c] = right_side[pivot, c], right_side[i, c]
        for r in range(i + 1, n):
            factor = matrix[r, i] / matrix[i, i]
            if factor != 0.0:
                for c in range(i, n):
                    matrix[r, c] -= factor * matrix[i, c]
                for c in range(count):
                    right_side[r, c] -= factor * right_side[i, c]
    for i in range(n - 1, -1, -1):
        for c in range(count):
            for r in range(i + 1, n):
                right_side[i, c] -= matrix[i, r] * right_side[r, c]
            right_side[i, c] /= matrix[i, i]


@compiled
def _read(propagator: Propagator, x: Array, w: Array, value: Array, sample: int) -> None:
    """Sensor readings of a state, and their rates."""
    output, feedthrough = propagator.output, propagator.feedthrough
    for s in range(output.shape[1]):
        for p in range(len(x)):
            total = 0.0
            for a in range(x.shape[1]):
                total += output[0, s, a] * x[p, a]
                if p:
                    total += output[p, s, a] * x[0, a]
            for b in range(w.shape[1]):
                total += feedthrough[0, s, b] * w[p, b]
                if p:
                    total += feedthrough[p, s, b] * w[0, b]
            value[p, s, sample] = total
