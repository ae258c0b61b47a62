r"""Exact motion of the linear structure from one instant to the next, joint forces varying linearly between them.

.. math:: \ddot \eta + C_m \dot \eta + \Lambda \eta = -\Phi^T B^T g(t), \qquad g = f - D u

in the mass-normalised modes Phi of the structure with the stiffness D of the balance's linear reference, so that
contacts that stick and stay closed are exact, however stiff. The exponential of the structure together with a constant
and a ramp of the force (Van Loan) gives all increments.

References
----------
Van Loan, Computing integrals involving the matrix exponential, IEEE Transactions on Automatic Control 23 (1978).
"""

from typing import NamedTuple

import numpy as np
import scipy.linalg

from hbsolve.linear_modes import LinearModes
from reduction.array_type import Matrix


class LinearStep(NamedTuple):
    """One step; the state is modal displacements, then modal velocities."""

    is_diagonal: bool
    """Whether the modes uncouple."""
    matrix: Matrix
    """Transition: rows a_qq, a_qv, a_vq, a_vv, shape (4, r), if the modes uncouple, else shape (2 r, 2 r)."""
    by_force_before: Matrix
    by_force_after: Matrix
    """State added by unit joint forces g at the first, and at the second instant, shape (2 r, d)."""


def linear_step(modes: LinearModes, step: float) -> LinearStep:
    """The step of the length `step` [s]."""
    r = len(modes.eigenvalue)
    # Balanced variables (scale q, v) keep the exponential of a stiff mode a rotation.
    scale = np.maximum(np.sqrt(np.abs(modes.eigenvalue)), 1 / step)
    if modes.is_diagonal:
        generator = np.zeros((r, 4, 4))
        generator[:, 0, 1] = scale * step
        generator[:, 1, 0] = -modes.eigenvalue * step / scale
        generator[:, 1, 1] = -np.diag(modes.damping) * step
        generator[:, 1, 2] = generator[:, 2, 3] = 1.0
        exact = scipy.linalg.expm(generator)
        matrix = np.array([exact[:, 0, 0], exact[:, 0, 1] / scale, exact[:, 1, 0] * scale, exact[:, 1, 1]])
        constant, ramp = (np.concatenate([exact[:, 0, i] / scale, exact[:, 1, i]])[:, None] * step for i in (2, 3))
        columns = np.vstack([modes.rows.T, modes.rows.T])
        return LinearStep(
            True,
            np.ascontiguousarray(matrix),
            np.ascontiguousarray((ramp - constant) * columns),
            np.ascontiguousarray(-ramp * columns),
        )
    d = len(modes.rows)
    size = max(float(np.abs(modes.rows).max(initial=0.0)), np.finfo(float).tiny)
    generator = np.zeros((2 * r + 2 * d, 2 * r + 2 * d))
    generator[:r, r : 2 * r] = np.diag(scale * step)
    generator[r : 2 * r, :r] = np.diag(-modes.eigenvalue * step / scale)
    generator[r : 2 * r, r : 2 * r] = -modes.damping * step
    generator[r : 2 * r, 2 * r : 2 * r + d] = modes.rows.T / size
    generator[2 * r : 2 * r + d, 2 * r + d :] = np.eye(d)
    exact = scipy.linalg.expm(generator)[: 2 * r]
    unscale, rescale = np.concatenate([1 / scale, np.ones(r)]), np.concatenate([scale, np.ones(r)])
    constant, ramp = (unscale[:, None] * exact[:, 2 * r + i * d : 2 * r + (i + 1) * d] * (size * step) for i in (0, 1))
    return LinearStep(
        False,
        np.ascontiguousarray(unscale[:, None] * exact[:, : 2 * r] * rescale),
        np.ascontiguousarray(ramp - constant),
        np.ascontiguousarray(-ramp),
    )
