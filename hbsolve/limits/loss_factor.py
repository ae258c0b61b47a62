r"""The loss factor of eq. 10 as an objective, and the amplitude at its limits, as in the paper below.

.. math:: \eta = \frac{\Delta W_\mathrm{dis}}{2 \pi U_\mathrm{pot}}

In a steady state the work of the excitation equals the dissipation, and it is linear in the motion; U_pot is the
largest potential energy of the vibration over the period, in the structure and in the springs of the contacts
(`hbsolve.energy`). Both are functions of the joint forces g, since q = q_lin - alpha B^T g.

The paper seeks the extremes over multipliers m in [-1, 1] of eq. 11, T = m mu N at the first instant. This is Coulomb's
cone itself and does not bound the sliders: every sticking state has such an m. So the limits of the paper are those of
the loss factor over all slider positions, without a box.

References
----------
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), eqs 9-12.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from hbsolve.balance import HarmonicBalance
from hbsolve.condensed import Condensed, Recovery
from hbsolve.errors import BalanceError
from hbsolve.limits.objective import OutputHarmonic
from hbsolve.limits.response_limits import limit_problem, response_limits
from hbsolve.limits.result import ResponseLimits
from hbsolve.sampling import complex_from_real
from reduction.array_type import Array, Real, Whole


@dataclass(frozen=True, kw_only=True, eq=False)
class LossFactor:
    """Eta of eq. 10 [-]."""

    def check(self, balance: HarmonicBalance) -> None:
        """See `Objective`.

        Raises
        ------
        BalanceError
            A joint whose energy is not that of springs in series with sliders.
        """
        for joint in balance.system.joints:
            if not joint.series_springs:
                raise BalanceError(
                    f'the loss factor is defined only for the energy of friction contacts, but "{joint.name}" is a '
                    f"{type(joint).__name__}: bound an amplitude instead"
                )

    def measure(self, balance: HarmonicBalance, condensed: Condensed) -> "LossMeasure":
        """See `Objective`."""
        joints = balance.system.joints
        normal = [
            (int(first) + joint.normal_direction, joint.stuck_force[joint.normal_direction])
            for first, joint in zip(balance.table.direction, joints, strict=False)
            if joint.normal_direction is not None
        ]
        return LossMeasure(
            balance=balance,
            normal=np.array([direction for direction, _ in normal], dtype=np.int64),
            at_zero=np.array([force for _, force in normal]),
            recovery=balance.structure.recovery(condensed),
            work=np.pi * np.arange(balance.n_harmonic)[:, None] * 1j * balance.structure.dynamic.conj(),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class LossMeasure:
    """Eta at one frequency; see `hbsolve.limits.objective.Measure`."""

    balance: HarmonicBalance
    recovery: Recovery
    work: Array
    """Factor of q: the real part of the product is the work in a period at level 1, shape (H + 1, r) [N]."""
    normal: Whole
    """Directions of unilateral normal springs, shape (c,)."""
    at_zero: Real
    """Force of each normal spring at v = 0, negative where it is open, shape (c,) [N]."""
    least: float = float(np.finfo(float).tiny)

    def _energies(self, level: float, x: Real, g: Real) -> tuple[float, float, int, Real, Real, Real, Real]:
        """Work, U_pot, its instant, and quantities for its derivatives at that instant.

        These are the vibration of the structure, that of the tangential forces (0 for normals), and for the normal
        springs their force beyond that at the mean displacement, and its linearisation about the mean displacement.
        """
        recovery = self.recovery
        joint_response = (recovery.contact @ complex_from_real(g)[..., None])[..., 0]
        q = recovery.static + level * recovery.dynamic - joint_response
        work = level * float((self.work * q).real.sum())
        n = self.balance.n_sample
        # Vibration at the instants of the balance.
        turned = np.exp(2j * np.pi * np.outer(np.arange(n), np.arange(1, len(q))) / n)
        moved = (turned @ q[1:]).real
        springs = self.balance.table.reference  # of a contact, the reference is the stiffness of its springs
        force = (g + springs[:, None] * x)[:, 1:] @ self.balance.sampling.evaluate[1:]
        stored = 0.5 * np.einsum("nr,nr->n", moved @ self.balance.system.stiffness, moved)
        force[self.normal] = 0.0
        stored = stored + 0.5 * (force**2 / springs[:, None]).sum(axis=0)
        # Energy of the normal springs about the mean displacement, see `hbsolve.energy`.
        k, mean = springs[self.normal, None], x[self.normal, :1]
        v = x[self.normal] @ self.balance.sampling.evaluate
        N, held = (np.maximum(self.at_zero[:, None] + k * item, 0.0) for item in (v, mean))
        stored = stored + ((N**2 - held**2) / (2 * k) - held * (v - mean)).sum(axis=0)
        at = int(stored.argmax())
        tangent = np.where(held > 0, k * (v - mean), 0.0)
        return work, float(stored[at]), at, moved[at], force[:, at], (N - held)[:, at], tangent[:, at]

    def value(self, level: float, x: Real, g: Real) -> float:
        """See `Measure`."""
        work, stored, *_ = self._energies(level, x, g)
        return work / (2 * np.pi * stored)

    def slopes(self, level: float, x: Real, g: Real) -> tuple[Real, Real]:
        """See `Measure`; the instant of the largest energy is stationary."""
        work, stored, at, moved, force, beyond, tangent = self._energies(level, x, g)
        basis = self.balance.sampling.instants[at].copy()
        normal_by_x = np.outer(beyond, basis)
        normal_by_x[:, 0] -= tangent
        basis[0] = 0.0
        pull = force / self.balance.table.reference
        energy_by_x = np.outer(self.balance.table.reference * pull, basis)
        energy_by_x[self.normal] = normal_by_x
        energy_by_g = np.outer(pull, basis)
        work_by_g = np.zeros_like(g)
        strain = self.balance.system.stiffness @ moved
        for k in range(1, self.balance.n_harmonic):
            turn = basis[2 * k - 1] + 1j * basis[2 * k]
            by_energy = -(strain @ self.recovery.contact[k]) * turn
            by_work = -level * (self.work[k] @ self.recovery.contact[k])
            for target, by in ((energy_by_g, by_energy), (work_by_g, by_work)):
                # Re(by dg_k), dg_k = dg_c - i dg_s
                target[:, 2 * k - 1] += by.real
                target[:, 2 * k] += by.imag
        scale = 1 / (2 * np.pi * stored)
        by_x = -work * scale / stored * energy_by_x
        return by_x, scale * work_by_g - work * scale / stored * energy_by_g


@dataclass(frozen=True, kw_only=True, eq=False)
class LossFactorLimits:
    """Amplitudes of an output at extreme loss factors, the limits of Ferhatoglu, Botto and Zucca."""

    loss_factor: ResponseLimits
    """Least and largest loss factor, with their states and certificates."""
    amplitude: Float[Real, "2 l f"]
    """Amplitude of the output: first at the largest eta, the lower limit of the paper, then at the least, its upper
    limit, shape (2, l, f) [m]."""


def loss_factor_limits(
    balance: HarmonicBalance,
    output: OutputHarmonic,
    angular_frequency: Sequence[float] | Real,
    levels: Sequence[float] | Real,
    *,
    nominal: Sequence[float] | Real | None = None,
    reach: float = np.inf,
    **options: Any,
) -> LossFactorLimits:
    """Amplitude of an output at extreme loss factors, eqs 9-12.

    These bound the amplitude at resonance only; see `docs/response_limits.md`.

    Parameters
    ----------
    balance, angular_frequency, levels, options
        As `response_limits`.
    output
        Output whose amplitude is given.
    nominal, reach
        Box for the sliders, as in `limit_problem`; by default without bounds, as in the paper.
    """
    problem = limit_problem(balance, LossFactor(), nominal=nominal, reach=reach)
    output.check(balance)
    answer = response_limits(problem, angular_frequency, levels, **options)
    amplitude = np.full(answer.value.shape, np.nan)
    for at in np.ndindex(*answer.value.shape):
        if np.isfinite(answer.value[at]):
            omega, level = float(answer.angular_frequency[at[2]]), float(answer.level[at[1]])
            point = problem.at(omega, level)
            trial = point.trial(answer.motion[at], answer.initial_slider[at], float(answer.residual_norm[at]))
            measure = output.measure(balance, point.condensed)
            amplitude[at] = measure.value(level, trial.motion, trial.forces.coefficients)
    return LossFactorLimits(loss_factor=answer, amplitude=amplitude[::-1])
