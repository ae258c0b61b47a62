"""A steady state, and the motion and the sliders from which a solution starts."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float

from hbsolve.aft import InitialSliders
from hbsolve.balance import HarmonicBalance
from hbsolve.errors import BalanceError
from hbsolve.sampling import real_from_complex
from reduction.array_input import check_finite_array, check_whole_number
from reduction.array_type import Array, Real

#: Largest relative difference of two motions of one state: Newton's method leaves 1e-9 of the linear motion, which a
#: nearby resonance or fold amplifies.
SAME_STATE = 1e-5


@dataclass(frozen=True, kw_only=True, eq=False)
class SteadyState:
    """One periodic response; d joint directions, s sliders, harmonics 0 to H."""

    angular_frequency: float
    """Omega [rad/s]."""
    level: float
    """Scale of the harmonic force [-]."""
    displacement: Complex[Array, "harmonic d"]
    """Coefficients of the joint directions, shape (H + 1, d) [m]."""
    coefficients: Complex[Array, "harmonic r"]
    """Coefficients of all degrees of freedom, shape (H + 1, r) [m]."""
    initial_slider: Float[Real, " s"]
    """Slider positions (or multipliers, see `multiplier`) at the first instant, as given, shape (s,) [m or -]."""
    multiplier: bool
    """Whether `initial_slider` holds the multipliers m of eq. 11."""
    periodic_slider: Float[Real, " s"]
    """Slider positions at the start of the steady period, shape (s,) [m]."""
    residual_norm: float
    """|R| relative to the linear motion; 0 where it is round-off [-]."""
    iterations: int
    """Newton iterations in all [-]."""

    @property
    def frequency(self) -> float:
        """Omega / (2 pi) [Hz]."""
        return self.angular_frequency / (2 * np.pi)

    @property
    def sliders(self) -> InitialSliders:
        """`initial_slider` and `multiplier` as an argument of compiled code."""
        return InitialSliders(np.array(self.initial_slider), np.full(len(self.initial_slider), int(self.multiplier)))

    @property
    def motion(self) -> Real:
        """`displacement` as real coefficients, shape (d, nh) [m]."""
        return real_from_complex(self.displacement)

    def amplitude(self, row: int | Float[Real, " r"], harmonic: int = 1) -> float:
        """Amplitude of one harmonic of a degree of freedom, or of a row over all of them [m].

        Parameters
        ----------
        row
            A degree of freedom, or weights of all of them, shape (r,) [-].
        harmonic
            k, from 0 to H.

        Raises
        ------
        BalanceError
            A harmonic or a degree of freedom that the state does not have, or a row of another size.
        """
        return float(abs(harmonic_at(self.coefficients, row, harmonic)))


def is_same_motion(one: Real, other: Real) -> bool:
    """Whether two motions of the directions, shape (d, nh), are the same state."""
    return float(np.linalg.norm(one - other)) <= SAME_STATE * float(np.linalg.norm(other))


def harmonic_at(
    coefficients: Complex[Array, "... harmonic r"], row: int | Float[Real, " r"], harmonic: int
) -> Complex[Array, "..."]:
    """Complex amplitude of one harmonic of a degree of freedom, or of a row over all of them, shape (r,) [m].

    Raises
    ------
    BalanceError
        A harmonic or a degree of freedom that the coefficients, shape (..., H + 1, r), do not have, or a row of another
        size.
    """
    n_harmonic, n_dof = coefficients.shape[-2:]
    q = coefficients[..., check_harmonic(harmonic, n_harmonic), :]
    if row is None or isinstance(row, str | int | float) or np.ndim(row) == 0:
        dof = check_whole_number(row, "row", BalanceError)
        if not 0 <= dof < n_dof:
            raise BalanceError(f"degree of freedom {dof} does not exist: the structure has 0 to {n_dof - 1}")
        return np.asarray(q[..., dof])
    meaning = ", one weight per degree of freedom, or the number of one"
    return np.asarray(q @ check_finite_array(row, "the row", BalanceError, (n_dof,), meaning))


def check_harmonic(harmonic: int, n_harmonic: int) -> int:
    """Return the number of a harmonic; refuse (`BalanceError`) one that does not exist."""
    k = check_whole_number(harmonic, "harmonic", BalanceError)
    if not 0 <= k < n_harmonic:
        raise BalanceError(f"harmonic {k} is not between 0 and {n_harmonic - 1}: give one of these")
    return k


def check_state(balance: HarmonicBalance, state: SteadyState) -> None:
    """Refuse (`BalanceError`) an object that is not a state of this balance; compiled code does not check."""
    if not isinstance(state, SteadyState):
        raise BalanceError(f"the state is a {type(state).__name__}: give one that `steady_state` returned")
    shapes = {
        "coefficients": (balance.n_harmonic, balance.system.n_dof),
        "displacement": (balance.n_harmonic, balance.n_direction),
        "initial_slider": (balance.n_slider,),
    }
    for name, wanted in shapes.items():
        result = np.shape(getattr(state, name))
        if result != wanted:
            raise BalanceError(
                f"the state has {name} of shape {result}, the balance {wanted}: give the balance with which the state "
                "was found"
            )


def make_initial_sliders(
    balance: HarmonicBalance, slider: Sequence[float] | Real | None, multiplier: bool = False
) -> InitialSliders:
    """Check initial sliders given by a caller.

    Parameters
    ----------
    balance
        Balance of the system.
    slider
        Positions, one per tangent in order of joints, shape (s,) [m], or multipliers [-]; zero by default, springs
        without tension at rest.
    multiplier
        Whether the values are fractions of Coulomb's limit (eq. 11), from -1 to 1.

    Raises
    ------
    BalanceError
        Another number of values than sliders, values that are not finite, or a multiplier beyond Coulomb's cone.
    """
    n = balance.n_slider
    given = np.zeros(n) if slider is None else slider
    value = np.array(
        check_finite_array(given, "slider", BalanceError, (n,), ", one number per tangent in order of joints")
    )
    if multiplier and n and np.abs(value).max() > 1:
        worst = value[np.abs(value).argmax()]
        raise BalanceError(f"multiplier {worst:g} is outside [-1, 1]: it is the share of Coulomb's limit (eq. 11)")
    return InitialSliders(value, np.full(n, int(multiplier)))


def in_harmonics_of(balance: HarmonicBalance, motion: Real) -> Real:
    """A motion of fewer harmonics, padded with zeros to those of a balance, shape (d, nh) [m]."""
    return np.pad(motion, ((0, 0), (0, 2 * balance.n_harmonic - 1 - motion.shape[1])))


def start_motion(balance: HarmonicBalance, start: SteadyState | Real | None) -> Real | None:
    """Check a start motion given by a caller, since compiled code checks nothing.

    Another shape than that of the balance, or entries that are not finite real numbers, are refused (`BalanceError`).
    """
    if start is None:
        return None
    n_direction, n_harmonic = balance.n_direction, balance.n_harmonic
    if isinstance(start, SteadyState):
        if start.displacement.shape != (n_harmonic, n_direction):
            raise BalanceError(
                f"the start is a state with displacement of shape {start.displacement.shape}, the balance has "
                f"{n_harmonic} harmonics with the mean and {n_direction} directions: give a state of this balance"
            )
        return start.motion
    shape, meaning = (n_direction, 2 * n_harmonic - 1), ", a steady state or a branch's `start`"
    return check_finite_array(
        start, "the start", BalanceError, shape, f", real coefficients of the directions{meaning}"
    )
