"""Free decay of a record: start and end, modes, and their initial guesses."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.signal.slow_flow import SlowFlow

Vector = Float[NDArray[np.float64], " n"]

#: The decay begins at the last point whose size is at least this fraction of the largest [-].
AT_RELEASE = 0.97
#: Amplitude in standard deviations of noise, averaged over this number of periods, at which a mode ends.
ABOVE_NOISE, AVERAGED = 4.0, 5.0
#: Least power of a significant spectral line over the median.
STANDS_OUT = 60.0
#: Least amplitude of a further mode over the largest amplitude of the decay [-].
LEAST_MODE = 0.01
#: Largest number of samples of a fit, unless a period would have fewer than this number; more samples change little.
MOST_SAMPLES, FEWEST_PER_PERIOD = 6000, 16
#: Highest frequency of a harmonic or of a further mode [cycles per sample]: 0.8 times the Nyquist frequency.
RESOLVED = 0.4
#: Low-pass filter for decimation: a Kaiser window with this number of remaining samples on either side, half a period
#: of the highest mode, falls by 54 dB between 0.8 and 1.2 times the new Nyquist frequency [-].
KAISER, REACH = 5.0, 8
#: Zero padding of a spectrum: density of lines over the resolution of the record [-].
PADDED = 4
#: Periods of one estimate from the envelope, and bending stiffness of initial guesses [-].
READING, BENDING = 2.0, 0.02
#: Least range of the logarithm of an amplitude for splines: with a single estimate a mode has none [-].
LEAST_RANGE = 0.1
#: A line at a harmonic may be a separate mode if its amplitude exceeds this fraction of the largest line, and its power
#: exceeds that at the ends of the harmonic's lines by this factor [-].
STRONG, PEAK = 0.05, 2.0
#: Modes closer than this fraction of their frequency to a harmonic of another are taken for the harmonic [-].
HARMONIC = 0.03


@dataclass(frozen=True, kw_only=True, eq=False)
class Decay:
    """Part of a record in which modes decay freely.

    Parameters
    ----------
    start
        First instant [s].
    step
        Time between samples [s].
    values
        Samples, shape (n,).
    frequencies
        Approximate frequencies of the modes [Hz].
    floor
        Amplitude below which a mode is indistinguishable from noise.
    """

    start: float
    step: float
    values: Vector
    frequencies: tuple[float, ...]
    floor: float

    def with_frequency(self, frequency: float) -> "Decay":
        """The same with one more mode."""
        return replace(self, frequencies=(*self.frequencies, frequency))

    def envelope(self, number: int) -> Complex[NDArray[np.complex128], " n"]:
        """Analytic signal of one mode, from the spectral lines that are nearest to it."""
        n = len(self.values)
        own = self.frequencies[number]
        line = np.fft.fftfreq(2 * n, self.step)
        others = [abs(other - own) / 2 for position, other in enumerate(self.frequencies) if position != number]
        reach = min([0.45 * own, *others])
        spectrum = np.fft.fft(self.values - self.values.mean(), 2 * n)
        spectrum[np.abs(line - own) > reach] = 0
        return np.asarray(2 * np.fft.ifft(spectrum)[:n])

    def n_sample(self, number: int) -> int:
        """Number of samples until a mode has decayed to the noise [-]."""
        smooth = self._smooth(number)
        below = np.flatnonzero(smooth < self.floor)
        fewest = min(len(smooth), max(int(6 / self.frequencies[number] / self.step), 24))
        return max(int(below[0]) if len(below) else len(smooth), fewest)

    def duration(self, number: int) -> float:
        """Time from the start until a mode has decayed to the noise [s]."""
        return (self.n_sample(number) - 1) * self.step

    def _smooth(self, number: int) -> Vector:
        width = max(int(AVERAGED / self.frequencies[number] / self.step), 1)
        size = np.abs(self.envelope(number))
        padded = np.pad(size, (width // 2, width - 1 - width // 2), mode="edge")
        return np.convolve(padded, np.ones(width) / width, mode="valid")


def find_decay(
    time: Vector, values: Vector, step: float, start: float | None, end: float | None,
    frequencies: Sequence[float] | None,
) -> Decay:  # fmt: skip
    """The decay of a record, with its dominant mode or the given modes.

    Raises
    ------
    CampaignError
        No decay, or no oscillation.
    """
    quiet = float(np.median(values[-max(len(values) // 10, 8) :]))
    size = np.abs(values - quiet)
    if not size.max() > 0:
        raise CampaignError(f"the signal is {values[0]:.6g} throughout: it contains no decay")
    first = int(np.flatnonzero(size >= AT_RELEASE * size.max())[-1])
    if start is not None:
        first = int(np.searchsorted(time, start))
    last = len(time) if end is None else int(np.searchsorted(time, end, side="right"))
    if last - first < 32:
        raise CampaignError(
            f"{max(last - first, 0)} samples from {time[min(first, len(time) - 1)]:.6g} s on: a decay needs 32 or "
            "more; name its start and end"
        )
    part = values[first:last]
    power, line, noise = _compute_spectrum(part, step)
    top = int(np.argmax(power))
    if power[top] < STANDS_OUT * np.median(power):
        raise CampaignError("nothing oscillates after the release: the spectrum has no dominant line")
    modes = tuple(float(item) for item in frequencies) if frequencies is not None else (float(line[top]),)
    skip = 0 if start is not None else min(round(0.5 / min(modes) / step), len(part) - 32)
    n_left = len(part) - skip
    stride = max(1, min(-(-n_left // MOST_SAMPLES), int(1 / (FEWEST_PER_PERIOD * max(modes) * step))))
    # Samples before the given start may not belong to the decay: the low-pass filter does not use them.
    skip = skip if stride == 1 else max(skip, REACH * stride)
    floor = ABOVE_NOISE * noise * np.sqrt(2 * min(modes) * step / AVERAGED)
    decay = Decay(
        start=float(time[first + skip]), step=step * stride, values=_decimate(part, skip, stride), frequencies=modes,
        floor=floor,
    )  # fmt: skip
    longest = max(decay.n_sample(number) for number in range(len(modes)))
    resolved = 1 / (longest * decay.step)
    for one, other in pairwise(sorted(modes)):
        if other - one < resolved:
            raise CampaignError(
                f"modes at {one:.6g} and {other:.6g} Hz are closer than the {1 / resolved:.3g} s above the noise can "
                f"resolve, {resolved:.3g} Hz: name one of them"
            )
    return replace(decay, values=decay.values[:longest])


def _decimate(values: Vector, first: int, stride: int) -> Vector:
    """Decimate samples with an anti-aliasing filter, from a first one on.

    The filter is symmetric with a gain of 1 within 0.2 % below 0.8 times the new Nyquist frequency, so that it changes
    neither phase nor decay of a mode. Samples for which the filter exceeds the ends are left out.
    """
    if stride == 1:
        return values[first:]
    from scipy.signal import firwin, oaconvolve

    low_pass = firwin(2 * REACH * stride + 1, 1 / stride, window=("kaiser", KAISER))
    return np.asarray(oaconvolve(values, low_pass, mode="valid")[first - REACH * stride :: stride])


def guess_modes(decay: Decay, harmonics: tuple[int, ...], intervals: int) -> list[SlowFlow]:
    """Initial guesses of all modes from the envelopes: constants for no interval, else cubic splines.

    The first mode, the strongest, has harmonics; those that coincide with another mode, or that the samples do not
    resolve, are left out.
    """
    flows = []
    for number, own in enumerate(decay.frequencies):
        n_sample = decay.n_sample(number)
        orders = tuple(
            order
            for order in (harmonics if number == 0 else ())
            if order * own * decay.step < RESOLVED
            and all(abs(order * own / other - 1) > HARMONIC for other in decay.frequencies)
        )
        logarithm, rate, omega, phase = _read_envelope(decay, number, n_sample)
        flow = SlowFlow(
            breaks=np.linspace(
                min(logarithm.min(), logarithm.max() - LEAST_RANGE), logarithm.max(), max(intervals, 1) + 1
            ),
            degree=3 if intervals else 0,
            coefficients=np.zeros(0),
            n_sample=len(decay.values),
            harmonics=orders,
        )
        basis = flow.basis(logarithm)
        # A small penalty on bending determines coefficients that few estimates leave open.
        bend = BENDING * np.sqrt(len(basis)) * np.diff(np.eye(basis.shape[1]), min(2, basis.shape[1] - 1), axis=0)
        tied = np.vstack([basis, bend if basis.shape[1] > 1 else np.zeros((0, 1))])
        if not intervals:  # beats with other modes shift estimates of the envelope, but not the spectral line
            omega = np.full(len(omega), 2 * np.pi * own)
        parts = [
            np.linalg.lstsq(tied, np.concatenate([part, np.zeros(len(tied) - len(basis))]), rcond=None)[0]
            for part in (np.log(rate), omega)
        ]
        flows.append(replace(flow, coefficients=np.concatenate([[logarithm[0], phase], *parts])))
    return flows


def _read_envelope(decay: Decay, number: int, n_sample: int) -> tuple[Vector, Vector, Vector, float]:
    """Logarithms of the amplitude, decay rates and frequencies of an envelope, and the phase at the start.

    Each estimate is over two periods; there is one per period.
    """
    own = decay.frequencies[number]
    envelope = decay.envelope(number)[:n_sample]
    size, phase = np.log(np.maximum(np.abs(envelope), 1e-300)), np.unwrap(np.angle(envelope))
    width = min(max(round(READING / own / decay.step), 2), n_sample)
    hop = max(width // 2, 1)
    places = np.arange(0, max(n_sample - width, 1), hop)
    at = np.arange(width) - (width - 1) / 2
    norm = (at**2).sum() * decay.step
    rows = [(size[a : a + width], phase[a : a + width]) for a in places if a + width <= n_sample]
    logarithm = np.array([part.mean() for part, _ in rows])
    omega = np.array([(at * part).sum() / norm for _, part in rows])
    rate = np.array([-(at * part).sum() / norm for part, _ in rows])
    typical = max(float((logarithm[0] - logarithm[-1]) / max(len(rows) - 1, 1) / (hop * decay.step)), 1e-3 * own)
    half = (width - 1) / 2 * decay.step
    return logarithm, np.maximum(rate, 0.03 * typical), omega, float(rows[0][1].mean() - omega[0] * half)


def find_strong_harmonic(decay: Decay, harmonics: tuple[int, ...]) -> float | None:
    """Frequency of the largest line at a harmonic of a mode that may be a separate mode [Hz]; None without one."""
    power, line, _ = _compute_spectrum(decay.values, decay.step)
    result: list[tuple[float, float]] = []
    for own in decay.frequencies:
        for order in harmonics:
            near = np.flatnonzero(np.abs(line / (order * own) - 1) < HARMONIC)
            taken = any(abs(order * own / other - 1) < HARMONIC for other in decay.frequencies)
            if not len(near) or taken:
                continue
            top = near[np.argmax(power[near])]
            # The flank of a damped mode falls over these lines; a separate mode has a peak above both of their ends.
            if power[top] > max(PEAK * power[near[[0, -1]]].max(), STRONG**2 * power.max()):
                result.append((float(power[top]), float(line[top])))
    return max(result)[1] if result else None


def find_new_tone(decay: Decay, residual: Vector) -> float | None:
    """Frequency of the largest line of a residual [Hz]; None if it is noise or a harmonic."""
    power, line, _ = _compute_spectrum(residual, decay.step)
    whole, _, _ = _compute_spectrum(decay.values, decay.step)
    allowed = line * decay.step < RESOLVED
    for own in decay.frequencies:
        allowed &= np.abs(line - own) > 2 / (len(residual) * decay.step)
    power = np.where(allowed, power, 0.0)
    top = int(np.argmax(power))
    if power[top] < STANDS_OUT * np.median(power) or power[top] < LEAST_MODE**2 * whole.max():
        return None
    return float(line[top])


def estimate_noise(values: Vector, step: float) -> float:
    """Standard deviation of white noise in the presence of lines, from the median of the spectrum."""
    return _compute_spectrum(values, step)[2]


def _compute_spectrum(values: Vector, step: float) -> tuple[Vector, Vector, float]:
    """Power of the lines under a falling window, their frequencies [Hz], and the standard deviation of white noise."""
    n = len(values)
    window = np.cos(np.pi / 2 * np.arange(n) / n) ** 2
    spectrum = np.abs(np.fft.rfft((values - values.mean()) * window, PADDED * n)) ** 2
    spectrum[: 2 * PADDED] = 0.0
    # The median of chi-squared with two degrees of freedom is 2 ln 2.
    noise = np.sqrt(np.median(spectrum[2 * PADDED :]) / np.log(2) / (window**2).sum())
    return (
        np.asarray(spectrum, dtype=np.float64),
        np.asarray(np.fft.rfftfreq(PADDED * n, step), dtype=np.float64),
        float(noise),
    )
