r"""Newton's method for the balance of the joint directions, compiled as a whole.

.. math:: R(x) = x - x_\mathrm{lin} + A\, g(x), \qquad g = f - D x

is eq. 12 in the joint directions. g differs from a constant only where a contact slips or lifts off: with L these rows
of its Jacobian, the step solves a system of only as many unknowns (`hbsolve.linearised`),

.. math:: (I + L A)\, y = -L R, \qquad \Delta x = -R - A\, y ,

by GMRES where the rows are many (`hbsolve.krylov`), and by elimination where they are few or GMRES is slow.

The columns of A_k, displacements under a unit force along one direction, are stored one per row of an array. Only those
of the directions that slip or lift off are read.

R is continuous with kinks. Backtracking on |R| handles the kinks; if no shorter step decreases |R|, a step is taken
anyway, because a kink can make every short step worse while the next piece converges at once.

Continuation borders the system with one equation and one unknown, lambda::

    [ I + A L   R_lambda ] [ dx      ]     [ R ]
    [ c^T       c_0      ] [ dlambda ] = - [ r ]

References
----------
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), eq. 12.
"""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from fe.compiled import compiled
from hbsolve.aft import BalanceArrays, joint_forces
from hbsolve.joint_law.registry import FORCE, JACOBIAN
from hbsolve.krylov import Border, gmres, operator
from hbsolve.linearised import active_rows, scattered, small_matrix, solve_if_finite, times_jacobian
from reduction.array_type import Array, Real

#: Up to this many rows elimination is faster than GMRES; with more it is as fast as GMRES with rows / 3 vectors.
DENSE, ROWS_PER_VECTOR = 150, 3
#: |residual| of GMRES relative to the right side: from 1e-6 on Newton's method takes as many steps as with exact
#: solutions.
RELATIVE = 1e-8
#: ... and relative to the tolerance of Newton's method: the last step need not be more accurate.
MARGIN = 0.01

#: Round-off of R relative to the motions of which it is the sum. A joint may be 1e4 times as stiff as its reference in
#: the linear structure (`MAX_JOINT_RATIO` over `MAX_REFERENCE_RATIO` of `hbsolve.balance`), which increases the
#: round-off of its force.
ROUND_OFF = 1e4 * np.finfo(float).eps
#: |R| after a step, relative to |R| before it, above which |R| may be round-off: convergence is quadratic.
STALLED = 0.5
#: Size of the linear motion if no load moves the joints: round-off alone then decides whether R is zero [m].
NO_LOAD = np.finfo(float).tiny
#: Sufficient decrease, the factor of a shortened step, and the shortest one (Nocedal and Wright, chapter 3).
DECREASE, SHORTEN, SHORTEST = 1e-4, 0.4, 5e-3
#: |R| over the tolerance below which the next step is expected to be the last, and its Jacobian not to be needed: the
#: square root of the relative tolerance, as convergence is quadratic.
NEARLY = 3e4
#: Where no step decreases |R|: growth of |R| up to which the best step is taken, and the factor of the step otherwise.
GROWTH, ESCAPE = 1.5, 0.1


class BalancePoint(NamedTuple):
    """R(x) at one frequency and level; d joint directions, nh = 2 H + 1."""

    linear: Float[Real, "d nh"]
    """x_lin, motion of the directions with all contacts stuck, shape (d, nh) [m]."""
    angular_frequency: float
    """Omega [rad/s]."""
    columns: Array
    """Columns of A_k: row j has the displacements under a unit force along direction j, shape (H + 1, d, d) [m/N]."""
    arrays: BalanceArrays
    """Joints and instants."""


