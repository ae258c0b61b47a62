r"""One step of pseudo-arclength continuation: the metric, the oriented tangent, the corrections.

A step goes from (x, lambda) along the unit tangent t by ds and is corrected in the plane perpendicular to t,

.. math:: R(x, \lambda) = 0, \qquad \frac{t_x \cdot \Delta x}{s_x^2} + \frac{t_\lambda \Delta \lambda}{s_\lambda^2} = ds

R is piecewise smooth. Where a contact changes its state the tangent turns by any angle, and "ahead" is no longer the
direction nearest to the last one. Such a kink preserves

.. math:: \operatorname{sign} \det \begin{bmatrix} R_x & R_\lambda \\ t_x^T & t_\lambda \end{bmatrix}
          = \operatorname{sign} \det (I + L A) \cdot \operatorname{sign} t_\lambda

because the two Jacobians differ by a product with the normal n of the kink, so that both give the same determinant when
bordered by n, and the branch crosses the kink if n . t keeps its sign. (A smooth branch point changes the sign.)

References
----------
Keller, in Applications of Bifurcation Theory (1977): pseudo-arclength.
Allgower and Georg, Introduction to Numerical Continuation Methods (2003), sections 2.1 and 12: orientation, piecewise
linear branches.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from hbsolve.aft import InitialSliders
from hbsolve.continuation.continuation_parameter import Equation, Path, equation
from hbsolve.errors import BalanceError
from hbsolve.linearised import active_rows, small_matrix
from hbsolve.newton import RELATIVE, STALLED, bordered_step, imbalance
from hbsolve.solution import TOLERANCE, compute_linear_size
from reduction.array_type import Real, Whole

#: Largest number of corrections.
CORRECTIONS = 10
#: Largest distance of the corrected point over the step, and the step up to which any distance is accepted (a kink).
STRETCH, TINY = 2.0, 1e-3
#: Cosine to the last tangent above which there is no kink: the sign has then changed at a smooth branch point.
STRAIGHT_ON = 0.9999


class Direction(NamedTuple):
    """A direction in motion, shape (d, nh) [m], and lambda."""

    motion: Real
    value: float


class Metric(NamedTuple):
    """Scales s_x [m] and s_lambda: lengths of directions are relative to them."""

    motion: float
    value: float

    def dot(self, a: Direction, b: Direction) -> float:
        """Inner product of two directions."""
        return float(np.sum(a.motion * b.motion)) / self.motion**2 + a.value * b.value / self.value**2

    def length(self, a: Direction) -> float:
        """Length of a direction."""
        return float(np.sqrt(self.dot(a, a)))

    def cosine(self, a: Direction, b: Direction) -> float:
        """Cosine between two directions; 1 where one has no length."""
        lengths = self.length(a) * self.length(b)
        return self.dot(a, b) / lengths if lengths else 1.0


class Corrected(NamedTuple):
    """A point of the branch, and the direction that led there."""

    way: Direction

    motion: Real
    value: float
    iterations: int
    at: Equation


def tangent(here: Equation, last: Direction, metric: Metric, orientation: int) -> tuple[Direction, int]:
    """Tangent of length 1 in the direction of travel, and the sign of the determinant along it.

    `last` is the last tangent; `orientation` is the sign of the determinant so far, or 0 without one, so that `last`
    alone determines the direction.
    """
    t = _along_kernel(here, last, metric)
    sign = _compute_determinant_sign(here) * (1 if t.value >= 0 else -1)
    if sign == -orientation and metric.cosine(t, last) < STRAIGHT_ON:
        return Direction(-t.motion, -t.value), orientation
    return t, sign


def correct_points(
    path: Path,
    x: Real,
    value: float,
    t: Direction,
    step: float,
    metric: Metric,
    sliders: InitialSliders,
    orientation: int,
) -> Iterator[Corrected]:
    """Points at one step from (x, value): along t, then along the tangent of the smooth piece beyond a kink."""
    ahead = Direction(step * t.motion, step * t.value)
    straight_on = correct_in_plane(path, x, value, t, step, metric, sliders, ahead)
    if straight_on is not None:
        yield straight_on
    try:
        beyond = equation(path, value + ahead.value, x + ahead.motion, sliders)
    except BalanceError:
        return
    turned, _ = tangent(beyond, t, metric, orientation)
    round_kink = correct_in_plane(path, x, value, turned, step, metric, sliders, ahead)
    if round_kink is not None:
        yield round_kink


def correct_in_plane(
    path: Path,
    x: Real,
    value: float,
    t: Direction,
    step: float,
    metric: Metric,
    sliders: InitialSliders,
    ahead: Direction,
) -> Corrected | None:
    """Newton's method in the plane perpendicular to the unit tangent t, at one step from (x, value).

    It begins at the distance `ahead` from (x, value).
    """
    x_new, value_new = x + ahead.motion, value + ahead.value
    border, corner = np.ascontiguousarray(t.motion / metric.motion**2), t.value / metric.value**2
    best = np.inf
    for iteration in range(CORRECTIONS + 1):
        try:
            at = equation(path, value_new, x_new, sliders)
        except BalanceError:
            return None
        norm = float(np.linalg.norm(at.residual))
        if norm > STALLED * best:
            norm = float(imbalance(at.residual, at.condensed.columns, x_new, at.forces.coefficients))
        if norm <= TOLERANCE * compute_linear_size(at.balance.linear(at.condensed)):
            break
        if iteration == CORRECTIONS or not np.isfinite(norm) or norm > 1e3 * best:
            return None
        best = min(best, norm)
        remainder = metric.dot(t, Direction(x_new - x, value_new - value)) - step
        first, count = at.balance.joint_of_direction
        dx, dvalue = bordered_step(
            at.forces, at.condensed.columns, first, count, at.residual, at.by_value, border, corner, remainder,
            RELATIVE,
        )  # fmt: skip
        x_new, value_new = x_new + dx, value_new + float(dvalue)
    moved = metric.length(Direction(x_new - x, value_new - value))
    return None if moved > STRETCH * step and step > TINY else Corrected(t, x_new, value_new, iteration, at)


def _along_kernel(here: Equation, last: Direction, metric: Metric) -> Direction:
    """Unit tangent at an acute angle to the last one, from the system bordered by it."""
    first, count = here.balance.joint_of_direction
    t_x, t_value = bordered_step(
        here.forces, here.condensed.columns, first, count, 0 * here.residual, here.by_value,
        np.ascontiguousarray(last.motion / metric.motion**2), last.value / metric.value**2, -1.0, RELATIVE,
    )  # fmt: skip
    t = Direction(t_x, float(t_value))
    length = metric.length(t)
    if not np.isfinite(length) or length == 0.0:
        return Direction(np.zeros_like(last.motion), float(np.sign(last.value) or 1.0) * metric.value)
    return Direction(t.motion / length, t.value / length)


def _compute_determinant_sign(here: Equation) -> int:
    """Sign of det(I + L A)."""
    first, count = here.balance.joint_of_direction
    rows: Whole = active_rows(here.forces.active)
    if not len(rows):
        return 1
    nh = here.residual.shape[1]
    matrix = small_matrix(rows, here.forces.jacobian, first, count, here.condensed.columns, nh)
    return int(np.linalg.slogdet(matrix)[0])
