r"""The march through a time record, in machine code: exact for the linear part, implicit in the forces of the joints.

With x = [q, dq/dt] and the inputs w = [force, 1, forces of the joints],

.. math:: x_{k+1} = \Phi x_k + \Gamma_0 w_k + \Gamma_1 w_{k+1}

is exact where w is linear between two instants; each instant's joint forces are found by Newton's method. The rates
with parameters obey the same recursion, differentiated.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.record_propagator import BEFORE
from fe.compiled import compiled
from hbsolve.instant_force import InstantTable, instant_force

#: Newton steps an instant at most, and the last one relative to the largest force.
MOST_STEPS, CONVERGED = 30, 1e-12


@compiled
def march(
    phi: Float[NDArray[np.float64], "p1 n n"],
    gamma0: Float[NDArray[np.float64], "p1 n m"],
    gamma1: Float[NDArray[np.float64], "p1 n m"],
    follow: Float[NDArray[np.float64], "jj n"],
    table: InstantTable,
    law: Float[NDArray[np.float64], "p1 j m"],
    output: Float[NDArray[np.float64], "p1 s n"],
    feed: Float[NDArray[np.float64], "p1 s m"],
    start: Float[NDArray[np.float64], "p1 n"],
    force: Float[NDArray[np.float64], " t"],
    every: int,
    value: Float[NDArray[np.float64], "p1 s k"],
) -> bool:
    """Fill the sensors' values and their rates; False where the response gets out of hand.

    Parameters
    ----------
    phi, gamma0, gamma1, law, output, feed, start
        Row 0: themselves; rows 1 to p: their rates with each parameter.
    follow
        Rows of each joint's displacement (all joints), then of its velocity, shape (2 j, n).
    table
        Law of each joint.
    force
        At all instants of the march.
    every
        Instants between two samples.
    value
        Filled: row 0 values, then rates, shape (p + 1, s, n_sample).
    """
    n_joint, n_all, n = len(table.kind), len(phi), phi.shape[1]
    x, new = start.copy(), np.zeros_like(start)
    w, w_new = np.zeros((n_all, gamma0.shape[2])), np.zeros((n_all, gamma0.shape[2]))
    moved, own, slope = np.zeros(2 * n_joint), np.zeros(2 * n_joint), np.zeros(2 * n_joint)
    rates = np.zeros((n_joint, 2 + law.shape[2]))
    forces, matrix, right = np.zeros(n_joint), np.zeros((n_joint, n_joint)), np.zeros((n_joint, n_all))
    # How the joints' motions answer to the joints' forces at the end of a step; at the start of the march, not at all.
    answer = np.zeros((2 * n_joint, n_joint))
    w[0, 0], w[0, 1], w_new[0, 1] = force[0], 1.0, 1.0
    for i in range(2 * n_joint):
        for a in range(n):
            moved[i] += follow[i, a] * x[0, a]
    joint_forces(table, law[0], moved, w[0, BEFORE:], slope, rates)
    joint_matrix(answer, slope, matrix)
    _force_rates(rates, law, follow, slope, x, matrix, right, w)
    for i in range(2 * n_joint):
        for j in range(n_joint):
            for a in range(n):
                answer[i, j] += follow[i, a] * gamma1[0, a, BEFORE + j]
    _read(output, feed, x, w, value, 0)
    for k in range(1, len(force)):
        w_new[0, 0] = force[k]
        _linear(phi, gamma0, gamma1, x, w, w_new, new)
        if n_joint:
            for i in range(2 * n_joint):
                own[i] = 0.0
                for a in range(n):
                    own[i] += follow[i, a] * new[0, a]
            for j in range(n_joint):
                w_new[0, BEFORE + j] = w[0, BEFORE + j]
            if not _newton(table, law[0], answer, own, moved, forces, slope, rates, matrix, right, w_new[0, BEFORE:]):
                return False
            for a in range(n):
                for j in range(n_joint):
                    new[0, a] += gamma1[0, a, BEFORE + j] * w_new[0, BEFORE + j]
        if n_all > 1:
            _linear_rates(phi, gamma0, gamma1, x, w, w_new, new)
            if n_joint:
                joint_matrix(answer, slope, matrix)
                _force_rates(rates, law, follow, slope, new, matrix, right, w_new)
                for p in range(1, n_all):
                    for a in range(n):
                        for j in range(n_joint):
                            new[p, a] += gamma1[0, a, BEFORE + j] * w_new[p, BEFORE + j]
        x, new = new, x
        w, w_new = w_new, w
        if k % every == 0:
            for a in range(n):
                if not np.isfinite(x[0, a]):
                    return False
            _read(output, feed, x, w, value, k // every)
    return True


@compiled
def _linear(
    phi: Float[NDArray[np.float64], "p1 n n"],
    gamma0: Float[NDArray[np.float64], "p1 n m"],
    gamma1: Float[NDArray[np.float64], "p1 n m"],
    x: Float[NDArray[np.float64], "p1 n"],
    w: Float[NDArray[np.float64], "p1 m"],
    w_new: Float[NDArray[np.float64], "p1 m"],
    new: Float[NDArray[np.float64], "p1 n"],
) -> None:
    """Fill the next state but for the joints' forces there."""
    for a in range(phi.shape[1]):
        total = 0.0
        for b in range(phi.shape[1]):
            total += phi[0, a, b] * x[0, b]
        for b in range(w.shape[1]):
            total += gamma0[0, a, b] * w[0, b]
        for b in range(BEFORE):
            total += gamma1[0, a, b] * w_new[0, b]
        new[0, a] = total


