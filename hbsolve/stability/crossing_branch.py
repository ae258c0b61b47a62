r"""Branches that cross another one at a branch point, as where a symmetric structure begins to move asymmetrically.

At a branch point the equations :math:`[R_x \; R_\lambda]` have a second direction :math:`\varphi` in their kernel,
beside the tangent t of the known branch. Inverse iteration with the system bordered by t finds it. The plane
:math:`\varphi \cdot \Delta = \pm s`, in which Newton's method searches, contains no point of the known branch, which
departs from the branch point in this direction only to second order.

References
----------
Keller, in Applications of Bifurcation Theory (1977): switching of branches at a simple bifurcation point.
Seydel, Practical Bifurcation and Stability Analysis (2010), section 5.6.
"""

import numpy as np

from fe.blas_threads import on_one_blas_thread
from hbsolve.aft import InitialSliders
from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.arclength import Direction, Metric, correct_in_plane, tangent
from hbsolve.continuation.branch import ResponseBranch
from hbsolve.continuation.branch_path import make_path
from hbsolve.continuation.continuation_parameter import LevelPath, Path, equation
from hbsolve.continuation.response import follow_to_end, make_branch
from hbsolve.continuation.step import FIRST, Continuation, ContinuationState, Mark
from hbsolve.errors import BalanceError
from hbsolve.newton import bordered_step
from hbsolve.solution import recover_state
from hbsolve.stability.branch_stability import Bifurcation, BifurcationPoint
from hbsolve.state import SteadyState
from reduction.array_type import Real

#: Distances s from the branch point at which the other branch is sought, relative to the amplitude there.
DISTANCES = (0.02, 0.05, 0.1, 0.2)
#: Inverse iterations: each makes the error smaller by the distance to the branch point, some 1e-6.
ITERATIONS = 4
#: Relative residual for which the bordered system is solved by elimination: it is nearly singular here.
DENSE = 0.0


@on_one_blas_thread
def crossing_branches(
    balance: HarmonicBalance, branch: ResponseBranch, point: BifurcationPoint, *, step: float | None = None
) -> tuple[ResponseBranch, ...]:
    """Branches that leave another one at a branch point, one to either side, each beginning with that point.

    The two branches of a pitchfork are mirror images. They are followed within the range of the given branch, round
    folds.

    Parameters
    ----------
    balance, branch
        As for `hbsolve.stability.branch_stability.branch_stability`.
    point
        Bifurcation of the branch, of the kind `BRANCH_POINT`.
    step
        Largest step in angular frequency [rad/s] or level [-]; a fiftieth of the range by default.

    Returns
    -------
    One branch or two; none where no other branch is found near the point.

    Raises
    ------
    BalanceError
        A bifurcation of another kind, or a branch of another balance.
    """
    if point.kind is not Bifurcation.BRANCH_POINT:
        raise BalanceError(f"a {point.kind.label} has no other branch of the same period: give a branch point")
    path, values = make_path(balance, branch)
    result = []
    for side in (1, -1):
        left = _find_first_point(path, values, branch, balance, point, side)
        if left is None:
            continue
        first_state, state = left
        ends = (float(values.min()), float(values.max()))
        first, last = ends if state.tangent.value >= 0 else ends[::-1]
        continuation = Continuation(path=path, first=first, last=last, step=step)
        begun = [(_get_value(path, point.state), point.state), (state.value, first_state)]
        points, state, reason = follow_to_end(continuation, (begun, state))
        states = [item for _, item in points]
        result.append(
            make_branch([path.balance] * len(states), states, reason, continuation.stopped_at(state), state.leaps)
        )
    return tuple(result)


def _find_first_point(
    path: Path, values: Real, branch: ResponseBranch, balance: HarmonicBalance, point: BifurcationPoint, side: int
) -> tuple[SteadyState, ContinuationState] | None:
    """First point of the other branch to one side, and the state of a continuation there."""
    x, value, start = point.state.motion, _get_value(path, point.state), point.state.sliders
    metric = Metric(float(np.linalg.norm(x)) or 1.0, float(np.ptp(values)))
    after = branch.start(balance, point.index + 1) - branch.start(balance, point.index)
    way = Direction(after, float(values[point.index + 1] - values[point.index]))
    across = _find_second_direction(path, x, value, start, way, metric)
    for distance in DISTANCES:
        ahead = Direction(side * distance * across.motion, side * distance * across.value)
        t = Direction(side * across.motion, side * across.value)
        result = correct_in_plane(path, x, value, t, distance, metric, start, ahead)
        if result is None:
            continue
        away = Direction(result.motion - x, result.value - value)
        length = metric.length(away)
        here = recover_state(result.at.balance, result.at.condensed, result.motion, start, 0.0, result.iterations)
        state = ContinuationState(
            value=result.value, motion=result.motion, slider=start.value, by_multiplier=start.by_multiplier,
            tangent=Direction(away.motion / length, away.value / length), orientation=0, step=FIRST, n_point=2,
            mark=Mark(Direction(result.motion, result.value), Direction(0 * x, 0.0), 2),
        )  # fmt: skip
        return here, state
    return None


def _find_second_direction(
    path: Path, x: Real, value: float, start: InitialSliders, way: Direction, metric: Metric
) -> Direction:
    """Direction of length 1 in the kernel, perpendicular to the tangent of the known branch."""
    here = equation(path, value, x, start)
    t, _ = tangent(here, way, metric, 0)
    # A random direction has a component in the kernel; a fixed seed makes results repeatable.
    result = Direction(metric.motion * np.random.default_rng(0).standard_normal(x.shape), 0.0)
    first, count = here.balance.joint_of_direction
    border, corner = np.ascontiguousarray(t.motion / metric.motion**2), t.value / metric.value**2
    for _ in range(ITERATIONS):
        motion, by_value = bordered_step(
            here.forces, here.condensed.columns, first, count, -result.motion, here.by_value, border, corner,
            -result.value, DENSE,
        )  # fmt: skip
        length = metric.length(Direction(motion, float(by_value)))
        result = Direction(motion / length, float(by_value) / length)
    along = metric.dot(result, t)
    return Direction(result.motion - along * t.motion, result.value - along * t.value)


def _get_value(path: Path, state: SteadyState) -> float:
    """Lambda of a state."""
    return state.level if isinstance(path, LevelPath) else state.angular_frequency
