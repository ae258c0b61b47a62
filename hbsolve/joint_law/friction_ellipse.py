"""A contact with two tangents under one elliptic limit: the isotropic contact with a stretched second tangent.

With c u_2 in place of u_2, c = k_2 mu_1 / (k_1 mu_2), the limit is a circle of stiffness k_1 and friction mu_1, and T_2
is mu_2 / mu_1 times the second force of that contact; see `reduction.joint_law.friction_ellipse`.
"""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law import coulomb
from hbsolve.joint_law.registry import FORCES, JACOBIAN, PARAMETERS, CompiledLaw

#: Number of parameters of the isotropic contact: k_1, k_n, mu_1, N_0 and g, which come first.
ISOTROPIC = 5
#: Indices of the parameters k_1, mu_1, k_2 and mu_2.
K_1, MU_1, K_2, MU_2 = 0, 2, 5, 6


@compiled
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """Directions: two tangents, then the normal; see `hbsolve.joint_law.registry`."""
    k, mu, k_2, mu_2 = parameters[K_1], parameters[MU_1], parameters[K_2], parameters[MU_2]
    c, share, nh = k_2 * mu / (k * mu_2), mu_2 / mu, sampling.evaluate.shape[0]
    stretched, begin, D = u.copy(), start.copy(), reference.copy()
    stretched[1] *= c
    if not by_multiplier[1]:
        begin[1] *= c
    D[1] *= k / k_2
    coulomb.force(stretched, velocity, omega, D, parameters[:ISOTROPIC], begin, by_multiplier, sampling, want, out)
    if want >= PARAMETERS:
        _add_parameters(u[1], c, share, D[1], parameters, start, by_multiplier, sampling, out)
    out.force[1] *= share
    out.slider[1] /= c
    if want >= JACOBIAN:
        out.jacobian[1] *= share
        out.jacobian[:, :, nh : 2 * nh] *= c


@compiled
def _add_parameters(
    u: Any, c: float, share: float, D: float, parameters: Any, start: Any, by_multiplier: Any, sampling: Any, out: Any
) -> None:
    """Convert derivatives of the isotropic contact by its parameters and starts into those of the elliptic contact.

    The derivative of the forces with respect to c follows from the Jacobian, so that only its harmonics are correct;
    nothing else of it is used.
    """
    nh = sampling.evaluate.shape[0]
    x = np.dot(u, sampling.project)
    by_c = np.empty((2, len(u)))
    for d in range(2):
        by_c[d] = np.dot(np.dot(out.jacobian[d, :, nh : 2 * nh].copy(), x), sampling.evaluate)
        if not by_multiplier[1]:
            by_c[d] += start[1] * out.by_start[1, d]
    by_c[1] += D * u  # the linear reference stays as it is
    spring = out.force[1] + D * c * u
    for number, c_by, share_by in (
        (K_1, -c / parameters[K_1], 0.0),
        (MU_1, c / parameters[MU_1], -share / parameters[MU_1]),
        (K_2, c / parameters[K_2], 0.0),
        (MU_2, -c / parameters[MU_2], share / parameters[MU_2]),
    ):
        for d in range(2):
            out.by_parameter[number, d] += c_by * by_c[d]
        # All derivatives of the second force are multiplied by `share` below.
        out.by_parameter[number, 1] += share_by / share * spring
    for number in range(len(parameters)):
        out.by_parameter[number, 1] *= share
    for number in range(2):
        out.by_start[number, 1] *= share
    if not by_multiplier[1]:
        out.by_start[1] *= c


@compiled
def step_slopes(before: Any, after: Any, velocity: Any, slider: Any, parameters: Any, out: Any) -> None:
    """See `hbsolve.joint_law.registry.CompiledLaw`."""
    share = parameters[MU_2] / parameters[MU_1]
    c = parameters[K_2] / (parameters[K_1] * share)
    first, last, w = before.copy(), after.copy(), slider.copy()
    first[1] *= c
    last[1] *= c
    w[1] *= c
    coulomb.step_slopes(first, last, velocity, w, parameters[:ISOTROPIC], out)
    # Second tangent after and before the step, and the second slider.
    for column in (1, 7, 10):
        out[:, column] *= c
    out[1] *= share
    out[4] /= c


FORCES.register(CompiledLaw(name="friction_ellipse", force=force, instant=None, step_slopes=step_slopes))
