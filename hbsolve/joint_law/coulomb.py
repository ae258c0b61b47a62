r"""Two tangents under one limit: isotropic Coulomb friction, exact along straight paths from sample to sample.

Between two samples the contact point moves by :math:`\Delta` on a straight line, and the radius of the limit,
:math:`r = \mu N / k_t`, changes linearly from one to the other. The spring, :math:`e = u - w`, is stretched by all of
the motion until :math:`|e| = r`. From there on it keeps that length, and the slider slips along :math:`e`, in the
direction of the spring force; where r is constant its path is a tractrix. Only the component of the motion across the
spring changes the direction of the spring,

.. math:: r\, \frac{d\delta}{ds} = -|\Delta| \sin\delta, \qquad
          \tan\frac{\delta_1}{2} = e^{-\kappa} \tan\frac{\delta_0}{2}, \qquad
          \kappa = |\Delta| \int \frac{ds}{r}

with :math:`\delta` the angle from the motion to the spring. A disc is convex and the spring turns towards the motion
only. So a contact sticks between two samples if the spring is within the limit at the second, and otherwise begins to
slip at one instant and slides until the second. The error is that of straight paths: of second order in the distance
of the samples. A start, and a contact without load at either sample, is put on the limit by radial return, which is
exact where the spring was slack. As with one tangent, a contact that closes between two samples counts as closed from
the first.

The slider may need many periods to settle. A period whose last slip is at instant j takes the angle :math:`\theta` of
that spring to :math:`F(\theta)`, where :math:`F'`, between -1 and 1, is the product of the derivatives of the angle
after each slip by the angle before it. So Newton's method finds the cycle, :math:`\theta = F(\theta)`, in a few
periods. A cycle with slip is unique: two springs at a constant distance slip at the same instants in the same
direction, and are therefore the same. A cycle without slip is one of many: then periods are iterated without Newton's
method until the slider ends a period where it began it (shakedown), and the derivative is carried through all of them.
A contact that stays within its limit needs no iteration. A spring of direction :math:`n` on the limit turns by
:math:`d\theta`, and

.. math:: dw = du - n\, dr - r\, n_\perp\, d\theta ,

so that the angle is the only unknown. In a cycle :math:`d\theta = F'\, d\theta + b`, with b the derivative at a fixed
angle where the period begins.

References
----------
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), eqs 7 and 8, in two tangents.
Simo and Hughes, Computational Inelasticity, Springer (1998), chapter 3: radial return.
"""

from typing import Any, NamedTuple

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.registry import FORCES, JACOBIAN, PARAMETERS, SEPARATED, SLIP, STICK, TOUCH, CompiledLaw
from hbsolve.joint_law.unilateral import normal_force, unilateral
from reduction.array_type import Real, Whole

#: Largest number of periods; sliders that still creep after these are reported.
MAX_PERIOD = 200
#: 1 - F' below which the angle hardly converges to a cycle, and periods are iterated.
MIN_CONTRACTION = 1e-6
#: Largest number of Newton steps towards a cycle, and largest change of the angle in a step [rad].
MAX_NEWTON, MAX_STEP = 40, 1.0
#: Index for no instant.
NONE = -1
#: A slider has settled when a period moves it by less than this fraction of the radius of its limit or of the motion.
SETTLED = 1e-11
#: Value of |z| below which the mean inverse of the radius is computed, to round-off, by its series in
#: z = (r_1 - r_0) / (r_1 + r_0).
SERIES = 0.03
#: Largest kappa: the square of exp(-kappa) must not underflow.
MAX_EXPONENT = 300.0


class SliderStates(NamedTuple):
    """State of the slider before a period, in row 0, and after each slip of the period: w = u_j - r n.

    Its derivative is dw = du_j - n dr_j - r n_perp dtheta, and for a given start dw = dstart.
    """

    instant: Whole
    """j, shape (m,)."""
    angle_slopes: Real
    """Derivatives of theta, the angle of n, by the coefficients of both tangents and the normal, by the five
    parameters and by the two starts, shape (m, 3 nh + 7)."""
    state: Real
    """n in columns 0 and 1, r, whether w follows each tangent of u_j, and its derivative by each start, shape (m, 7).
    """


