r"""Spring and dashpot beyond a clearance, on one side or both.

.. math:: f = \max\left(k \delta + c \min(\delta / h, 1)\, \dot\delta,\ 0\right), \qquad \delta = u - g > 0

The damping grows with the indentation up to the depth :math:`h`, so that the force is continuous at impact; a constant
dashpot (Kelvin and Voigt) would act with c times the impact velocity from the first instant. The force is never
tensile: in a fast release it is zero before the surfaces separate. Below the depth h this is the contact of Hunt and
Crossley, :math:`k \delta (1 + \chi \dot\delta)` with :math:`\chi = c / (k h)`.

References
----------
Hunt and Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42 (1975), 440-445.
Adams/Solver, functions IMPACT and BISTOP: damping that grows with the indentation.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from reduction.array_type import Row
from reduction.errors import JointError
from reduction.joint_law.registry import LAWS, DirectedJoint, LawOption, LawParameter, Samples


@LAWS.register
@dataclass(frozen=True, kw_only=True, eq=False)
class DampedStop(DirectedJoint):
    """Stop with damping and without friction.

    Parameters
    ----------
    name
        Name in messages and results.
    direction
        Row of u, positive towards the stop, shape (r,) [-].
    stiffness
        Stiffness k [N/m].
    damping
        Damping coefficient c of the dashpot at full depth [N s/m].
    depth
        Depth h, the indentation from which the dashpot acts fully [m].
    gap
        Gap g [m]; negative for a pre-compressed stop, on one side only.
    sides
        "one": a stop at u = gap; "both": another one at u = -gap.

    Raises
    ------
    JointError
        A stiffness or a depth that is not positive, a negative damping, two sides with a negative gap, or a number that
        is not finite.
    """

    kind = "damped_stop"
    parameters = (
        LawParameter(name="stiffness", unit="N/m", meaning="k", typical=1e6, positive=True),
        LawParameter(name="damping", unit="N s/m", meaning="c", typical=500.0, lower=0.0),
        LawParameter(name="depth", unit="m", meaning="at which c is there in full", typical=1e-5, positive=True),
        LawParameter(name="gap", unit="m", meaning="negative for a pre-compressed stop", typical=1e-5, default=0.0),
    )
    options = (LawOption(name="sides", choices=("one", "both"), meaning="a stop on one side, or on both"),)
    typical_displacement = 3e-5
    can_slip = False
    one_sided = True
    n_slider = 0
    stuck_stiffness = (0.0,)  # it may be open at rest

    stiffness: float
    damping: float
    depth: float
    gap: float = 0.0
    sides: str = "one"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.sides not in {"one", "both"}:
            raise JointError(f'joint "{self.name}": sides = {self.sides!r} must be "one" or "both"')
        if self.sides == "both" and self.gap < 0:
            raise JointError(
                f'joint "{self.name}": gap = {self.gap:g} must not be negative for two sides: use a spring instead'
            )

    @property
    def force_law(self) -> str:
        """Name of the compiled force, which differs for one side and for both."""
        return "damped_stop" if self.sides == "one" else "damped_play"

    @property
    def reference_stiffness(self) -> tuple[float, ...]:
        """Stiffness if the stop is closed at rest, else 0 [N/m]."""
        return (self.stiffness if self.gap < 0 else 0.0,)

    def spring_energy(
        self, parameters: Mapping[str, float], displacement: Samples, force: Samples, slider: Samples
    ) -> Row:
        """Energy of the springs about the mean displacement."""
        k, gap = parameters["stiffness"], parameters["gap"]
        both = self.sides == "both"

        def indented(u: Row) -> tuple[Row, Row]:
            near, far = np.maximum(u - gap, 0), np.maximum(-u - gap, 0) * both
            return k / 2 * (near**2 + far**2), k * (near - far)

        u, mean = displacement[0], displacement[0].mean()
        energy, slope = indented(mean)
        return np.asarray(indented(u)[0] - energy - slope * (u - mean))
