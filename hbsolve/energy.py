r"""Energy over one period: input, dissipated, stored, and the loss factor.

.. math:: \eta = \frac{\Delta W_\mathrm{dis}}{2 \pi U_\mathrm{pot}}

U_pot is the largest elastic energy of the *vibration* during the period: of the structure without its joints,
q~ K q~ / 2, and of the springs of the joints, with q~ = q - q_0, the forces T and N likewise without their means, so
that static preloads do not count. Of a cubic spring about its mean displacement u_0 it is V(u) - V(u_0) - V'(u_0) u~
with V = k u^4 / 4. For a viscous oscillator at resonance eta = 2 zeta.

References
----------
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), eq. 10.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from hbsolve.balance import HarmonicBalance
from hbsolve.contact.catalogue import parameter_names
from hbsolve.contact_motion import ContactMotion, contact_motion
from hbsolve.fourier import samples_from_coefficients
from hbsolve.state import SteadyState, check_state
from reduction.jointed_system import CubicSpring, ElasticStop, FrictionContact, JenkinsElement, Joint


@dataclass(frozen=True, kw_only=True, eq=False)
class EnergyBalance:
    """Energies of one period [J].

    Parameters
    ----------
    input_work
        Of the harmonic force.
    joint_dissipation
        Of each joint, shape (n_joint,).
    linear_dissipation
        Of the damping matrix.
    stored
        U_pot, as above.
    """

    input_work: float
    joint_dissipation: Float[NDArray[np.float64], " joint"]
    linear_dissipation: float
    stored: float

    @property
    def dissipated(self) -> float:
        """Delta W_dis: joints and linear damping [J]."""
        return float(self.joint_dissipation.sum()) + self.linear_dissipation

    @property
    def loss_factor(self) -> float:
        """Eta of eq. 10 [-]."""
        return self.dissipated / (2 * np.pi * self.stored) if self.stored else 0.0


def energy_balance(balance: HarmonicBalance, state: SteadyState) -> EnergyBalance:
    """Energies of a state over its period; input and dissipation are equal up to the residual.

    Raises
    ------
    BalanceError
        A state of another balance.
    """
    check_state(balance, state)
    q, system = state.coefficients, balance.system
    k = np.arange(len(q))
    force = state.level * balance.structure.dynamic
    input_work = np.pi * float(np.sum(k * (1j * q * force.conj()).real.sum(axis=1)))
    damped = np.einsum("kr,rs,ks->k", q.conj(), system.damping, q).real
    motions = contact_motion(balance, state)
    vibration = q.copy()
    vibration[0] = 0
    moved = samples_from_coefficients(vibration, balance.n_sample)
    stored = 0.5 * np.einsum("nr,rs,ns->n", moved, system.stiffness, moved, optimize=True)
    table = balance.table
    for number, (joint, motion) in enumerate(zip(system.joints, motions, strict=True)):
        # Those of the balance: along a branch over a parameter they are not the joint's own.
        values = table.value[table.parameter[number] : table.parameter[number + 1]]
        parameters = dict(zip(parameter_names(joint), values.tolist(), strict=True))
        stored = stored + _spring_energy(joint, parameters, motion)
    return EnergyBalance(
        input_work=input_work,
        joint_dissipation=np.array([float(motion.dissipated.sum()) for motion in motions]),
        linear_dissipation=np.pi * state.angular_frequency * float(np.sum(k**2 * damped)),
        stored=float(stored.max()),
    )


def _spring_energy(
    joint: Joint, parameters: Mapping[str, float], motion: ContactMotion
) -> Float[NDArray[np.float64], " n"]:
    """Elastic energy of a joint's springs at each instant, without its means, shape (n,) [J]."""
    force = motion.force - motion.force.mean(axis=1, keepdims=True)
    if isinstance(joint, FrictionContact):
        tangents = np.sum(force[:-1] ** 2, axis=0) / (2 * parameters["tangential_stiffness"])
        return np.asarray(tangents + force[-1] ** 2 / (2 * parameters["normal_stiffness"]))
    if isinstance(joint, JenkinsElement):
        return np.asarray(force[0] ** 2 / (2 * parameters["tangential_stiffness"]))
    if isinstance(joint, ElasticStop):
        return np.asarray(force[0] ** 2 / (2 * parameters["stiffness"]))
    if isinstance(joint, CubicSpring):
        mean = motion.displacement[0].mean()
        u = motion.displacement[0] - mean
        return np.asarray(parameters["stiffness"] * u**2 * (1.5 * mean**2 + mean * u + u**2 / 4))
    return np.zeros(motion.force.shape[1])
