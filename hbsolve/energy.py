r"""Energy over one period: input, dissipated, stored, and the loss factor.

.. math:: \eta = \frac{\Delta W_\mathrm{dis}}{2 \pi U_\mathrm{pot}}

U_pot is the largest elastic energy of the *vibration* during the period: of the structure without its joints,
q~ K q~ / 2, and of the springs of the joints, with q~ = q - q_0, so that static preloads do not count. A spring with a
slider in series counts by its force without the mean, T~^2 / (2 k_t). A spring without one counts about its mean
displacement u_0, by V(u) - V(u_0) - V'(u_0) u~: V = k u^4 / 4 of a cubic spring, and N^2 / (2 k_n) of the unilateral
normal spring of a contact. For a viscous oscillator at resonance eta = 2 zeta.

References
----------
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), eq. 10.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from hbsolve.balance import HarmonicBalance
from hbsolve.contact_motion import contact_motion
from hbsolve.fourier import samples_from_coefficients
from hbsolve.state import SteadyState, check_state
from reduction.array_type import Real


@dataclass(frozen=True, kw_only=True, eq=False)
class EnergyBalance:
    """Energies of one period [J]."""

    input_work: float
    """Work of the harmonic force."""
    joint_dissipation: Float[Real, " joint"]
    """Energy dissipated by each joint, shape (n_joint,)."""
    linear_dissipation: float
    """Energy dissipated by the damping matrix and by structural damping."""
    stored: float
    """U_pot, see the module."""

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
    linear = state.angular_frequency * float(np.sum(k**2 * damped))
    if system.structural_damping is not None:
        linear += float(np.sum(k * np.einsum("kr,rs,ks->k", q.conj(), system.structural_damping, q).real))
    motions = contact_motion(balance, state)
    vibration = q.copy()
    vibration[0] = 0
    moved = samples_from_coefficients(vibration, balance.n_sample)
    stored = 0.5 * np.einsum("nr,rs,ns->n", moved, system.stiffness, moved, optimize=True)
    table = balance.table
    for number, (joint, motion) in enumerate(zip(system.joints, motions, strict=True)):
        # Parameters of the balance: along a branch over a parameter they differ from those of the joint.
        values = table.value[table.parameter[number] : table.parameter[number + 1]]
        parameters = dict(zip(joint.parameter_names, values.tolist(), strict=True))
        vibrating = motion.force - motion.force.mean(axis=1, keepdims=True)
        energy = joint.spring_energy(parameters, motion.displacement, vibrating, motion.slider)
        stored = stored if energy is None else stored + energy
    return EnergyBalance(
        input_work=input_work,
        joint_dissipation=np.array([float(motion.dissipated.sum()) for motion in motions]),
        linear_dissipation=np.pi * linear,
        stored=float(stored.max()),
    )
