"""A damper whose force is a polynomial of the velocity, of odd powers."""

from reduction.joint_law.function_law import joint_law
from reduction.joint_law.registry import LawParameter


@joint_law(
    kind="polynomial damper",
    parameters=[
        LawParameter(name="cubic", unit="N s^3/m^3", meaning="f / v^3", typical=-0.6),
        LawParameter(name="quintic", unit="N s^5/m^5", meaning="f / v^5", typical=1.2),
    ],
    typical_displacement=1e-3,
    n_state=0,
    stuck_stiffness=lambda cubic, quintic: 0.0,  # noqa: ARG005  # all parameters are passed
    energy=None,
)
def polynomial_damper(u, velocity, state, parameters):
    """f = cubic v^3 + quintic v^5."""
    cubic, quintic = parameters
    return cubic * velocity**3 + quintic * velocity**5
