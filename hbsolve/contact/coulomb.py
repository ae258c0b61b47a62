r"""Two tangents under one limit: isotropic Coulomb friction by radial return.

.. math:: w \leftarrow u - \frac{\mu N}{k_t} \frac{u - w}{|u - w|} \quad \text{if} \quad k_t |u - w| > \mu N

The slider is pulled along like a load on a rope. It may need many periods to settle (shakedown), so periods are marched
until it returns to where it began one; the derivative is carried through all of them, so that it is exact for what was
computed. Where the direction of sliding turns, radial return is of first order in the distance of the samples: twice as
many halve the error.

References
----------
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), eqs 7 and 8, in two tangents.
Simo and Hughes, Computational Inelasticity, Springer (1998), chapter 3: radial return.
"""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.contact.law import JACOBIAN, PARAMETERS, SEPARATED, SLIP, STICK
from hbsolve.contact.unilateral import normal_force, unilateral

#: Periods at most; sliders that creep on after these are left where they are.
MAX_PERIOD = 200
#: A slider has settled when a period moves it by less than this part of the radius of its limit or of the motion.
SETTLED = 1e-11


@compiled
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """Directions: two tangents, then the normal; see `hbsolve.contact.law`."""
    kt, kn, mu, preload, gap = parameters[0], parameters[1], parameters[2], parameters[3], parameters[4]
    n, nh = u.shape[1], sampling.evaluate.shape[0]
    N, closed = np.empty(n), np.empty(n, np.int64)
    n_open = normal_force(u[2], kn, preload, gap, N, closed)
    unilateral(2, u[2], N, closed, n_open, reference[2], kn, gap, 3, 1, 4, sampling, want, out)

    # Columns of S: coefficients of both tangents and the normal, the five parameters, the two starts.
    derive = want >= JACOBIAN
    width = 3 * nh + 7
    S = np.zeros((2, width))
    traces = np.zeros((n, 2, width)) if derive else np.zeros((1, 2, width))
    w, begin = start.copy(), np.empty(2)
    for d in range(2):
        S[d, 3 * nh + 5 + d] = 1.0
        if by_multiplier[d]:
            w[d] = u[d, 0] - start[d] * mu * N[0] / kt
            _limit_change(S[d], -start[d], N[0], u[2, 0], closed[0], kt, kn, mu, gap, sampling.instants[0])
            S[d, d * nh : (d + 1) * nh] += sampling.instants[0]
            S[d, 3 * nh + 5 + d] = -mu * N[0] / kt
    scale = max(np.abs(u[:2]).max(), mu * N.max() / kt)
    n_slip = 0
    for _ in range(MAX_PERIOD):
        begin[:] = w
        n_slip = 0
        for k in range(n):
            r = mu * N[k] / kt
            e0, e1 = u[0, k] - w[0], u[1, k] - w[1]
            length = np.sqrt(e0 * e0 + e1 * e1)
            slipped = length > r
            if slipped:
                n_slip += 1
                e0, e1 = e0 / length, e1 / length
                w[0], w[1] = u[0, k] - r * e0, u[1, k] - r * e1
                if derive:
                    _return_derivative(
                        S, e0, e1, r / length, N[k], u[2, k], closed[k], kt, kn, mu, gap, sampling.instants[k]
                    )
            out.slider[0, k], out.slider[1, k] = w[0], w[1]
            status = SEPARATED if not closed[k] else (SLIP if slipped else STICK)
            out.status[0, k] = out.status[1, k] = status
            if derive:
                traces[k] = S
        if np.hypot(w[0] - begin[0], w[1] - begin[1]) <= SETTLED * scale:
            break
    for d in range(2):
        for k in range(n):
            out.force[d, k] = kt * (u[d, k] - out.slider[d, k]) - reference[d] * u[d, k]
        if want >= PARAMETERS:
            for k in range(n):
                for p in range(5):
                    out.by_parameter[p, d, k] = -kt * traces[k, d, 3 * nh + p]
                out.by_parameter[0, d, k] += u[d, k] - out.slider[d, k]
                for s in range(2):
                    out.by_start[s, d, k] = -kt * traces[k, d, 3 * nh + 5 + s]
        if derive and (n_slip or np.abs(traces[0, d, : 3 * nh]).max() > 0.0):
            out.active[d] = nh if n_slip else 1
            rows = nh if n_slip else 1
            weights = np.ascontiguousarray(sampling.project[:, :rows].T)
            own = np.ascontiguousarray(traces[:, d, : 3 * nh])
            out.jacobian[d, :rows, :] = -kt * np.dot(weights, own)
        if derive and kt != reference[d]:
            out.active[d] = nh
            for a in range(nh):
                out.jacobian[d, a, d * nh + a] += kt - reference[d]


@compiled
def _limit_change(
    S: Any, factor: float, N: float, v: float, closed: int, kt: float, kn: float, mu: float, gap: float, basis: Any
) -> None:
    """Add factor times the derivative of the radius mu N / k_t to a row of S."""
    nh = len(basis)
    S[3 * nh] -= factor * mu * N / (kt * kt)
    S[3 * nh + 2] += factor * N / kt
    if closed:
        S[2 * nh : 3 * nh] += factor * mu * kn / kt * basis
        S[3 * nh + 1] += factor * mu * (v - gap) / kt
        S[3 * nh + 3] += factor * mu / kt
        S[3 * nh + 4] -= factor * mu * kn / kt


@compiled
def _return_derivative(
    S: Any, e0: float, e1: float, share: float, N: float, v: float, closed: int, kt: float, kn: float, mu: float,
    gap: float, basis: Any,
) -> None:  # fmt: skip
    """The slider follows: dw = du - e dr - (r / |u - w|) (I - e e^T) (du - dw), with e the direction of sliding."""
    nh = len(basis)
    for c in range(S.shape[1]):
        du0 = basis[c] if c < nh else 0.0
        du1 = basis[c - nh] if nh <= c < 2 * nh else 0.0
        d0, d1 = du0 - S[0, c], du1 - S[1, c]
        along = e0 * d0 + e1 * d1
        S[0, c] = du0 - share * (d0 - e0 * along)
        S[1, c] = du1 - share * (d1 - e1 * along)
    _limit_change(S[0], -e0, N, v, closed, kt, kn, mu, gap, basis)
    _limit_change(S[1], -e1, N, v, closed, kt, kn, mu, gap, basis)
