r"""Newton's method for the balance of the joint directions, compiled as a whole.

.. math:: R(x) = x - x_\mathrm{lin} + A\, g(x), \qquad g = f - D x

is eq. 12 in the joint directions. g differs from a constant only where a contact slips or lifts off: with those rows
L of its Jacobian, the step solves a system of their number alone,

.. math:: (I + L A)\, y = -L R, \qquad \Delta x = -R - A\, y .

The functions are continuous with kinks. Backtracking on |R| handles those; where no shorter step helps, one is taken
anyway, because a kink can make every short step worse while the next piece converges at once.

Continuation borders the system with one equation and one unknown, lambda::

    [ I + A L   R_lambda ] [ dx      ]     [ R ]
    [ c^T       c_0      ] [ dlambda ] = - [ r ]

References
----------
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), eq. 12.
"""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.aft import joint_forces
from hbsolve.contact.law import FORCE, JACOBIAN

#: Sufficient decrease, the factor of a shortened step, and the shortest one (Nocedal and Wright, chapter 3).
DECREASE, SHORTEN, SHORTEST = 1e-4, 0.4, 5e-3
#: A step that does not decrease |R| is taken whole up to this growth, else this share of it.
GROWTH, ESCAPE = 1.5, 0.1


@compiled
def apply_receptance(receptance: Any, g: Any) -> Any:
    """A g: response of the linear structure to forces with the coefficients g, shape (d, nh) both."""
    d, nh = g.shape
    x = np.empty((d, nh))
    x[:, 0] = np.dot(np.ascontiguousarray(receptance[0].real), np.ascontiguousarray(g[:, 0]))
    for k in range(1, (nh + 1) // 2):
        moved = np.dot(receptance[k], g[:, 2 * k - 1] - 1j * g[:, 2 * k])
        x[:, 2 * k - 1], x[:, 2 * k] = moved.real, -moved.imag
    return x


@compiled
def active_rows(active: Any) -> Any:
    """Direction and column of each row of the Jacobian that is not zero, shape (m, 2)."""
    rows = np.empty((active.sum(), 2), np.int64)
    m = 0
    for d in range(len(active)):
        for a in range(active[d]):
            rows[m, 0], rows[m, 1] = d, a
            m += 1
    return rows


@compiled
def times_jacobian(rows: Any, jacobian: Any, first: Any, count: Any, x: Any) -> Any:
    """L x on the active rows, shape (m,); first and count are those of the joint of each direction."""
    nh = x.shape[1]
    y = np.zeros(len(rows))
    for i in range(len(rows)):
        d, a = rows[i, 0], rows[i, 1]
        for e in range(count[d]):
            for b in range(nh):
                y[i] += jacobian[d, a, e * nh + b] * x[first[d] + e, b]
    return y


@compiled
def small_matrix(rows: Any, jacobian: Any, first: Any, count: Any, receptance: Any, nh: int) -> Any:
    """I + L A on the active rows, shape (m, m)."""
    m = len(rows)
    Z = np.zeros((m, m))
    for i in range(m):
        d, a = rows[i, 0], rows[i, 1]
        for e in range(count[d]):
            seen = first[d] + e
            for j in range(m):
                column, b = rows[j, 0], rows[j, 1]
                if b == 0:
                    Z[i, j] += jacobian[d, a, e * nh] * receptance[0, seen, column].real
                    continue
                k = (b + 1) // 2
                cosine, sine = jacobian[d, a, e * nh + 2 * k - 1], jacobian[d, a, e * nh + 2 * k]
                alpha = receptance[k, seen, column]
                if b % 2:
                    Z[i, j] += cosine * alpha.real - sine * alpha.imag
                else:
                    Z[i, j] += cosine * alpha.imag + sine * alpha.real
    for i in range(m):
        Z[i, i] += 1.0
    return Z


@compiled
def scattered(rows: Any, y: Any, d: int, nh: int) -> Any:
    """Values on the active rows as coefficients, shape (d, nh)."""
    g = np.zeros((d, nh))
    for i in range(len(rows)):
        g[rows[i, 0], rows[i, 1]] = y[i]
    return g


@compiled
def solve_linearised(forces: Any, receptance: Any, first: Any, count: Any, right: Any) -> Any:
    """Solve (I + A L) x = right."""
    d, nh = right.shape
    rows = active_rows(forces.active)
    if len(rows) == 0:
        return right.copy()
    Z = small_matrix(rows, forces.jacobian, first, count, receptance, nh)
    y = np.linalg.solve(Z, times_jacobian(rows, forces.jacobian, first, count, right))
    return right - apply_receptance(receptance, scattered(rows, y, d, nh))


@compiled
def solve_bordered(
    forces: Any, receptance: Any, first: Any, count: Any, residual: Any, by_lambda: Any, border: Any, corner: float,
    remainder: float,
) -> Any:  # fmt: skip
    """Step (dx, dlambda) of the bordered system above; it stays regular at a fold."""
    d, nh = residual.shape
    rows = active_rows(forces.active)
    m = len(rows)
    Z = np.zeros((m + 1, m + 1))
    right = np.zeros(m + 1)
    Z[:m, :m] = small_matrix(rows, forces.jacobian, first, count, receptance, nh)
    Z[:m, m] = times_jacobian(rows, forces.jacobian, first, count, by_lambda)
    right[:m] = -times_jacobian(rows, forces.jacobian, first, count, residual)
    # -border . A e_i for each active row i.
    for i in range(m):
        column, b = rows[i, 0], rows[i, 1]
        total = 0.0
        if b == 0:
            for e in range(d):
                total += border[e, 0] * receptance[0, e, column].real
        else:
            k = (b + 1) // 2
            for e in range(d):
                alpha = receptance[k, e, column]
                if b % 2:
                    total += border[e, 2 * k - 1] * alpha.real - border[e, 2 * k] * alpha.imag
                else:
                    total += border[e, 2 * k - 1] * alpha.imag + border[e, 2 * k] * alpha.real
        Z[m, i] = -total
    Z[m, m] = corner - (border * by_lambda).sum()
    right[m] = -remainder + (border * residual).sum()
    y = np.linalg.solve(Z, right)
    dx = -residual - by_lambda * y[m]
    if m:
        dx -= apply_receptance(receptance, scattered(rows, y[:m], d, nh))
    return dx, y[m]


@compiled
def newton(
    x: Any, linear: Any, omega: float, receptance: Any, table: Any, first: Any, count: Any, start: Any, sampling: Any,
    tolerance: float, max_iteration: int,
) -> Any:  # fmt: skip
    """Solve R(x) = 0 from x; returns x, |R|, and the number of iterations. `tolerance` is absolute."""
    forces = joint_forces(x, omega, table, start, sampling, JACOBIAN)
    R = x - linear + apply_receptance(receptance, forces.coefficients)
    norm = np.sqrt((R * R).sum())
    iteration = 0
    while norm > tolerance and iteration < max_iteration:
        iteration += 1
        dx = -solve_linearised(forces, receptance, first, count, R)
        step, best, best_step = 1.0, np.inf, 1.0
        while True:
            want = JACOBIAN if step == 1.0 else FORCE
            forces = joint_forces(x + step * dx, omega, table, start, sampling, want)
            R_new = x + step * dx - linear + apply_receptance(receptance, forces.coefficients)
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
        if want != JACOBIAN or step != 1.0:
            forces = joint_forces(x, omega, table, start, sampling, JACOBIAN)
            R_new = x - linear + apply_receptance(receptance, forces.coefficients)
            new = np.sqrt((R_new * R_new).sum())
        R, norm = R_new, new
        if not np.isfinite(norm):
            break
    return x, norm, iteration