@compiled
def apply_receptance(columns: Any, g: Any) -> Any:
    """A g: response of the linear structure to forces with the coefficients g, shape (d, nh) both.

    Where a contact sticks its force is constant, so that most columns of the harmonics are not read.
    """
    d, nh = g.shape
    x, mean, cosine, sine = np.empty((d, nh)), np.zeros(d), np.empty(d), np.empty(d)
    varied, n_varied = np.empty(d, np.int64), 0
    for j in range(d):
        force = g[j, 0]
        for i in range(d):
            mean[i] += columns[0, j, i].real * force
        if g[j, 1:].any():
            varied[n_varied] = j
            n_varied += 1
    x[:, 0] = mean
    for k in range(1, (nh + 1) // 2):
        cosine[:], sine[:] = 0.0, 0.0
        for j in varied[:n_varied]:
            c, s = g[j, 2 * k - 1], g[j, 2 * k]
            for i in range(d):
                alpha = columns[k, j, i]
                cosine[i] += alpha.real * c + alpha.imag * s
                sine[i] += alpha.real * s - alpha.imag * c
        x[:, 2 * k - 1], x[:, 2 * k] = cosine, sine
    return x


@compiled
def imbalance(R: Any, columns: Any, x: Any, g: Any) -> float:
    """|R| [m]; zero where it is round-off of the motion x and of the motions by the mean of each joint force g.

    Preloads may move the joints, or cancel, by far more than the loads do: 1e-9 of the motion under the loads is then
    less than numbers of 16 digits resolve. Newton's method calls this only where |R| no longer falls, so that a state
    is as accurate as possible.
    """
    norm: float = np.sqrt((R * R).sum())
    d = len(x)
    moved = np.zeros(d)
    for j in range(d):
        force = abs(g[j, 0])
        for i in range(d):
            moved[i] += abs(columns[0, j, i].real) * force
    return norm if norm > ROUND_OFF * (np.sqrt((x * x).sum()) + np.sqrt((moved * moved).sum())) else 0.0


@compiled
def transposed_receptance(columns: Any, x: Any) -> Any:
    """A^T x, shape (d, nh) both."""
    d, nh = x.shape
    g = np.empty((d, nh))
    g[:, 0] = np.dot(np.ascontiguousarray(columns[0].real), np.ascontiguousarray(x[:, 0]))
    for k in range(1, (nh + 1) // 2):
        product = np.dot(columns[k], x[:, 2 * k - 1] + 1j * x[:, 2 * k])
        g[:, 2 * k - 1], g[:, 2 * k] = product.real, product.imag
    return g


@compiled
def newton_step(forces: Any, columns: Any, first: Any, count: Any, right: Any, relative: float) -> Any:
    """Solve (I + A L) x = right to a relative residual; by elimination if that is 0."""
    d, nh = right.shape
    rows = active_rows(forces.active)
    if len(rows) == 0:
        return right.copy()
    moved = times_jacobian(rows, forces.jacobian, first, count, right)
    y: Any = np.empty(0)
    solved = False
    if len(rows) > DENSE and relative > 0.0:
        matrix = operator(rows, forces.jacobian, first, count, columns)
        border = Border(np.empty(0), np.empty(0), 0.0)
        y, solved = gmres(matrix, border, moved, relative, len(rows) // ROWS_PER_VECTOR)
    if not solved:
        y = solve_if_finite(small_matrix(rows, forces.jacobian, first, count, columns, nh), moved)
    return right - apply_receptance(columns, scattered(rows, y, d, nh))


@compiled
def bordered_step(
    forces: Any, columns: Any, first: Any, count: Any, residual: Any, by_lambda: Any, border: Any, corner: float,
    remainder: float, relative: float,
) -> Any:  # fmt: skip
    """Step (dx, dlambda) of the bordered system above, regular also at a fold; `relative` as for `newton_step`."""
    d, nh = residual.shape
    rows = active_rows(forces.active)
    m = len(rows)
    column = times_jacobian(rows, forces.jacobian, first, count, by_lambda)
    right = np.empty(m + 1)
    right[:m] = -times_jacobian(rows, forces.jacobian, first, count, residual)
    right[m] = -remainder + (border * residual).sum()
    # -border . A e_i for each active row i.
    row = np.empty(m)
    adjoint_row = transposed_receptance(columns, border)
    for i in range(m):
        row[i] = -adjoint_row[rows[i, 0], rows[i, 1]]
    last = corner - (border * by_lambda).sum()
    # GMRES weighs forces, lambda and the last equation alike only when the new row and column have the size of I.
    width = np.sqrt((column * column).sum())
    width = width if width > 0.0 else 1.0
    height = np.sqrt((row * row).sum() + (last / width) ** 2)
    height = height if height > 0.0 else 1.0
    column /= width
    row /= height
    last /= width * height
    right[m] /= height
    y: Any = np.empty(0)
    solved = False
    if m > DENSE and relative > 0.0:
        matrix = operator(rows, forces.jacobian, first, count, columns)
        y, solved = gmres(matrix, Border(column, row, last), right, relative, m // ROWS_PER_VECTOR)
    if not solved:
        Z = np.empty((m + 1, m + 1))
        Z[:m, :m] = small_matrix(rows, forces.jacobian, first, count, columns, nh)
        Z[:m, m], Z[m, :m], Z[m, m] = column, row, last
        y = solve_if_finite(Z, right)
    by = y[m] / width
    dx = -residual - by_lambda * by
    if m:
        dx -= apply_receptance(columns, scattered(rows, y[:m], d, nh))
    return dx, by


@compiled
def newton_with_forces(x: Any, point: Any, start: Any, tolerance: float, max_iteration: int) -> Any:
    """Result of `newton`, and the joint forces at x."""
    linear, omega, columns, arrays = point
    table, first, count, sampling = arrays
    forces = joint_forces(x, omega, table, start, sampling, JACOBIAN)
    R = x - linear + apply_receptance(columns, forces.coefficients)
    norm = np.sqrt((R * R).sum())
    iteration = 0
    while norm > tolerance and iteration < max_iteration:
        iteration += 1
        dx = -newton_step(forces, columns, first, count, R, max(RELATIVE, MARGIN * tolerance / norm))
        step, best, best_step = 1.0, np.inf, 1.0
        while True:
            want = JACOBIAN if step == 1.0 and norm > NEARLY * tolerance else FORCE
            tried = step
            forces = joint_forces(x + step * dx, omega, table, start, sampling, want)
            R_new = x + step * dx - linear + apply_receptance(columns, forces.coefficients)
            new = np.sqrt((R_new * R_new).sum())
            if new < best:
                best, best_step = new, step
            if new < (1.0 - DECREASE * step) * norm or new < tolerance:
                break
            step *= SHORTEN
            if step < SHORTEST:
                step = best_step if best < GROWTH * norm else ESCAPE
                break
        x = x + step * dx
        if (want != JACOBIAN or step != 1.0) and not (tried == step and new <= tolerance):
            forces = joint_forces(x, omega, table, start, sampling, JACOBIAN)
            R_new = x - linear + apply_receptance(columns, forces.coefficients)
            new = np.sqrt((R_new * R_new).sum())
        if new > STALLED * norm:
            new = imbalance(R_new, columns, x, forces.coefficients)
        R, norm = R_new, new
        if not np.isfinite(norm):
            break
    return x, norm, iteration, forces


@compiled
def newton(x: Any, point: Any, start: Any, tolerance: float, max_iteration: int) -> Any:
    """Solve R(x) = 0 from x; returns x, |R| (0 where it is round-off), and the number of iterations.

    Parameters
    ----------
    x
        Motion of the joint directions, shape (d, nh) [m].
    point
        `BalancePoint` at which to solve.
    start
        `hbsolve.aft.InitialSliders`.
    tolerance
        |R| of a solution [m].
    max_iteration
        Largest number of iterations [-].
    """
    x, norm, iteration, _ = newton_with_forces(x, point, start, tolerance, max_iteration)
    return x, norm, iteration
