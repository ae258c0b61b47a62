"""Checks of the input arrays of measured signals."""

from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.errors import CampaignError

Samples = Float[NDArray[np.float64], " n"]
Channels = Float[NDArray[np.float64], "c n"]

#: Largest deviation of the instants of a uniform clock, relative to a step: files round times [-].
ROUNDING = 0.2
#: Tolerance for an integer number of last digits, and largest rounding error of an instant in last digits [-]: one
#: half, and a little more for the error of the fitted line.
WHOLE, HALF = 1e-4, 0.6
#: Relative difference of steps below which rounding is not reported [-]: half of it on either side turns the phase of
#: the Nyquist frequency by 1 deg.
NOTED = 0.01
#: Largest number of digits considered; a file with more has no relevant rounding.
MOST_DIGITS = 10


def check_channels(values: Any, what: str = "values") -> Channels:
    """Signals as an array of shape (c, n), finite.

    Parameters
    ----------
    values
        Signals, shape (n,) or (c, n).
    what
        Name in messages.

    Raises
    ------
    CampaignError
        Another shape, or values that are not finite.
    """
    channels = np.atleast_2d(np.asarray(values, dtype=np.float64))
    if channels.ndim != 2 or not channels.size:
        raise CampaignError(f"{what} have shape {np.shape(values)}: give (n,) or (c, n), one row per channel")
    wrong = np.argwhere(~np.isfinite(channels))
    if len(wrong):
        row, sample = wrong[0]
        raise CampaignError(
            f"{what}: sample {sample} of channel {row} is {channels[row, sample]}, and {len(wrong)} samples in total "
            "are not numbers: cut the record before them, or repeat the measurement"
        )
    return channels


def check_time(time: Any, n_sample: int, fewest: int = 4) -> Samples:
    """Instants of samples, ascending, shape (n,) [s].

    Raises
    ------
    CampaignError
        Different numbers of instants and samples, too few, or times that do not increase and have no constant rate.
    """
    instants = np.asarray(time, dtype=np.float64)
    if instants.shape != (n_sample,):
        raise CampaignError(
            f"time has shape {instants.shape}, the signals {n_sample} samples: give one instant per sample"
        )
    if n_sample < fewest:
        raise CampaignError(f"the record has {n_sample} samples: at least {fewest} are needed")
    if not np.isfinite(instants).all():
        raise CampaignError(f"the time of sample {int(np.argmin(np.isfinite(instants)))} is not a number: correct it")
    step = np.diff(instants)
    if (step <= 0).any():
        if (clock := recover_time_base(instants)) is not None:
            return clock
        first = int(np.argmax(step <= 0)) + 1
        raise CampaignError(
            f"time does not rise at sample {first} ({instants[first - 1]:.9g} s, then {instants[first]:.9g} s): sort "
            "the samples, or cut the record there"
        )
    return _undo_rounding(instants)


def recover_time_base(time: Samples) -> Samples | None:
    """Uniform instants that equal the given ones to their last digits, shape (n,) [s]; None if there are none."""
    if len(time) < 2 or (np.diff(time) < 0).any() or not time[-1] > time[0]:
        return None
    clock = _undo_rounding(time)
    return clock if (np.diff(clock) > 0).all() else None


def note_rounded_time(time: Samples) -> tuple[str, ...]:
    """Remark on rounded instants of a file that are replaced by uniform ones; empty for other instants.

    Parameters
    ----------
    time
        Instants as in `check_time`, shape (n,) [s].
    """
    clock = recover_time_base(time)
    if clock is None or clock is time:
        return ()
    steps, step = np.diff(time), compute_uniform_step(clock)
    if np.ptp(steps) <= NOTED * step:
        return ()
    equal = int((steps == 0).sum())
    same = f", {equal} of {len(time)} to that of the sample before" if equal else ""
    return (
        f"instants are rounded, so that steps are {steps.min():.4g} to {steps.max():.4g} s{same}: the constant rate of "
        f"{1 / step:.6g} Hz fits all of them to their last digit and is used; write more digits",
    )


def _undo_rounding(time: Samples) -> Samples:
    """Uniform instants if the given ones differ from these by rounding alone; otherwise the given ones, shape (n,)."""
    steps = np.diff(time)
    if np.ptp(steps) <= WHOLE * steps.mean() or _lacks_samples(steps):
        return time
    sample = np.arange(len(time))
    for digit in (_find_last_digit(time), _find_last_digit_of_decade(time)):
        if not digit.all():
            continue
        clock = np.polynomial.Polynomial.fit(sample, time, 1, w=1 / digit)(sample)
        if (np.abs(time - clock) <= HALF * digit).all():
            return np.asarray(clock)
    return time


def _lacks_samples(steps: Samples) -> bool:
    """Whether all steps are whole multiples of the median step, so that samples are missing and nothing is rounded.

    Rounded steps are of two neighbouring numbers of last digits. If the median step is one last digit, rounding cannot
    be distinguished from missing samples, which are more probable than such a coarse clock.
    """
    usual = float(np.median(steps))
    if usual <= 0:
        return False
    count = steps / usual
    return bool(count.min() > 0.5 and np.abs(count - np.round(count)).max() < WHOLE * count.max())


def _find_last_digit(time: Samples) -> Samples:
    """Size of the last written digit of each instant, for a common number of decimals or of digits, shape (n,) [s]."""
    size = np.zeros(len(time))
    with np.errstate(divide="ignore"):
        power = np.where(time == 0, -np.inf, np.floor(np.log10(np.abs(time))))
    for first in (np.zeros(len(time)), power):
        for digit in range(MOST_DIGITS):
            unit = 10.0 ** (first - digit)
            with np.errstate(invalid="ignore", divide="ignore"):
                part = np.where(unit > 0, time / unit, 0.0)
            if np.abs(part - np.round(part)).max() < WHOLE:
                size = np.maximum(size, unit)
                break
    return size


def _find_last_digit_of_decade(time: Samples) -> Samples:
    """Size of the last written digit in each decade, as for five digits but at least four decimals, shape (n,) [s]."""
    size = np.zeros(len(time))
    power = np.floor(np.log10(np.where(time == 0, np.inf, np.abs(time))))
    power[time == 0] = power.min()
    for decade in np.unique(power):
        there = power == decade
        for digit in range(MOST_DIGITS):
            part = time[there] / 10.0 ** (decade - digit)
            if np.abs(part - np.round(part)).max() < WHOLE:
                size[there] = 10.0 ** (decade - digit)
                break
    return size


def compute_uniform_step(time: Samples) -> float:
    """Step of a uniform clock [s].

    Raises
    ------
    CampaignError
        Samples that are missing, or steps that change.
    """
    step = float((time[-1] - time[0]) / (len(time) - 1))
    if np.abs(time - time[0] - step * np.arange(len(time))).max() > ROUNDING * step:
        steps = np.diff(time)
        raise CampaignError(
            f"the steps of time range from {steps.min():.6g} to {steps.max():.6g} s: sample at one rate, or resample"
        )
    return step
