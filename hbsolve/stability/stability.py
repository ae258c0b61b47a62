"""Stability of a steady state: its Floquet multipliers."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex

from fe.blas_threads import on_one_blas_thread
from hbsolve.aft import InitialSliders
from hbsolve.balance import HarmonicBalance
from hbsolve.errors import BalanceError
from hbsolve.linear_modes import LinearModes, compute_linear_modes
from hbsolve.stability.monodromy import monodromy
from hbsolve.state import SteadyState, check_state
from reduction.array_input import freeze_arrays
from reduction.array_type import Array, Real

#: Least number of instants at which a disturbance is followed. Where contacts change their state between two instants,
#: the error is of first order in their distance: with this number, multipliers are within 1e-3 of the integration in
#: time for joints that are about as stiff as the structure.
LEAST_SAMPLE = 4096
#: Excess of a multiplier over 1 that counts as neutral: the error by round-off and instants for undamped motions.
NEUTRAL = 1e-6


@dataclass(frozen=True, kw_only=True, eq=False)
class Stability:
    """Floquet multipliers of one steady state."""

    angular_frequency: float
    """Omega [rad/s]."""
    multipliers: Complex[Array, " m"]
    """The factors by which disturbances grow in a period, the largest first, shape (m,) [-]: two of each degree of
    freedom and one of each slider that moves."""

    def __post_init__(self) -> None:
        freeze_arrays(self, "multipliers", dtype=np.complex128)

    @property
    def exponents(self) -> Complex[Array, " m"]:
        """Floquet exponents, their imaginary part within Omega / 2, shape (m,) [1/s]."""
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(self.multipliers) * self.angular_frequency / (2 * np.pi))

    @property
    def n_unstable(self) -> int:
        """Number of multipliers outside the unit circle."""
        return int((np.abs(self.multipliers) > 1 + NEUTRAL).sum())

    @property
    def is_stable(self) -> bool:
        """Whether every small disturbance stays small."""
        return self.n_unstable == 0


@on_one_blas_thread
def stability(balance: HarmonicBalance, state: SteadyState, *, n_sample: int = 0) -> Stability:
    """Stability of a steady state.

    Parameters
    ----------
    balance
        Balance with which the state was found.
    state
        Steady state.
    n_sample
        Instants per period at which a disturbance is followed; by default those of the balance, 4096 at least [-].

    Raises
    ------
    BalanceError
        A state of another balance, too few instants, or joints too stiff compared with the structure.
    """
    check_state(balance, state)
    refuse_stiffer_joints(balance)
    return compute_stability(
        balance, compute_linear_modes(balance), state.angular_frequency, state.motion, state.sliders, n_sample
    )


def compute_stability(
    balance: HarmonicBalance,
    modes: LinearModes,
    angular_frequency: float,
    motion: Real,
    start: InitialSliders,
    n_sample: int = 0,
) -> Stability:
    """Stability of a motion of the joint directions, real coefficients of shape (d, 2 H + 1) [m]."""
    fine = balance.with_samples(n_sample or max(balance.n_sample, LEAST_SAMPLE))
    matrix, n_zero = monodromy(fine, modes, angular_frequency, motion, start)
    values = np.linalg.eigvals(matrix).astype(np.complex128)
    values = values[np.argsort(-np.abs(values), kind="stable")]
    return Stability(angular_frequency=angular_frequency, multipliers=values[: len(values) - n_zero])


def refuse_stiffer_joints(balance: HarmonicBalance) -> None:
    """Refuse joints stiffer than the linear reference, whose forces between instants are not resolved."""
    if (stiffer := balance.find_stiffer_joint()) is not None:
        name, stiffness, most = stiffer
        raise BalanceError(
            f'joint "{name}" has a stiffness of {stiffness:.3g} N/m, which is too stiff for a stability analysis of '
            f"this structure: give {most:.3g} N/m, which are practically rigid there"
        )
