"""Linear dashpot along one row."""

from collections.abc import Mapping
from dataclasses import dataclass

from reduction.joint_law.registry import LAWS, DirectedJoint, LawParameter, Samples


@LAWS.register
@dataclass(frozen=True, kw_only=True, eq=False)
class ViscousDamper(DirectedJoint):
    """f = damping du/dt.

    Parameters
    ----------
    name
        Name in messages and results.
    direction
        Row of u, shape (r,) [-].
    damping
        Damping coefficient, not negative [N s/m].

    Raises
    ------
    JointError
        A negative damping, or a number that is not finite.
    """

    kind = "viscous_damper"
    parameters = (LawParameter(name="damping", unit="N s/m", meaning="f / v", typical=10.0, lower=0.0),)
    typical_displacement = 1e-4
    n_slider = 0
    stuck_stiffness = (0.0,)

    damping: float

    def spring_energy(
        self, parameters: Mapping[str, float], displacement: Samples, force: Samples, slider: Samples
    ) -> None:
        """Zero: this law stores no energy."""
