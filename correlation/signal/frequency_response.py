r"""Frequency responses from time histories: averaged cross spectra, and their coherence.

With the cross spectra :math:`S_{xy}` of force x and response y,

.. math:: H_1 = S_{xy} / S_{xx}, \qquad H_2 = S_{yy} / S_{yx}, \qquad \gamma^2 = H_1 / H_2

H1 is biased low by noise of the force, H2 high by noise of the response; the true value lies between them if only noise
lowers the coherence. A nonlinear structure lowers it as well.

Hammer blows are cut out at the pulse. A force window removes noise outside the pulse; an exponential window
:math:`e^{-\sigma (t - t_0)}` on force and response makes both decay within the block. Since it acts on both, the result
is exactly :math:`H(i \omega + \sigma)`: all poles are shifted to the left by sigma, which `fit_modes` corrects.

References
----------
Bendat and Piersol, Random Data, 4th ed., Wiley (2010), section 6.1.
Fladung and Rost, Application and correction of the exponential window, Mech. Syst. Signal Process. 11 (1997) 23.
"""

from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.signal.record import Channels, Samples, check_channels, check_time, compute_uniform_step
from geometry.read_only_array import freeze_fields

Responses = Complex[NDArray[np.complex128], "c f"]
Shares = Float[NDArray[np.float64], "c f"]

#: A blow begins where the force exceeds this fraction of its largest value [-], and ends below it. A second blow within
#: a block is a double hit.
TRIGGER = 0.2
#: Part of a block before its blow [-].
BEFORE = 0.01
#: Width of the force window, in durations of the pulse [-].
PULSE_WINDOW = 5.0


#: Coherence at which the relative standard deviation of a response is 1 / sqrt(2) with one average, and the largest
#: required coherence [-].
LEAST_COHERENCE, MOST_COHERENCE = 0.5, 0.8
#: Probability that any line of pure noise exceeds the limit of the coherence [-].
CHANCE = 0.01


