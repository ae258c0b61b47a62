r"""Frequency and damping against amplitude from a free decay, mode by mode.

A mode that decays slowly is :math:`x(t) = A(t) \cos \varphi(t)` with harmonics. Its frequency is that of the phase. Its
damping follows from the action :math:`J \propto \omega A^2` rather than from the amplitude: if the frequency depends on
the amplitude, A changes with it even without any dissipation, but the action does not (an adiabatic invariant). So

.. math:: \zeta \omega = -\tfrac{1}{2} \frac{\mathrm{d}}{\mathrm{d}t} \ln (\omega A^2)

with A the first harmonic of the displacement. This is the damping ratio that harmonic balance gives for the steady
state of the same amplitude at phase resonance, to first order of damping and of the change of frequency per period. An
acceleration is brought to a displacement by :math:`\omega^2`, which changes its rate of decay as well.

The first half period after a release is left out: friction moves along its virgin curve there, not along its loop.

References
----------
Landau and Lifshitz, Mechanics, 3rd ed. (1976), section 49.
Londoño, Neild and Cooper, Identification of backbone curves of nonlinear systems from resonance decay responses,
J. Sound Vib. 348 (2015) 224.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.signal.logarithmic_spline import LogarithmicFit, fit_logarithms
from correlation.signal.record import check_channels, check_time, uniform_step
from correlation.signal.release import Decay, find_decay, first_guess, new_tone
from geometry.read_only_array import freeze_fields

Values = Float[NDArray[np.float64], " k"]

#: Powers of omega by which a signal exceeds a displacement.
POWER = {"displacement": 0, "velocity": 1, "acceleration": 2}
#: Numbers of spline intervals that are tried; the information criterion picks one.
INTERVALS = (1, 2, 3, 4, 6, 8, 12, 16, 24)
#: Harmonics of a mode that are fitted beside it, and points of a result.
HARMONICS, N_POINT = (2, 3, 5), 60
#: Most modes that are looked for where their number is not given.
MOST_MODES = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class RingDown:
    """A mode during its free decay, at k instants with falling amplitude.

    Parameters
    ----------
    time
        Shape (k,) [s].
    amplitude, amplitude_deviation
        Of the first harmonic of the signal, peak, shape (k,) [unit of the signal].
    displacement
        The same of the displacement, shape (k,) [unit of the signal times s or s^2].
    frequency, frequency_deviation
        Undamped, shape (k,) [Hz].
    damping_ratio, damping_deviation
        Shape (k,) [-].
    start, end
        First and last instant used [s].
    noise_floor
        Amplitude below which a mode vanishes in the noise [unit of the signal].
    residual
        Root mean square of what all modes leave, over that of the signal [-].
    suspicions
        What speaks against the result, in words.
    """

    time: Values
    amplitude: Values
    amplitude_deviation: Values
    displacement: Values
    frequency: Values
    frequency_deviation: Values
    damping_ratio: Values
    damping_deviation: Values
    start: float
    end: float
    noise_floor: float
    residual: float
    suspicions: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze_fields(
            self, "time", "amplitude", "amplitude_deviation", "displacement", "frequency", "frequency_deviation",
            "damping_ratio", "damping_deviation",
        )  # fmt: skip


def analyse_ring_down(
    time: Any,
    values: Any,
    *,
    quantity: str = "displacement",
    start: float | None = None,
    end: float | None = None,
    frequencies: Sequence[float] | None = None,
) -> tuple[RingDown, ...]:
    """Frequency and damping against amplitude of every mode in a free decay.

    Parameters
    ----------
    time
        Instants at one rate, shape (n,) [s].
    values
        Signal, shape (n,) [any unit].
    quantity
        "displacement", "velocity" or "acceleration".
    start, end
        Part of the record to be used [s]; by default from half a period after the release to where the modes vanish in
        the noise.
    frequencies
        Modes to be fitted, roughly [Hz]; by default those that stand out.

    Returns
    -------
    The modes, by rising frequency.

    Raises
    ------
    CampaignError
        A clock that is not uniform, an unknown quantity, or no decay in the record.
    """
    if quantity not in POWER:
        raise CampaignError(f'"{quantity}" is no quantity of a ring-down: give {", ".join(POWER)}')
    channel = check_channels(values)
    if len(channel) != 1:
        raise CampaignError(f"values have shape {np.shape(values)}: give the samples of one channel, shape (n,)")
    instants = check_time(time, channel.shape[1], fewest=32)
    step = uniform_step(instants)
    decay = find_decay(instants, channel[0], step, start, end, frequencies)
    fit, decay = _fit_modes(decay, frequencies is None)
    modes = [_describe(decay, fit, number, POWER[quantity]) for number in range(len(decay.frequencies))]
    return tuple(sorted(modes, key=lambda mode: float(mode.frequency[-1])))


def _fit_modes(decay: Decay, adds: bool) -> tuple[LogarithmicFit, Decay]:
    """The fit with as many modes and spline intervals as the data call for."""
    best = _best_intervals(decay)
    while adds and len(decay.frequencies) < MOST_MODES:
        tone = new_tone(decay, best.residual)
        if tone is None:
            break
        more = decay.with_frequency(tone)
        trial = _best_intervals(more)
        if trial.criterion >= best.criterion or (trial.residual**2).sum() > 0.7 * (best.residual**2).sum():
            break
        decay, best = more, trial
    return best, decay


def _best_intervals(decay: Decay) -> LogarithmicFit:
    """The fit whose number of spline intervals has the best information criterion."""
    best: LogarithmicFit | None = None
    worse = 0
    for count in INTERVALS:
        fit = fit_logarithms(decay.values, first_guess(decay, count, HARMONICS))
        if best is None or fit.criterion < best.criterion:
            best, worse = fit, 0
        else:
            worse += 1
        if worse == 3:
            break
    assert best is not None
    return best


def _describe(decay: Decay, fit: LogarithmicFit, number: int, power: int) -> RingDown:
    """Frequency and damping of one mode with their standard deviations, from its spline."""
    spline, covariance = fit.splines[number], fit.covariance[number]
    span = decay.duration(number)
    share = np.linspace(0, 1, N_POINT)
    value = spline(share)
    rate, bend = spline(share, nu=1) / span, spline(share, nu=2) / span**2
    b = len(spline.c)
    basis = type(spline)(spline.t, np.eye(b), spline.k)
    by_value, by_rate, by_bend = basis(share), basis(share, nu=1) / span, basis(share, nu=2) / span**2
    omega, growth = rate[:, 1], rate[:, 0]
    # Decay of the action of the displacement: -d/dt (ln A + (1/2 - p) ln omega).
    excess = power - 0.5
    decay_rate = -growth + excess * bend[:, 1] / omega
    undamped = np.hypot(omega, decay_rate)
    zeros = np.zeros_like(by_value)
    omega_slope = np.hstack([zeros, by_rate])
    decay_slope = np.hstack(
        [-by_rate, excess * (by_bend / omega[:, None] - (bend[:, 1] / omega**2)[:, None] * by_rate)]
    )
    amplitude_slope = np.hstack([by_value, zeros])
    omega_deviation, decay_deviation, relative = (
        np.sqrt(np.maximum(np.einsum("ki,ij,kj->k", slope, covariance, slope), 0.0))
        for slope in (omega_slope, decay_slope, amplitude_slope)
    )
    amplitude = np.exp(value[:, 0])
    return RingDown(
        time=decay.start + share * span,
        amplitude=amplitude,
        amplitude_deviation=amplitude * relative,
        displacement=amplitude / undamped**power,
        frequency=undamped / (2 * np.pi),
        frequency_deviation=omega_deviation / (2 * np.pi),
        damping_ratio=decay_rate / undamped,
        damping_deviation=decay_deviation / undamped,
        start=decay.start,
        end=decay.start + span,
        noise_floor=decay.floor,
        residual=float(np.sqrt((fit.residual**2).mean() / (decay.values**2).mean())),
        suspicions=decay.suspicions,
    )