#: First columns of `SliderStates.state`.
RADIUS, FOLLOWS, BY_START = 2, 3, 5


@compiled
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """Directions: two tangents, then the normal; see `hbsolve.joint_law.registry`."""
    kt, kn, mu, preload, gap = parameters[0], parameters[1], parameters[2], parameters[3], parameters[4]
    n, nh = u.shape[1], sampling.evaluate.shape[0]
    N, closed = np.empty(n), np.empty(n, np.int64)
    n_open = normal_force(u[2], kn, preload, gap, N, closed)
    unilateral(2, u[2], closed, n_open, reference[2], kn, preload, gap, 3, 1, 4, sampling, want, out)

    radius = mu / kt * N
    w = start.copy()
    for d in range(2):
        if by_multiplier[d]:
            w[d] = u[d, 0] - start[d] * radius[0]
    n_beyond = 0
    for k in range(n):
        e0, e1 = u[0, k] - w[0], u[1, k] - w[1]
        n_beyond += radius[k] <= 0.0 or e0 * e0 + e1 * e1 > radius[k] * radius[k]
    slips = n_beyond > 0

    derive = want >= JACOBIAN
    # Derivatives of the radius by the normal displacement, and by the parameters.
    n_radius = (n if slips else 1) if derive else 0
    r_by_v, r_by = np.zeros(n_radius), np.zeros((n_radius, 5))
    for k in range(n_radius):
        r_by[k, 0], r_by[k, 2] = -radius[k] / kt, N[k] / kt
        if closed[k]:
            r_by_v[k] = mu * kn / kt
            r_by[k, 1], r_by[k, 3], r_by[k, 4] = mu * (u[2, k] - gap) / kt, mu / kt, -r_by_v[k]
    n_row = (n + 1 if slips else 1) if derive else 0
    rows = SliderStates(np.zeros(n_row, np.int64), np.empty((n_row, 3 * nh + 7)), np.zeros((n_row, 7)))
    if derive:
        rows.angle_slopes[0] = 0.0
        for d in range(2):
            rows.state[0, d] = start[d] if by_multiplier[d] else 0.0
            rows.state[0, FOLLOWS + d] = by_multiplier[d]
            rows.state[0, BY_START + d] = -radius[0] if by_multiplier[d] else 1.0

    n_slip = 0
    which = np.zeros(n, np.int64)
    if slips:
        n_slip = _iterate_periods(u, radius, w, rows, which, r_by, r_by_v, sampling, derive, out)
    else:
        for d in range(2):
            out.slider[d] = w[d]
    for k in range(n if slips or n_open else 0):
        status = SLIP if which[k] > (which[k - 1] if k else 0) else STICK
        out.status[0, k] = out.status[1, k] = status if closed[k] else SEPARATED
    for d in range(2):
        beyond, own, slider, spring = kt - reference[d], u[d], out.slider[d], out.force[d]
        for k in range(n):
            spring[k] = beyond * own[k] - kt * slider[k]
        if want >= PARAMETERS:
            for k in range(n):
                i = which[k]
                j, state = rows.instant[i], rows.state[i]
                across = _across(state, d)
                for p in range(5):
                    by = across * rows.angle_slopes[i, 3 * nh + p] - state[d] * r_by[j, p]
                    out.by_parameter[p, d, k] = -kt * by
                out.by_parameter[0, d, k] += u[d, k] - out.slider[d, k]
                for s in range(2):
                    by = across * rows.angle_slopes[i, 3 * nh + 5 + s]
                    out.by_start[s, d, k] = -kt * (by + (state[BY_START + d] if s == d else 0.0))
        if derive and (n_slip or rows.state[0, FOLLOWS + d]):
            active = nh if n_slip else 1
            out.active[d] = active
            weights = _weights(which, n_slip + 1, active, sampling.projected_sum)
            out.jacobian[d, :active, :] = -kt * np.dot(weights, _by_motion(d, rows, n_slip + 1, r_by_v, sampling))
        if derive and beyond != 0.0:
            out.active[d] = nh
            for a in range(nh):
                out.jacobian[d, a, d * nh + a] += beyond


