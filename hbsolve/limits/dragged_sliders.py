"""How far the vibration of a test drags its sliders.

The static load bounds the friction forces at rest. Vibration raises normal forces, and a slider that it has dragged
stays there while the vibration goes on, at other frequencies too.
"""

from collections.abc import Callable, Sequence

import numpy as np

from hbsolve.limits.point import LimitPoint, Sliders, TrialState
from hbsolve.limits.problem import LimitCurve, LimitProblem
from hbsolve.limits.slider_bounds import N_KIND, ON_BOUND, random_sliders
from reduction.array_type import Real

#: Of what few tests with few harmonics reach; with more of both a slider was seen to come a sixth further [-].
MARGIN = 1.25


def dragged_reach(
    problem: LimitProblem,
    angular_frequency: Real,
    levels: Sequence[float],
    *,
    count: int = N_KIND,
    seed: int = 0,
    report: Callable[[float, float], None] | None = None,
) -> float:
    """Distance from the centre of the box that sliders of some tests reach [m], at least that of the box.

    A test begins at rest with sliders in the box, is swept from one end of the frequencies to the other, and back. The
    box holds no slider back on the way.

    Parameters
    ----------
    problem
        System, and the box of the states at rest.
    angular_frequency
        Rising, shape (f,) [rad/s].
    levels
        Levels of the tests, shape (l,) [-].
    count
        Tests at each level, half of them swept up first [-].
    seed
        Of their first sliders.
    report
        Called with the number of frequencies that are done, and of all on the way of all tests.
    """
    random, box = np.random.default_rng(seed), problem.box
    rising = range(len(angular_frequency))
    furthest, done, total = 0.0, 0, 4 * len(levels) * len(angular_frequency)
    for level in levels:
        curve = LimitCurve(problem=problem, level=level, angular_frequency=angular_frequency)
        for first, way in enumerate((rising, rising[::-1])):
            kinds = range(first, count, 2)
            sliders = [box.clip(random_sliders(problem.sliders, box, random, kind)) for kind in kinds]
            states: list[TrialState | None] = [None] * len(sliders)
            for at in (*way, *way[::-1]):
                point, last = curve.point(at), None
                for number, before in enumerate(states):
                    states[number] = state = _next(point, before, sliders[number], last)
                    if state is not None:
                        last, sliders[number] = state, state.carried
                        # The place of a slider that slips is no memory.
                        drift = np.abs(state.carried - box.nominal)[state.sticking]
                        furthest = max(furthest, float(drift.max(initial=0.0)))
                done += 1
                if report is not None:
                    report(done, total)
    return box.reach if furthest <= (1 + ON_BOUND) * box.reach else MARGIN * furthest


def _next(point: LimitPoint, before: TrialState | None, w: Sliders, last: TrialState | None) -> TrialState | None:
    """The state of a test at its next frequency; `last` is that of another test there."""
    near = None if before is None else point.solve(before.x, w)
    if near is None and last is not None:
        near = point.towards(w, last)
    return near or point.from_rest(w) or point.from_anywhere(w)
