r"""Assignment of peaks to modes, over the levels of one structure, and between measurements and model.

The distance of two peaks combines frequency, in octaves, and shape: :math:`|\log_2 f_1 / f_2| + 1 - \mathrm{MAC}`.
Peaks an octave apart, or with orthogonal motions, are different modes. With a single sensor, or with sensors without
phase that move in proportion, the frequency alone decides. All peaks of two levels are paired simultaneously, such that
the sum of the distances is minimal.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

import numpy as np
from scipy.optimize import linear_sum_assignment

from correlation.metric.curve_peak import CurvePeak

#: Distance from which two peaks belong to different modes [-].
OTHER_MODE = 1.0
#: Peaks of one mode by the number of their level.
Mode = Mapping[int, CurvePeak]
One = TypeVar("One")
Other = TypeVar("Other")


def track_modes(states: Sequence[Sequence[CurvePeak]]) -> tuple[Mode, ...]:
    """Modes of a structure over its levels, in ascending frequency; each has a peak at one or more levels.

    Parameters
    ----------
    states
        Peaks of each level, in the order of the levels.
    """
    # Start with the level that shows most modes; the others are compared with the nearest known level.
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
    """Numbers of the predicted modes that correspond to measured ones, by the levels that show both."""
    return dict(_pair(measured, predicted, _measure_mode_distance))


def measure_distance(one: CurvePeak, other: CurvePeak) -> float:
    """Distance of two peaks in frequency and shape [-]."""
    apart = abs(float(np.log2(one.frequency / other.frequency)))
    both = np.isfinite(one.shape) & np.isfinite(other.shape)
    first, second = one.shape[both], other.shape[both]
    size = float(np.linalg.norm(first) * np.linalg.norm(second))
    return apart + (1 - float(abs(np.vdot(first, second)) / size) ** 2 if size else 0.0)


def _measure_mode_distance(one: Mode, other: Mode) -> float:
    common = one.keys() & other.keys()
    return float(np.mean([measure_distance(one[n], other[n]) for n in common])) if common else OTHER_MODE


def _pair(
    ones: Sequence[One], others: Sequence[Other], distance: Callable[[One, Other], float]
) -> list[tuple[int, int]]:
    """Pairs with the smallest sum of distances; those with a distance of different modes are left out."""
    if not (ones and others):
        return []
    apart = np.array([[min(distance(one, other), OTHER_MODE) for other in others] for one in ones])
    rows, columns = linear_sum_assignment(apart)
    return [(int(i), int(j)) for i, j in zip(rows, columns, strict=True) if apart[i, j] < OTHER_MODE]
