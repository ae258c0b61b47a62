"""Structural damping of a joint: a loss factor that may depend on the amplitude."""

from collections.abc import Mapping
from dataclasses import dataclass

from reduction.joint_law.registry import LAWS, DirectedJoint, LawParameter, Samples


@LAWS.register
@dataclass(frozen=True, kw_only=True, eq=False)
class StructuralDamper(DirectedJoint):
    r"""Damping force of a complex stiffness whose loss factor is a power of the amplitude, without the spring force.

    .. math:: f = \frac{\pi (p + 2)}{4}\, \eta k\, |u| \left| \frac{u}{r} \right|^p \tanh\frac{\dot u}{v}

    Under u = A cos(Omega t) with A Omega far above v, it dissipates the work of the complex stiffness
    k (1 + i eta (A / r)^p), independently of the frequency. Unlike a complex stiffness, it is a force in time.

    Parameters
    ----------
    name
        Name in messages and results.
    direction
        Row of u, shape (r,) [-].
    stiffness
        Stiffness k of the damped spring [N/m]; the spring is part of the structure.
    loss_factor
        Loss factor eta at the amplitude `reference` [-].
    reference
        Reference amplitude r [m].
    exponent
        Exponent p of the amplitude in the loss factor, 0 for a constant loss factor [-].
    velocity
        Velocity v at which the force is 76 % of that of fast motion [m/s].

    Raises
    ------
    JointError
        A negative loss factor or exponent, another parameter that is not positive, or a number that is not finite.

    References
    ----------
    T. J. Reid, Free vibration and hysteretic damping, J. R. Aeronaut. Soc. 60 (1956), 283: the case p = 0.
    """

    kind = "structural_damper"
    parameters = (
        LawParameter(name="stiffness", unit="N/m", meaning="of the damped spring", typical=4e5, positive=True),
        LawParameter(name="loss_factor", unit="-", meaning="at the reference", typical=0.05, lower=0.0),
        LawParameter(name="reference", unit="m", meaning="amplitude", typical=2e-5, positive=True, is_form=True),
        LawParameter(
            name="exponent",
            unit="-",
            meaning="of the amplitude in the loss factor",
            typical=0.5,
            lower=0.0,
            is_form=True,
        ),
        LawParameter(name="velocity", unit="m/s", meaning="at 76 % of the force", typical=0.005, positive=True),
    )
    typical_displacement = 2e-5
    n_slider = 0
    stuck_stiffness = (0.0,)

    stiffness: float
    loss_factor: float
    reference: float
    exponent: float
    velocity: float

    def spring_energy(
        self, parameters: Mapping[str, float], displacement: Samples, force: Samples, slider: Samples
    ) -> None:
        """Zero: this law stores no energy."""
