r"""Frequency and damping against amplitude from a free decay, mode by mode.

A mode that decays slowly is :math:`x(t) = A(t) \cos \varphi(t)` with harmonics. Its frequency is that of the phase. Its
damping follows from the action :math:`J \propto \omega A^2` rather than from the amplitude: if the frequency depends on
the amplitude, A changes with it even without any dissipation, but the action does not (an adiabatic invariant). So

.. math:: \zeta \omega = -\tfrac{1}{2} \frac{\mathrm{d}}{\mathrm{d}t} \ln (\omega A^2)

with A the first harmonic of the displacement. This is the damping ratio of harmonic balance for the steady state with
the same amplitude at phase resonance, to first order in damping and in the change of frequency per period. Conversion
of an acceleration to a displacement by :math:`\omega^2` changes the decay rate as well.

The first half period after a release is left out: there friction follows its virgin curve rather than its loop.

References
----------
Landau and Lifshitz, Mechanics, 3rd ed. (1976), section 49.
Londoño, Neild and Cooper, Identification of backbone curves of nonlinear systems from resonance decay responses,
J. Sound Vib. 348 (2015) 224.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import floor, log10
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.model import DERIVATIVE
from correlation.signal.decay_fit import fit_modes
from correlation.signal.decay_misfit import find_fault, measure_misfit
from correlation.signal.free_decay import Decay, find_decay
from correlation.signal.record import check_channels, check_time, compute_uniform_step
from correlation.signal.slow_flow import SlowFlowFit
from geometry.read_only_array import freeze_fields

Values = Float[NDArray[np.float64], " k"]

#: Ratio of the amplitude of a mode that does not fit to the largest one that fits, up to which the mode is left out
#: instead of starting the decay later [-].
WEAK = 0.1
#: Number of points of a result.
N_POINT = 60
#: If modes are not functions of their own amplitudes, the decay is started later by these numbers of periods of its
#: lowest mode; largest fraction of the decay that is left out in this way [-].
LATER, MOST_LEFT_OUT = (2.0, 8.0, 32.0), 0.5


@dataclass(frozen=True, kw_only=True, eq=False)
class RingDown:
    """A mode during its free decay, at k instants with decreasing amplitude.

    Parameters
    ----------
    time
        Instants, shape (k,) [s].
    amplitude, amplitude_deviation
        Peak amplitude of the first harmonic of the signal, shape (k,) [unit of the signal].
    displacement
        The same for the displacement, shape (k,) [unit of the signal times s or s^2].
    frequency, frequency_deviation
        Undamped natural frequency, shape (k,) [Hz].
    damping_ratio, damping_deviation
        Damping ratio, shape (k,) [-].
    start, end
        First and last instant used [s].
    noise_floor
        Amplitude below which a mode is indistinguishable from noise [unit of the signal].
    residual
        Root mean square of the residual of all modes over that of the signal [-].
    remarks
        Messages on the evaluation of the record.
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
    remarks: tuple[str, ...] = ()

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
        Part of the record to be used [s]; by default from half a period after the release, or later if modes are not
        functions of their own amplitudes before, until the modes vanish in the noise.
    frequencies
        Approximate frequencies of the modes to be fitted [Hz]; by default those of clear spectral lines.

    Returns
    -------
    The modes, by rising frequency.

    Raises
    ------
    CampaignError
        A clock that is not uniform, an unknown quantity, no decay in the record, or no mode that fits it.
    """
    cut = partial(cut_decay, time, values, quantity=quantity, end=end, frequencies=frequencies)
    decay = cut(start=start)
    best = first = _read_modes(decay, frequencies is None, DERIVATIVE[quantity])
    later = None
    lowest = min((float(mode.frequency[-1]) for mode in first.modes), default=decay.frequencies[0])
    for periods in LATER if start is None else ():
        skip = periods / lowest
        if not best.disturbed or skip > MOST_LEFT_OUT * len(decay.values) * decay.step:
            break
        # Rounded to the digits of the remark, so that this start in the manifest gives the same result.
        at = round(decay.start + skip, 2 - floor(log10(skip)))
        try:
            rest = cut(start=at)
        except CampaignError:  # the rest is too short to identify its modes
            break
        trial = _read_modes(rest, frequencies is None, DERIVATIVE[quantity])
        if not trial.disturbed or len(trial.modes) > len(best.modes):
            best, later = trial, at
    if not best.modes:
        raise CampaignError(
            f"no mode of this decay can be read from {best.decay.start:.4g} s on: {best.faults[0]}; give the start of "
            "a part in which modes decay freely, or their frequencies"
        )
    remarks = [f"{fault}, and is left out" for fault in best.faults]
    if later is not None:
        remarks.append(
            f"the decay is read from {best.decay.start:.4g} s on: before that it is not a "
            "free decay of modes: the drive may still be on, or several modes may slip at once; "
            f'start = "{later:.10g} s" in the manifest keeps this choice'
        )
    modes = [replace(mode, remarks=tuple(remarks)) for mode in best.modes]
    return tuple(sorted(modes, key=lambda mode: float(mode.frequency[-1])))


class _Reading(NamedTuple):
    """Modes that fit the record, messages on the others, and whether one of these is not weak."""

    decay: Decay
    modes: list[RingDown]
    faults: list[str]
    disturbed: bool


def _read_modes(decay: Decay, adds: bool, power: int) -> _Reading:
    """All modes of the decay from a given start."""
    fit, decay = fit_modes(decay, adds)
    modes, faults, at_fault = [], [], []
    fitted = [_describe(decay, fit, number, power) for number in range(len(decay.frequencies))]
    for number, mode in enumerate(fitted):
        misfit = measure_misfit(decay, fit, number)
        fault = find_fault(misfit, mode.frequency, mode.damping_ratio, mode.damping_deviation)
        fault = fault or _describe_duplicate(mode, fitted)
        if fault:
            faults.append(f"a mode at {decay.frequencies[number]:.4g} Hz {fault}")
            at_fault.append(mode.amplitude[0])
            continue
        passed = mode.time - decay.start
        modes.append(
            replace(
                mode,
                frequency_deviation=mode.frequency * misfit.widen(passed, mode.frequency_deviation / mode.frequency),
                damping_deviation=misfit.widen(passed, mode.damping_deviation),
            )
        )
    largest = max((mode.amplitude[0] for mode in modes), default=0.0)
    return _Reading(decay, modes, faults, disturbed=max(at_fault, default=0.0) > WEAK * largest)


def _describe_duplicate(mode: RingDown, fitted: Sequence[RingDown]) -> str:
    """Reason why a mode duplicates another one, in words; empty if it does not.

    Modes whose frequencies differ by less than they decay cancel each other at any size.
    """
    own = float(np.median(mode.frequency))
    for other in fitted:
        near = float(np.median(other.frequency))
        rate = float(np.median(mode.frequency * mode.damping_ratio) + np.median(other.frequency * other.damping_ratio))
        if other is not mode and abs(own - near) < rate / 2 and other.amplitude[0] > WEAK * mode.amplitude[0]:
            return f"cannot be separated from one at {near:.4g} Hz"
    return ""


def cut_decay(
    time: Any,
    values: Any,
    *,
    quantity: str = "displacement",
    start: float | None = None,
    end: float | None = None,
    frequencies: Sequence[float] | None = None,
) -> Decay:
    """Cut out the decay that `analyse_ring_down` fits, with its checks; it is much faster than the fit."""
    if quantity not in DERIVATIVE:
        raise CampaignError(f'"{quantity}" is not a quantity of a ring-down: give {", ".join(DERIVATIVE)}')
    channel = check_channels(values)
    if len(channel) != 1:
        raise CampaignError(f"values have shape {np.shape(values)}: give the samples of one channel, shape (n,)")
    instants = check_time(time, channel.shape[1], fewest=32)
    return find_decay(instants, channel[0], compute_uniform_step(instants), start, end, frequencies)


def _describe(decay: Decay, fit: SlowFlowFit, number: int, power: int) -> RingDown:
    """Frequency and damping of one mode with their standard deviations, from its flow."""
    flow, covariance = fit.flows[number], fit.covariance[number]
    time, logarithm, _ = flow.path(flow.coefficients)
    span = decay.duration(number)
    last = float(np.interp(span, time, logarithm))
    at = np.linspace(logarithm[0], last, N_POINT)
    count = (len(flow.coefficients) - 2) // 2
    values, slopes = flow.basis(at), flow.basis(at, derivative=1)
    rate = np.exp(values @ flow.coefficients[2 : 2 + count])
    omega, bend = values @ flow.coefficients[2 + count :], slopes @ flow.coefficients[2 + count :]
    # Decay of the action of the displacement, (1/2) d ln(omega A^2): A is that of the signal, omega^power times as
    # large.
    excess = 0.5 - power
    factor = 1 + excess * bend / omega
    decay_rate = rate * factor
    undamped = np.hypot(omega, decay_rate)
    by_omega = np.hstack([np.zeros((N_POINT, 2 + count)), values])
    by_bend = excess * (slopes / omega[:, None] - values * (bend / omega**2)[:, None])
    by_rate = np.hstack([np.zeros((N_POINT, 2)), values * decay_rate[:, None], by_bend * rate[:, None]])
    by_start = np.zeros((N_POINT, len(flow.coefficients)))
    by_start[:, 0] = 1.0
    omega_deviation, decay_deviation, relative = (
        np.sqrt(np.maximum(np.einsum("ki,ij,kj->k", slope, covariance, slope), 0.0))
        for slope in (by_omega, by_rate, by_start)
    )
    # Within half a period, the loop of a decay differs from that of a steady state: the change of the damping in this
    # time is added to its standard deviation.
    passing = np.abs(np.gradient(decay_rate, at)) * rate * np.pi / omega
    amplitude = np.exp(at)
    return RingDown(
        time=decay.start + np.interp(-at, -logarithm, time),
        amplitude=amplitude,
        amplitude_deviation=amplitude * relative,
        displacement=amplitude / undamped**power,
        frequency=undamped / (2 * np.pi),
        frequency_deviation=omega_deviation / (2 * np.pi),
        damping_ratio=decay_rate / undamped,
        damping_deviation=np.hypot(decay_deviation, passing) / undamped,
        start=decay.start,
        end=decay.start + span,
        noise_floor=decay.floor,
        residual=float(np.sqrt((fit.residual**2).mean() / (decay.values**2).mean())),
    )
