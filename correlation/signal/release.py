"""Where a free decay begins and ends in a record, which modes are in it, and first guesses of them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.signal.logarithmic_spline import ModeStart

Vector = Float[NDArray[np.float64], " n"]

#: The decay begins at the last point whose size is at least this share of the largest [-].
AT_RELEASE = 0.97
#: A mode ends where its amplitude is so many standard deviations of noise, averaged over so many periods.
ABOVE_NOISE, AVERAGED = 4.0, 5.0
#: A line of a spectrum is no chance of noise if its power is so many times the median.
STANDS_OUT = 60.0
#: A tone of a residual is a mode only above this share of the largest amplitude of the decay [-].
LEAST_MODE = 0.01
#: Samples of a fit: more would be slower and change nothing.
MOST_SAMPLES = 30000
#: Modes nearer than this share of their frequency to a harmonic of another are taken for it [-].
HARMONIC = 0.03


@dataclass(frozen=True, kw_only=True, eq=False)
class Decay:
    """Part of a record in which modes decay freely.

    Parameters
    ----------
    start
        Its first instant [s].
    step
        Time between samples [s].
    values
        Shape (n,).
    frequencies
        Of its modes, roughly [Hz].
    floor
        Amplitude of a mode that cannot be told from noise.
    suspicions
        What speaks against it, in words.
    """

    start: float
    step: float
    values: Vector
    frequencies: tuple[float, ...]
    floor: float
    suspicions: tuple[str, ...] = ()

    def with_frequency(self, frequency: float) -> "Decay":
        """The same with one more mode."""
        return replace(self, frequencies=(*self.frequencies, frequency))

    def envelope(self, number: int) -> Complex[NDArray[np.complex128], " n"]:
        """Analytic signal of one mode, from the lines of the spectrum that are nearer to it than to any other."""
        n = len(self.values)
        own = self.frequencies[number]
        line = np.fft.fftfreq(2 * n, self.step)
        others = [abs(other - own) / 2 for position, other in enumerate(self.frequencies) if position != number]
        reach = min([0.45 * own, *others])
        spectrum = np.fft.fft(self.values - self.values.mean(), 2 * n)
        spectrum[np.abs(line - own) > reach] = 0
        return np.asarray(2 * np.fft.ifft(spectrum)[:n])

    def n_sample(self, number: int) -> int:
        """Samples before a mode has sunk into the noise [-]."""
        smooth = self._smooth(number)
        below = np.flatnonzero(smooth < self.floor)
        fewest = min(len(smooth), max(int(6 / self.frequencies[number] / self.step), 24))
        return max(int(below[0]) if len(below) else len(smooth), fewest)

    def duration(self, number: int) -> float:
        """From the start to where a mode has sunk into the noise [s]."""
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
    """The decay of a record, with its dominant mode or the modes that are given.

    Raises
    ------
    CampaignError
        No decay, or nothing that oscillates.
    """
    quiet = float(np.median(values[-max(len(values) // 10, 8) :]))
    size = np.abs(values - quiet)
    if not size.max() > 0:
        raise CampaignError(f"the signal is {values[0]:.6g} throughout: there is no decay in it")
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
    power, line, noise = _spectrum(part, step)
    top = int(np.argmax(power))
    if power[top] < STANDS_OUT * np.median(power):
        raise CampaignError("nothing oscillates after the release: no line stands out of the spectrum")
    modes = tuple(float(item) for item in frequencies) if frequencies is not None else (float(line[top]),)
    if start is None:
        skip = min(round(0.5 / min(modes) / step), len(part) - 32)
        first, part = first + skip, part[skip:]
    stride = max(1, min(len(part) // MOST_SAMPLES, int(1 / (12 * max(modes) * step))))
    averaged = AVERAGED / min(modes) / (step * stride)
    floor = ABOVE_NOISE * noise * np.sqrt(2 / averaged)
    decay = Decay(start=float(time[first]), step=step * stride, values=part[::stride], frequencies=modes, floor=floor)
    longest = max(decay.n_sample(number) for number in range(len(modes)))
    return replace(decay, values=decay.values[:longest])


def first_guess(decay: Decay, count: int, harmonics: tuple[int, ...]) -> list[ModeStart]:
    """First guesses of all modes, with so many spline intervals.

    A harmonic that another mode stands on, or that the samples do not resolve, is left out.
    """
    modes = []
    for number, own in enumerate(decay.frequencies):
        envelope = decay.envelope(number)
        size = np.maximum(np.abs(envelope), 1e-3 * decay.floor + 1e-300)
        n_sample = decay.n_sample(number)
        orders = tuple(
            order
            for order in harmonics
            if order * own * decay.step < 0.4
            and all(abs(order * own / other - 1) > HARMONIC for other in decay.frequencies)
        )
        # Few periods bear few intervals.
        most = max(int(n_sample * decay.step * own / 2), 1)
        modes.append(
            ModeStart(
                logarithm=np.log(size) + 1j * np.unwrap(np.angle(envelope)),
                n_sample=n_sample,
                breaks=np.linspace(0, 1, min(count, most) + 1),
                harmonics=orders,
            )
        )
    return modes


def new_tone(decay: Decay, residual: Vector) -> float | None:
    """Frequency of the largest line that a fit has left, if it is neither noise nor a harmonic [Hz]."""
    power, line, _ = _spectrum(residual, decay.step)
    whole, _, _ = _spectrum(decay.values, decay.step)
    allowed = np.ones(len(line), dtype=bool)
    for own in decay.frequencies:
        allowed &= np.abs(line - own) > 2 / (len(residual) * decay.step)
    power = np.where(allowed, power, 0.0)
    top = int(np.argmax(power))
    if power[top] < STANDS_OUT * np.median(power) or power[top] < LEAST_MODE**2 * whole.max():
        return None
    return float(line[top])


def _spectrum(values: Vector, step: float) -> tuple[Vector, Vector, float]:
    """Power of the lines under a falling window, their frequencies [Hz], and the standard deviation of white noise."""
    n = len(values)
    window = np.cos(np.pi / 2 * np.arange(n) / n) ** 2
    spectrum = np.abs(np.fft.rfft((values - values.mean()) * window)) ** 2
    spectrum[:2] = 0.0
    # The median of chi-squared with two degrees of freedom is 2 ln 2.
    noise = np.sqrt(np.median(spectrum[2:]) / np.log(2) / (window**2).sum())
    return np.asarray(spectrum, dtype=np.float64), np.asarray(np.fft.rfftfreq(n, step), dtype=np.float64), float(noise)
