"""Forces of joints without memory at an instant, and small linear systems between them, in machine code."""

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from correlation.record_propagator import CUBIC, QUADRATIC
from fe.compiled import compiled


@compiled
def joint_forces(
    kind: Int[NDArray[np.int64], " j"],
    law: Float[NDArray[np.float64], "j 2"],
    moved: Float[NDArray[np.float64], " jj"],
    force: Float[NDArray[np.float64], " j"],
    slope: Float[NDArray[np.float64], " jj"],
) -> None:
    """Fill the forces of all joints and their slopes.

    Parameters
    ----------
    kind, law
        Which law, and its numbers.
    moved
        Displacements of all joints, then velocities, shape (2 j,).
    force
        Filled.
    slope
        Filled: with displacements, then velocities, shape (2 j,).
    """
    n_joint = len(kind)
    for j in range(n_joint):
        u, v, size = moved[j], moved[n_joint + j], law[j, 0]
        slope[j], slope[n_joint + j] = 0.0, 0.0
        if kind[j] == CUBIC:
            force[j] = size * u**3
            slope[j] = 3 * size * u**2
        elif kind[j] == QUADRATIC:
            force[j] = size * abs(v) * v
            slope[n_joint + j] = 2 * size * abs(v)
        else:
            force[j] = size * max(u - law[j, 1], 0.0)
            slope[j] = size if u > law[j, 1] else 0.0


@compiled
def joint_rate(
    kind: int, law: Float[NDArray[np.float64], "2"], change: Float[NDArray[np.float64], "2"], u: float, v: float
) -> float:
    """Rate of a joint's force with a parameter of which its numbers change by `change`, the motion held."""
    if kind == CUBIC:
        return float(change[0] * u**3)
    if kind == QUADRATIC:
        return float(change[0] * abs(v) * v)
    return float(change[0] * max(u - law[1], 0.0) - (law[0] * change[1] if u > law[1] else 0.0))


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
