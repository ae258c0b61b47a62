"""Piecewise linear damper, for a measured or identified force without a formula."""

from collections.abc import Mapping
from dataclasses import dataclass

from reduction.joint_law.registry import LAWS, DirectedJoint, LawParameter, Samples


@LAWS.register
@dataclass(frozen=True, kw_only=True, eq=False)
class PiecewiseDamper(DirectedJoint):
    """f = sign(v) times the sum of damping[i] max(abs(v) - i width, 0), i = 0, 1, ..., with v = du/dt.

    Parameters
    ----------
    name
        Name in messages and results.
    direction
        Row of u, shape (r,) [-].
    width
        Width of a piece [m/s].
    damping
        Change of the slope df/dv at 0, width, 2 width, ..., of either sign, a list [N s/m].

    Raises
    ------
    JointError
        A width that is not positive, or a number that is not finite.
    """

    kind = "piecewise_damper"
    parameters = (
        LawParameter(name="width", unit="m/s", meaning="of a piece", typical=2e-3, positive=True),
        LawParameter(
            name="damping", unit="N s/m", meaning="change at 0, width, 2 width, ..., a list", typical=1e3, is_list=True
        ),
    )
    typical_displacement = 2e-5
    n_slider = 0
    stuck_stiffness = (0.0,)

    width: float
    damping: tuple[float, ...]

    def spring_energy(
        self, parameters: Mapping[str, float], displacement: Samples, force: Samples, slider: Samples
    ) -> None:
        """Zero: this law stores no energy."""
