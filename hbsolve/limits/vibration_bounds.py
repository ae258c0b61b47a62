r"""Bounds of slider positions under the vibration of a test.

The static load bounds the friction forces at rest, and so the slider positions at the start of a vibration. Vibration
raises normal forces, and a dragged slider keeps its position while the vibration continues, at other frequencies too.
Slider i then exceeds its distance at rest by an amount that is found by simulated tests of some histories. Contacts of
one line belong to two bodies that move together, and have the largest excess of the line,

.. math:: w_{\mathrm{max}, i} = w_{\mathrm{rest}, i} + 1.25 \max_{j \in \mathrm{line}(i)}
          \max_t\, (|w_j - w_{\mathrm{nominal}, j}| - w_{\mathrm{rest}, j})^+ .

These tests go from one steady state to the next. Laboratory tests have transients in between: a suddenly applied load
makes a lightly damped mode overshoot its steady state by a factor of up to two, through all smaller amplitudes. The
maximum is therefore over tests at the level and at twice the level.
"""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

from hbsolve.limits.point import LimitPoint, Sliders, TrialState
from hbsolve.limits.problem import LimitCurve, LimitProblem
from hbsolve.limits.slider_bounds import ON_BOUND, make_random_sliders
from reduction.array_type import Real

#: Safety factor on the excess of few tests with few harmonics [-].
MARGIN = 1.25
#: Largest ratio of a transient to its steady state [-].
OVERSHOOT = 2.0
#: Number of steps of slow sweeps from one frequency to the next.
SWEEP_STEPS = 4
#: Number of tests for each sequence of frequencies and direction, each from its own sliders.
N_TEST = 2
#: Seed of the first sliders of the tests.
SEED = 0


def compute_vibration_bounds(
    problem: LimitProblem,
    angular_frequency: Real,
    levels: Sequence[float],
    *,
    stops: Sequence[Sequence[int]] = (),
    report: Callable[[float, float], None] | None = None,
) -> Float[Real, "l s"]:
    """Distance of the sliders from the centre of the box in some tests at each level, at least that of the box [m].

    A test is at one load, which is a level or its overshoot. It begins at rest with sliders in the box, is swept from
    one end of the frequencies to the other, and back. The box does not bound the sliders during the test. Tests go
    directly from one frequency to the next, in `SWEEP_STEPS` steps, and with the stops of the laboratory tests: the
    final position of a slider depends on the last motion in which it slips, and so on the length of a step. A slowly
    growing motion drags its sliders along, while a long step may end on another branch, which drags some sliders less
    and others further.

    Parameters
    ----------
    problem
        System, and the box of the states at rest.
    angular_frequency
        Omega, ascending, shape (f,) [rad/s].
    levels
        Levels of the tests, shape (l,) [-].
    stops
        Frequencies at which each laboratory test stops, as ascending indices into `angular_frequency`.
    report
        Called with the number of finished frequencies, and of all frequencies of all tests.
    """
    box, line = problem.box, problem.sliders.line
    number = np.arange(len(angular_frequency))
    slowly = np.interp(np.linspace(0, number[-1], SWEEP_STEPS * number[-1] + 1), number, angular_frequency)
    straight = {tuple(number.tolist()), *(tuple(way) for way in stops)}
    rising = [*(SWEEP_STEPS * np.array(way) for way in sorted(straight)), np.arange(len(slowly))]
    ways = [way[::sign].tolist() for way in rising for sign in (1, -1)]
    loads = [factor * level for level in levels for factor in (1.0, OVERSHOOT)]
    excess = np.zeros((len(loads), len(line)))
    done, total = 0, 2 * len(loads) * sum(map(len, ways))
    for row, load in enumerate(loads):
        curve, random = LimitCurve(problem=problem, level=load, angular_frequency=slowly), np.random.default_rng(SEED)
        for first, way in enumerate(ways):
            kinds = range(first, N_TEST * len(ways), len(ways))
            sliders = [box.clip(make_random_sliders(problem.sliders, box, random, kind)) for kind in kinds]
            states: list[TrialState | None] = [None] * len(sliders)
            for at in (*way, *way[::-1]):
                point, last = curve.point(at), None
                for test, before in enumerate(states):
                    states[test] = state = _solve_next(point, before, sliders[test], last)
                    if state is not None:
                        last, sliders[test] = state, state.periodic_slider
                        # The position of a slipping slider does not depend on the history.
                        beyond = np.abs(state.periodic_slider - box.nominal) - box.reach
                        excess[row] = np.maximum(excess[row], np.where(state.sticking, beyond, 0.0))
                done += 1
                if report is not None:
                    report(done, total)
    # Excess of a slider that has not moved is round-off.
    excess[excess <= ON_BOUND * box.reach] = 0.0
    excess = excess.reshape(len(levels), 2, len(line)).max(axis=1)
    of_line = np.zeros((len(levels), int(line.max()) + 1))
    for slider, own in enumerate(line.tolist()):
        of_line[:, own] = np.maximum(of_line[:, own], excess[:, slider])
    return np.asarray(box.reach + MARGIN * of_line[:, line])


def _solve_next(point: LimitPoint, before: TrialState | None, w: Sliders, last: TrialState | None) -> TrialState | None:
    """The state of a test at its next frequency; `last` is the state of another test at that frequency.

    A state that is not found is skipped: a full search for each of very many states would take seconds.
    """
    near = None if before is None else point.solve(before.motion, w)
    if near is None and last is not None:
        near = point.towards(w, last)
    return near or point.from_rest(w) or point.from_few_starts(w)