@compiled
def _linear_rates(
    phi: Float[NDArray[np.float64], "p1 n n"],
    gamma0: Float[NDArray[np.float64], "p1 n m"],
    gamma1: Float[NDArray[np.float64], "p1 n m"],
    x: Float[NDArray[np.float64], "p1 n"],
    w: Float[NDArray[np.float64], "p1 m"],
    w_new: Float[NDArray[np.float64], "p1 m"],
    new: Float[NDArray[np.float64], "p1 n"],
) -> None:
    """Fill the rates of the next state but for those of the joints' forces there."""
    for p in range(1, len(phi)):
        for a in range(phi.shape[1]):
            total = 0.0
            for b in range(phi.shape[1]):
                total += phi[0, a, b] * x[p, b] + phi[p, a, b] * x[0, b]
            for b in range(w.shape[1]):
                total += gamma0[0, a, b] * w[p, b] + gamma0[p, a, b] * w[0, b] + gamma1[p, a, b] * w_new[0, b]
            new[p, a] = total


@compiled
def _newton(
    table: InstantTable,
    law: Float[NDArray[np.float64], "j m"],
    answer: Float[NDArray[np.float64], "jj j"],
    own: Float[NDArray[np.float64], " jj"],
    moved: Float[NDArray[np.float64], " jj"],
    forces: Float[NDArray[np.float64], " j"],
    slope: Float[NDArray[np.float64], " jj"],
    rates: Float[NDArray[np.float64], "j m2"],
    matrix: Float[NDArray[np.float64], "j j"],
    right: Float[NDArray[np.float64], "j q"],
    found: Float[NDArray[np.float64], " j"],
) -> bool:
    """Find the joints' forces; `moved` and `slope` are left where they are found."""
    for _ in range(MOST_STEPS):
        for i in range(len(own)):
            moved[i] = own[i]
            for j in range(len(found)):
                moved[i] += answer[i, j] * found[j]
        joint_forces(table, law, moved, forces, slope, rates)
        largest, change = 0.0, 0.0
        for j in range(len(found)):
            right[j, 0] = forces[j] - found[j]
        joint_matrix(answer, slope, matrix)
        solve_small(matrix, right, 1)
        for j in range(len(found)):
            found[j] += right[j, 0]
            largest, change = max(largest, abs(found[j])), max(change, abs(right[j, 0]))
        if not np.isfinite(change):
            return False
        if change <= CONVERGED * largest:
            return True
    return False


