r"""Pseudo-arclength continuation of steady states over frequency, level or a joint's parameter, round folds.

A step goes from (x, lambda) along the unit tangent t by ds and is corrected in the plane square to t,

.. math:: R(x, \lambda) = 0, \qquad \frac{t_x \cdot \Delta x}{s_x^2} + \frac{t_\lambda \Delta \lambda}{s_\lambda^2} = 0

with s_x the amplitude of the vibration at the last point and s_lambda a share of the range: a step changes the motion
by a share ds of itself, or lambda by that share of s_lambda, whichever comes first.

References
----------
Keller, in Applications of Bifurcation Theory (1977): pseudo-arclength.
Seydel, Practical Bifurcation and Stability Analysis (2010), section 4.5: scaling and step control.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from hbsolve.aft import Start
from hbsolve.balance import HarmonicBalance, Real
from hbsolve.branch import ResponseBranch, branch_of
from hbsolve.errors import BalanceError
from hbsolve.newton import solve_bordered
from hbsolve.parameter import Equation, FrequencyPath, JointPath, LevelPath, equation
from hbsolve.steady_state import TOLERANCE, NoConvergence, SteadyState, finished, slider_start, solve_at, steady_state

#: Largest, first and smallest ds.
LARGEST, FIRST, LEAST = 0.2, 0.05, 1e-7
#: Corrections at most; a step that takes EASY or fewer grows, one that takes HARD or more shrinks.
CORRECTIONS, EASY, HARD = 10, 3, 6
GROW, SHRINK, RETRY = 1.5, 0.6, 0.35
#: Two successive tangents with a smaller cosine belong to different branches, unless the step is tiny (a kink).
ALIGNED, TINY = 0.5, 1e-3
#: Cosine between a step and the last tangent below which the step runs back.
BACKWARD = -0.8
#: Points of a closed branch at least, and the largest difference of the tangents' shares of lambda where it closes.
LEAST_LOOP, SAME_WAY = 12, 0.1
#: Steps of largest length over the range by default, and points at most.
STEPS, MOST_POINTS = 50, 5000

REACHED = "reached the last value"


@dataclass(frozen=True, kw_only=True, eq=False)
class ContinuationState:
    """All that the next step depends on; a continuation goes on from it with the same result.

    Parameters
    ----------
    value
        Lambda.
    motion
        Real coefficients of the joint directions, shape (d, nh) [m].
    slider, by_multiplier
        Initial state of the sliders, shape (s,).
    tangent_motion, tangent_value
        Unit tangent, in the direction of travel; zeros before the first step.
    step
        The next ds.
    n_point
        Points so far.
    mark_motion, mark_value, mark_tangent, mark_point
        An earlier point, with its tangent's share of lambda, and its number: a branch that comes back to it is closed.
    stop_reason
        Empty while there is a next step.
    """

    value: float
    motion: Real
    slider: Float[NDArray[np.float64], " s"]
    by_multiplier: NDArray[np.int64]
    tangent_motion: Real
    tangent_value: float
    step: float
    n_point: int
    mark_motion: Real
    mark_value: float
    mark_tangent: float
    mark_point: int
    stop_reason: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class Continuation:
    """A branch from one value of lambda to another.

    Parameters
    ----------
    path
        What lambda is: `FrequencyPath`, `LevelPath` or `JointPath`.
    first, last
        Where the branch begins and ends, in either order.
    step
        Largest step in lambda; a fiftieth of the range by default.
    most_points
        Stop after so many.

    Raises
    ------
    BalanceError
        An empty range, or a step that is not positive.
    """

    path: FrequencyPath | LevelPath | JointPath
    first: float
    last: float
    step: float | None = None
    most_points: int = MOST_POINTS

    def __post_init__(self) -> None:
        if not np.isfinite([self.first, self.last]).all() or self.first == self.last:
            raise BalanceError(f"the range from {self.first:g} to {self.last:g} is empty: give two different ends")
        for end in (self.first, self.last):
            self.path.at(end)  # refuses an end that its path cannot have, before anything is computed
        if self.step is not None and not self.step > 0:
            raise BalanceError(f"step = {self.step:g} must be positive")

    @property
    def _scale(self) -> float:
        """s_lambda."""
        return (self.step or abs(self.last - self.first) / STEPS) / LARGEST

    def begin(
        self, start: Real | None = None, slider: NDArray[np.float64] | None = None, multiplier: bool = False
    ) -> tuple[SteadyState, ContinuationState]:
        """The first point.

        Raises
        ------
        NoConvergence
            No steady state at the first value.
        """
        balance, condensed = self.path.at(self.first)
        sliders = slider_start(balance, slider, multiplier)
        try:
            found = solve_at(balance, condensed, start, sliders)
        except NoConvergence:
            found = steady_state(
                balance, condensed.angular_frequency, start=start, slider=sliders.value, multiplier=multiplier
            )
        return found, self.state_at(found.motion, sliders)

    def state_at(self, motion: Real, sliders: Start) -> ContinuationState:
        """Where the branch begins, for a solution at the first value."""
        return ContinuationState(
            value=self.first,
            motion=motion,
            slider=sliders.value,
            by_multiplier=sliders.by_multiplier,
            tangent_motion=np.zeros_like(motion),
            tangent_value=0.0,
            step=FIRST,
            n_point=1,
            mark_motion=motion,
            mark_value=self.first,
            mark_tangent=0.0,
            mark_point=1,
        )

    def advance(self, state: ContinuationState) -> tuple[SteadyState | None, ContinuationState]:
        """The next point, and the state after it; no point, and a stop reason, if there is none."""
        sliders = Start(np.array(state.slider), np.array(state.by_multiplier))
        x, value = np.array(state.motion), state.value
        here = equation(self.path, value, x, sliders)
        scale = _amplitude(x)
        t_x, t_value = self._tangent(here, state, scale)
        step = state.step
        while step >= LEAST:
            end = self._end(value, t_value, step)
            if end is not None:
                return self._finish(state, x + (self.last - value) / t_value * t_x, sliders)
            found = self._corrected(x, value, t_x, t_value, step, scale, sliders)
            if found is not None and self._backward(state, found[0] - x, found[1] - value, scale):
                # At a kink that turns by more than a right angle the way on has a negative share of the last tangent.
                t_x, t_value = -t_x, -t_value
                found = self._corrected(x, value, t_x, t_value, step, scale, sliders)
                if found is not None and self._backward(state, found[0] - x, found[1] - value, scale):
                    found, t_x, t_value = None, -t_x, -t_value
            if found is not None:
                x_new, value_new, iterations, at = found
                beyond = (value_new - self.last) * (self.last - self.first)
                if beyond > 0:
                    share = (self.last - value) / (value_new - value)
                    return self._finish(state, x + share * (x_new - x), sliders)
                if self._outside(value_new):
                    return None, replace(
                        state, stop_reason=self._words("turned back beyond its first value", value_new)
                    )
                grow = GROW if iterations <= EASY else SHRINK if iterations >= HARD else 1.0
                point = _point(at, x_new, sliders, iterations)
                if self._closed(state, x_new, value_new, t_value, step, scale):
                    reason = self._words("the branch closes on itself", value_new)
                    return point, replace(state, n_point=state.n_point + 1, stop_reason=reason)
                marked = state.n_point + 1 >= 2 * state.mark_point
                return point, replace(
                    state,
                    mark_motion=x_new if marked else state.mark_motion,
                    mark_value=value_new if marked else state.mark_value,
                    mark_tangent=t_value if marked else state.mark_tangent,
                    mark_point=state.n_point + 1 if marked else state.mark_point,
                    value=value_new,
                    motion=x_new,
                    tangent_motion=t_x,
                    tangent_value=t_value,
                    step=min(grow * step, LARGEST),
                    n_point=state.n_point + 1,
                    stop_reason="" if state.n_point + 1 < self.most_points else f"reached {self.most_points} points",
                )
            step *= RETRY
        return self._leap(state, x, sliders, t_value)

    def _backward(self, state: ContinuationState, dx: Real, dvalue: float, scale: float) -> bool:
        """Whether a step runs back along the way that led here."""
        last = np.sqrt(np.sum((state.tangent_motion / scale) ** 2) + (state.tangent_value / self._scale) ** 2)
        moved = np.sqrt(np.sum((dx / scale) ** 2) + (dvalue / self._scale) ** 2)
        share = np.sum(state.tangent_motion * dx) / scale**2 + state.tangent_value * dvalue / self._scale**2
        return bool(share < BACKWARD * last * moved)

    def _closed(
        self, state: ContinuationState, x: Real, value: float, t_value: float, step: float, scale: float
    ) -> bool:
        """Whether a point lies within a step of the marked one, and travels the same way."""
        away = np.sum(((x - state.mark_motion) / scale) ** 2) + ((value - state.mark_value) / self._scale) ** 2
        same_way = abs(t_value - state.mark_tangent) <= SAME_WAY * self._scale
        return bool(away <= step**2 and same_way and state.n_point >= state.mark_point + LEAST_LOOP)

    def _tangent(self, here: Equation, state: ContinuationState, scale: float) -> tuple[Real, float]:
        """Unit tangent in the direction of travel, from the bordered system with the last one as its border."""
        border, corner = state.tangent_motion / scale**2, state.tangent_value / self._scale**2
        if not state.tangent_value and not border.any():
            corner = np.sign(self.last - self.first) / self._scale**2
        balance = here.balance
        first, count = balance.joint_of_direction
        t_x, t_value = solve_bordered(
            here.forces, here.condensed.receptance, first, count, 0 * here.residual, here.by_value,
            np.ascontiguousarray(border), float(corner), -1.0,
        )  # fmt: skip
        length = np.sqrt(np.sum((t_x / scale) ** 2) + (t_value / self._scale) ** 2)
        if not np.isfinite(length) or length == 0.0:
            return np.zeros_like(state.motion), float(np.sign(self.last - self.first) * self._scale)
        return t_x / length, float(t_value / length)

    def _corrected(
        self, x: Real, value: float, t_x: Real, t_value: float, step: float, scale: float, sliders: Start
    ) -> tuple[Real, float, int, Equation] | None:
        """The point at one step from (x, value), with the number of corrections; none if they fail."""
        x_new, value_new = x + step * t_x, value + step * t_value
        border, corner = np.ascontiguousarray(t_x / scale**2), t_value / self._scale**2
        best = np.inf
        for iteration in range(CORRECTIONS + 1):
            try:
                at = equation(self.path, value_new, x_new, sliders)
            except BalanceError:
                return None
            norm = float(np.linalg.norm(at.residual))
            if norm <= TOLERANCE * float(np.linalg.norm(at.balance.linear(at.condensed))):
                break
            if iteration == CORRECTIONS or not np.isfinite(norm) or norm > 1e3 * best:
                return None
            best = min(best, norm)
            remainder = float((border * (x_new - x - step * t_x)).sum() + corner * (value_new - value - step * t_value))
            first, count = at.balance.joint_of_direction
            dx, dvalue = solve_bordered(
                at.forces, at.condensed.receptance, first, count, at.residual, at.by_value, border, corner, remainder
            )
            x_new, value_new = x_new + dx, value_new + float(dvalue)
        moved = np.sqrt(np.sum(((x_new - x) / scale) ** 2) + ((value_new - value) / self._scale) ** 2)
        aligned = step / moved if moved else 0.0
        return None if aligned < ALIGNED and step > TINY else (x_new, value_new, iteration, at)

    def _end(self, value: float, t_value: float, step: float) -> float | None:
        """Share of the step at which its prediction reaches the last value."""
        ahead = self.last - value
        reach = step * t_value
        return ahead / reach if reach and 0 <= ahead / reach <= 1 else None

    def _finish(
        self, state: ContinuationState, predicted: Real, sliders: Start
    ) -> tuple[SteadyState | None, ContinuationState]:
        balance, condensed = self.path.at(self.last)
        try:
            found = solve_at(balance, condensed, predicted, sliders)
        except NoConvergence as error:
            return None, replace(state, stop_reason=str(error))
        return found, replace(
            state, value=self.last, motion=found.motion, n_point=state.n_point + 1, stop_reason=REACHED
        )

    def _leap(
        self, state: ContinuationState, x: Real, sliders: Start, t_value: float
    ) -> tuple[SteadyState | None, ContinuationState]:
        """Where the arc cannot be followed, the next point at a fixed lambda."""
        towards = np.sign(t_value or self.last - self.first)
        for share in (0.1, 0.5, 0.01):
            value = state.value + float(towards) * share * LARGEST * self._scale
            if self._outside(value) or (self.last - value) * (self.last - self.first) < 0:
                continue
            balance, condensed = self.path.at(value)
            try:
                found = solve_at(balance, condensed, x, sliders)
            except NoConvergence:
                continue
            jump = np.linalg.norm(found.motion - x) / _amplitude(x)
            if jump > 5 * LARGEST:
                continue
            return found, replace(
                state,
                value=value,
                motion=found.motion,
                tangent_motion=np.zeros_like(x),
                tangent_value=float(towards),
                step=FIRST,
                n_point=state.n_point + 1,
            )
        return None, replace(
            state, stop_reason=self._words("the corrections fail even for the smallest step", state.value)
        )

    def _outside(self, value: float) -> bool:
        return (value - self.first) * (self.last - self.first) < 0

    def _words(self, reason: str, value: float) -> str:
        return f"{reason}, at {self.path.shown(value):.6g} {self.path.unit}"


def run(
    continuation: Continuation,
    start: Real | None = None,
    slider: NDArray[np.float64] | None = None,
    report: Callable[[float, float], None] | None = None,
) -> ResponseBranch:
    """A whole branch.

    Parameters
    ----------
    continuation
        What, from where to where.
    start, slider
        As `hbsolve.steady_state.steady_state`.
    report
        Called with the way done and the whole way.
    """
    found, state = continuation.begin(start, slider)
    states, values, way = [found], [state.value], abs(continuation.last - continuation.first)
    while not state.stop_reason:
        point, state = continuation.advance(state)
        if point is not None:
            states.append(point)
            values.append(state.value)
        if report is not None:
            report(abs(state.value - continuation.first), way)
    path = continuation.path
    # A joint's parameter is part of the balance; frequency and level are part of the state.
    balances = [path.at(value)[0] for value in values] if isinstance(path, JointPath) else path.balance
    return branch_of(balances, states, state.stop_reason)


def frequency_response(
    balance: HarmonicBalance,
    first: float,
    last: float,
    *,
    step: float | None = None,
    slider: NDArray[np.float64] | None = None,
    report: Callable[[float, float], None] | None = None,
) -> ResponseBranch:
    """Forced response over frequency, round folds.

    Parameters
    ----------
    balance
        The system, its harmonics and the level of its force.
    first, last
        Range of Omega, in either order [rad/s].
    step
        Largest step [rad/s]; a fiftieth of the range by default.
    slider
        Initial slider positions, shape (s,) [m]; zero by default.
    report
        Called with the way done and the whole way.
    """
    return run(
        Continuation(path=FrequencyPath(balance=balance), first=first, last=last, step=step), None, slider, report
    )


def level_response(
    balance: HarmonicBalance,
    angular_frequency: float,
    first: float,
    last: float,
    *,
    step: float | None = None,
    slider: NDArray[np.float64] | None = None,
    report: Callable[[float, float], None] | None = None,
) -> ResponseBranch:
    """Response at one frequency over the level of the force, round folds; see `frequency_response`."""
    path = LevelPath(balance=balance, angular_frequency=angular_frequency)
    return run(Continuation(path=path, first=first, last=last, step=step), None, slider, report)


def joint_response(
    balance: HarmonicBalance,
    angular_frequency: float,
    joint: str,
    parameter: str,
    first: float,
    last: float,
    *,
    step: float | None = None,
    slider: NDArray[np.float64] | None = None,
    report: Callable[[float, float], None] | None = None,
) -> ResponseBranch:
    """Response at one frequency over a parameter of a joint, round folds; see `frequency_response`."""
    path = JointPath(balance=balance, angular_frequency=angular_frequency, joint=joint, parameter=parameter)
    return run(Continuation(path=path, first=first, last=last, step=step), None, slider, report)


def _amplitude(x: Real) -> float:
    """Size of the vibration, or of the displacement where nothing vibrates [m]."""
    vibration = float(np.linalg.norm(x[:, 1:]))
    return vibration or float(np.linalg.norm(x)) or 1.0


def _point(at: Equation, x: Real, sliders: Start, iterations: int) -> SteadyState:
    size = float(np.linalg.norm(at.balance.linear(at.condensed))) or 1.0
    return finished(at.balance, at.condensed, x, sliders, float(np.linalg.norm(at.residual)) / size, iterations)
