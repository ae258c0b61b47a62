r"""Harmonics of the settled part of a record, with phases relative to the force.

After a change of the frequency the response contains a transient at the natural frequencies. It causes a drift of the
harmonics over the record, and a residual that is larger in the first half than in the second. The longest part up to
the end of the record without these effects is used. If there is none, the last part is returned and marked as not
settled.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.special import fdtri

from correlation.errors import CampaignError
from correlation.signal.harmonics import DriftingFit, Harmonics, find_frequency, fit_drifting, refine_frequency
from correlation.signal.record import Channels, Samples, check_channels, check_time

#: Fractions of the record at which the settled part may begin [-].
STARTS = tuple(np.linspace(0.0, 0.75, 16))
#: Least number of periods of a settled part [-]: fewer show no drift.
FEWEST_PERIODS = 4.0
#: Largest relative drift that counts as settled, extrapolated to half of the record [-]; also the largest decrease of
#: the residual, as a fraction of the amplitude.
SETTLED = 0.01
#: Probability of a significant decrease of a residual that is noise [-].
CHANCE = 1e-3


def fit_steady_state(
    time: Any,
    values: Any,
    reference: Any,
    n_harmonic: int,
    *,
    frequency: float | None = None,
    names: Sequence[str] | None = None,
) -> Harmonics:
    """Harmonics of channels with phases relative to the first harmonic of a reference, the force.

    Parameters
    ----------
    time
        Instants, ascending, shape (n,) [s].
    values
        Signals, shape (n,) or (c, n) [any unit].
    reference
        Force, drive or base acceleration, shape (n,) [any unit].
    n_harmonic
        H, the highest harmonic [-].
    frequency
        Omega / 2 pi [Hz]; by default that of the reference.
    names
        Names of the channels, for suspicions; their numbers by default.

    Returns
    -------
    Coefficients, with those of the reference as `reference`; `start` is the begin of the settled part.

    Raises
    ------
    CampaignError
        As `fit_harmonics`; a reference of zeros.
    """
    channels = check_channels(values)
    force = check_channels(reference, "the reference")
    instants = check_time(time, channels.shape[1])
    if force.shape != (1, len(instants)):
        raise CampaignError(f"the reference has shape {np.shape(reference)}: give ({len(instants)},), one per instant")
    if not force.std() > 0:
        raise CampaignError(f"the reference is {force[0, 0]:.6g} throughout: name the channel of the force that drives")
    everything = np.vstack([force, channels])
    start = find_frequency(instants, force) if frequency is None else float(frequency)
    first, fit = _find_settled_part(instants, everything, start, n_harmonic, frequency is None)
    used = slice(first, None)
    words = ["the reference", *(names or [f"channel {number}" for number in range(len(channels))])]
    described = fit.describe(instants[used], everything[:, used], _share(instants[used], instants) * SETTLED, words)
    fading = compute_residual_decay(fit, instants[used])
    relative = fading * described.residual
    suspicions = [
        *described.suspicions,
        *(
            f"{words[row]}: the residual of the harmonics decays by {relative[row]:.2g} of the amplitude within the "
            "part used: an earlier transient has not decayed"
            for row in np.flatnonzero(relative > SETTLED)
        ),
    ]
    return _turn_in_phase(
        replace(
            described,
            settled=described.settled and not (relative > SETTLED).any(),
            suspicions=tuple(suspicions),
        )
    )


def compute_residual_decay(fit: DriftingFit, time: Samples) -> Float[NDArray[np.float64], " c"]:
    """Relative decrease of the residual's root mean square from the first half to the second, shape (c,) [-].

    It is zero if the difference is not significant; the number of independent values follows from the bandwidth of the
    residual, not from the number of samples.
    """
    half = len(time) // 2
    first = (fit.residual[:, :half] ** 2).mean(axis=1)
    second = (fit.residual[:, -half:] ** 2).mean(axis=1)
    both = np.where(first + second > 0, (first + second) / 2, 1)
    left = fit.residual
    correlation = np.array([_compute_correlation_sum(row) for row in left])
    count = np.maximum(half / correlation, 2)
    limit = fdtri(count, count, 1 - CHANCE)
    faded = first > limit * second
    return np.where(faded, np.sqrt(np.maximum(first - second, 0) / both), 0.0)


def _compute_correlation_sum(values: Samples) -> float:
    """Sum of the squared autocorrelation: samples per independent value of a square [-]."""
    spectrum = np.abs(np.fft.rfft(values)) ** 2
    total = spectrum.sum()
    return float(max(len(spectrum) * (spectrum**2).sum() / total**2 / 2, 1.0)) if total > 0 else 1.0


def _find_settled_part(
    time: Samples, channels: Channels, frequency: float, n_harmonic: int, refine: bool
) -> tuple[int, DriftingFit]:
    """First sample of the longest settled part up to the end, and the fit to it; the last quarter if there is none."""
    last: tuple[int, DriftingFit] | None = None
    for share in STARTS:
        first = int(share * len(time))
        part = time[first:]
        if last is not None and (part[-1] - part[0]) * frequency < FEWEST_PERIODS:
            break
        fit = fit_drifting(part, channels[:, first:], frequency, n_harmonic)
        if refine:
            fit = refine_frequency(part, channels[:, first:], fit, n_harmonic)
        last = first, fit
        described = fit.describe(part, channels[:, first:], _share(part, time) * SETTLED)
        if described.settled and not (compute_residual_decay(fit, part) * described.residual > SETTLED).any():
            break
    assert last is not None  # the first of `STARTS` is always fitted, or refused
    return last


def _share(part: Samples, whole: Samples) -> float:
    """Length of a part over the whole, so that a slow drift is not missed because the part is short [-]."""
    return float((part[-1] - part[0]) / (whole[-1] - whole[0]))


def _turn_in_phase(whole: Harmonics) -> Harmonics:
    """The channels after the first, with phases such that the first harmonic of the first is real and positive."""
    order = np.arange(whole.coefficients.shape[1])
    fundamental = whole.coefficients[0, 1]
    size = np.abs(fundamental)
    if not size > 0:
        raise CampaignError("the reference has no first harmonic at this frequency: name the channel of the force")
    turn = (np.conj(fundamental) / size) ** order
    turned = whole.coefficients * turn
    # The reference's own phase is known to its relative deviation; harmonic k turns k times as much.
    own = order * np.abs(turned) * whole.deviation[0, 1] / size / np.sqrt(2)
    deviation = np.hypot(whole.deviation, own)
    return replace(
        whole,
        coefficients=turned[1:],
        deviation=deviation[1:],
        drift=whole.drift[1:],
        drift_deviation=whole.drift_deviation[1:],
        residual=whole.residual[1:],
        reference=turned[0],
        reference_deviation=whole.deviation[0],
    )
