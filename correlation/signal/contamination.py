"""Contamination of a steady state: noise power near a line, foreign tones, clipping."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from correlation.signal.record import Channels, Samples

#: Lines of the spectrum next to a harmonic for the estimate of noise; the nearest ones are removed by the fit [-].
NEAREST, FARTHEST = 3, 15
#: A foreign tone is reported above this fraction of a channel's amplitude [-].
LEAST_TONE = 0.01
#: Number of lines on either side over which Hann's window spreads a tone, and largest error of a fundamental in
#: standard deviations [-].
LEAKING, SURE = 2.0, 3.0
#: In white noise, the largest of n lines exceeds the mean by a factor of ln n + 7 in 1 of 1000 records.
BEYOND_CHANCE = 7.0
#: Ratio of the number of samples at a crest to that at the next value below it: at most 2.4 for a sine, see `_clipped`.
CREST = 6.0
#: Least number of samples of a flat crest, and their least fraction of the record [-].
FEWEST_FLAT, LEAST_FLAT = 8, 2e-3


def estimate_noise_power(
    time: Samples, residual: Channels, frequency: float, n_harmonic: int
) -> Float[NDArray[np.float64], "c harmonic"]:
    """Mean square of white noise with the residual's power density near each harmonic, shape (c, H + 1).

    For a harmonic with too few lines around it, it is the mean square of the whole residual.
    """
    n, span = residual.shape[1], float(time[-1] - time[0])
    mean_square = (residual**2).mean(axis=1)
    power = np.repeat(mean_square[:, None], n_harmonic + 1, axis=1)
    per_line = frequency * span  # lines of the spectrum between two harmonics
    reach = min(FARTHEST, int(per_line / 2))
    if reach < NEAREST + 3:
        return power
    window = np.hanning(n)
    spectrum = np.abs(np.fft.rfft(residual * window, axis=1)) ** 2 / (window**2).sum()
    for k in range(n_harmonic + 1):
        line = round(k * per_line)
        beside = np.arange(line - reach, line + reach + 1)
        chosen = beside[(np.abs(beside - line) >= NEAREST) & (beside > 0) & (beside < spectrum.shape[1])]
        if len(chosen) >= 6:
            power[:, k] = spectrum[:, chosen].mean(axis=1)
    return power


def find_contamination(
    time: Samples,
    channels: Channels,
    residual: Channels,
    frequency: tuple[float, float],
    n_harmonic: int,
    names: Sequence[str],
) -> list[str]:
    """Messages on foreign tones and flat crests of each channel, with their evidence.

    Parameters
    ----------
    time, channels, residual
        Instants, shape (n,) [s], signals, and their residuals of the fitted harmonics, shape (c, n).
    frequency
        Fundamental, and its standard deviation [Hz].
    n_harmonic
        Highest fitted harmonic; higher ones, which friction also causes, are not foreign.
    names
        Names of the channels.
    """
    result = []
    harmonics = _find_higher_harmonics(time, *frequency, n_harmonic)
    for name, values, left in zip(names, channels, residual, strict=True):
        amplitude = np.sqrt(2) * values.std()
        if not amplitude > 0:
            continue
        tone = _find_tone(time, left, harmonics)
        if tone is not None and tone[1] > LEAST_TONE * amplitude:
            ratio = tone[0] / frequency[0]
            kind = "a subharmonic or combination tone" if abs(2 * ratio - round(2 * ratio)) < 0.02 else "hum or a beat"
            result.append(
                f"{name}: the residual of the harmonics has a tone at {tone[0]:.5g} Hz ({ratio:.4g} times the "
                f"frequency) of {tone[1] / amplitude:.2g} of the amplitude: {kind}"
            )
        for side, sign in (("upper", 1.0), ("lower", -1.0)):
            flat = _clipped(sign * values)
            if flat:
                result.append(
                    f"{name}: {flat} samples, {flat / len(values):.2g} of all, are at the {side} end "
                    f"{sign * (sign * values).max():.6g} exactly: "
                    "the signal is clipped, and its amplitude is a lower bound"
                )
    return result


def _find_higher_harmonics(
    time: Samples, frequency: float, deviation: float, n_harmonic: int
) -> Bool[NDArray[np.bool_], " l"]:
    """Mask of spectral lines that may belong to harmonics that were not fitted, shape (n // 2 + 1,).

    Lines are 1/T apart, and the frequency error of a harmonic is that of the fundamental times its order.
    """
    n = len(time)
    line = np.fft.rfftfreq(n, float(time[-1] - time[0]) / (n - 1))
    order = np.round(line / frequency)
    apart = np.abs(line - order * frequency)
    return np.asarray((order > n_harmonic) & (apart <= LEAKING * line[1] + SURE * order * deviation))


def _find_tone(time: Samples, residual: Samples, left_out: Bool[NDArray[np.bool_], " l"]) -> tuple[float, float] | None:
    """Frequency [Hz] and amplitude of the largest tone of a residual, if significant.

    Lines in `left_out`, of higher harmonics, do not count.
    """
    n = len(residual)
    window = np.hanning(n)
    spectrum = np.abs(np.fft.rfft(residual * window))
    power = np.where(left_out, 0.0, spectrum**2)
    top = int(np.argmax(power))
    # Hann's window spreads a tone over its neighbouring lines: the mean without these is that of the noise.
    noise = ~left_out
    noise[max(top - 2, 0) : top + 3] = False
    others = power[noise]
    if not len(others) or power[top] <= others.mean() * (np.log(n) + BEYOND_CHANCE) or top == 0:
        return None
    line = np.fft.rfftfreq(n, float(time[-1] - time[0]) / (n - 1))
    return float(line[top]), float(2 * spectrum[top] / window.sum())


def _clipped(values: Samples) -> int:
    """Number of samples at the largest value, if a smooth crest would have fewer; else 0.

    A sine of amplitude A is within one step q of a converter of its crest during sqrt(2 q / A) / pi of the time, and
    within the next step during (sqrt 2 - 1) of that: counts of two neighbouring values differ by a factor of up to 2.4.
    """
    value, count = np.unique(values, return_counts=True)
    if len(value) < 4 or count[-1] < max(FEWEST_FLAT, LEAST_FLAT * len(values)):
        return 0
    # A sine that is sampled synchronously reaches its largest value often, but never in consecutive samples.
    there = values == value[-1]
    in_a_row = bool((there[1:] & there[:-1]).any())
    return int(count[-1]) if in_a_row and count[-1] > CREST * count[-3:-1].max() else 0
