r"""Forces of joints over one step, along the straight path between two positions.

Each law gives the force at the end of the step and its *mean over the path*. Along a straight path
u(s) = u_a + s (u_b - u_a) the touch-down, the lift-off and the onset of slip are found exactly, and so is the mean
force of every law but the coupled one; a kink inside a step then costs no more than the curvature of the path does.
The work of a mean force is the work of the law itself, so springs and stops neither create nor lose energy.

*One tangent.* Stick and the cone |T| <= mu N are both linear in s, and the cone is convex: a path that ends inside
has not left it, one that ends outside has left it once, at s*, and slides from there on.

*Two tangents coupled.* After the onset of slip T = L n(theta) with L = mu N(s), and the angle between the sliding and
the friction force obeys

.. math:: \frac{d\delta}{ds} = -\frac{k_t |\Delta u|}{L(s)} \sin\delta, \qquad
          \tan\frac{\delta_b}{2} = \tan\frac{\delta_c}{2}\, \exp\Bigl(-\int k_t |\Delta u| / L\, ds\Bigr)

which is exact as well; an implicit (radial) return would be of first order in the step here.

References
----------
Krieg and Krieg, Accuracies of numerical solution methods for the elastic-perfectly plastic model, Journal of Pressure
Vessel Technology 99 (1977), for the angle.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.compiled import compiled
from transient.joint_table import (
    CONTACT,
    COULOMB_CONTACT,
    CUBIC,
    DAMPER,
    FRICTION,
    GAP,
    JENKINS,
    NORMAL,
    PRELOAD,
    STOP,
    STRENGTH,
    TANGENTIAL,
    Packed,
)

Vector = Float[NDArray[np.float64], " n"]


@compiled
def slide(start: float, increment: float, limit_start: float, limit_end: float) -> tuple[float, float]:
    """Friction force of one tangent: (end, mean over the path) [N] of a force that grows by `increment` in stick."""
    trial = start + increment
    if abs(trial) <= limit_end:
        return trial, 0.5 * (start + trial)
    sign = 1.0 if trial > 0.0 else -1.0
    onset = (limit_start - sign * start) / (sign * increment - (limit_end - limit_start))
    onset = min(max(onset, 0.0), 1.0)
    at_onset = sign * (limit_start + onset * (limit_end - limit_start))
    end = sign * limit_end
    return end, 0.5 * (start + at_onset) * onset + 0.5 * (at_onset + end) * (1.0 - onset)


@compiled
def slide_coupled(
    x: float, y: float, dx: float, dy: float, limit_start: float, limit_end: float
) -> tuple[float, float, float, float]:
    """Friction force of two tangents with one limit: (end x, end y, mean x, mean y) [N]."""
    ex, ey = x + dx, y + dy
    if ex * ex + ey * ey <= limit_end * limit_end:
        return ex, ey, 0.5 * (x + ex), 0.5 * (y + ey)
    growth = limit_end - limit_start
    # |T + s dT| = L + s dL is a s^2 + 2 b s + c = 0, with c <= 0 at the start and a positive value at s = 1.
    a = dx * dx + dy * dy - growth * growth
    b = x * dx + y * dy - limit_start * growth
    c = min(x * x + y * y - limit_start * limit_start, 0.0)
    root = np.sqrt(max(b * b - a * c, 0.0))
    onset = -c / (b + root) if b > 0.0 else ((root - b) / a if a != 0.0 else 1.0)
    onset = min(max(onset, 0.0), 1.0)
    cx, cy = x + onset * dx, y + onset * dy
    limit = limit_start + onset * growth
    length = np.sqrt(dx * dx + dy * dy)
    ox, oy = cx, cy
    size = np.sqrt(cx * cx + cy * cy)
    if length > 0.0:
        ux, uy = dx / length, dy / length
        if size > 0.0 and limit > 0.0 and limit_end > 0.0:
            ratio = limit_end / limit
            mean_inverse = (
                np.log(ratio) / (ratio - 1.0) if abs(ratio - 1.0) > 1e-6 else 1.0 - 0.5 * (ratio - 1.0)
            ) / limit
            cosine, sine = (cx * ux + cy * uy) / size, (ux * cy - uy * cx) / size
            half = sine / max(1.0 + cosine, 1e-300) * np.exp(-length * (1.0 - onset) * mean_inverse)
            cosine, sine = (1.0 - half * half) / (1.0 + half * half), 2.0 * half / (1.0 + half * half)
            ox, oy = cosine * ux - sine * uy, cosine * uy + sine * ux
        else:
            ox, oy = ux, uy
    elif size > 0.0:
        ox, oy = cx / size, cy / size
    ex, ey = limit_end * ox, limit_end * oy
    rest = 1.0 - onset
    return (
        ex,
        ey,
        0.5 * (x + cx) * onset + 0.5 * (cx + ex) * rest,
        0.5 * (y + cy) * onset + 0.5 * (cy + ey) * rest,
    )


@compiled
def closed_part(start: float, end: float) -> tuple[float, float]:
    """Part (first, last) of the path over which a quantity that varies linearly from start to end is positive."""
    if start <= 0.0 and end <= 0.0:
        return 1.0, 1.0
    if start < 0.0:
        return start / (start - end), 1.0
    if end < 0.0:
        return 0.0, start / (start - end)
    return 0.0, 1.0


@compiled
def joint_force(
    joint: int,
    joints: Packed,
    before: Vector,
    after: Vector,
    slider: Vector,
    step: float,
    mean: Vector,
    end: Vector,
    moved: Vector,
) -> None:
    """Write mean and end force [N] of one joint's directions and the moved sliders [m] into the last three arguments.

    before, after: positions of all directions at both ends of the step, shape (d,) [m]; slider: all sliders before it,
    shape (s,) [m]; step: its length [s].
    """
    kind, i, j = joints[0][joint], joints[1][joint], joints[2][joint]
    n_tangent = joints[3][joint]
    value = joints[4][joint]
    if kind in (CONTACT, COULOMB_CONTACT):
        k = i + n_tangent
        stiffness, friction = value[TANGENTIAL], value[FRICTION]
        normal_start = value[PRELOAD] + value[NORMAL] * (before[k] - value[GAP])
        normal_end = value[PRELOAD] + value[NORMAL] * (after[k] - value[GAP])
        first, last = closed_part(normal_start, normal_end)
        closed = last - first
        normal_start, normal_end = max(normal_start, 0.0), max(normal_end, 0.0)
        mean[k] = 0.5 * (normal_start + normal_end) * closed
        end[k] = normal_end
        # A contact that closes within the step starts without friction force, where it touches down.
        held = 1.0 if first == 0.0 and closed > 0.0 else 0.0
        if kind == COULOMB_CONTACT:
            end[i], end[i + 1], mean[i], mean[i + 1] = slide_coupled(
                held * stiffness * (before[i] - slider[j]),
                held * stiffness * (before[i + 1] - slider[j + 1]),
                stiffness * (after[i] - before[i]) * closed,
                stiffness * (after[i + 1] - before[i + 1]) * closed,
                friction * normal_start,
                friction * normal_end,
            )
        else:
            for n in range(n_tangent):
                end[i + n], mean[i + n] = slide(
                    held * stiffness * (before[i + n] - slider[j + n]),
                    stiffness * (after[i + n] - before[i + n]) * closed,
                    friction * normal_start,
                    friction * normal_end,
                )
        for n in range(n_tangent):
            mean[i + n] *= closed
            moved[j + n] = after[i + n] - end[i + n] / stiffness
    elif kind == JENKINS:
        stiffness, limit = value[TANGENTIAL], value[STRENGTH]
        end[i], mean[i] = slide(stiffness * (before[i] - slider[j]), stiffness * (after[i] - before[i]), limit, limit)
        moved[j] = after[i] - end[i] / stiffness
    elif kind == CUBIC:
        a, b = before[i], after[i]
        end[i] = value[STRENGTH] * b * b * b
        mean[i] = 0.25 * value[STRENGTH] * (a + b) * (a * a + b * b)
    elif kind == STOP:
        a, b = value[NORMAL] * (before[i] - value[GAP]), value[NORMAL] * (after[i] - value[GAP])
        first, last = closed_part(a, b)
        end[i] = max(b, 0.0)
        mean[i] = 0.5 * (max(a, 0.0) + end[i]) * (last - first)
    elif kind == DAMPER:
        speed = (after[i] - before[i]) / step
        mean[i] = value[STRENGTH] * abs(speed) * speed
        end[i] = mean[i]


@compiled
def joint_forces(
    joints: Packed, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:
    """`joint_force` of all joints."""
    for joint in range(joints[0].size):
        joint_force(joint, joints, before, after, slider, step, mean, end, moved)
