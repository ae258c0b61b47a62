r"""The slider of one tangent: predictor, corrector and the trace from which all derivatives follow.

.. math:: T = k_t (u - w), \qquad w \leftarrow \min(\max(w, u - \mu N / k_t), u + \mu N / k_t)

The slider of an instant was put there by the last slip before, at instant j with sign s,

.. math:: w = u_j - s \mu N_j / k_t,

or has never moved. Two periods are enough: a period clips w to an interval, or leaves it at one value, and does the
same the second time, so that the second period is periodic to the last digit.

References
----------
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), eqs 7, 8 and 11.
Siewert et al., J. Eng. Gas Turbines Power 132 (2010): the predictor-corrector.
"""

from typing import Any

from fe.compiled import compiled
from hbsolve.joint_law.registry import SEPARATED, SLIP, STICK, TOUCH
from hbsolve.sampling import sum_products


@compiled
def slide(
    u: Any, limit: Any, stiffness: float, start: float, by_multiplier: int, w: Any, event: Any, sign: Any
) -> None:
    """March two periods and record the second.

    `limit` is mu N, shape (n,). `event` receives j, -1 for a slider that has not moved since the start; `sign` s,
    which for a start by multiplier is the multiplier itself.
    """
    n, r = len(u), limit / stiffness
    z, j, s = start, -1, 0.0
    if by_multiplier:
        z, s = u[0] - start * r[0], start
    for _ in range(2):
        for k in range(n):
            if u[k] - z > r[k]:
                z, j, s = u[k] - r[k], k, 1.0
            elif u[k] - z < -r[k]:
                z, j, s = u[k] + r[k], k, -1.0
            w[k], event[k], sign[k] = z, j, s
        if j < 0:
            break


@compiled
def slider_slopes(
    tangent: int, normal: int, slider: int, u: float, w: float, limit: float, stiffness: float, limit_by_v: float,
    out: Any,
) -> None:  # fmt: skip
    """Write the rows of one tangent and its slider, as `hbsolve.joint_law.registry.CompiledLaw.step_slopes`.

    A slip to u with the limit mu N, whose derivative by v is `limit_by_v`, ends at w = u -+ mu N / k_t; a slider that
    sticks stays at w. A contact without load slips.
    """
    d = (out.shape[1] - out.shape[0]) // 2
    stretch = u - w
    if abs(stretch) * stiffness > limit + TOUCH * (limit + stiffness * abs(u)) or limit <= 0.0:
        sign = 1.0 if stretch > 0.0 else -1.0
        out[tangent, normal] += sign * limit_by_v
        out[d + slider, tangent] = 1.0
        out[d + slider, normal] -= sign * limit_by_v / stiffness
    else:
        out[tangent, tangent] += stiffness
        out[tangent, 3 * d + slider] -= stiffness
        out[d + slider, 3 * d + slider] = 1.0


@compiled
def state(k: int, event: int, closed: int) -> int:
    """State of the contact at instant k."""
    if not closed:
        return SEPARATED
    return SLIP if event == k else STICK


@compiled
def tangent_jacobian(
    tangent: int, normal: int, event: Any, sign: Any, closed: Any, stiffness: float, reference: float,
    limit_by_v: float, by_multiplier: int, sampling: Any, out: Any,
) -> None:  # fmt: skip
    """Derivative of k_t (u - w) - D u with respect to the coefficients of u, and of v through mu N.

    `reference` is D, and `limit_by_v` mu k_n, or 0 for a constant limit.
    """
    n, nh = len(event), sampling.evaluate.shape[0]
    rows, k = 0, 0
    while k < n:
        first, j, s = k, event[k], sign[k]
        if j == k:  # a run of slip: each instant is its own event
            is_closed = closed[k]
            while k < n and event[k] == k and sign[k] == s and closed[k] == is_closed:
                k += 1
            by_limit, products = s * limit_by_v if is_closed else 0.0, sum_products(sampling, first, k)
            for a in range(nh):
                row = out.jacobian[tangent, a]
                by_u, by_v = row[tangent * nh : (tangent + 1) * nh], row[normal * nh : (normal + 1) * nh]
                for b in range(nh):
                    by_u[b] -= stiffness * products[a, b]
                for b in range(nh if by_limit != 0.0 else 0):
                    by_v[b] += by_limit * products[a, b]
            rows = nh
            continue
        while k < n and event[k] == j and event[k] != k:
            k += 1
        if j < 0:
            if not by_multiplier:
                continue  # never moved: a constant
            j = 0
        whole = k - first == n
        rows = max(rows, 1 if whole else nh)
        by_limit, moved = s * limit_by_v if closed[j] else 0.0, sampling.instants[j]
        for a in range(1 if whole else nh):
            weight = sampling.projected_sum[k, a] - sampling.projected_sum[first, a]
            row = out.jacobian[tangent, a]
            by_u, by_v = row[tangent * nh : (tangent + 1) * nh], row[normal * nh : (normal + 1) * nh]
            for b in range(nh):
                by_u[b] -= stiffness * weight * moved[b]
            for b in range(nh if by_limit != 0.0 else 0):
                by_v[b] += by_limit * weight * moved[b]
    if stiffness != reference:
        rows = nh
        for a in range(nh):
            out.jacobian[tangent, a, tangent * nh + a] += stiffness - reference
    out.active[tangent] = rows
