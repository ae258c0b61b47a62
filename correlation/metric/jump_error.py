"""Errors of the frequencies at which a response jumps from one steady state to another.

If a branch of the model ends slightly earlier than the measured one, the error is this frequency difference, not the
difference of two branches at the points between.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from numpy.typing import NDArray

from correlation.feature.gap import find_gaps
from correlation.feature.jump import find_curve_jumps
from correlation.feature.observation import Observation
from correlation.prediction import Prediction, SweepJump

#: Least change at a jump, relative to the larger value, and relative to the change of the other sweep [-].
MIN_JUMP, ALONE = 0.2, 2.0
#: Number of steps next to a jump in which the response may still settle [-].
SETTLED = 3


@dataclass(frozen=True, kw_only=True)
class JumpError:
    """A jump of a sweep, measured and predicted.

    Parameters
    ----------
    free, level
        Configuration and level [-, unit of the drive].
    sweep
        +1 up, -1 down.
    falls
        Whether the amplitude falls along the sweep.
    frequency, frequency_deviation
        Middle of the measured step, and the standard deviation of a frequency within it [Hz]; NaN if the measured
        response does not jump.
    predicted_frequency
        Frequency of the predicted jump [Hz]; NaN if the response of the model does not jump.
    swept_both_ways
        Whether the other sweep was measured too. In a single sweep a steep flank looks like a jump.
    """

    free: bool
    level: float
    sweep: int
    falls: bool
    frequency: float
    frequency_deviation: float
    predicted_frequency: float
    swept_both_ways: bool

    @property
    def frequency_error(self) -> float:
        """Predicted less measured frequency [Hz]."""
        return self.predicted_frequency - self.frequency


def compute_jump_errors(
    observed: Observation, prediction: Prediction, sweeps: tuple[int, ...]
) -> tuple[JumpError, ...]:
    """Jumps of each configuration, level and sweep; each measured one paired with the nearest predicted one.

    Parameters
    ----------
    observed
        Measurements, k points.
    prediction
        Prediction at the same points.
    sweeps
        Directions in which the structure was swept.
    """
    # A level may be reached through others that are not part of these data.
    measured = {*zip(observed.points.free.tolist(), observed.points.level.tolist(), strict=True)}
    predicted = [jump for jump in prediction.jumps if (jump.free, jump.level) in measured]
    result, both = [], len(sweeps) > 1
    for jump, width in find_measured_jumps(observed, sweeps):
        own = [item for item in predicted if item[:3] == jump[:3] and item.falls == jump.falls]
        nearest = min(own, key=lambda item: abs(item.frequency - jump.frequency), default=None)
        if nearest is not None:
            predicted.remove(nearest)
        result.append(
            JumpError(
                **jump._asdict(),
                frequency_deviation=width / np.sqrt(12),
                predicted_frequency=np.nan if nearest is None else nearest.frequency,
                swept_both_ways=both,
            )
        )
    result += [
        JumpError(
            **item._replace(frequency=np.nan)._asdict(), frequency_deviation=np.nan,
            predicted_frequency=item.frequency, swept_both_ways=both,
        )
        for item in predicted
    ]  # fmt: skip
    return tuple(sorted(result, key=lambda item: (item.free, item.level, -item.sweep)))


def find_measured_jumps(observed: Observation, sweeps: tuple[int, ...]) -> Iterator[tuple[SweepJump, float]]:
    """Jumps of the largest motion, and the width of the frequency step of each [Hz].

    If both sweeps were measured, one of them jumps at each end of the range in which they differ, and the other does
    not. With a single sweep, a step far larger than its neighbours is taken for a jump.
    """
    points, value = observed.points, np.abs(observed.value)
    motion = observed.motion & (points.harmonic == 1) & (observed.count > 0)
    for free, level in sorted({*zip(points.free[motion].tolist(), points.level[motion].tolist(), strict=True)}):
        here = motion & (points.free == free) & (points.level == level)
        sensor = points.sensor[here][np.argmax(value[here])]
        of_sensor = here & (points.sensor == sensor)
        rows = {way: _sort_rising(observed, of_sensor & np.isin(points.sweep, (0, way))) for way in sweeps}
        for way, own in rows.items():
            if len(sweeps) == 1:
                steps = find_curve_jumps(points.frequency[own], observed.value[own]).tolist()
            else:
                steps = _find_ends(observed, own, rows[-way])
            for step in steps:
                low, high = own[step], own[step + 1]
                middle = float(points.frequency[low] + points.frequency[high]) / 2
                falls = bool((value[high] < value[low]) == (way > 0))
                yield SweepJump(free, level, way, middle, falls), float(points.frequency[high] - points.frequency[low])


def _sort_rising(observed: Observation, chosen: Bool[NDArray[np.bool_], " k"]) -> Int[NDArray[np.int64], " n"]:
    rows = np.flatnonzero(chosen)
    return np.asarray(rows[np.argsort(observed.points.frequency[rows])])


def _find_ends(
    observed: Observation, own: Int[NDArray[np.int64], " n"], other: Int[NDArray[np.int64], " m"]
) -> list[int]:
    """Steps of a sweep into, out of or between states with two branches that are far larger than in the other sweep.

    Steps over a gap between two measured bands do not count. The other sweep may have been read at other frequencies.
    On one side of a jump the sweeps are on different branches.
    """
    points, value = observed.points, observed.value
    split, change = points.sweep[own] != 0, np.abs(np.diff(value[own]))
    beside = _read_between(points.frequency[other], value[other], points.frequency[own])
    size, apart = np.abs(value[own]), np.abs(value[own] - beside)
    large = change > np.maximum(MIN_JUMP * np.maximum(size[1:], size[:-1]), ALONE * np.abs(np.diff(beside)))
    jumps = (split[1:] | split[:-1]) & large & (np.maximum(apart[1:], apart[:-1]) > change / 2)
    jumps[find_gaps(points.frequency[own])] = False
    # After a jump the response settles for some steps: the largest step is the jump.
    near = [change[max(step - SETTLED, 0) : step + SETTLED + 1].max() for step in range(len(change))]
    return [int(step) for step in np.flatnonzero(jumps & (change >= near))]


def _read_between(
    frequency: Float[NDArray[np.float64], " m"], value: Complex[NDArray[np.complex128], " m"],
    at: Float[NDArray[np.float64], " n"],
) -> Complex[NDArray[np.complex128], " n"]:  # fmt: skip
    """Values of a curve at some frequencies by linear interpolation, shape (n,); NaN beyond its ends."""
    if not len(frequency):
        return np.full(len(at), np.nan, dtype=np.complex128)
    return np.asarray(np.interp(at, frequency, value, left=np.nan, right=np.nan))


def find_rows_between_jumps(observed: Observation, errors: tuple[JumpError, ...]) -> Bool[NDArray[np.bool_], " k"]:
    """Mask of rows between a measured jump and its predicted one, where the model is on another branch, shape (k,)."""
    points, between_jumps = observed.points, np.zeros(len(observed.points), dtype=bool)
    for item in errors:
        if np.isfinite(item.frequency_error):
            low, high = sorted((item.frequency, item.predicted_frequency))
            between = (points.frequency > low) & (points.frequency < high) & np.isin(points.sweep, (0, item.sweep))
            between_jumps |= between & (points.free == item.free) & (points.level == item.level)
    return between_jumps


def take_measured_branch(
    observed: Observation, prediction: Prediction, sweeps: tuple[int, ...]
) -> Complex[NDArray[np.complex128], " k"]:
    """Predicted values on the branch of the structure, shape (k,).

    Disturbances may cause a jump before the branch ends. After an early jump the prediction is taken on the branch to
    which the structure jumped: from the sweep back, or from the first state after the predicted jump without a sweep
    back. If the model jumps earlier than the structure, its last state before the jump is used for the missing branch.

    Parameters
    ----------
    observed, prediction, sweeps
        As for `compute_jump_errors`.
    """
    value, points = prediction.value.copy(), observed.points
    for jump in compute_jump_errors(observed, prediction, sweeps) if prediction.by_sweep.size else ():
        rows = np.flatnonzero(find_rows_between_jumps(observed, (jump,)))
        if not len(rows):
            continue
        late = jump.frequency_error * jump.sweep > 0
        number = sweeps.index(jump.sweep)
        if late and len(sweeps) > 1:
            back = prediction.by_sweep[1 - number, rows]
            # If the sweep back is on the same branch or has no state, the other branch of the model is unknown.
            other = np.abs(back - prediction.by_sweep[number, rows]) > MIN_JUMP * np.abs(back)
            value[rows[other]] = back[other]
            rows = rows[~other]
        # Beyond the jump of the model if it is late, before it if it is early.
        beyond = (points.frequency - jump.predicted_frequency) * jump.sweep > 0
        side = (points.free == jump.free) & (points.level == jump.level) & (beyond == late)
        for row in rows:
            own = np.flatnonzero(
                side & (points.sensor == points.sensor[row]) & (points.harmonic == points.harmonic[row])
            )
            if len(own):
                nearest = own[np.argmin(np.abs(points.frequency[own] - jump.predicted_frequency))]
                value[row] = prediction.by_sweep[number, nearest]
    return value


def list_swept_rows(observed: Observation, jump: SweepJump) -> tuple[Int[NDArray[np.int64], " n"], int]:
    """Rows of the sweep and motion of a jump, in ascending frequency, and index of the first one above the jump."""
    points = observed.points
    of_level = observed.motion & (points.harmonic == 1) & (observed.count > 0)
    of_level &= (points.free == jump.free) & (points.level == jump.level)
    sensor = points.sensor[of_level][np.argmax(np.abs(observed.value[of_level]))]
    rows = _sort_rising(observed, of_level & (points.sensor == sensor) & np.isin(points.sweep, (0, jump.sweep)))
    return rows, int(np.searchsorted(points.frequency[rows], jump.frequency))


def find_other_branch(
    observed: Observation, prediction: Prediction, sweeps: tuple[int, ...]
) -> Bool[NDArray[np.bool_], " k"]:
    """Mask of rows, at levels with jumps, at which the model is on another branch than the structure, shape (k,).

    At these the log error of the largest motion exceeds half of the log ratio of the jump.

    Parameters
    ----------
    observed, prediction, sweeps
        As for `compute_jump_errors`.
    """
    points, measured, predicted = observed.points, np.abs(observed.value), np.abs(prediction.value)
    other = np.zeros(len(points), dtype=bool)
    for jump, _ in find_measured_jumps(observed, sweeps):
        own, above = list_swept_rows(observed, jump)
        way = abs(np.log(measured[own[above]] / measured[own[above - 1]]))
        with np.errstate(invalid="ignore", divide="ignore"):
            off = np.abs(np.log(predicted[own] / measured[own])) > way / 2
        for row in own[off]:
            same = (points.frequency == points.frequency[row]) & (points.sweep == points.sweep[row])
            other |= same & (points.free == jump.free) & (points.level == jump.level)
    return other
