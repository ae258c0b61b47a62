r"""The unilateral normal spring.

.. math:: N = \max(N_0 + k_n (v - g),\ 0)

References
----------
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), eq. 6.
"""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.registry import JACOBIAN, PARAMETERS
from hbsolve.sampling import add_products, add_sums


@compiled
def normal_force(v: Any, stiffness: float, preload: float, gap: float, N: Any, closed: Any) -> int:
    """Fill N and `closed` (1 or 0), both of shape (n,); return the number of open instants."""
    n_open = 0
    for k in range(len(v)):
        N[k] = preload + stiffness * (v[k] - gap)
        closed[k] = 1
        if N[k] <= 0.0:
            N[k] = 0.0
            closed[k] = 0
            n_open += 1
    return n_open


@compiled
def unilateral(
    direction: int, v: Any, closed: Any, n_open: int, reference: float, stiffness: float, preload: float, gap: float,
    preload_at: int, stiffness_at: int, gap_at: int, sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """Write N - D v of one direction; arguments `..._at` are indices of parameters, negative for none."""
    n, nh = len(v), sampling.evaluate.shape[0]
    # Where the stiffness is D, N - D v of a closed contact is the same at all instants, to the last digit.
    beyond, at_zero = stiffness - reference, preload - stiffness * gap
    force = out.force[direction]
    for k in range(n):
        force[k] = at_zero + beyond * v[k] if closed[k] else -reference * v[k]
    if want >= JACOBIAN:
        own = direction * nh
        # Open instants differ from the closed spring by -k_n, and the closed spring from D by k_n - D.
        if n_open or stiffness != reference:
            out.active[direction] = nh
            for a in range(nh):
                out.jacobian[direction, a, own + a] = stiffness - reference
        if n_open:
            cosine, sine = np.zeros(nh), np.zeros(nh)
            k = 0
            while k < n:
                first = k
                while k < n and closed[k] == closed[first]:
                    k += 1
                if not closed[first]:
                    add_sums(-stiffness, sampling, first, k, cosine, sine)
            add_products(cosine, sine, n, out.jacobian[direction, :, own : own + nh])
    if want >= PARAMETERS:
        for k in range(n):
            if closed[k]:
                if preload_at >= 0:
                    out.by_parameter[preload_at, direction, k] = 1.0
                out.by_parameter[stiffness_at, direction, k] = v[k] - gap
                out.by_parameter[gap_at, direction, k] = -stiffness
