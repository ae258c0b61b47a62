r"""The slider of one tangent: predictor, corrector and the trace from which all derivatives follow.

.. math:: T = k_t (u - w), \qquad w \leftarrow \min(\max(w, u - \mu N / k_t), u + \mu N / k_t)

The position of the slider was set by the last slip, at instant j with sign s,

.. math:: w = u_j - s \mu N_j / k_t,

or is that of the start if it has never moved. Without a limit the slider follows any motion, also a later one (s = 0).
Two periods are enough: a period clips w to an interval, or leaves it at one value, and does the same the second time,
so that the second period is periodic to the last digit. From the first slip that both periods share, the second repeats
the first.

References
----------
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), eqs 7, 8 and 11.
Siewert et al., J. Eng. Gas Turbines Power 132 (2010): the predictor-corrector.
"""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.registry import SEPARATED, SLIP, STICK, TOUCH
from hbsolve.sampling import add_products, add_sums


@compiled
def slide(
    u: Any, limit: Any, stiffness: float, start: float, by_multiplier: int, w: Any, event: Any, sign: Any
) -> None:
    """Follow the slider over two periods and record the second.

    `limit` is mu N, shape (n,). `event` receives j, or -1 for a slider that has not moved since the start; `sign`
    receives s, or the multiplier for a start by multiplier that has not moved.
    """
    n, r = len(u), limit / stiffness
    z, j, s = start, -1, 0.0
    if by_multiplier:
        z, s = u[0] - start * r[0], start
    for period in range(2):
        for k in range(n):
            low, high = u[k] - r[k], u[k] + r[k]
            if z < low:
                z, j, s = low, k, 1.0
            elif z > high:
                z, j, s = high, k, -1.0
            elif r[k] <= 0.0:  # without a limit it follows any motion, also a later one
                z, j, s = u[k], k, 0.0
            if period and j == k and event[k] == k and sign[k] == s:
                return
            w[k], event[k], sign[k] = z, j, s
        if j < 0:
            return


@compiled
def write_slider(
    tangent: int, u: Any, limit: Any, stiffness: float, reference: float, start: float, by_multiplier: int, event: Any,
    sign: Any, closed: Any, out: Any,
) -> None:  # fmt: skip
    """Follow one tangent and write its force beyond D u, the slider and its state; arguments as of `slide`."""
    w, force, status = out.slider[tangent], out.force[tangent], out.status[tangent]
    slide(u, limit, stiffness, start, by_multiplier, w, event, sign)
    # A slider that every period puts to the same position, at one instant, only touches its limit.
    before = event[-1]
    for k in range(len(u)):
        # The stretch of a stiff spring is lost in round-off; where the slider slips, the force is its limit.
        if event[k] == k and before != k:
            force[k] = sign[k] * limit[k] - reference * u[k]
        else:
            force[k] = (stiffness - reference) * u[k] - stiffness * w[k]
        before = event[k]
    for k in range(len(u)):
        status[k] = state(k, event[k], closed[k])


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
    jacobian, own, across = out.jacobian[tangent], tangent * nh, normal * nh
    # Sums over all slip of products by the motion along the tangent and along the normal.
    cosine, sine = np.zeros((2, nh)), np.zeros((2, nh))
    rows, k = 0, 0
    while k < n:
        first, j, s = k, event[k], sign[k]
        if j == k and k + 1 < n and event[k + 1] == k + 1:  # a run of slip: each instant is its own event
            is_closed = closed[k]
            while k < n and event[k] == k and sign[k] == s and closed[k] == is_closed:
                k += 1
            add_sums(-stiffness, sampling, first, k, cosine[0], sine[0])
            add_sums(s * limit_by_v if is_closed else 0.0, sampling, first, k, cosine[1], sine[1])
            rows = nh
            continue
        while k < n and event[k] == j:
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
            for b in range(nh):
                jacobian[a, own + b] -= stiffness * weight * moved[b]
            for b in range(nh if by_limit != 0.0 else 0):
                jacobian[a, across + b] += by_limit * weight * moved[b]
    if rows > 1:
        add_products(cosine[0], sine[0], n, jacobian[:, own : own + nh])
        if limit_by_v != 0.0:
            add_products(cosine[1], sine[1], n, jacobian[:, across : across + nh])
    if stiffness != reference:
        rows = nh
        for a in range(nh):
            jacobian[a, own + a] += stiffness - reference
    out.active[tangent] = rows
