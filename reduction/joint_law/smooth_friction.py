"""Coulomb friction with a smooth step, as used in programs without sliders."""

from collections.abc import Mapping
from dataclasses import dataclass

from reduction.joint_law.registry import LAWS, DirectedJoint, LawParameter, Samples


@LAWS.register
@dataclass(frozen=True, kw_only=True, eq=False)
class SmoothFriction(DirectedJoint):
    """f = limit_force tanh(du/dt / velocity).

    It creeps under any force and never sticks: use it to compare with programs that have no other friction.

    Parameters
    ----------
    name
        Name in messages and results.
    direction
        Row of u, shape (r,) [-].
    limit_force
        Limit force, not negative [N].
    velocity
        Velocity at which the force is 76 % of its limit [m/s].

    Raises
    ------
    JointError
        A negative limit, a velocity that is not positive, or a number that is not finite.
    """

    kind = "smooth_friction"
    parameters = (
        LawParameter(name="limit_force", unit="N", meaning="force at high velocity", typical=1.0, lower=0.0),
        LawParameter(name="velocity", unit="m/s", meaning="at 76 % of the limit", typical=0.02, positive=True),
    )
    typical_displacement = 1e-4
    n_slider = 0
    stuck_stiffness = (0.0,)
    nlvib = ("tanhDryFriction", {"friction_limit_force": "limit_force", "eps": "velocity"})

    limit_force: float
    velocity: float

    def spring_energy(
        self, parameters: Mapping[str, float], displacement: Samples, force: Samples, slider: Samples
    ) -> None:
        """Zero: this law stores no energy."""
