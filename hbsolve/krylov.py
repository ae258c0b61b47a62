r"""GMRES for (I + L A) y = right, `hbsolve.linearised`, without the matrix, also bordered by one equation and unknown.

As L is block diagonal by joint and A by harmonic, a product with both costs a tenth of one with the matrix, and most of
its eigenvalues are close to 1.

References
----------
Saad and Schultz, SIAM J. Sci. Stat. Comput. 7 (1986): GMRES.
Paige, Rozloznik and Strakos, SIAM J. Matrix Anal. Appl. 28 (2006): its modified Gram-Schmidt form is backward stable.
"""

from typing import Any, NamedTuple

import numpy as np

from fe.compiled import compiled
from hbsolve.linearised import active_directions
from reduction.array_type import Real, Whole

#: Least number of vectors before GMRES may be stopped for slow convergence: it starts slowly.
TRIAL = 12


class Operator(NamedTuple):
    """Arrays for products with I + L A; m active directions, f of them beyond the mean, s directions of their joints.

    These s directions are called seen.
    """

    n_full: int
    """f."""
    real: Real
    """Re A_k from the active directions to those of their joints, shape (H + 1, m, s) [m/N]."""
    imag: Real
    """Im A_k."""
    seen: Whole
    """Indices of the directions of each active direction's joint among the s ones, shape (most directions, m)."""
    law: Real
    """L by coefficient of the force, by direction and coefficient of the motion, shape (nh, most directions nh, m)."""


class Border(NamedTuple):
    """Additional equation and unknown; empty arrays for none."""

    column: Real
    row: Real
    corner: float


@compiled
def operator(rows: Any, jacobian: Any, first: Any, count: Any, columns: Any) -> Any:
    """I + L A on the active rows, packed for `product`."""
    directions, n_full = active_directions(rows)
    n_harmonic, d, n = columns.shape[0], columns.shape[1], len(directions)
    nh = 2 * n_harmonic - 1
    place, order = np.full(d, -1), np.empty(d, np.int64)
    n_seen, most = 0, 1
    for c in directions:
        most = max(most, count[c])
        for s in range(first[c], first[c] + count[c]):
            if place[s] < 0:
                place[s], order[n_seen] = n_seen, s
                n_seen += 1
    real, imag = np.empty((n_harmonic, n, n_seen)), np.empty((n_harmonic, n, n_seen))
    for k in range(n_harmonic):
        for j in range(n):
            for i in range(n_seen):
                alpha = columns[k, directions[j], order[i]]
                real[k, j, i], imag[k, j, i] = alpha.real, alpha.imag
    seen, law = np.zeros((most, n), np.int64), np.zeros((nh, most * nh, n))
    for j in range(n):
        c = directions[j]
        for e in range(count[c]):
            seen[e, j] = place[first[c] + e]
            for a in range(nh if j < n_full else 1):
                for b in range(e * nh, (e + 1) * nh):
                    law[a, b, j] = jacobian[c, a, b]
    return Operator(n_full, real, imag, seen, law)