@compiled
def _iterate_periods(
    u: Any, radius: Any, w: Any, rows: Any, which: Any, r_by: Any, r_by_v: Any, sampling: Any, derive: bool, out: Any
) -> int:
    """Move the slider w through periods until it settles; record w, the slips and their number in the last period."""
    given = w.copy()
    scale = max(np.abs(u[:2]).max(), radius.max())
    n_slip, at, shifted = _settle(u, radius, w, scale, rows, which, r_by, r_by_v, sampling, out)
    if not derive and (n_slip or not shifted):
        return n_slip
    if n_slip:
        first = rows.angle_slopes[0].copy(), rows.state[0].copy()
        if _close(u, radius, w, at, rows, which, r_by, r_by_v, sampling, out):
            return n_slip
        rows.instant[0], rows.angle_slopes[0], rows.state[0] = 0, first[0], first[1]
    w[:] = given
    n_slip, at = 0, NONE
    for _ in range(MAX_PERIOD):
        begin0, begin1 = w[0], w[1]
        if derive:
            rows.instant[0], rows.state[0] = rows.instant[n_slip], rows.state[n_slip]
            rows.angle_slopes[0] = rows.angle_slopes[n_slip]
        n_slip, at, _ = _period(u, radius, w, at, rows, which, r_by, r_by_v, sampling, derive, out)
        if np.hypot(w[0] - begin0, w[1] - begin1) <= SETTLED * scale:
            break
    else:
        out.unsettled[0] = 1
    return n_slip


@compiled
def _settle(
    u: Any, radius: Any, w: Any, scale: float, rows: Any, which: Any, r_by: Any, r_by_v: Any, sampling: Any, out: Any
) -> tuple[int, int, bool]:
    """Move the slider w to a cycle with slip, by Newton's method.

    Returns the number of slips, 0 if there is no such cycle; the instant of the last slip; and whether w differs from
    the position to which periods alone would have moved it.
    """
    at, least, shifted = NONE, np.inf, False
    for _ in range(MAX_NEWTON):
        begin0, begin1, last = w[0], w[1], at
        n_slip, at, by_angle = _period(u, radius, w, at, rows, which, r_by, r_by_v, sampling, False, out)
        moved = np.hypot(w[0] - begin0, w[1] - begin1)
        if n_slip == 0 or moved <= SETTLED * scale:
            # A slip that does not change the angle is round-off: the spring only sticks.
            return (n_slip if by_angle < 1.0 - MIN_CONTRACTION else 0), at, shifted
        if at == last and moved < least and by_angle < 1.0 - MIN_CONTRACTION:
            least, shifted = moved, True
            n0, n1, m0, m1 = u[0, at] - w[0], u[1, at] - w[1], u[0, at] - begin0, u[1, at] - begin1
            step = np.arctan2(m0 * n1 - m1 * n0, m0 * n0 + m1 * n1) * by_angle / (1.0 - by_angle)
            step = min(max(step, -MAX_STEP), MAX_STEP)
            cosine, sine = np.cos(step), np.sin(step)
            w[0], w[1] = u[0, at] - (cosine * n0 - sine * n1), u[1, at] - (cosine * n1 + sine * n0)
    return 0, at, True


@compiled
def _close(
    u: Any, radius: Any, w: Any, at: int, rows: Any, which: Any, r_by: Any, r_by_v: Any, sampling: Any, out: Any
) -> bool:
    """Differentiate the cycle that ends with the slider w and the last slip at `at`; False where F' is nearly 1."""
    state, column = rows.state[0], rows.angle_slopes.shape[1] - 2
    rows.instant[0], state[RADIUS] = at, radius[at]
    state[FOLLOWS], state[FOLLOWS + 1], state[BY_START], state[BY_START + 1] = 1.0, 1.0, 0.0, 0.0
    for d in range(2):
        state[d] = (u[d, at] - w[d]) / radius[at] if radius[at] > 0.0 else 0.0
    # A cycle does not depend on a start: the column of the start holds the derivative of each angle by the first angle.
    rows.angle_slopes[0], rows.angle_slopes[0, column] = 0.0, 1.0
    n_slip, _, by_angle = _period(u, radius, w, at, rows, which, r_by, r_by_v, sampling, True, out)
    if n_slip == 0 or by_angle > 1.0 - MIN_CONTRACTION:
        return False
    first = rows.angle_slopes[n_slip, :column] / (1.0 - by_angle)
    for i in range(n_slip + 1):
        for c in range(column):
            rows.angle_slopes[i, c] += rows.angle_slopes[i, column] * first[c]
        rows.angle_slopes[i, column] = 0.0
    return True


