r"""LuGre friction of Canudas de Wit and others: bristles that bend, and a limit that decreases with velocity.

.. math:: f = \sigma_0 z + \sigma_1 \dot z + \sigma_2 \dot u, \qquad
          \dot z = \dot u - \frac{\sigma_0 |\dot u|}{g(\dot u)} z, \qquad
          g(v) = F_c + (F_s - F_c)\, e^{-(v / v_s)^2}

References
----------
Canudas de Wit, Olsson, Astrom and Lischinsky, A new model for control of systems with friction, IEEE Trans. Autom.
Control 40 (1995), 419-425.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from reduction.array_type import Row
from reduction.errors import JointError
from reduction.joint_law.parallel_sliders import compute_vibration_energy
from reduction.joint_law.registry import LAWS, DirectedJoint, LawParameter, Samples


@LAWS.register
@dataclass(frozen=True, kw_only=True, eq=False)
class LuGreFriction(DirectedJoint):
    """Friction along one row that depends on displacement and velocity.

    Its state is u - z, the position of the bristles, and g / sigma_0, the deflection z at which they slip [m].

    Parameters
    ----------
    name
        Name in messages and results.
    direction
        Row of u, shape (r,) [-].
    tangential_stiffness
        Stiffness sigma_0 of the bristles [N/m].
    limit_force
        Limit force F_c at high velocity [N].
    static_force
        Limit force F_s at rest, at least F_c [N].
    velocity
        Velocity v_s over which the limit decreases [m/s].
    bristle_damping
        Damping sigma_1 of the bristles [N s/m]; 0 by default.
    damping
        Viscous damping sigma_2 [N s/m]; 0 by default.

    Raises
    ------
    JointError
        A number that is not positive, a negative damping, a static force below the limit force, or a number that is not
        finite.
    """

    kind = "lugre"
    parameters = (
        LawParameter(name="tangential_stiffness", unit="N/m", meaning="sigma_0", typical=1e6, positive=True),
        LawParameter(name="limit_force", unit="N", meaning="F_c, at high velocity", typical=8.0, positive=True),
        LawParameter(name="static_force", unit="N", meaning="F_s, at rest", typical=10.0, positive=True),
        LawParameter(name="velocity", unit="m/s", meaning="v_s, of the fall", typical=5e-3, positive=True),
        LawParameter(name="bristle_damping", unit="N s/m", meaning="sigma_1", typical=100.0, lower=0.0, default=0.0),
        LawParameter(name="damping", unit="N s/m", meaning="sigma_2", typical=50.0, lower=0.0, default=0.0),
    )
    typical_displacement = 3e-5
    n_slider = 2

    tangential_stiffness: float
    limit_force: float
    static_force: float
    velocity: float
    bristle_damping: float = 0.0
    damping: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.static_force < self.limit_force:
            raise JointError(
                f'joint "{self.name}": static_force = {self.static_force:g} must be at least limit_force = '
                f"{self.limit_force:g}"
            )

    @property
    def stuck_stiffness(self) -> tuple[float, ...]:
        """Stiffness sigma_0 [N/m]."""
        return (self.tangential_stiffness,)

    @property
    def slider_intervals(self) -> str:
        """Reason why there is no interval: the joint creeps under any force."""
        return "creeps under any force and has no interval of stick: remove it, or use jenkins"

    def spring_energy(
        self, parameters: Mapping[str, float], displacement: Samples, force: Samples, slider: Samples
    ) -> Row:
        """Energy of the bristles about their mean deflection."""
        return compute_vibration_energy(np.array([parameters["tangential_stiffness"]]), displacement[0], slider[:1])
