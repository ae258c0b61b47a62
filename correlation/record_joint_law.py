"""Forces of all joints of a model at an instant, and small linear systems between them, in machine code."""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.compiled import compiled
from hbsolve.joint_table import InstantTable, instant_force


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