@compiled
def _period(
    u: Any, radius: Any, w: Any, at: int, rows: Any, which: Any, r_by: Any, r_by_v: Any, sampling: Any, derive: bool,
    out: Any,
) -> tuple[int, int, float]:  # fmt: skip
    """Move the slider w through one period, and record it; `at` is the instant of the last slip before.

    The first instant of the first period has no predecessor: a start beyond the limit is put on the limit.

    Returns the number of slips, the instant of the last one, and the derivative of its angle by that before the period.
    """
    n = u.shape[1]
    before, r_before = (0, 0.0) if at == NONE else (n - 1, radius[n - 1])
    n_slip, by_angle = 0, 0.0 if at == NONE else 1.0
    for k in range(n):
        r = radius[k]
        e0, e1 = u[0, k] - w[0], u[1, k] - w[1]
        if r <= 0.0 or e0 * e0 + e1 * e1 > r * r:  # without a limit the slider follows any motion, also a later one
            n_slip += 1
            if r_before > 0.0 and r > 0.0:
                n0, n1, a0, a1, b0, b1, c_before, c = _slip(
                    u[0, before] - w[0], u[1, before] - w[1],
                    u[0, k] - u[0, before], u[1, k] - u[1, before], r_before, r, derive,
                )  # fmt: skip
            else:
                length = np.sqrt(e0 * e0 + e1 * e1)
                n0, n1, a0, a1 = 0.0, 0.0, 0.0, 0.0
                if length > 0.0:
                    n0, n1 = e0 / length, e1 / length
                    a0, a1 = -n1 / length, n0 / length
                b0, b1, c_before, c = a0, a1, 0.0, 0.0
            by_angle *= a1 * (u[0, at] - w[0]) - a0 * (u[1, at] - w[1])
            at = k
            w[0], w[1] = u[0, k] - r * n0, u[1, k] - r * n1
            if derive:
                _write_angle_slopes(
                    rows, n_slip, before, k, a0, a1, b0, b1, c_before, c, r_by, r_by_v, sampling.instants
                )
                rows.instant[n_slip], state = k, rows.state[n_slip]
                state[0], state[1], state[RADIUS] = n0, n1, r
                state[FOLLOWS], state[FOLLOWS + 1], state[BY_START], state[BY_START + 1] = 1.0, 1.0, 0.0, 0.0
        before, r_before = k, r
        out.slider[0, k], out.slider[1, k] = w[0], w[1]
        which[k] = n_slip
    return n_slip, at, by_angle


@compiled
def _across(state: Any, d: int) -> float:
    """Derivative of w in direction d by the angle theta of the spring: a component of -r n_perp."""
    return float(state[RADIUS] * state[1] if d == 0 else -state[RADIUS] * state[0])


@compiled
def _by_motion(d: int, rows: Any, count: int, r_by_v: Any, sampling: Any) -> Any:
    """Derivative of w in direction d, by the coefficients of the motion, in each of the first rows, shape (m, 3 nh)."""
    nh = sampling.evaluate.shape[0]
    by = np.empty((count, 3 * nh))
    for i in range(count):
        state, slopes, now = rows.state[i], rows.angle_slopes[i], sampling.instants[rows.instant[i]]
        across, follows, shrinks = _across(state, d), state[FOLLOWS + d], state[d] * r_by_v[rows.instant[i]]
        for c in range(3 * nh):
            by[i, c] = across * slopes[c]
        for c in range(nh):
            by[i, d * nh + c] += follows * now[c]
            by[i, 2 * nh + c] -= shrinks * now[c]
    return by


@compiled
def _weights(which: Any, count: int, rows: int, projected_sum: Any) -> Any:
    """Sums of the projection over the consecutive instants of each slider state, shape (rows, count)."""
    weights, k = np.zeros((rows, count)), 0
    while k < len(which):
        end = k
        while end < len(which) and which[end] == which[k]:
            end += 1
        for a in range(rows):
            weights[a, which[k]] = projected_sum[end, a] - projected_sum[k, a]
        k = end
    return weights


