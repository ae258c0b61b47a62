r"""Friction forces and closed parts of a straight path within a step.

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

from fe.compiled import compiled

#: The angle turns by no more than exp(-this): the square of that must not vanish.
MAX_EXPONENT = 300.0


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
            # The form of tan(delta / 2) without cancellation: a force may oppose the sliding exactly.
            near, far = (1.0 + cosine, sine) if cosine > 0.0 else (sine, 1.0 - cosine)
            far *= np.exp(-min(length * (1.0 - onset) * mean_inverse, MAX_EXPONENT))
            square = near * near + far * far
            cosine, sine = (near * near - far * far) / square, 2.0 * near * far / square
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