class Excitation(Enum):
    """Kind of excitation."""

    RANDOM = "random"
    """Stationary noise: Hann's window, blocks that overlap by half."""
    BURST = "burst"
    """Blocks that begin and end at rest: no window, no overlap."""
    HAMMER = "hammer"
    """Blows: blocks begin at them."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FrequencyResponse:
    """Frequency responses of some channels to one force.

    Parameters
    ----------
    frequency
        Frequencies, shape (f,) [Hz].
    h1, h2
        Frequency responses, shape (c, f) [unit of the response / unit of the force].
    coherence
        Ordinary coherence gamma^2 in [0, 1], shape (c, f) [-]; 1 and without information for a single block.
    decay
        sigma of the exponential window [1/s]: all poles of H are shifted to the left by it. 0 without one.
    averages
        Number of averaged blocks; blocks that overlap by half under a Hann window are equivalent to 5 % fewer
        independent blocks.
    suspicions
        Double hits, clipped channels and the like, in words.
    """

    frequency: Float[NDArray[np.float64], " f"]
    h1: Responses
    h2: Responses
    coherence: Shares
    decay: float = 0.0
    averages: int = 1
    suspicions: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze_fields(self, "frequency", "coherence")
        freeze_fields(self, "h1", "h2", kind=np.complex128)


def estimate_frequency_response(
    time: Any,
    reference: Any,
    responses: Any,
    *,
    block: float | None = None,
    excitation: Excitation | str = Excitation.RANDOM,
    decay: float = 0.0,
    force_window: bool = False,
) -> FrequencyResponse:
    """Frequency responses H1 and H2 with coherence.

    Parameters
    ----------
    time
        Instants at one rate, shape (n,) [s].
    reference
        Force, shape (n,) [any unit].
    responses
        Signals, shape (n,) or (c, n) [any unit].
    block
        Length of a block [s], the inverse of the resolution; by default an eighth of the record, or for a hammer the
        time between blows.
    excitation
        Kind of excitation: "random", "burst" or "hammer".
    decay
        sigma of an exponential window for blows [1/s]; 0 for none.
    force_window
        Whether the force outside the pulse of a blow is set to zero.

    Raises
    ------
    CampaignError
        A clock that is not uniform, a block that does not fit the record, a force of zeros, or no blow in the record.
    """
    kind = _read_excitation(excitation)
    channels = check_channels(responses, "the responses")
    force = check_channels(reference, "the reference")
    instants = check_time(time, channels.shape[1], fewest=16)
    if force.shape != (1, len(instants)):
        raise CampaignError(f"the reference has shape {np.shape(reference)}: give ({len(instants)},), one per instant")
    if not force.std() > 0:
        raise CampaignError(f"the reference is {force[0, 0]:.6g} throughout: a frequency response needs the force")
    if not (np.isfinite(decay) and decay >= 0):
        raise CampaignError(f"decay = {decay}: give the rate of an exponential window in 1/s, or 0")
    step = compute_uniform_step(instants)
    suspicions: list[str] = []
    if kind is Excitation.HAMMER:
        forces, blocks, of_blows = _cut_impact_blocks(force[0], channels, step, block, decay, force_window)
        suspicions += of_blows
    else:
        forces, blocks = _cut_blocks(force[0], channels, step, block, kind)
    x = np.fft.rfft(forces, axis=-1)
    y = np.fft.rfft(blocks, axis=-1)
    lines = np.asarray(np.fft.rfftfreq(forces.shape[-1], step), dtype=np.float64)
    return _average(x, y, lines, decay, tuple(suspicions))


def compute_coherence_limit(averages: int | None, count: int) -> float:
    r"""Coherence above which a value of a frequency response is significant [-].

    The relative standard deviation of H1 is :math:`\sqrt{(1 - \gamma^2) / (2 n \gamma^2)}`. If the response is
    independent of the force, the estimate from n averages exceeds g with the probability :math:`(1 - g)^{n - 1}`.

    Parameters
    ----------
    averages
        Number n of averages; None if it is unknown, as for an analyser.
    count
        Number of values, of which none should pass by chance.
    """
    if averages is None or averages < 2:
        return LEAST_COHERENCE
    by_chance = 1 - (CHANCE / max(count, 1)) ** (1 / (averages - 1))
    return float(min(max(by_chance, LEAST_COHERENCE), MOST_COHERENCE))


def _average(
    x: Complex[NDArray[np.complex128], "b f"],
    y: Complex[NDArray[np.complex128], "b c f"],
    frequency: Float[NDArray[np.float64], " f"],
    decay: float,
    suspicions: tuple[str, ...],
) -> FrequencyResponse:
    """H1, H2 and coherence of the spectra of all blocks."""
    xx = (np.abs(x) ** 2).mean(axis=0)
    yy = (np.abs(y) ** 2).mean(axis=0)
    xy = (np.conj(x)[:, None] * y).mean(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        h1 = np.where(xx > 0, xy / xx, np.nan)
        h2 = np.where(np.abs(xy) > 0, yy / np.conj(xy), np.nan)
        coherence = np.clip(np.where(yy * xx > 0, np.abs(xy) ** 2 / (xx * yy), 0.0), 0.0, 1.0)
    if len(x) == 1:
        suspicions = (*suspicions, "one block: the coherence is not known")
    return FrequencyResponse(
        frequency=frequency, h1=h1, h2=h2, coherence=coherence, decay=decay, averages=len(x), suspicions=suspicions
    )  # fmt: skip


def _read_excitation(excitation: Excitation | str) -> Excitation:
    try:
        return Excitation(excitation)
    except ValueError:
        names = ", ".join(f'"{item.value}"' for item in Excitation)
        raise CampaignError(f'"{excitation}" is not an excitation: give {names}') from None


def _cut_blocks(
    force: Samples, channels: Channels, step: float, block: float | None, kind: Excitation
) -> tuple[Float[NDArray[np.float64], "b m"], Float[NDArray[np.float64], "b c m"]]:
    """Blocks of a stationary record or of bursts, without their means, under the window."""
    n = len(force)
    size = n // 8 if block is None else round(block / step)
    if not 8 <= size <= n:
        raise CampaignError(
            f"a block of {size * step:.4g} s has {size} samples of the record's {n}: give a block of at least "
            f"{8 * step:.3g} and at most {n * step:.4g} s"
        )
    hop = size // 2 if kind is Excitation.RANDOM else size
    window = np.hanning(size + 1)[:-1] if kind is Excitation.RANDOM else np.ones(size)
    cut = np.lib.stride_tricks.sliding_window_view(np.vstack([force, channels]), size, axis=1)[:, ::hop]
    cut = (cut - cut.mean(axis=-1, keepdims=True)) * window
    return cut[0], np.moveaxis(cut[1:], 0, 1)


def _cut_impact_blocks(
    force: Samples, channels: Channels, step: float, block: float | None, decay: float, force_window: bool
) -> tuple[Float[NDArray[np.float64], "b m"], Float[NDArray[np.float64], "b c m"], list[str]]:
    """Blocks that begin just before a blow, under their windows; a block with a second blow is left out."""
    level = np.median(force)
    pulse = force - level
    pulse = pulse if pulse.max() >= -pulse.min() else -pulse
    above = pulse > TRIGGER * pulse.max()
    rises = np.flatnonzero(above & ~np.concatenate([[False], above[:-1]]))
    starts, doubles = _find_first_of_each(rises, block, step)
    if block is None:
        block = (np.diff(starts).min() if len(starts) > 1 else len(force) - starts[0]) * step * (1 - 2 * BEFORE)
    size = round(block / step)
    early = max(int(BEFORE * size), 2)
    suspicions = []
    whole = [start for start in starts if start >= early and start - early + size <= len(force)]
    clean = [start for start in whole if start not in doubles]
    if len(clean) < len(whole):
        suspicions.append(
            f"{len(whole) - len(clean)} of {len(whole)} blows are followed by a second one within their block and are "
            "left out"
        )
    if not clean:
        raise CampaignError(
            f"no clean blow of {block:.4g} s in the record of {len(force) * step:.4g} s: {len(rises)} pulses, "
            f"{len(whole)} with a whole block, {len(doubles)} double hits; give a shorter block"
        )
    late = step * np.maximum(np.arange(size) - early, 0)
    window = np.exp(-decay * step * (np.arange(size) - early))
    forces, blocks = [], []
    for start in clean:
        part = slice(start - early, start - early + size)
        quiet = channels[:, part] - channels[:, start - early : start].mean(axis=1, keepdims=True)
        blow = force[part] - np.median(force[part])
        if force_window:
            length = max(int(above[start : start + size].sum()), 1) * step
            blow = blow * (late <= PULSE_WINDOW * length)
        forces.append(blow * window)
        blocks.append(quiet * window)
    return np.array(forces), np.array(blocks), suspicions


def _find_first_of_each(rises: NDArray[np.intp], block: float | None, step: float) -> tuple[list[int], set[int]]:
    """First rise of each blow, and those blows that have a second one within their block."""
    if not len(rises):
        raise CampaignError("no blow in the record: the force has no pulse")
    gaps = np.diff(rises)
    # Rises of one blow and its rebound are much nearer to each other than blows.
    reach = round(block / step) if block is not None else (gaps.max() / 2 if len(gaps) else np.inf)
    starts, doubles = [int(rises[0])], set[int]()
    for rise in rises[1:]:
        if rise - starts[-1] < reach:
            doubles.add(starts[-1])
        else:
            starts.append(int(rise))
    return starts, doubles
