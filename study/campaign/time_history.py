"""Kind of a time history, judged from its envelope and its spectrum."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.signal.record import check_time

Samples = Float[NDArray[np.float64], " n"]
#: Units of time in seconds.
SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0, "": 1.0}
#: Number of windows of the envelope.
WINDOWS = 20
#: Decay: ratio of its end to its largest window [-], number of first windows that may have the largest, and rank
#: correlation of the windows after it with time [-]; all are upper limits.
DECAYED, EARLY, FALLING = 0.3, 5, -0.85
#: Steady state: largest relative variation over its second half, smallest fraction of power in a line and its
#: multiples [-].
STEADY, IN_LINES = 0.1, 0.9
#: Pulse: smallest ratio of its peak to the root mean square, and fraction of the record that contains the peak [-].
CREST, SOON = 8.0, 0.3
#: Number of phase bins of a period.
PHASES = 72
#: Smallest ratio of the force of a joint where its displacement reverses to its largest [-]. After a sixth of the phase
#: to the other reversal a spring has lost 7 % of its range, friction more; a drive at its limit loses less than `LOST`.
AT_TURN, LOST = 0.9, 0.05
#: A sine is within 10 % of its largest value in 2 arccos(0.9) / pi = 29 % of its samples; a sine clipped by 7 % in the
#: fraction `FLAT` [-].
NEAR_LIMIT, FLAT = 0.9, 0.37


@dataclass(frozen=True, kw_only=True)
class Judged:
    """Kind of a time history, with its evidence.

    Parameters
    ----------
    kind
        "decay", "steady state", "pulse" or "broadband".
    evidence
        Numbers of the judgement, in words.
    frequency
        Strongest frequency [cycles per sample].
    """

    kind: str
    evidence: str
    frequency: float


def judge_history(values: Samples) -> Judged:
    """Judge the kind of a time history.

    Parameters
    ----------
    values
        Uniform samples, shape (n,).
    """
    signal = values - np.mean(values)
    frequency, share = find_strongest_line(signal)
    windows = np.array([np.sqrt(np.mean(part**2)) for part in np.array_split(signal, min(WINDOWS, len(signal)))])
    largest = int(np.argmax(windows))
    crest = float(np.abs(signal).max() / max(float(np.sqrt(np.mean(signal**2))), 1e-300))
    end = float(windows[-3:].mean() / max(windows[largest], 1e-300))
    after = windows[largest:]
    if largest < EARLY and end < DECAYED and len(after) > 3:
        from scipy.stats import spearmanr

        falls = float(spearmanr(np.arange(len(after)), after).statistic)
        if falls < FALLING:
            return Judged(kind="decay", evidence=f"its envelope falls to {100 * end:.0f} %", frequency=frequency)
    if crest > CREST and int(np.argmax(np.abs(signal))) < SOON * len(signal):
        return Judged(kind="pulse", evidence=f"its peak is {crest:.0f} times its root mean square", frequency=frequency)
    second = windows[len(windows) // 2 :]
    spread = float(np.ptp(second) / max(float(second.mean()), 1e-300))
    if spread < STEADY and share > IN_LINES:
        evidence = (
            f"constant within {100 * spread:.1f} %, {100 * share:.0f} % of its power in one frequency and its multiples"
        )
        return Judged(kind="steady state", evidence=evidence, frequency=frequency)
    evidence = f"neither decaying nor steady: {100 * share:.0f} % of its power is periodic"
    return Judged(kind="broadband", evidence=evidence, frequency=frequency)


def find_strongest_line(signal: Samples) -> tuple[float, float]:
    """Strongest frequency [cycles per sample], and fraction of the power in it and its multiples [-].

    Parameters
    ----------
    signal
        Samples without their mean, shape (n,).
    """
    n = len(signal)
    power = np.abs(np.fft.rfft(signal * np.hanning(n))) ** 2
    power[:2] = 0.0
    total = float(power.sum())
    if total == 0:
        return 0.0, 0.0
    peak = int(np.argmax(power))
    lines = np.zeros(len(power), dtype=bool)
    for multiple in range(peak, len(power), peak):
        lines[max(0, multiple - 3) : multiple + 4] = True
    return peak / n, float(power[lines].sum() / total)


def estimate_sine_amplitude(values: Samples) -> float:
    """Amplitude of a settled sine, from the standard deviation of the second half of its samples.

    Parameters
    ----------
    values
        Samples, shape (n,).
    """
    return float(np.sqrt(2.0) * np.std(values[len(values) // 2 :]))


def distortion(signal: Samples) -> float:
    """Fraction of the power of a periodic signal outside its strongest line [-].

    Parameters
    ----------
    signal
        Samples without their mean, shape (n,).
    """
    n = len(signal)
    power = np.abs(np.fft.rfft(signal * np.hanning(n))) ** 2
    power[:2] = 0.0
    peak = int(np.argmax(power))
    total = float(power.sum())
    return 1.0 - float(power[max(0, peak - 3) : peak + 4].sum()) / total if total else 0.0


def turns_with(displacement: Samples, force: Samples) -> bool:
    """Whether a force is the response of a joint: near its largest where the displacement reverses, then decreasing.

    A clipped or distorted drive does not reverse with the displacement, or stays at its limit after the reversal.

    Parameters
    ----------
    displacement, force
        Samples of both without their means, shape (n,) each.
    """
    from scipy.signal import hilbert

    phase = np.angle(np.asarray(hilbert(displacement))) * PHASES / (2 * np.pi)
    number = np.rint(phase).astype(np.int64) % PHASES
    mean = np.bincount(number, force, PHASES) / np.maximum(np.bincount(number, minlength=PHASES), 1)
    both_ways = (mean - np.roll(mean, -PHASES // 2)) / 2
    at_turn = both_ways[0]
    return bool(at_turn > AT_TURN * both_ways.max() and at_turn - both_ways[PHASES // 12] > LOST * 2 * at_turn)


def compute_share_near_limit(values: Samples) -> float:
    """Fraction of samples within 10 % of the limits, which are the 0.5 and 99.5 % quantiles because of noise [-].

    Parameters
    ----------
    values
        Samples, shape (n,).
    """
    low, high = np.quantile(values, [0.005, 0.995])
    return float(np.mean(np.abs(values - (low + high) / 2) > NEAR_LIMIT * (high - low) / 2))


def find_uniform_rate(time: Samples) -> float | None:
    """Sampling rate of instants [1/unit of time]; None if a step differs by more than 5 % from the mean step.

    Parameters
    ----------
    time
        Instants, shape (n,).
    """
    try:
        steps = np.diff(check_time(time, len(time)))
    except CampaignError:
        return None
    mean = float(steps.mean()) if len(steps) else 0.0
    # Instants are rounded in files, which changes single steps but not the mean.
    if mean <= 0 or (steps <= 0).any() or np.abs(steps - mean).max() > 0.05 * mean:
        return None
    return 1.0 / mean
