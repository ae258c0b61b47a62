"""Perturbation of optima, so that a search leaves their basin of attraction.

Basins occur in families. A damper rotated one way in its grooves gives about the same value as one rotated the other
way, but no small steps connect the two, since the states between them are far worse. So slider patterns are reversed,
in all combinations of lines, or in a random choice of combinations if there are too many.
"""

from collections.abc import Iterable, Sequence

import numpy as np

from hbsolve.limits.local_search import GAIN
from hbsolve.limits.optimum import LimitKey, Optima, improve
from hbsolve.limits.optimum_continuation import MAX_RELATIVE_LOSS
from hbsolve.limits.point import LimitPoint, Sliders, TrialState
from hbsolve.limits.problem import LimitCurve
from hbsolve.limits.slider_bounds import make_random_sliders
from hbsolve.limits.sliders import SliderTable

#: Largest number of reversed combinations of lines.
MOST_TURNS = 15
#: Number of random perturbations of each optimum, and their sizes, in lengths of the intervals.
N_RANDOM, SIZES = 12, (0.3, 1.0)


def perturb(
    curve: LimitCurve, best: Optima, keys: Iterable[LimitKey], seed: Sequence[int]
) -> tuple[Optima, set[LimitKey]]:
    """Search again from perturbations of some optima; returns the optima and the keys of those that improved."""
    best, gained = dict(best), set()
    random = np.random.default_rng(seed)
    for key in keys:
        point, optimum, side = curve.point(key[0]), best[key], key[1]
        trial = point.trial(optimum.motion, optimum.initial_slider, optimum.residual_norm)
        turned = reverse_lines(point.sliders, point.box.nominal, optimum.initial_slider, random)
        for w in (*turned, *(_perturb_at_random(point, best, key, trial, random) for _ in range(N_RANDOM))):
            reached = point.towards(point.box.clip(w), trial, tries=8)
            if reached is None or side * point.gain(reached.value, trial.value) < -MAX_RELATIVE_LOSS:
                continue
            if improve(point, best, key, reached.motion, reached.initial_slider) > 10 * GAIN:
                gained.add(key)
    return best, gained


def reverse_lines(table: SliderTable, nominal: Sliders, w: Sliders, random: np.random.Generator) -> list[Sliders]:
    """Sliders with displacements from nominal in reverse order along some lines, for each choice of lines."""
    count = int(table.line.max()) + 1
    members = [np.flatnonzero(table.line == line) for line in range(count)]
    if 2**count - 1 <= MOST_TURNS:
        chosen = [[line for line in range(count) if number >> line & 1] for number in range(1, 2**count)]
    else:
        chosen = [np.flatnonzero(random.random(count) < 0.5).tolist() for _ in range(MOST_TURNS)]
    result = []
    for lines in chosen:
        moved = w - nominal
        for line in lines:
            moved[members[line]] = moved[members[line]][::-1]
        result.append(nominal + moved)
    return result


def _perturb_at_random(
    point: LimitPoint, best: Optima, key: LimitKey, trial: TrialState, random: np.random.Generator
) -> Sliders:
    """Sliders moved at random, or those of another optimum."""
    table, n = point.sliders, len(point.sliders.tangent)
    length = np.abs(trial.intervals.high - trial.intervals.low)
    length = np.maximum(length, length.mean())
    kind = random.integers(4)
    if kind == 0:
        some = random.random(n) < 0.5
        return np.asarray(trial.initial_slider + some * random.normal(size=n) * random.choice(SIZES) * length)
    if kind == 1:
        return np.where(random.random(n) < 0.4, make_random_sliders(table, point.box, random, 7), trial.initial_slider)
    # Sliders of one line, or all sliders, of another nearby optimum of either limit.
    others = sorted(item for item in best if item != key)
    other = best[others[random.integers(len(others))]].initial_slider if others else trial.initial_slider
    line = int(random.integers(int(table.line.max()) + 1))
    return np.where(table.line == line, other, trial.initial_slider) if kind == 2 else other