@compiled
def _slip(
    e0: float, e1: float, d0: float, d1: float, r_before: float, r: float, derive: bool
) -> tuple[float, float, float, float, float, float, float, float]:
    """The spring at the end of a motion d that leaves the limit, its radius going from r_before > 0 to r > 0.

    Returns its direction n and the derivatives of its angle by both components of e; if `derive`, also those by d, by
    r_before and by r. The derivative by the instant at which slip begins is zero: the spring turns at the same rate
    just before and after it.
    """
    growth = r - r_before
    # |e + s d|^2 = (r_before + s growth)^2 at the onset: a s^2 + 2 b s + c = 0.
    a = d0 * d0 + d1 * d1 - growth * growth
    b = e0 * d0 + e1 * d1 - r_before * growth
    c = min(e0 * e0 + e1 * e1 - r_before * r_before, 0.0)
    root = np.sqrt(max(b * b - a * c, 0.0))
    s = 1.0
    if b > 0.0:
        s = -c / (b + root)
    elif a > 0.0:
        s = (root - b) / a
    s = min(max(s, 0.0), 1.0)
    rest = 1.0 - s

    # Directions: m of the spring at the onset, p of the motion.
    m0, m1 = e0 + s * d0, e1 + s * d1
    size = np.sqrt(m0 * m0 + m1 * m1)
    m0, m1 = m0 / size, m1 / size
    path = np.sqrt(d0 * d0 + d1 * d1)
    p0, p1 = m0, m1
    if path > 0.0:
        p0, p1 = d0 / path, d1 / path

    # Mean of 1 / radius over the rest.
    onset = r_before + s * growth
    half, z = 2.0 / (r + onset), (r - onset) / (r + onset)
    zz = z * z
    if abs(z) < SERIES:
        mean = half * (1.0 + zz * (1 / 3 + zz * (1 / 5 + zz * (1 / 7 + zz / 9))))
    else:
        mean = np.log(r / onset) / (r - onset)

    # tan(delta / 2) = y / x, in that of its two forms that has no cancellation.
    cosine, sine = p0 * m0 + p1 * m1, p0 * m1 - p1 * m0
    x, y = (1.0 + cosine, sine) if cosine > 0.0 else (sine, 1.0 - cosine)
    kappa = path * rest * mean
    decay = np.exp(-min(kappa, MAX_EXPONENT))
    square = x * x + y * y * decay * decay
    cosine, sine = (x * x - y * y * decay * decay) / square, 2.0 * x * y * decay / square
    n0, n1 = cosine * p0 - sine * p1, cosine * p1 + sine * p0

    # d theta_1 = h d theta_0 + (1 - h) d phi - sin(delta_1) d kappa, where h = sin(delta_1) / sin(delta_0) and phi is
    # the direction of the motion.
    h = decay * (x * x + y * y) / square / size
    by_e0, by_e1 = -h * m1, h * m0
    if not derive:
        return n0, n1, by_e0, by_e1, 0.0, 0.0, 0.0, 0.0
    if abs(z) < SERIES:
        by_z = half * z * (2 / 3 + zz * (4 / 5 + zz * (6 / 7 + zz * 8 / 9)))
        mean_by_r = 0.5 * half * (half * onset * by_z - mean)
        mean_by_onset = -0.5 * half * (half * r * by_z + mean)
    else:
        mean_by_r, mean_by_onset = (1.0 / r - mean) / (r - onset), (mean - 1.0 / onset) / (r - onset)
    by_path = sine * rest * mean
    by_phi = rest * mean * (x * x - y * y * decay) / square
    by_phi *= (1.0 - decay) / kappa if kappa > 1e-4 else 1.0 - 0.5 * kappa
    by_onset = -sine * path * rest * mean_by_onset
    return (
        n0, n1, by_e0, by_e1,
        s * by_e0 - by_phi * p1 - by_path * p0, s * by_e1 + by_phi * p0 - by_path * p1,
        rest * by_onset, s * by_onset - sine * path * rest * mean_by_r,
    )  # fmt: skip