@compiled
def product(matrix: Any, y: Any, x: Any, gathered: Any, out: Any) -> None:
    """Write (I + L A) y into `out`; x and gathered are buffers for the motion of all s directions and by joint."""
    real, imag, n_full = matrix.real, matrix.imag, matrix.n_full
    n_harmonic, n, n_seen = real.shape
    nh = 2 * n_harmonic - 1
    x[:] = 0.0
    mean = x[0]
    for j in range(n):
        p, v = real[0, j], y[j]
        for i in range(n_seen):
            mean[i] += p[i] * v
    for k in range(1, n_harmonic):
        in_cosine, in_sine = x[2 * k - 1], x[2 * k]
        at, by = n + (2 * k - 2) * n_full, n + (2 * k - 1) * n_full
        # Four columns at a time, to read and write x a quarter as often.
        whole = n_full - n_full % 4
        for j in range(0, whole, 4):
            c, c1, c2, c3 = y[at + j], y[at + j + 1], y[at + j + 2], y[at + j + 3]
            s, s1, s2, s3 = y[by + j], y[by + j + 1], y[by + j + 2], y[by + j + 3]
            p, p1, p2, p3 = real[k, j], real[k, j + 1], real[k, j + 2], real[k, j + 3]
            q, q1, q2, q3 = imag[k, j], imag[k, j + 1], imag[k, j + 2], imag[k, j + 3]
            for i in range(n_seen):
                in_cosine[i] += ((p[i] * c + q[i] * s) + (p1[i] * c1 + q1[i] * s1)) + (
                    (p2[i] * c2 + q2[i] * s2) + (p3[i] * c3 + q3[i] * s3)
                )
                in_sine[i] += ((p[i] * s - q[i] * c) + (p1[i] * s1 - q1[i] * c1)) + (
                    (p2[i] * s2 - q2[i] * c2) + (p3[i] * s3 - q3[i] * c3)
                )
        for j in range(whole, n_full):
            c, s, p, q = y[at + j], y[by + j], real[k, j], imag[k, j]
            for i in range(n_seen):
                in_cosine[i] += p[i] * c + q[i] * s
                in_sine[i] += p[i] * s - q[i] * c
    for b in range(len(gathered)):
        u, coefficient, place = gathered[b], x[b % nh], matrix.seen[b // nh]
        for j in range(n):
            u[j] = coefficient[place[j]]
    for a in range(nh):
        at, many = (0, n) if a == 0 else (n + (a - 1) * n_full, n_full)
        z = out[at : at + many]
        z[:] = y[at : at + many]
        for b in range(len(gathered)):
            law, u = matrix.law[a, b], gathered[b]
            for j in range(many):
                z[j] += law[j] * u[j]


@compiled
def gmres(matrix: Any, border: Any, right: Any, relative: float, most: int) -> Any:
    """Solve by at most `most` vectors; returns the solution and whether |residual| <= relative |right|.

    It stops early where the residual has, after `TRIAL` vectors or more, not fallen at half the necessary rate.
    """
    n_harmonic, n, n_seen = matrix.real.shape
    m, n_row = len(right), n + (2 * n_harmonic - 2) * matrix.n_full
    nh = 2 * n_harmonic - 1
    x, gathered = np.empty((nh, n_seen)), np.empty((len(matrix.seen) * nh, n))
    V, R, y = np.empty((most + 1, m)), np.zeros((most + 1, most)), np.zeros(m)
    cosine, sine, g = np.empty(most), np.empty(most), np.zeros(most + 1)
    g[0] = np.sqrt(np.dot(right, right))
    if not g[0] > 0.0:
        return y, g[0] == 0.0
    goal, pace = relative * g[0], np.log(relative) / (2 * max(most, 1))
    size = g[0]
    V[0] = right / g[0]
    used = 0
    while abs(g[used]) > goal:
        if used == most or (used >= TRIAL and abs(g[used]) > np.exp(pace * used) * size):
            return y, False
        v, w = V[used], V[used + 1]
        product(matrix, v[:n_row], x, gathered, w[:n_row])
        if m > n_row:
            w[n_row] = np.dot(border.row, v[:n_row]) + border.corner * v[n_row]
            for i in range(n_row):
                w[i] += border.column[i] * v[n_row]
        for j in range(used + 1):
            u, h = V[j], np.dot(V[j], w)
            R[j, used] = h
            for i in range(m):
                w[i] -= h * u[i]
        beyond = np.sqrt(np.dot(w, w))
        for j in range(used):
            h, below = R[j, used], R[j + 1, used]
            R[j, used], R[j + 1, used] = cosine[j] * h + sine[j] * below, cosine[j] * below - sine[j] * h
        length = np.hypot(R[used, used], beyond)
        if not (length > 0.0 and np.isfinite(length)):
            return y, False
        cosine[used], sine[used] = R[used, used] / length, beyond / length
        R[used, used] = length
        g[used], g[used + 1] = cosine[used] * g[used], -sine[used] * g[used]
        used += 1
        if beyond > 0.0:
            w /= beyond
    for j in range(used - 1, -1, -1):
        for i in range(j + 1, used):
            g[j] -= R[j, i] * g[i]
        g[j] /= R[j, j]
        y += g[j] * V[j]
    return y, True