@compiled
def _force_rates(
    rates: Float[NDArray[np.float64], "j m2"],
    law: Float[NDArray[np.float64], "p1 j m"],
    follow: Float[NDArray[np.float64], "jj n"],
    slope: Float[NDArray[np.float64], " jj"],
    x: Float[NDArray[np.float64], "p1 n"],
    matrix: Float[NDArray[np.float64], "j j"],
    right: Float[NDArray[np.float64], "j q"],
    w: Float[NDArray[np.float64], "p1 m"],
) -> None:
    """Fill the rates of the joints' forces; x holds the states' rates without their share."""
    n_joint, n_rate = len(rates), len(x) - 1
    for p in range(n_rate):
        for j in range(n_joint):
            rate = 0.0
            for i in range(law.shape[2]):
                rate += rates[j, 2 + i] * law[p + 1, j, i]
            for a in range(x.shape[1]):
                rate += (slope[j] * follow[j, a] + slope[n_joint + j] * follow[n_joint + j, a]) * x[p + 1, a]
            right[j, p] = rate
    solve_small(matrix, right, n_rate)
    for p in range(n_rate):
        for j in range(n_joint):
            w[p + 1, BEFORE + j] = right[j, p]


@compiled
def _read(
    output: Float[NDArray[np.float64], "p1 s n"],
    feed: Float[NDArray[np.float64], "p1 s m"],
    x: Float[NDArray[np.float64], "p1 n"],
    w: Float[NDArray[np.float64], "p1 m"],
    value: Float[NDArray[np.float64], "p1 s k"],
    sample: int,
) -> None:
    """What the sensors read of a state, and its rates."""
    for s in range(output.shape[1]):
        for p in range(len(x)):
            total = 0.0
            for a in range(x.shape[1]):
                total += output[0, s, a] * x[p, a]
                if p:
                    total += output[p, s, a] * x[0, a]
            for b in range(w.shape[1]):
                total += feed[0, s, b] * w[p, b]
                if p:
                    total += feed[p, s, b] * w[0, b]
            value[p, s, sample] = total


@compiled
def joint_forces(
    table: InstantTable,
    law: Float[NDArray[np.float64], "j m"],
    moved: Float[NDArray[np.float64], " jj"],
    force: Float[NDArray[np.float64], " j"],
    slope: Float[NDArray[np.float64], " jj"],
    rates: Float[NDArray[np.float64], "j m2"],
) -> None:
    """Fill the forces of all joints and their slopes.

    Parameters
    ----------
    table
        Which laws.
    law
        Their parameters, shape (j, m).
    moved
        Displacements of all joints, then velocities, shape (2 j,).
    force
        Filled, shape (j,).
    slope
        Filled: with displacements, then velocities, shape (2 j,).
    rates
        Filled: with displacement, velocity and each parameter, shape (j, 2 + m).
    """
    n_joint = len(force)
    for j in range(n_joint):
        force[j] = instant_force(table.kind[j], table.address[j], moved[j], moved[n_joint + j], law[j], rates[j])
        slope[j], slope[n_joint + j] = rates[j, 0], rates[j, 1]


@compiled
def joint_matrix(
    answer: Float[NDArray[np.float64], "jj j"],
    slope: Float[NDArray[np.float64], " jj"],
    matrix: Float[NDArray[np.float64], "j j"],
) -> None:
    """Fill I - d laws / d forces, where `answer` is how the joints' motions answer to their forces."""
    n_joint = len(matrix)
    for j in range(n_joint):
        for i in range(n_joint):
            matrix[j, i] = -slope[j] * answer[j, i] - slope[n_joint + j] * answer[n_joint + j, i]
        matrix[j, j] += 1.0


@compiled
def solve_small(
    matrix: Float[NDArray[np.float64], "j j"], right: Float[NDArray[np.float64], "j q"], count: int
) -> None:
    """Solve for the first `count` columns by Gauss's elimination with pivots; both arrays are used up."""
    n = len(matrix)
    for i in range(n):
        pivot = i
        for r in range(i + 1, n):
            if abs(matrix[r, i]) > abs(matrix[pivot, i]):
                pivot = r
        if pivot != i:
            for c in range(n):
                matrix[i, c], matrix[pivot, c] = matrix[pivot, c], matrix[i, c]
            for c in range(count):
                right[i, c], right[pivot, c] = right[pivot, c], right[i, c]
        for r in range(i + 1, n):
            factor = matrix[r, i] / matrix[i, i]
            if factor != 0.0:
                for c in range(i, n):
                    matrix[r, c] -= factor * matrix[i, c]
                for c in range(count):
                    right[r, c] -= factor * right[i, c]
    for i in range(n - 1, -1, -1):
        for c in range(count):
            for r in range(i + 1, n):
                right[i, c] -= matrix[i, r] * right[r, c]
            right[i, c] /= matrix[i, i]
