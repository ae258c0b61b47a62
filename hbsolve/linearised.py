r"""The linear algebra of one step of Newton's method: I + L A on the rows of L that are not zero.

L, the Jacobian of the joint forces g, is block diagonal by joint, A by harmonic. The rows are ordered by coefficient
and, within one, by direction, so that inner loops run over directions, in contiguous memory. Directions with only the
mean active come last.
"""

from typing import Any

import numpy as np

from fe.compiled import compiled


@compiled
def active_rows(active: Any) -> Any:
    """Direction and coefficient of each row of the Jacobian that is not zero, shape (m, 2)."""
    nh = active.max() if len(active) else 1
    full = np.flatnonzero(active > 1)
    every = np.concatenate((full, np.flatnonzero(active == 1)))
    rows = np.empty((len(every) + (nh - 1) * len(full), 2), np.int64)
    rows[: len(every), 0], rows[: len(every), 1] = every, 0
    for b in range(1, nh):
        first = len(every) + (b - 1) * len(full)
        rows[first : first + len(full), 0], rows[first : first + len(full), 1] = full, b
    return rows


@compiled
def active_directions(rows: Any) -> Any:
    """The active directions, and the number of those active beyond the mean."""
    mean = 0
    while mean < len(rows) and rows[mean, 1] == 0:
        mean += 1
    full = 0
    while mean + full < len(rows) and rows[mean + full, 1] == 1:
        full += 1
    return rows[:mean, 0].copy(), full


@compiled
def times_jacobian(rows: Any, jacobian: Any, first: Any, count: Any, x: Any) -> Any:
    """L x on the active rows, shape (m,); first and count are those of the joint of each direction."""
    nh = x.shape[1]
    y = np.empty(len(rows))
    for i in range(len(rows)):
        d, a = rows[i, 0], rows[i, 1]
        total = 0.0
        for e in range(count[d]):
            for b in range(nh):
                total += jacobian[d, a, e * nh + b] * x[first[d] + e, b]
        y[i] = total
    return y


@compiled
def transposed_jacobian(rows: Any, jacobian: Any, first: Any, count: Any, y: Any) -> Any:
    """L^T y of values on the active rows, shape (d, nh)."""
    d, nh, _ = jacobian.shape
    x = np.zeros((d, nh))
    for i in range(len(rows)):
        c, a = rows[i, 0], rows[i, 1]
        for e in range(count[c]):
            for b in range(nh):
                x[first[c] + e, b] += jacobian[c, a, e * nh + b] * y[i]
    return x


@compiled
def scattered(rows: Any, y: Any, d: int, nh: int) -> Any:
    """Values on the active rows as coefficients, shape (d, nh)."""
    g = np.zeros((d, nh))
    for i in range(len(rows)):
        g[rows[i, 0], rows[i, 1]] = y[i]
    return g


@compiled
def solve_if_finite(matrix: Any, right: Any) -> Any:
    """Solution of a system, shape (m,); NaN if its entries overflow, such as for a steep law far beyond its range.

    Newton's method then ends as it does if |R| overflows.
    """
    if not (np.isfinite(matrix).all() and np.isfinite(right).all()):
        return np.full(len(right), np.nan)
    return np.linalg.solve(matrix, right)


@compiled
def small_matrix(rows: Any, jacobian: Any, first: Any, count: Any, columns: Any, nh: int) -> Any:
    """I + L A on the active rows, shape (m, m); `columns` are those of A, see `hbsolve.newton`."""
    directions, n_full = active_directions(rows)
    n_harmonic, d, n = columns.shape[0], columns.shape[1], len(directions)
    # Active columns of A, real and imaginary part each contiguous; rows of other joints are not set.
    real, imag = np.empty((n_harmonic, d, n)), np.empty((n_harmonic, d, n))
    used = np.zeros(d, np.bool_)
    for c in directions:
        used[first[c] : first[c] + count[c]] = True
    for k in range(n_harmonic):
        for s in range(d):
            if used[s]:
                for j in range(n):
                    alpha = columns[k, directions[j], s]
                    real[k, s, j], imag[k, s, j] = alpha.real, alpha.imag
    Z = np.zeros((len(rows), len(rows)))
    for i in range(len(rows)):
        c, a = rows[i, 0], rows[i, 1]
        z = Z[i]
        for e in range(count[c]):
            s = first[c] + e
            law = jacobian[c, a, e * nh : (e + 1) * nh]
            mean, p = law[0], real[0, s]
            for j in range(n):
                z[j] += mean * p[j]
            for k in range(1, n_harmonic):
                cosine, sine = law[2 * k - 1], law[2 * k]
                p, q = real[k, s], imag[k, s]
                at = n + (2 * k - 2) * n_full
                by_cosine, by_sine = z[at : at + n_full], z[at + n_full : at + 2 * n_full]
                for j in range(n_full):
                    by_cosine[j] += cosine * p[j] - sine * q[j]
                    by_sine[j] += cosine * q[j] + sine * p[j]
        z[i] += 1.0
    return Z
