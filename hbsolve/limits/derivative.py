r"""How a steady state answers the sliders that stick: exact, by the implicit function theorem.

A sliding start w of a contact that sticks is a constant force -k_t w in g, so with L the Jacobian of g

.. math:: (I + A L)\, \frac{dx}{dw} = A\, k_t\, e_0, \qquad (I + L A)\, y = L A\, k_t\, e_0,
          \qquad \frac{dx}{dw} = A\, (k_t\, e_0 - y), \qquad \frac{dg}{dw} = y - k_t\, e_0 .

The ends of the intervals of `hbsolve.limits.sliders` move with the motion at the instants that set them, and the
derivative of all of it costs one elimination on the active rows. An adjoint solution would give the gradient alone, by
the same elimination; the search needs the intervals as well.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from hbsolve.limits.point import LimitPoint, TrialState
from hbsolve.linearised import active_rows, small_matrix

Real = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class SliderDerivative:
    """By the starts of the n free sliders; s sliders, d directions.

    Parameters
    ----------
    free
        Which sliders these are, shape (n,).
    gradient
        Of the objective, shape (n,) [its unit / m].
    motion
        Of x, shape (d, nh, n) [-].
    low, high
        Of the ends of their intervals, shape (n, n) [-].
    """

    free: Int[NDArray[np.int64], " n"]
    gradient: Float[NDArray[np.float64], " n"]
    motion: Float[NDArray[np.float64], "d nh n"]
    low: Float[NDArray[np.float64], "n n"]
    high: Float[NDArray[np.float64], "n n"]


def slider_derivative(point: LimitPoint, trial: TrialState) -> SliderDerivative:
    """Derivative of a steady state; at a kink that of one side."""
    free, table, A = trial.free, point.sliders, point.condensed.receptance
    tangent, kt = table.tangent[free], table.stiffness[free]
    first, count = point.balance.joint_of_direction
    d, nh = trial.x.shape
    moved = np.zeros((d, nh, len(free)))
    moved[:, 0] = A[0].real[:, tangent] * kt
    rows = active_rows(trial.forces.active)
    by_x, by_g = point.measure.slopes(point.balance.level, trial.x, trial.forces.coefficients)
    gradient = -kt * by_g[tangent, 0]
    if len(rows) and len(free):
        at, harmonic = rows[:, 0], rows[:, 1]
        law = trial.forces.jacobian[at, harmonic].reshape(len(rows), -1, nh)[:, :, 0]
        others = np.minimum(first[at][:, None] + np.arange(law.shape[1]), d - 1)
        right = np.einsum("me,men->mn", law, moved[others, 0])
        matrix = small_matrix(rows, trial.forces.jacobian, first, count, A, nh)
        y = np.linalg.solve(matrix, right)
        gradient = gradient + by_g[at, harmonic] @ y
        pushed = np.zeros_like(moved)
        pushed[at, harmonic] = y
        moved[:, 0] -= A[0].real @ pushed[:, 0]
        if nh > 1:
            answer = A[1:] @ np.moveaxis(pushed[:, 1::2] - 1j * pushed[:, 2::2], 1, 0)
            moved[:, 1::2] -= np.moveaxis(answer.real, 0, 1)
            moved[:, 2::2] += np.moveaxis(answer.imag, 0, 1)
    gradient = gradient + np.tensordot(by_x, moved, 2)
    ends = []
    for instants, pressed, sign in (
        (trial.cone.at_low[free], trial.cone.pressed_low[free], -1.0),
        (trial.cone.at_high[free], trial.cone.pressed_high[free], 1.0),
    ):
        basis = point.balance.sampling.instants[instants]
        slide = np.einsum("ia,iak->ik", basis, moved[tangent])
        press = np.einsum("ia,iak->ik", basis, moved[table.normal[free]])
        ends.append(slide + sign * pressed[:, None] * press)
    return SliderDerivative(free=free, gradient=gradient, motion=moved, low=ends[0], high=ends[1])
