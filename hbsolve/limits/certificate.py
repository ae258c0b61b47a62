"""What is known about a limit beyond its value: how well it is solved, and how far from better ones.

A gradient norm says nothing at a kink, so the certificate takes steps: the gain that the linear programme predicts at
three radii, and the gain that the steady states there really have.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from hbsolve.limits.follow import follow
from hbsolve.limits.local_search import LimitSide, linear_step, local_search, moved
from hbsolve.limits.optimum import Best, Optimum
from hbsolve.limits.point import LimitPoint
from hbsolve.limits.problem import LimitProblem
from hbsolve.limits.sliders import multipliers

Real = NDArray[np.float64]

#: Steps, in lengths of the intervals.
RADII = (0.05, 0.0125, 0.003)
#: A neighbour's state, followed here, that ends so much worse lies on another branch of optima.
JUMP = 0.01


@dataclass(frozen=True, kw_only=True, eq=False)
class Certificate:
    """Of one limit; s sliders.

    Parameters
    ----------
    residual
        |R| relative to the linear motion [-].
    predicted, realised
        Gain of a step, relative to the value, at each of `RADII`, shape (3,) [-].
    spread
        Between the best and the worst end of the local searches, relative to the value [-].
    starts
        How many those were [-].
    stuck
        Sliders that keep memory [-].
    drift
        Largest |w - nominal| [m].
    on_bound
        Sliders that the box holds [-].
    repaired
        Whether a sampled state outside an earlier limit led here.
    jump
        Whether the limit is on another branch of optima than that of a neighbour in frequency.
    multiplier
        m of eq. 11, shape (s,) [-].
    share
        Shares of the period in which sliders stick, slip and are separated, shape (3,) [-].
    """

    residual: float
    predicted: Float[Real, " 3"]
    realised: Float[Real, " 3"]
    spread: float
    starts: int
    stuck: int
    drift: float
    on_bound: int
    repaired: bool
    jump: bool
    multiplier: Float[Real, " s"]
    share: Float[Real, " 3"]


def certificates(
    problem: LimitProblem, level: float, omega: Float[Real, " f"], numbers: Sequence[int], best: Best
) -> dict[tuple[int, LimitSide], Certificate]:
    """Certificates at the frequencies `numbers`; `best` also holds the neighbours of the first and the last."""
    found = {}
    for at in numbers:
        point = problem.at(float(omega[at]), level)
        for side in LimitSide:
            if (at, side) in best:
                optimum = best[at, side]
                # One state alone has no branches to choose from.
                jump = not _is_one(best, at) and any(
                    _jumps(problem, point, omega, at, step, side, best) for step in (-1, 1) if (at + step, side) in best
                )
                found[at, side] = _certificate(point, optimum, side, jump)
    return found


def _certificate(point: LimitPoint, optimum: Optimum, side: LimitSide, jump: bool) -> Certificate:
    trial = point.trial(optimum.x, optimum.w, optimum.residual)
    linear = linear_step(point, trial, side)
    size = max(abs(trial.value), point.measure.least)
    predicted, realised = np.zeros(len(RADII)), np.zeros(len(RADII))
    for number, radius in enumerate(RADII):
        step, gain = linear.step(radius)
        predicted[number] = gain / size
        there = moved(point, trial, linear, step) if gain > 0 else None
        realised[number] = side * (there.value - trial.value) / size if there else 0.0
    ends = np.array(optimum.starts)
    status = np.concatenate([
        trial.forces.status[2 * joint : 2 * joint + count]
        for joint, count in enumerate(np.diff(point.balance.table.slider)) if count
    ])  # fmt: skip
    return Certificate(
        residual=optimum.residual,
        predicted=predicted,
        realised=realised,
        spread=float(np.ptp(ends)) / size if len(ends) else 0.0,
        starts=len(ends),
        stuck=len(trial.free),
        drift=point.box.drift(trial.w),
        on_bound=point.box.active(trial.w),
        repaired=optimum.repaired,
        jump=jump,
        multiplier=multipliers(point.sliders, trial.x, trial.carried, point.balance.sampling.evaluate),
        share=np.bincount(status.ravel(), minlength=3) / status.size,
    )


def _is_one(best: Best, at: int) -> bool:
    """Whether both limits are the same to less than a jump."""
    if any((at, side) not in best for side in LimitSide):
        return False
    lower, upper = (best[at, side].value for side in LimitSide)
    return abs(upper - lower) <= JUMP * abs(upper)


def _jumps(
    problem: LimitProblem, point: LimitPoint, omega: Float[Real, " f"], at: int, step: int, side: LimitSide, best: Best
) -> bool:
    """Whether a neighbour's state does not become this one."""
    optimum, neighbour = best[at, side], best[at + step, side]
    worse = JUMP * max(abs(optimum.value), point.measure.least)
    if side * (optimum.value - optimum.followed.get(step, -side * np.inf)) <= worse:
        return False
    before, level = float(omega[at + step]), point.balance.level
    settled = follow(problem, level, side, neighbour, before, float(omega[at]))
    return settled is None or side * (optimum.value - local_search(point, settled, side).value) > worse
