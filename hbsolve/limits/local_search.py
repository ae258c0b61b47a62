r"""A local search over the sliders within Coulomb's bounds: sequential linear programming in a trust region.

At a steady state the objective and the intervals of the undetermined sliders are linear in a change d of their starts,
to first order. The step solves

.. math:: \max \pm \nabla J \cdot d, \qquad w_\mathrm{low} + w_\mathrm{low}' d \le w + d \le w_\mathrm{high} +
          w_\mathrm{high}' d, \qquad |w + d - w_\mathrm{nominal}| \le w_\mathrm{max}, \qquad |d| \le \Delta\, r

with r the lengths of the intervals; then the steady state of the new sliders is computed, and an improving step is
accepted. Limits lie at kinks, where contacts begin to slip or lift off: a vertex of the programme follows the bounds
along them, while a gradient step would end at each.

The derivatives are exact, by the implicit function theorem: the start w of a slider that sticks gives the constant
force -k_t w in g, so that with L the Jacobian of g

.. math:: (I + A L)\, \frac{dx}{dw} = A\, k_t\, e_0, \qquad (I + L A)\, y = L A\, k_t\, e_0,
          \qquad \frac{dx}{dw} = A\, (k_t\, e_0 - y), \qquad \frac{dg}{dw} = y - k_t\, e_0 .

The ends of the intervals of `hbsolve.limits.sliders` move with the motion at the instants that determine them; all
derivatives cost one elimination on the active rows. An adjoint solution would give the gradient only, at the same cost;
the search needs the intervals as well.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from jaxtyping import Float, Int

from hbsolve.limits.linear_program import best_step
from hbsolve.limits.point import STRICT_RATIO, LimitPoint, TrialState
from hbsolve.linearised import active_rows, small_matrix
from reduction.array_type import Real, Whole

#: First, largest and least radius of the trust region, in lengths of the intervals.
RADIUS, LARGEST, SMALLEST = 0.5, 1.0, 1e-3
#: Realised over predicted gain: least for a step to be accepted; the region shrinks below the second, grows above the
#: third.
ACCEPT, POOR, GOOD = 0.1, 0.3, 0.7
REJECTED, SHRINK, GROW = 0.4, 0.5, 2.0
#: The search ends after two steps with less than this relative gain, or if less than a tenth of it is predicted.
GAIN = 1e-4
MAX_STEP = 20
#: Least scale of an interval, relative to the mean length, so that a narrow interval does not freeze the others.
NARROW = 0.05


class LimitSide(IntEnum):
    """Side of a limit, the sign of its objective."""

    LOWER = -1
    UPPER = 1


@dataclass(frozen=True, kw_only=True, eq=False)
class SliderDerivative:
    """Derivatives with respect to the starts of the n undetermined sliders; s sliders, d directions."""

    undetermined: Int[Whole, " n"]
    """Numbers of these sliders, shape (n,)."""
    gradient: Float[Real, " n"]
    """Derivative of the objective, shape (n,) [its unit / m]."""
    motion: Float[Real, "d nh n"]
    """Derivative of the motion, shape (d, nh, n) [-]."""
    low: Float[Real, "n n"]
    high: Float[Real, "n n"]
    """Derivatives of the ends of the intervals, shape (n, n) [-]."""


def compute_slider_derivative(point: LimitPoint, trial: TrialState) -> SliderDerivative:
    """Derivative of a steady state; one-sided at a kink."""
    own, table, A = trial.undetermined, point.sliders, point.condensed.receptance
    tangent, kt = table.tangent[own], table.stiffness[own]
    first, count = point.balance.joint_of_direction
    d, nh = trial.motion.shape
    moved = np.zeros((d, nh, len(own)))
    moved[:, 0] = A[0].real[:, tangent] * kt
    rows = active_rows(trial.forces.active)
    by_x, by_g = point.measure.slopes(point.balance.level, trial.motion, trial.forces.coefficients)
    gradient = -kt * by_g[tangent, 0]
    if len(rows) and len(own):
        at, harmonic = rows[:, 0], rows[:, 1]
        law = trial.forces.jacobian[at, harmonic].reshape(len(rows), -1, nh)[:, :, 0]
        others = np.minimum(first[at][:, None] + np.arange(law.shape[1]), d - 1)
        right = np.einsum("me,men->mn", law, moved[others, 0])
        matrix = small_matrix(rows, trial.forces.jacobian, first, count, point.condensed.columns, nh)
        y = np.linalg.solve(matrix, right)
        gradient = gradient + by_g[at, harmonic] @ y
        force_change = np.zeros_like(moved)
        force_change[at, harmonic] = y
        moved[:, 0] -= A[0].real @ force_change[:, 0]
        if nh > 1:
            answer = A[1:] @ np.moveaxis(force_change[:, 1::2] - 1j * force_change[:, 2::2], 1, 0)
            moved[:, 1::2] -= np.moveaxis(answer.real, 0, 1)
            moved[:, 2::2] += np.moveaxis(answer.imag, 0, 1)
    gradient = gradient + np.tensordot(by_x, moved, 2)
    ends = []
    for instants, pressed, sign in (
        (trial.intervals.at_low[own], trial.intervals.limit_slope_low[own], -1.0),
        (trial.intervals.at_high[own], trial.intervals.limit_slope_high[own], 1.0),
    ):
        basis = point.balance.sampling.instants[instants]
        slide = np.einsum("ia,iak->ik", basis, moved[tangent])
        press = np.einsum("ia,iak->ik", basis, moved[table.normal[own]])
        ends.append(slide + sign * pressed[:, None] * press)
    return SliderDerivative(undetermined=own, gradient=gradient, motion=moved, low=ends[0], high=ends[1])


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearProgramme:
    """The linear programme at one steady state."""

    derivative: SliderDerivative
    """Derivatives at the state."""
    length: Real
    """Lengths of the intervals, shape (n,) [m]."""
    cost: Real
    """Gain by a move of each slider by the length of its interval, shape (n,)."""
    rows: Real
    bound: Real
    """Constraints by both ends of the intervals, shapes (2 n, n) and (2 n,)."""
    down: Real
    up: Real
    """Largest move of each slider in the box, in lengths of its interval, shape (n,)."""

    def step(self, radius: float) -> tuple[Float[Real, " n"], float]:
        """The best move of the undetermined sliders [m] and its predicted gain."""
        largest = np.abs(self.cost).max(initial=0.0)
        if not largest > 0:
            return np.zeros_like(self.cost), 0.0
        share = best_step(
            self.cost / largest, self.rows, self.bound, np.minimum(self.down, radius), np.minimum(self.up, radius)
        )
        return share * self.length, float(self.cost @ share)


def linear_step(point: LimitPoint, trial: TrialState, side: LimitSide) -> LinearProgramme:
    """The linear programme at a steady state."""
    derivative = compute_slider_derivative(point, trial)
    own, n = derivative.undetermined, len(derivative.undetermined)
    low, high, w = trial.intervals.low[own], trial.intervals.high[own], trial.initial_slider[own]
    length = high - low
    length = np.maximum(length, NARROW * length.mean()) if n else length
    rows = np.vstack([derivative.low - np.eye(n), np.eye(n) - derivative.high]) * length
    bound = np.maximum(np.concatenate([w - low, high - w]), 0.0)
    size = np.abs(rows).max(axis=1, initial=np.finfo(float).tiny)
    moved, reach = w - point.box.nominal[own], point.box.reach[own]
    return LinearProgramme(
        derivative=derivative,
        length=length,
        cost=side * derivative.gradient * length,
        rows=rows / size[:, None],
        bound=bound / size,
        down=np.maximum(reach + moved, 0.0) / length,
        up=np.maximum(reach - moved, 0.0) / length,
    )


def take_step(
    point: LimitPoint, trial: TrialState, linear: LinearProgramme, step: Float[Real, " n"]
) -> TrialState | None:
    """The steady state after a step, from the predicted motion, else from the previous motion; None if both fail."""
    w = trial.initial_slider.copy()
    w[linear.derivative.undetermined] += step
    stepped = point.settle(trial.motion + linear.derivative.motion @ step, w)
    return stepped or point.settle(trial.motion, w, STRICT_RATIO)


def local_search(point: LimitPoint, trial: TrialState, side: LimitSide, max_step: int = MAX_STEP) -> TrialState:
    """The best state reached by steps from a settled state."""
    radius, small = RADIUS, 0
    for _ in range(max_step):
        size = max(abs(trial.value), point.measure.least)
        linear, better = linear_step(point, trial, side), None
        while radius >= SMALLEST:
            step, predicted = linear.step(radius)
            if predicted < 0.1 * GAIN * size:
                break
            better = take_step(point, trial, linear, step)
            if better is not None and side * (better.value - trial.value) > ACCEPT * predicted:
                break
            better, radius = None, REJECTED * radius
        if better is None:
            break
        realised = side * (better.value - trial.value)
        trial = better
        small = small + 1 if realised < GAIN * size else 0
        if small == 2:
            break
        if realised > GOOD * predicted:
            radius = min(GROW * radius, LARGEST)
        elif realised < POOR * predicted:
            radius *= SHRINK
    return trial
