r"""Backbone of a model: frequency and damping ratio of one mode against its amplitude, as in a free decay.

A mode is held at resonance by a force in proportion to its inertia, :math:`F M \varphi \cos \Omega t`. If the modal
coordinate lags the force by a quarter of a period, the force balances the dissipation alone, and the motion is that of
the free decay at this amplitude. With the work per cycle W and the largest kinetic energy E of the first harmonic,

.. math:: \zeta = \frac{W}{4 \pi E}, \quad W = -\pi F \varphi^T M \operatorname{Im} X_1, \quad
          E = \tfrac{1}{2} \Omega^2 X_1^H M X_1 .

References
----------
M. Krack, Nonlinear modal analysis of nonconservative systems, Computers & Structures 154 (2015), for the mode of a
dissipative structure; M. Peeters, G. Kerschen and J. C. Golinval, Journal of Sound and Vibration 330 (2011), for the
phase criterion.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.model import DERIVATIVE, Model, Sensor
from fe.blas_threads import on_one_blas_thread
from fe.dense_modes import compute_dense_modes
from hbsolve.balance import HarmonicBalance
from hbsolve.errors import NoSteadyState
from hbsolve.state import SteadyState
from hbsolve.steady_state import steady_state
from reduction.jointed_system import modal_damping
from reduction.stuck import stick_at_rest

Real = Float[NDArray[np.float64], " k"]

#: Ratio of the modal amplitudes of two successive levels, and factor of the levels beyond the wanted amplitudes [-].
NEXT, MARGIN = 1.15, 1.4
#: First step of the search for the phase resonance over the damping ratio; smallest step and accuracy, relative to the
#: frequency [-].
STEP, LEAST_STEP, ACCURACY = 0.5, 1e-6, 1e-8
#: Smallest damping ratio of the linear structure for the first level [-].
UNDAMPED = 1e-6
#: Motion at a sensor, relative to the largest motion of the mode, below which the mode is not visible [-].
UNSEEN = 1e-9
#: Largest ratio of the frequencies of a measured mode and a mode of the model that are paired [-].
MAX_FREQUENCY_FACTOR = 1.5
#: Largest number of steps of one search, and of levels.
MOST_STEPS, MOST_LEVELS = 60, 120


@on_one_blas_thread
def predict_backbone(model: Model, sensor: str, near: float, amplitudes: Real) -> tuple[Real, Real]:
    """Frequencies [Hz] and damping ratios [-] at amplitudes of a sensor's first harmonic, shape (k,) each.

    Parameters
    ----------
    model
        Model; of its loads only the static ones are applied.
    sensor
        Name of a motion sensor; amplitudes are in the unit of its quantity.
    near
        Frequency [Hz] near that of the mode, which is the nearest linear mode with all closed contacts stuck.
    amplitudes
        Positive amplitudes, shape (k,) [SI unit of the sensor].

    Returns
    -------
    NaN at amplitudes without a steady state, and at all amplitudes if no mode is within a factor of 1.5.

    Raises
    ------
    CampaignError
        The model has no such motion sensor, or the mode is not visible at the sensor.
    """
    from scipy.interpolate import PchipInterpolator

    seen = next((item for item in model.sensors if item.name == sensor and isinstance(item, Sensor)), None)
    if seen is None:
        raise CampaignError(f'the model has no sensor of motion "{sensor}": add it to the case')
    mode = _make_driven_mode(model, near)
    ratio = mode.angular_frequency / (2 * np.pi * near)
    if not 1 / MAX_FREQUENCY_FACTOR < ratio < MAX_FREQUENCY_FACTOR:
        return np.full(len(amplitudes), np.nan), np.full(len(amplitudes), np.nan)
    scale = abs(float(seen.gain * seen.row @ mode.shape)) * mode.angular_frequency ** DERIVATIVE[seen.quantity]
    if not abs(seen.row @ mode.shape) > UNSEEN * np.abs(mode.shape).max() * np.abs(seen.row).sum():
        linear = mode.angular_frequency / (2 * np.pi)
        raise CampaignError(f'sensor "{sensor}" does not see the mode at {linear:.6g} Hz: take another sensor')
    lowest, highest = float(amplitudes.min()) / MARGIN, float(amplitudes.max()) * MARGIN
    points = _follow(mode, seen, lowest / scale, highest)
    if len(points) < 2:
        return np.full(len(amplitudes), np.nan), np.full(len(amplitudes), np.nan)
    amplitude, frequency, damping = np.array(points).T
    at, known = np.log(amplitudes), np.log(amplitude)
    inside = (at >= known[0]) & (at <= known[-1])
    return tuple(np.where(inside, PchipInterpolator(known, values)(at), np.nan) for values in (frequency, damping))  # type: ignore[return-value]


@dataclass(frozen=True, kw_only=True, eq=False)
class _Mode:
    """Balance under the force of one mode, with shape at unit modal mass, frequency and damping ratio of the mode."""

    balance: HarmonicBalance
    shape: Real
    angular_frequency: float
    damping_ratio: float

    def coordinate(self, state: SteadyState) -> complex:
        """Modal coordinate of the first harmonic; unit modal mass."""
        return complex(self.shape @ self.balance.system.mass @ state.coefficients[1])


def _make_driven_mode(model: Model, near: float) -> _Mode:
    system = model.system
    modes = compute_dense_modes(system.mass, stick_at_rest(system.stiffness, system.joints))
    omega = np.sqrt(np.maximum(modes.lambda_, 0.0))
    number = int(np.argmin(np.abs(omega - 2 * np.pi * near)))
    shape = modes.mode_shapes[:, number]
    force = np.zeros((2, system.n_dof), dtype=np.complex128)
    force[1] = system.mass @ shape
    driven = model.with_system(harmonic_force=force).system
    return _Mode(
        balance=HarmonicBalance(system=driven, n_harmonic=model.n_harmonic, n_sample=model.n_sample),
        shape=shape,
        angular_frequency=float(omega[number]),
        damping_ratio=max(
            float(modal_damping(system, shape[:, None], omega[[number]])[0]) / (2 * float(omega[number])), UNDAMPED
        ),
    )


def _follow(mode: _Mode, sensor: Sensor, first: float, highest: float) -> list[tuple[float, float, float]]:
    """Amplitude, frequency [Hz] and damping ratio at rising levels, from a modal amplitude to a sensor amplitude."""
    points: list[tuple[float, float, float]] = []
    omega, damping, coordinate = mode.angular_frequency, mode.damping_ratio, first
    state: SteadyState | None = None
    for _ in range(MOST_LEVELS):
        balance = mode.balance.at_level(2 * damping * omega**2 * coordinate)
        state = _find_phase_resonance(mode, balance, omega, damping, state)
        if state is None:
            break
        omega, moved = state.angular_frequency, abs(mode.coordinate(state))
        energy = omega**2 * float((state.coefficients[1].conj() @ balance.system.mass @ state.coefficients[1]).real) / 2
        work = -np.pi * balance.level * mode.coordinate(state).imag
        damping = work / (4 * np.pi * energy)
        amplitude = abs(sensor.gain * sensor.row @ state.coefficients[1]) * omega ** DERIVATIVE[sensor.quantity]
        if points and amplitude <= points[-1][0]:
            break
        points.append((amplitude, omega / (2 * np.pi), damping))
        if amplitude >= highest:
            break
        coordinate = NEXT * moved
    return points


def _find_phase_resonance(
    mode: _Mode, balance: HarmonicBalance, omega: float, damping: float, before: SteadyState | None
) -> SteadyState | None:
    """Steady state whose modal coordinate lags the force by a quarter of a period; None if the search fails."""
    from scipy.optimize import brentq

    last: list[SteadyState] = [] if before is None else [before]

    def lead(at: float) -> float:
        """Part of the modal coordinate in phase with the force: positive below the resonance, negative above."""
        state = steady_state(balance, at, start=last[-1] if last else None)
        value = mode.coordinate(state).real
        # States above the resonance are not used as a start: the search stays on the upper branch.
        if value > 0 or not last:
            last.append(state)
        return value

    step = max(STEP * damping, LEAST_STEP) * omega
    try:
        low, high = omega, omega
        here = lead(omega)
        for _ in range(MOST_STEPS):
            if here > 0:
                low, high = high, high + step
                here_next = lead(high)
                if here_next <= 0:
                    break
            else:
                low, high = low - step, low
                here_next = lead(low)
                if here_next > 0:
                    break
            here, step = here_next, 1.5 * step
        else:
            return None
        at = float(brentq(lead, low, high, xtol=ACCURACY * omega))
        return steady_state(balance, at, start=last[-1])
    except (NoSteadyState, ValueError):
        return None