@compiled
def _write_angle_slopes(
    rows: Any, row: int, before: int, k: int, a0: float, a1: float, b0: float, b1: float, c_before: float, c: float,
    r_by: Any, r_by_v: Any, instants: Any,
) -> None:  # fmt: skip
    """Write the derivatives of the angle after a slip to instant k, from the row before.

    d theta = a . d(u_before - w) + b . d(u - u_before) + c_before dr_before + c dr.
    """
    nh = instants.shape[1]
    old, new, state, j = rows.angle_slopes[row - 1], rows.angle_slopes[row], rows.state[row - 1], rows.instant[row - 1]
    past, now, last = instants[before], instants[k], instants[j]
    by_angle = -a0 * _across(state, 0) - a1 * _across(state, 1)
    along = a0 * state[0] + a1 * state[1]
    p0, p1, l0, l1 = a0 - b0, a1 - b1, -a0 * state[FOLLOWS], -a1 * state[FOLLOWS + 1]
    v_before, v, v_last = c_before * r_by_v[before], c * r_by_v[k], along * r_by_v[j]
    for part, (by_past, by_now, by_last) in enumerate(((p0, b0, l0), (p1, b1, l1), (v_before, v, v_last))):
        own, was = new[part * nh : (part + 1) * nh], old[part * nh : (part + 1) * nh]
        for i in range(nh):
            own[i] = by_past * past[i] + by_now * now[i] + by_last * last[i] + by_angle * was[i]
    for i in range(5):
        moved = c_before * r_by[before, i] + c * r_by[k, i] + along * r_by[j, i]
        new[3 * nh + i] = moved + by_angle * old[3 * nh + i]
    new[3 * nh + 5] = by_angle * old[3 * nh + 5] - a0 * state[BY_START]
    new[3 * nh + 6] = by_angle * old[3 * nh + 6] - a1 * state[BY_START + 1]


@compiled
def step_slopes(before: Any, after: Any, velocity: Any, slider: Any, parameters: Any, out: Any) -> None:
    """See `hbsolve.joint_law.registry.CompiledLaw`; columns: u after, velocities and u before (3 each), 2 sliders."""
    kt, kn, mu, preload, gap = parameters[0], parameters[1], parameters[2], parameters[3], parameters[4]
    N_before, N = preload + kn * (before[2] - gap), preload + kn * (after[2] - gap)
    r_before, r = mu / kt * max(N_before, 0.0), mu / kt * max(N, 0.0)
    before_by_v, by_v = mu * kn / kt if N_before > 0.0 else 0.0, mu * kn / kt if N > 0.0 else 0.0
    if N > 0.0:
        out[2, 2] = kn
    e0, e1 = after[0] - slider[0], after[1] - slider[1]
    length = np.sqrt(e0 * e0 + e1 * e1)
    if length <= r + TOUCH * (r + abs(after[0]) + abs(after[1])) and r > 0.0:
        out[3, 9], out[4, 10] = 1.0, 1.0
    else:
        n0, n1 = (e0 / length, e1 / length) if length > 0.0 else (0.0, 0.0)
        a0, a1, c_before, c = (-n1 / length, n0 / length, 0.0, 0.0) if length > 0.0 else (0.0, 0.0, 0.0, 0.0)
        b0, b1 = a0, a1
        if r_before > 0.0 and r > 0.0:
            n0, n1, a0, a1, b0, b1, c_before, c = _slip(
                before[0] - slider[0], before[1] - slider[1],
                after[0] - before[0], after[1] - before[1], r_before, r, True,
            )  # fmt: skip
        # w = u - r n, and n turns as in `_write_angle_slopes`.
        for d in range(2):
            across = r * n1 if d == 0 else -r * n0
            row = out[3 + d]
            row[0], row[1], row[6], row[7] = across * b0, across * b1, across * (a0 - b0), across * (a1 - b1)
            row[9], row[10] = -across * a0, -across * a1
            row[2] = across * c * by_v - (n0 if d == 0 else n1) * by_v
            row[8] = across * c_before * before_by_v
            row[d] += 1.0
    for d in range(2):
        for column in range(11):
            out[d, column] = -kt * out[3 + d, column]
        out[d, d] += kt


FORCES.register(CompiledLaw(name="coulomb", force=force, instant=None, step_slopes=step_slopes))
