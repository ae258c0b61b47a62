"""Drag of the surrounding air."""

from collections.abc import Mapping
from dataclasses import dataclass

from reduction.errors import ExchangeError
from reduction.joint_law.registry import LAWS, DirectedJoint, Joint, LawParameter, Samples


@LAWS.register
@dataclass(frozen=True, kw_only=True, eq=False)
class QuadraticDamper(DirectedJoint):
    """f = damping |du/dt| du/dt: drag of the surrounding air.

    Parameters
    ----------
    name
        Name in messages and results.
    direction
        Row of u, shape (r,) [-].
    damping
        Damping coefficient, not negative [N s^2/m^2].

    Raises
    ------
    JointError
        A negative damping, or a number that is not finite.
    """

    kind = "quadratic_damper"
    parameters = (LawParameter(name="damping", unit="N s^2/m^2", meaning="f / (abs(v) v)", typical=100.0, lower=0.0),)
    typical_displacement = 1e-4
    n_slider = 0
    stuck_stiffness = (0.0,)

    damping: float

    def spring_energy(
        self, parameters: Mapping[str, float], displacement: Samples, force: Samples, slider: Samples
    ) -> None:
        """Zero: this law stores no energy."""

    def exported(self, program: str) -> Joint:
        """Refuse the export, because no other program has this law.

        Raises
        ------
        ExchangeError
            Always.
        """
        raise ExchangeError(
            f'joint "{self.name}" is a damper with the force d |v| v, which {program} does not have: remove it, or '
            "put a linear damper into the damping matrix"
        )
