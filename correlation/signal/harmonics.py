r"""Harmonics of a steady state from its time history, by least squares.

.. math:: x(t) = \operatorname{Re} \sum_{k=0}^{H} (X_k + \tau D_k)\, e^{i k \Omega t}, \qquad -1 \le \tau \le 1

is fitted to all samples, with tau = 0 in the middle of the record. Least squares do not need a whole number of periods;
a discrete Fourier transform without one leaks. The drift D, the change per half of the record, shows whether the state
had settled; its common phase gives the frequency error. X is nearly independent of D, since tau is odd.

The standard deviation of a coefficient is that of noise with the power density of the residual near the line k Omega:
hum and other tones away from the line contribute only their part at the line.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.signal.contamination import estimate_noise_power, find_contamination
from correlation.signal.record import Channels, Samples, check_channels, check_time
from geometry.read_only_array import freeze_fields

Coefficients = Complex[NDArray[np.complex128], "c harmonic"]
Deviations = Float[NDArray[np.float64], "c harmonic"]
Shares = Float[NDArray[np.float64], " c"]

#: Least significant drift in standard deviations of its real part: exp(-z^2 / 2) = 0.1 % for a complex number.
SIGNIFICANT = 3.7
#: Rounds of the search for the frequency; each squares the error.
ROUNDS = 8
#: Least number of periods of a fit [-]: with fewer, mean, drift and first harmonic are indistinguishable.
FEWEST_PERIODS = 1.5


@dataclass(frozen=True, kw_only=True, eq=False)
class Harmonics:
    """Complex amplitudes of some channels, with suspicions about them.

    Parameters
    ----------
    frequency, frequency_deviation
        Omega / 2 pi and its standard deviation [Hz]; the deviation is 0 where the frequency was given.
    coefficients
        X_k, peak amplitudes of e^{i k Omega t}, shape (c, H + 1) [unit of the channels]. The origin of time is that of
        the record, or a zero phase of the reference.
    deviation
        Standard deviation of the real and of the imaginary part of each, shape (c, H + 1) [same unit].
    drift, drift_deviation
        Relative change of the largest harmonic over half of the part used, and its standard deviation, shape (c,) [-].
    residual
        Root mean square of the residual over that of the channel without its mean, shape (c,) [-].
    settled
        Whether no channel drifts significantly by more than the tolerance.
    start, end
        First and last instant of the part used [s].
    reference, reference_deviation
        The same for the reference channel, whose first harmonic is real and positive, shape (H + 1,); None without one.
    suspicions
        Messages on drifts, clipping and foreign tones, with their evidence.
    """

    frequency: float
    frequency_deviation: float
    coefficients: Coefficients
    deviation: Deviations
    drift: Shares
    drift_deviation: Shares
    residual: Shares
    settled: bool
    start: float
    end: float
    reference: Complex[NDArray[np.complex128], " harmonic"] | None = None
    reference_deviation: Float[NDArray[np.float64], " harmonic"] | None = None
    suspicions: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze_fields(self, "coefficients", kind=np.complex128)
        freeze_fields(self, "deviation", "drift", "drift_deviation", "residual")
        if self.reference is not None:
            freeze_fields(self, "reference", kind=np.complex128)
            freeze_fields(self, "reference_deviation")


def fit_harmonics(
    time: Any,
    values: Any,
    frequency: float | None,
    n_harmonic: int,
    *,
    refine: bool | None = None,
    tolerance: float = 0.01,
) -> Harmonics:
    """Harmonics 0 to H of channels over a whole record.

    Parameters
    ----------
    time
        Instants, ascending, evenly spaced or not, shape (n,) [s].
    values
        Signals, shape (n,) or (c, n) [any unit].
    frequency
        Omega / 2 pi [Hz]; None to estimate it from the record.
    n_harmonic
        H, the highest harmonic [-].
    refine
        Whether the frequency is corrected by the drift of the phases; by default only if none is given.
    tolerance
        Relative drift over half of the record that still counts as settled [-].

    Returns
    -------
    Coefficients with deviations, drift and suspicions.

    Raises
    ------
    CampaignError
        Samples that are not finite, fewer than one and a half periods, too few samples per period for the highest
        harmonic, or no significant frequency.
    """
    channels = check_channels(values)
    instants = check_time(time, channels.shape[1])
    _check_frequency(frequency)
    start = find_frequency(instants, channels) if frequency is None else float(frequency)
    fit = fit_drifting(instants, channels, start, n_harmonic)
    if frequency is None or refine:
        fit = refine_frequency(instants, channels, fit, n_harmonic)
    # The phase at the record's zero of time is extrapolated from the middle with this frequency; the error of a phase
    # has one direction, and counts half in real and imaginary part each.
    turned = np.pi * fit.frequency_deviation * (instants[0] + instants[-1]) / np.sqrt(2) * np.arange(n_harmonic + 1)
    deviation = np.hypot(fit.deviation, turned * np.abs(fit.constant))
    return replace(fit.describe(instants, channels, tolerance), deviation=deviation)


@dataclass(frozen=True, kw_only=True, eq=False)
class DriftingFit:
    """X and D of all channels at one frequency, with the power of the noise near each line.

    Parameters
    ----------
    frequency, frequency_deviation
        Frequency and its standard deviation [Hz].
    constant, drift
        X and D, shape (c, H + 1).
    residual
        Residual, shape (c, n).
    deviation
        Standard deviation of the real or imaginary part of X, shape (c, H + 1); that of D is sqrt(3) times as large.
    """

    frequency: float
    frequency_deviation: float
    constant: Coefficients
    drift: Coefficients
    residual: Channels
    deviation: Deviations

    def describe(
        self, time: Samples, channels: Channels, tolerance: float, names: Sequence[str] | None = None
    ) -> Harmonics:
        """The result, with messages on drift, clipping and foreign tones that begin with the name of the channel."""
        rows = np.arange(len(channels))
        names = [f"channel {row}" for row in rows] if names is None else names
        largest = 1 + np.argmax(np.abs(self.constant[:, 1:]), axis=1)
        size = np.abs(self.constant[rows, largest])
        size = np.where(size > 0, size, np.inf)
        drift, noise = np.abs(self.drift[rows, largest]), np.sqrt(3) * self.deviation[rows, largest]
        unsettled = (drift > tolerance * size) & (drift > SIGNIFICANT * noise)
        relative = self.drift[rows, largest] / np.where(size > 0, self.constant[rows, largest], 1)
        suspicions = [
            f"{names[row]}: harmonic {largest[row]} changes by {relative[row].real:+.2g} of its amplitude and "
            f"{relative[row].imag:+.2g} rad over half of the record ({drift[row] / noise[row]:.3g} standard "
            "deviations): it has not settled, or its frequency is wrong"
            for row in np.flatnonzero(unsettled).tolist()
        ]
        moved = channels - channels.mean(axis=1, keepdims=True)
        rms = np.sqrt((moved**2).mean(axis=1))
        left = np.sqrt((self.residual**2).mean(axis=1)) / np.where(rms > 0, rms, 1)
        suspicions += find_contamination(
            time, channels, self.residual, (self.frequency, self.frequency_deviation), self.constant.shape[1] - 1, names
        )
        return Harmonics(
            frequency=self.frequency,
            frequency_deviation=self.frequency_deviation,
            coefficients=self.constant,
            deviation=self.deviation,
            drift=drift / size,
            drift_deviation=noise / size,
            residual=left,
            settled=not unsettled.any(),
            start=float(time[0]),
            end=float(time[-1]),
            suspicions=tuple(suspicions),
        )


def fit_drifting(time: Samples, channels: Channels, frequency: float, n_harmonic: int) -> DriftingFit:
    """Least squares of X and D at a given frequency.

    Raises
    ------
    CampaignError
        The record is too short or sampled too coarsely for these harmonics.
    """
    if n_harmonic < 1:
        raise CampaignError(f"n_harmonic is {n_harmonic}: ask for at least the first harmonic")
    span, n = float(time[-1] - time[0]), len(time)
    if span * frequency < FEWEST_PERIODS:
        raise CampaignError(
            f"the record of {span:.4g} s holds {span * frequency:.3g} periods of {frequency:.6g} Hz: "
            f"{FEWEST_PERIODS} or more are needed"
        )
    if (n - 1) / span <= 2 * n_harmonic * frequency or n < 4 * n_harmonic + 2:
        raise CampaignError(
            f"{(n - 1) / span / frequency:.3g} samples per period of {frequency:.6g} Hz do not resolve harmonic "
            f"{n_harmonic}: ask for fewer harmonics, or sample faster"
        )
    middle = (time[0] + time[-1]) / 2
    phase = 2 * np.pi * frequency * (time - middle)
    order = np.arange(1, n_harmonic + 1)
    waves = np.hstack([np.ones((n, 1)), np.cos(np.outer(phase, order)), np.sin(np.outer(phase, order))])
    columns = np.hstack([waves, waves * (2 * (time - middle) / span)[:, None]])
    result = np.linalg.lstsq(columns, channels.T, rcond=None)[0]
    residual = channels - (columns @ result).T
    constant, drift = (_make_complex(part, n_harmonic) for part in np.split(result, 2))
    # Phases count from the record's own zero of time.
    turn = np.exp(-2j * np.pi * frequency * middle * np.arange(n_harmonic + 1))
    power = estimate_noise_power(time, residual, frequency, n_harmonic) * n / max(n - columns.shape[1], 1)
    share = np.where(np.arange(n_harmonic + 1) == 0, 1.0, 2.0)
    return DriftingFit(
        frequency=frequency,
        frequency_deviation=0.0,
        constant=constant * turn,
        drift=drift * turn,
        residual=residual,
        deviation=np.sqrt(share * power / n),
    )


def refine_frequency(time: Samples, channels: Channels, fit: DriftingFit, n_harmonic: int) -> DriftingFit:
    """The fit at the frequency at which the phases do not drift, by the Gauss-Newton method.

    A frequency that is too low by dOmega causes D_k = i k dOmega (span / 2) X_k in every harmonic of every channel.
    """
    half = float(time[-1] - time[0]) / 2
    order = np.arange(n_harmonic + 1)
    for _ in range(ROUNDS):
        turning = 1j * order * half * fit.constant
        weight = 1 / np.where(fit.deviation > 0, np.sqrt(3) * fit.deviation, np.inf) ** 2
        if not weight.any():  # an exact signal: all channels count by their size
            weight = np.ones_like(fit.deviation)
        norm = (weight * np.abs(turning) ** 2).sum()
        if not norm > 0:
            break
        step = float((weight * (np.conj(turning) * fit.drift).real).sum() / norm) / (2 * np.pi)
        step = float(np.clip(step, -0.25 / half, 0.25 / half))
        fit = fit_drifting(time, channels, fit.frequency + step, n_harmonic)
        fit = replace(fit, frequency_deviation=float(1 / (2 * np.pi * np.sqrt(norm))))
        if abs(step) < 1e-3 * fit.frequency_deviation or abs(step) * half < 1e-13:
            break
    return fit


def find_frequency(time: Samples, channels: Channels) -> float:
    """Fundamental frequency of a record [Hz], to a fraction of a line of its spectrum.

    It is that of the largest peak, or a half or a third of it if there is a clear line.

    Raises
    ------
    CampaignError
        There is no significant line in the spectrum.
    """
    n, span = len(time), float(time[-1] - time[0])
    even = np.linspace(time[0], time[-1], n)
    moved = np.array([np.interp(even, time, row) for row in channels])
    moved -= moved.mean(axis=1, keepdims=True)
    size = np.sqrt((moved**2).mean(axis=1, keepdims=True))
    if not size.any():
        raise CampaignError("all channels are constant: there is no frequency in the record")
    spectrum = np.abs(np.fft.rfft(moved / np.where(size > 0, size, 1) * np.hanning(n), 4 * n, axis=1)) ** 2
    power = spectrum.sum(axis=0)
    line = np.fft.rfftfreq(4 * n, span / (n - 1))
    power[line < FEWEST_PERIODS / span] = 0.0
    top = int(np.argmax(power))
    if power[top] < 30 * np.median(power):
        raise CampaignError("the record has no dominant frequency: name it")
    for divisor in (3, 2):
        near = np.abs(line - line[top] / divisor) < 1.0 / span
        beside = np.abs(line - line[top] / divisor) < 8.0 / span
        if near.any() and line[top] / divisor > 4 / span:
            floor = np.median(power[beside])
            if power[near].max() > max(100 * floor, 1e-4 * power[top]):
                return float(line[near][np.argmax(power[near])])
    return float(line[top])


def _check_frequency(frequency: float | None) -> None:
    if frequency is not None and not (np.isfinite(frequency) and frequency > 0):
        raise CampaignError(f"the frequency is {frequency}: give a positive number of Hz, or none")


def _make_complex(parts: Float[NDArray[np.float64], "p c"], n_harmonic: int) -> Coefficients:
    """X_k = a_k - i b_k of cosines and sines, shape (c, H + 1)."""
    mean, cosine, sine = parts[:1], parts[1 : n_harmonic + 1], parts[n_harmonic + 1 :]
    return np.asarray(np.vstack([mean, cosine - 1j * sine]).T, dtype=np.complex128)
