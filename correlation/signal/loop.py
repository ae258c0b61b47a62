r"""Force-displacement loops: work per cycle, secant stiffness, offsets and closing error of every period.

.. math:: W = \oint F\, \mathrm{d}x, \qquad k_s = \frac{F_+ - F_-}{x_+ - x_-}

with the ends :math:`x_\pm` of the displacement and the forces at these. Periods run from one maximum of the
displacement to the next; they need no time. Neighbouring periods of one amplitude form a plateau; ramps between,
before and after plateaus belong to none. A single closed period is a plateau. If the amplitude increases from period to
period, each ends where the displacement returns to its start value: a joint with memory has completed all smaller
cycles there, so that its loop closes.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray
from scipy.special import stdtrit

from correlation.errors import CampaignError
from correlation.signal.record import Samples, check_channels
from geometry.read_only_array import freeze_fields

Values = Float[NDArray[np.float64], " p"]
Ends = Int[NDArray[np.int64], " p"]

#: Turning points count if the motion between them exceeds this number of standard deviations of noise, this fraction of
#: the whole range, and this fraction of the motion between their neighbours [-].
BEYOND_NOISE, SMALLEST, PROMINENCE = 10.0, 0.02, 0.4
#: Amplitudes of neighbouring periods of one plateau differ by less than this fraction [-].
SAME_AMPLITUDE = 0.02
#: Least number of periods of a plateau; the first of them still depends on the loading history and does not count [-].
FEWEST_PERIODS = 2
#: Strokes have a common middle if it varies by less than this fraction of the smallest amplitude: for one-sided
#: motions, from zero to several amplitudes, the middles differ by half of the differences of the strokes [-].
CENTRED = 0.1
#: Force at the ends of the displacement: straight lines through the samples of this last fraction of the stroke [-].
END_SHARE = 0.04
#: Play: the force is below this fraction of its range on both branches, over at least this fraction of the stroke [-];
#: number of parts of the stroke.
NO_FORCE, LEAST_PLAY, PLAY_BINS = 0.03, 0.1, 50
#: Dwell: the displacement at forces near zero (`NO_FORCE`) is more than `DWELLS` times that extrapolated at the same
#: slope from the smaller one on both sides, up to the fraction `BESIDE` of the force's range [-].
BESIDE, DWELLS = 0.2, 2.5
#: A settled loop does not close if its ends differ by this fraction of the force's range, and by this number of
#: standard deviations [-].
OPEN, SURE = 0.05, 3.0
#: A loop supplies energy if its work is negative by this fraction of that of an ellipse of its size [-], and
#: significantly at this level [-]. The work of a single period has no scatter: the fraction is then `OPEN`.
NO_WORK, CHANCE = 1e-3, 1e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class Plateau:
    """Settled periods of one amplitude: means, with the standard deviation of each mean.

    Parameters
    ----------
    first, last
        Indices in `Loops` of the first and last settled period.
    amplitude, work, secant_stiffness, force_offset, displacement_offset, closing_error
        Mean and its standard deviation [m, J, N/m, N, m, -]; the deviation is NaN for a single period.
    """

    first: int
    last: int
    amplitude: tuple[float, float]
    work: tuple[float, float]
    secant_stiffness: tuple[float, float]
    force_offset: tuple[float, float]
    displacement_offset: tuple[float, float]
    closing_error: tuple[float, float]

    @property
    def n_period(self) -> int:
        """Number of its periods [-]."""
        return self.last - self.first + 1


@dataclass(frozen=True, kw_only=True, eq=False)
class Loops:
    """All periods of a record.

    Parameters
    ----------
    first
        First sample of each period, shape (p,); the last period ends at `end`.
    last
        Last sample of each period, its closing point, shape (p,).
    amplitude
        Half the stroke, shape (p,) [m].
    work
        Work per cycle, positive if the joint dissipates, shape (p,) [J].
    secant_stiffness
        Secant stiffness, shape (p,) [N/m].
    force_offset, displacement_offset
        Middle of the forces at both ends of the stroke, and of the ends, shape (p,) [N, m].
    closing_error
        Force at the end minus force at the start over the range of the force, shape (p,) [-].
    plateau
        Number of the plateau of each period, -1 on a ramp, shape (p,).
    plateaus
        Means over settled periods.
    play
        Fraction of the stroke over which the force stays near zero in both directions [-]; 0 without backlash.
    dwell
        Displacement after a reversal over which the force stays near zero, beyond a mere crossing [m]; 0 without.
    suspicions
        Backlash, negative work, loops that do not close and the like, in words.
    """

    first: Int[NDArray[np.int64], " p"]
    last: Int[NDArray[np.int64], " p"]
    amplitude: Values
    work: Values
    secant_stiffness: Values
    force_offset: Values
    displacement_offset: Values
    closing_error: Values
    plateau: Int[NDArray[np.int64], " p"]
    plateaus: tuple[Plateau, ...]
    play: float = 0.0
    dwell: float = 0.0
    suspicions: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze_fields(self, "first", "last", "plateau", kind=np.int64)
        freeze_fields(
            self, "amplitude", "work", "secant_stiffness", "force_offset", "displacement_offset", "closing_error"
        )

    def samples(self, period: int) -> slice:
        """Samples of one period, including its closing point."""
        return slice(int(self.first[period]), int(self.last[period]) + 1)

    @property
    def middle(self) -> float:
        """Common middle of the strokes of all plateaus [m]; 0 if they differ, or without a plateau."""
        middles = np.array([plateau.displacement_offset[0] for plateau in self.plateaus])
        smallest = min((plateau.amplitude[0] for plateau in self.plateaus), default=0.0)
        return float(np.median(middles)) if len(middles) and np.ptp(middles) < CENTRED * smallest else 0.0


def analyse_loop(displacement: Any, force: Any, *, tolerance: float = SAME_AMPLITUDE) -> Loops:
    """Periods of a force-displacement record, with their plateaus.

    Parameters
    ----------
    displacement
        Relative displacement of the two sides of a joint, shape (n,) [m].
    force
        Force that resists it, shape (n,) [N].
    tolerance
        Relative difference of amplitudes of neighbouring periods of one plateau [-].

    Raises
    ------
    CampaignError
        Samples that are not finite, a constant channel, or less than one period.
    """
    x, f = check_pair(displacement, force)
    bounds = find_periods(x)
    first, last = bounds[:-1], bounds[1:]
    table = _measure_periods(x, f, first, last)
    plateau, plateaus = _find_plateaus(table, _compute_drift(x, first, last), tolerance)
    if not plateaus:
        last = np.array([_return(x, a, b, tolerance) for a, b in zip(first, last, strict=True)])
        table = _measure_periods(x, f, first, last)
        plateau, plateaus = _find_plateaus(table, _compute_drift(x, first, last), tolerance)
    best = max(plateaus, key=lambda item: item.amplitude[0]).last if plateaus else len(table) - 1
    part = slice(int(first[best]), int(last[best]) + 1)
    play = _measure_play(x[part], f[part])
    suspicions = _list_suspicions(table, plateaus, play)
    return Loops(
        first=first,
        last=last,
        amplitude=table[:, 0],
        work=table[:, 1],
        secant_stiffness=table[:, 2],
        force_offset=table[:, 3],
        displacement_offset=table[:, 4],
        closing_error=table[:, 5],
        plateau=plateau,
        plateaus=plateaus,
        play=play,
        dwell=_measure_dwell(x[part], f[part]),
        suspicions=tuple(suspicions),
    )


def check_pair(displacement: Any, force: Any) -> tuple[Samples, Samples]:
    """Check both signals: of equal length, neither constant (else `CampaignError`)."""
    x, f = check_channels(displacement, "the displacement"), check_channels(force, "the force")
    if x.shape != f.shape or len(x) != 1:
        raise CampaignError(
            f"displacement and force have shapes {np.shape(displacement)} and {np.shape(force)}: give two signals of "
            "one length, shape (n,)"
        )
    for name, signal in (("displacement", x[0]), ("force", f[0])):
        if not np.ptp(signal) > 0:
            raise CampaignError(f"the {name} is {signal[0]:.6g} throughout: there is no loop")
    return x[0], f[0]


def find_periods(displacement: Samples) -> Int[NDArray[np.int64], " p"]:
    """Samples at which periods begin and the last one ends: maxima of the displacement, shape (n_period + 1,).

    Raises
    ------
    CampaignError
        Less than one period.
    """
    high = _find_highest_points(displacement)
    if len(high) < 2:
        raise CampaignError(
            f"the displacement turns {len(high)} times at its upper end: a loop needs one whole period "
            "between two of them"
        )
    return np.asarray(high, dtype=np.int64)


def _find_highest_points(displacement: Samples) -> NDArray[np.intp]:
    """Maximum of every period, with a prominence above noise and above a fraction of that of its neighbours."""
    from scipy.signal import find_peaks

    # The second difference of white noise has six times its variance, that of a smooth motion is small.
    noise = float(np.diff(displacement, 2).std()) / np.sqrt(6)
    least = max(BEYOND_NOISE * noise, SMALLEST * float(np.ptp(displacement)))
    places, facts = find_peaks(displacement, prominence=least)
    size = facts["prominences"]
    around = np.array([size[max(i - 2, 0) : i + 3].max() for i in range(len(size))])
    return np.asarray(places[size > PROMINENCE * around] if len(size) else places)


def _measure_periods(x: Samples, f: Samples, first: Ends, last: Ends) -> Float[NDArray[np.float64], "p 6"]:
    """Quantities of `_measure_period` for all periods, shape (p, 6)."""
    return np.array([_measure_period(x[a : b + 1], f[a : b + 1]) for a, b in zip(first, last, strict=True)])


def _compute_drift(x: Samples, first: Ends, last: Ends) -> Values:
    """Displacement at the end of each period less that at its start, over its stroke, shape (p,) [-]."""
    return np.array([(x[b] - x[a]) / np.ptp(x[a : b + 1]) for a, b in zip(first, last, strict=True)])


def _return(x: Samples, first: int, last: int, tolerance: float) -> int:
    """Sample at which a period ends; if it rises beyond its start, the one nearest to the displacement at the start."""
    low = first + int(np.argmin(x[first : last + 1]))
    if not x[last] - x[first] > tolerance * (x[first] - x[low]):
        return last
    above = low + int(np.argmax(x[low : last + 1] >= x[first]))
    return above if x[above] - x[first] < x[first] - x[above - 1] else above - 1


def _measure_period(x: Samples, f: Samples) -> Float[NDArray[np.float64], "6"]:
    """Amplitude, work, secant stiffness, offsets of force and displacement, closing error of one period."""
    smooth = _without_noise(x)
    low = int(np.argmin(smooth))
    highest, lowest = float(smooth[[0, -1]].mean()), float(smooth[low])
    stroke = highest - lowest
    work = float(np.sum((f[1:] + f[:-1]) / 2 * np.diff(x)) - (f[0] + f[-1]) / 2 * (x[-1] - x[0]))
    # The period begins and ends at its highest point, so that its second half precedes that reversal.
    turned = np.concatenate([np.arange(low, len(x)), np.arange(low)])
    top = _force_at_end(highest - smooth[turned], f[turned], len(x) - low, stroke)
    bottom = _force_at_end(smooth - lowest, f, low, stroke)
    force_range = float(np.ptp(f))
    closing = (f[-1] - f[0]) / force_range if force_range > 0 else 0.0
    return np.array([stroke / 2, work, (top - bottom) / stroke, (top + bottom) / 2, (highest + lowest) / 2, closing])


def _without_noise(x: Samples) -> Samples:
    """The displacement, smoothed over a fifteenth of the period if its noise would lift its highest point."""
    from scipy.signal import savgol_filter

    noise = float(np.diff(x, 2).std()) / np.sqrt(6) if len(x) > 4 else 0.0
    width = len(x) // 15 | 1
    if width < 5 or noise < 1e-4 * np.ptp(x):
        return x
    return np.asarray(savgol_filter(x, width, 2))


def _force_at_end(distance: Samples, f: Samples, turning: int, stroke: float) -> float:
    """Force at a reversal, from straight lines before and after it that meet there."""
    near = np.flatnonzero(np.abs(distance) <= END_SHARE * stroke)
    before = near[near <= turning]
    after = near[near > turning]
    if min(len(before), len(after)) < 3:
        return float(f[near].mean()) if len(near) else float(f[min(turning, len(f) - 1)])
    columns = np.zeros((len(near), 3))
    columns[:, 0] = 1
    columns[: len(before), 1] = distance[before]
    columns[len(before) :, 2] = distance[after]
    scale = np.abs(columns).max(axis=0)
    return float(np.linalg.lstsq(columns / np.where(scale > 0, scale, 1), f[near], rcond=None)[0][0])


def _find_plateaus(
    table: Float[NDArray[np.float64], "p 6"], drift: Values, tolerance: float
) -> tuple[Int[NDArray[np.int64], " p"], tuple[Plateau, ...]]:
    """Plateau of each period, and the means of each plateau."""
    plateau = np.full(len(table), -1, dtype=np.int64)
    plateaus: list[Plateau] = []
    start = 0
    while start < len(table):
        stop = start + 1
        while stop < len(table) and abs(table[stop, 0] / np.median(table[start:stop, 0]) - 1) < tolerance:
            stop += 1
        # A single period counts if displacement and force return to their start values.
        closes = abs(drift[start]) < tolerance and abs(table[start, 5]) < OPEN
        if stop - start >= FEWEST_PERIODS or len(table) == 1 or closes:
            first = start + 1 if stop - start > FEWEST_PERIODS else start
            plateau[first:stop] = len(plateaus)
            plateaus.append(_means(table[first:stop], first, stop - 1))
        start = stop
    return plateau, tuple(plateaus)


def _means(table: Float[NDArray[np.float64], "p 6"], first: int, last: int) -> Plateau:
    mean = table.mean(axis=0)
    deviation = table.std(axis=0, ddof=1) / np.sqrt(len(table)) if len(table) > 1 else np.full(6, np.nan)
    pairs = [(float(a), float(b)) for a, b in zip(mean, deviation, strict=True)]
    return Plateau(
        first=first, last=last, amplitude=pairs[0], work=pairs[1], secant_stiffness=pairs[2], force_offset=pairs[3],
        displacement_offset=pairs[4], closing_error=pairs[5],
    )  # fmt: skip


def _measure_play(x: Samples, f: Samples) -> float:
    """Fraction of the stroke over which both branches have no force [-]; 0 for a mere zero crossing."""
    part = np.clip(((x - x.min()) / np.ptp(x) * PLAY_BINS).astype(np.int64), 0, PLAY_BINS - 1)
    falling = np.arange(len(x)) <= np.argmin(x)
    free = np.ones(PLAY_BINS, dtype=bool)
    for branch in (falling, ~falling):
        count = np.bincount(part[branch], minlength=PLAY_BINS)
        mean = np.bincount(part[branch], f[branch], minlength=PLAY_BINS) / np.maximum(count, 1)
        free &= (count == 0) | (np.abs(mean) < NO_FORCE * np.ptp(f))
    runs = np.diff(np.flatnonzero(np.concatenate([[True], ~free, [True]]))) - 1
    share = float(runs.max()) / PLAY_BINS
    return share if share >= LEAST_PLAY else 0.0


def _measure_dwell(x: Samples, f: Samples) -> float:
    """Displacement at forces near zero beyond that of a crossing, mean of both branches [m]; 0 if one has none."""
    turn, size, result = int(np.argmin(x)), float(np.ptp(f)), []
    for way, force in ((x[: turn + 1], f[: turn + 1]), (x[turn:], -f[turn:])):
        # From the last sample above each level to the first one below: noise may cross a level several times.
        levels = size * np.array([BESIDE, NO_FORCE, -NO_FORCE, -BESIDE])
        above = [np.flatnonzero(force > level) for level in levels]
        if not all(len(rows) > 0 and rows[-1] + 1 < len(force) for rows in above[:2]):
            return 0.0
        below = [np.flatnonzero(force < level) for level in levels[2:]]
        if not all(len(rows) for rows in below):
            return 0.0
        ends = [above[0][-1], above[1][-1], *(rows[0] for rows in below)]
        before, through, after = np.abs(np.diff(way[ends]))
        crossing = min(before, after) * 2 * NO_FORCE / (BESIDE - NO_FORCE)
        result.append(float(through - crossing) if through > DWELLS * crossing else 0.0)
    return float(np.mean(result)) if all(result) else 0.0


def _has_negative_work(table: Float[NDArray[np.float64], "p 6"], plateaus: tuple[Plateau, ...]) -> bool:
    """Whether the work of settled periods, or else of all, is negative beyond its scatter."""
    settled = [table[plateau.first : plateau.last + 1] for plateau in plateaus]
    rows = np.concatenate(settled) if settled else table
    ellipse = np.pi * np.abs(rows[:, 2]) * rows[:, 0] ** 2
    share = rows[:, 1] / np.where(ellipse > 0, ellipse, np.inf)
    if len(share) == 1:
        return bool(share[0] < -OPEN)
    chance = stdtrit(len(share) - 1, 1 - CHANCE) * share.std(ddof=1) / np.sqrt(len(share))
    return bool(share.mean() < -max(NO_WORK, chance))


def _list_suspicions(table: Float[NDArray[np.float64], "p 6"], plateaus: tuple[Plateau, ...], play: float) -> list[str]:
    """Suspicions about the record from its periods, in words."""
    suspicions = []
    if play:
        suspicions.append(
            f"the force stays near zero over {play:.2g} of the stroke in both directions: backlash, or a joint that "
            "opens; its secant stiffness is not that of a contact"
        )
    if not plateaus:
        suspicions.append(
            "no two consecutive periods have equal amplitude, and no single period closes: there is no settled loop"
        )
    if _has_negative_work(table, plateaus):
        suspicions.append(
            "the loops run in the opposite direction, as if the joint supplied energy: one of the signals has the "
            "wrong sign"
        )
    apart = [
        mean for mean, deviation in (plateau.closing_error for plateau in plateaus)
        if abs(mean) > max(OPEN, SURE * np.nan_to_num(deviation))
    ]  # fmt: skip
    if apart:
        suspicions.append(
            f"its loops do not close: from one highest displacement to the next the force changes by "
            f"{100 * max(map(abs, apart)):.0f} % of its range: it drifts, or the joint has not settled"
        )
    return suspicions
