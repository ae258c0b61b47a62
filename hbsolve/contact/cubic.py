"""A cubic spring."""

from typing import Any

from fe.compiled import compiled
from hbsolve.contact.law import JACOBIAN, PARAMETERS
from hbsolve.contact.pointwise import displacement_jacobian

#: In the order of `parameters`; fields of `reduction.jointed_system.CubicSpring`.
NAMES = ("stiffness",)


@compiled
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """One direction; see `hbsolve.contact.law`."""
    out.force[0] = parameters[0] * u[0] ** 3 - reference[0] * u[0]
    if want >= JACOBIAN:
        displacement_jacobian(3.0 * parameters[0] * u[0] ** 2 - reference[0], sampling, out)
    if want >= PARAMETERS:
        out.by_parameter[0, 0] = u[0] ** 3
