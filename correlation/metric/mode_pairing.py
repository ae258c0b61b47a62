r"""Which peaks are of the same mode: over the levels of one structure, and of a measured and of a predicted one.

Two peaks are as far from each other as their frequencies, in octaves, and their shapes:
:math:`|\log_2 f_1 / f_2| + 1 - \mathrm{MAC}`. An octave, or motions at right angles, make another mode. Of a single
sensor, or of sensors without phase that move alike, the frequency alone decides. All peaks of two states are paired at
once, so that the sum of the distances is the least.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

import numpy as np
from scipy.optimize import linear_sum_assignment

from correlation.metric.curve_peak import CurvePeak

#: Distance from which on two peaks are of different modes [-].
OTHER_MODE = 1.0
#: Peaks of one mode by the number of their state.
Mode = Mapping[int, CurvePeak]
One = TypeVar("One")
Other = TypeVar("Other")


def track_modes(states: Sequence[Sequence[CurvePeak]]) -> tuple[Mode, ...]:
    """Modes of a structure over its levels, by rising frequency; each is seen at one level or more.

    Parameters
    ----------
    states
        Peaks of each level, in the order of the levels.
    """
    # A level that shows most modes tells them apart; from there on each is compared with the nearest level known.
    first = max(range(len(states)), key=lambda number: len(states[number]), default=0)
    modes: list[dict[int, CurvePeak]] = []
    for number in sorted(range(len(states)), key=lambda number: abs(number - first)):
        nearest = [mode[min(mode, key=lambda other: abs(other - number))] for mode in modes]
        pairs = dict(_pair(states[number], nearest, measure_distance))
        for own, peak in enumerate(states[number]):
            if own in pairs:
                modes[pairs[own]][number] = peak
            else:
                modes.append({number: peak})
    return tuple(sorted(modes, key=lambda mode: float(np.mean([peak.frequency for peak in mode.values()]))))


def pair_modes(measured: Sequence[Mode], predicted: Sequence[Mode]) -> dict[int, int]:
    """Numbers of the predicted modes that measured ones are, by the levels that show both."""
    return dict(_pair(measured, predicted, _mode_distance))


def measure_distance(one: CurvePeak, other: CurvePeak) -> float:
    """How far two peaks are from being of one mode [-]."""
    apart = abs(float(np.log2(one.frequency / other.frequency)))
    both = np.isfinite(one.shape) & np.isfinite(other.shape)
    first, second = one.shape[both], other.shape[both]
    size = float(np.linalg.norm(first) * np.linalg.norm(second))
    return apart + (1 - float(abs(np.vdot(first, second)) / size) ** 2 if size else 0.0)


def _mode_distance(one: Mode, other: Mode) -> float:
    common = one.keys() & other.keys()
    return float(np.mean([measure_distance(one[n], other[n]) for n in common])) if common else OTHER_MODE


def _pair(
    ones: Sequence[One], others: Sequence[Other], distance: Callable[[One, Other], float]
) -> list[tuple[int, int]]:
    """Pairs of the least sum of distances; those further apart than other modes are none."""
    if not (ones and others):
        return []
    apart = np.array([[min(distance(one, other), OTHER_MODE) for other in others] for one in ones])
    rows, columns = linear_sum_assignment(apart)
    return [(int(i), int(j)) for i, j in zip(rows, columns, strict=True) if apart[i, j] < OTHER_MODE]
