"""Interface between the harmonic balance and the law of a joint.

A law is one file that registers one compiled function `force` of this signature::

    force(u, velocity, omega, reference, parameters, start, by_multiplier, sampling, want, out)

u, velocity
    Displacement [m] and velocity [m/s] of the joint's directions at the n instants of a period, shape (d, n); no
    velocity, shape (d, 0), where no joint of the system has a law that uses it.
omega
    Omega [rad/s].
reference
    Stiffness of each direction that is part of the linear structure, D in eq. 12, shape (d,) [N/m]. The law writes
    f - D u and its derivatives: for a stuck or closed contact f - D u is constant and costs nothing.

Parameters
----------
    Values of `Joint.parameters`, in their order, shape (n_parameter,).
start, by_multiplier
    Slider positions at the first instant [m], or multipliers m of eq. 11 where the flag is set, shape (n_slider,).
sampling
    `hbsolve.sampling.Sampling`.
want
    FORCE, JACOBIAN or PARAMETERS: each includes the one before.
out
    A `LawOutput` to fill; all of its arrays arrive as zeros.

The velocity is Omega times the derivative in Omega t, so a law that depends on it also gives its derivative with
respect to Omega.

References
----------
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), eqs 6-8, 11 and 12.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, cast

import numpy as np

from geometry.registry import Registry
from reduction.array_type import Real, Whole

# NumPy integers: numba compiles a law once for their type, not once for each of the three values.
FORCE, JACOBIAN, PARAMETERS = cast("tuple[int, int, int]", tuple(np.arange(3)))
#: Largest number of directions of a joint.
MAX_DIRECTION = 3
#: Slip, relative to the limit and the displacement, that counts as round-off: a slider that sticks after slip is on its
#: limit to the last digits.
TOUCH = 1e-10
#: State of a contact at an instant.
STICK, SLIP, SEPARATED = 0, 1, 2


class LawOutput(NamedTuple):
    """Output of a law; nh = 2 H + 1, n instants."""

    force: Real
    """f - D u at each instant, shape (d, n) [N]."""
    jacobian: Real
    """Jacobian of the coefficients of `force` with respect to those of u, shape (d, nh, 3 nh) [N/m]."""
    active: Whole
    """Leading rows of each direction's Jacobian that are not zero: 0, 1 (the mean alone) or nh, shape (d,)."""
    by_parameter: Real
    """Derivative of `force` with respect to each parameter, shape (p, d, n)."""
    by_start: Real
    """Derivative of `force` with respect to each slider's position (or multiplier) at the start, shape (s, d, n)."""
    by_frequency: Real
    """Derivative of `force` with respect to Omega, shape (d, n)."""
    slider: Real
    """Slider positions at each instant, shape (s, n) [m]."""
    status: Whole
    """STICK, SLIP or SEPARATED at each instant of each tangent; row 0 of a joint with one direction, shape (2, n)."""
    unsettled: Whole
    """1 if the state of the joint does not repeat every period, so that the force is not periodic, shape (1,)."""


@dataclass(frozen=True, kw_only=True)
class CompiledLaw:
    """A law of the balance."""

    name: str
    """Name of the law, as in `Joint.force_law`."""
    force: Callable[..., Any]
    """Compiled function of the signature above."""
    instant: Callable[..., Any] | None
    """Compiled force of a law without memory at one instant, ``instant(u, velocity, parameters, slope)``, which fills
    `slope` with the derivatives by u, velocity and each parameter; none for laws with memory."""
    step_slopes: Callable[..., Any] | None = None
    """Derivatives of a law with memory for a step from one instant to the next,
    ``step_slopes(before, after, velocity, slider, parameters, out)``, with displacements at both instants, shape (d,),
    velocities at the second, and sliders before. It fills `out`, shape (d + s, 3 d + s), which arrives as zeros. Rows:
    the forces and sliders after the step. Columns: the displacements after, the velocities, the displacements before,
    and the sliders before. None for laws without memory."""
    uses_velocity: bool = False
    """Whether `force` reads the velocity."""


def _lacking_slopes(law: CompiledLaw) -> str | None:
    if (law.instant is None) == (law.step_slopes is None):
        return (
            "has both instant and step_slopes, or neither: a law without memory has the first, one with it the second"
        )
    return None


#: Forces of the laws of this program; a user's law has a function instead, `reduction.joint_law.function_law`.
FORCES: Registry[CompiledLaw] = Registry(
    "contact force",
    package="hbsolve.joint_law",
    group=None,
    facts={"force": "over a period", "instant": "at an instant"},
    check=_lacking_slopes,
)
