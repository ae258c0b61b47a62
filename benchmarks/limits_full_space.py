"""Search one limit in the full space: harmonics and sliders are unknowns, the balance is a constraint (eqs 9-12).

`trust_region` is closest to the method of the paper: SciPy's trust-constr with forward differences for all derivatives.
`interior_point` is IPOPT with exact first derivatives and a limited-memory approximation of the second ones.
Both stop at a limit of processor time; `trust_region` also stops at a state with the wanted value and a small residual.
`race` runs both and the local search from one start; `limits.py` and `rig_limits_trust.py` call it.
"""

import time
from contextlib import suppress
from math import pi

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from hbsolve.aft import InitialSliders
from hbsolve.continuation.continuation_parameter import spread
from hbsolve.joint_law.registry import FORCE, PARAMETERS
from hbsolve.limits.local_search import LimitSide, local_search
from hbsolve.limits.point import LimitPoint, TrialState
from hbsolve.limits.problem import LimitProblem
from hbsolve.limits.result import ResponseLimits
from hbsolve.solution import forces_at, residual

Real = NDArray[np.float64]

#: Largest |R| of a feasible state, relative to the linear motion.
FEASIBLE = 1e-4


class Enough(Exception):
    """Ends a search: the time is over, or the wanted value is reached."""


class FullSpace:
    """Objective and constraint over z = (motion, sliders), in units of the largest reach of the box."""

    def __init__(self, point: LimitPoint, trial: TrialState, seconds: float, wanted: float) -> None:
        self.point, self.shape, self.unit = point, trial.motion.shape, float(point.box.reach.max())
        self.began, self.seconds, self.wanted = time.process_time(), seconds, wanted
        self.start = np.concatenate([trial.motion.ravel(), trial.initial_slider]) / self.unit
        self.n = trial.motion.size
        self.best = (0.0, np.inf)
        nominal = point.box.nominal / self.unit
        free = np.full(self.n, np.inf)
        self.bounds = np.concatenate([-free, nominal - 1]), np.concatenate([free, nominal + 1])

    @property
    def spent(self) -> float:
        return time.process_time() - self.began

    def _state(self, z: Real) -> tuple[Real, InitialSliders]:
        x, w = z[: self.n].reshape(self.shape) * self.unit, z[self.n :] * self.unit
        return np.ascontiguousarray(x), InitialSliders(np.ascontiguousarray(w), np.zeros(len(w), dtype=np.int64))

    def balance(self, z: Real) -> Real:
        x, start = self._state(z)
        point = self.point
        forces = forces_at(point.balance, point.condensed.angular_frequency, x, start, FORCE)
        R = residual(point.balance, point.condensed, x, forces)
        size = float(np.linalg.norm(R)) / point.scale
        value = point.measure.value(point.balance.level, x, forces.coefficients)
        if size < FEASIBLE and value > self.best[0]:
            self.best = value, size
        if self.spent > self.seconds or self.best[0] >= self.wanted:
            raise Enough
        return R.ravel() / self.unit

    def objective(self, z: Real) -> float:
        x, start = self._state(z)
        point = self.point
        forces = forces_at(point.balance, point.condensed.angular_frequency, x, start, FORCE)
        return -point.measure.value(point.balance.level, x, forces.coefficients) / self.unit

    def _derivatives(self, z: Real) -> tuple[Real, Real, Real, Real]:
        """Derivatives of g by x and by w, and of the objective by x and by g."""
        x, start = self._state(z)
        point = self.point
        forces = forces_at(point.balance, point.condensed.angular_frequency, x, start, PARAMETERS)
        d, nh = self.shape
        first, count = point.balance.joint_of_direction
        by_x = np.zeros((d, nh, d, nh))
        for direction in range(d):
            for other in range(count[direction]):
                block = forces.jacobian[direction, :, other * nh : (other + 1) * nh]
                by_x[direction, :, first[direction] + other] = block
        sliders = point.balance.table.slider
        joints = np.searchsorted(sliders, np.arange(sliders[-1]), side="right") - 1
        by_w = np.array([spread(point.balance, int(j), forces.by_start[s]) for s, j in enumerate(joints)])
        slopes = point.measure.slopes(point.balance.level, x, forces.coefficients)
        return by_x.reshape(self.n, self.n), by_w.reshape(len(joints), self.n).T, slopes[0].ravel(), slopes[1].ravel()

    def gradient(self, z: Real) -> Real:
        by_x, by_w, slope_x, slope_g = self._derivatives(z)
        return -np.concatenate([slope_x + slope_g @ by_x, slope_g @ by_w])

    def jacobian(self, z: Real) -> Real:
        by_x, by_w, *_ = self._derivatives(z)
        d, nh = self.shape
        both = np.hstack([by_x, by_w]).reshape(d, nh, -1)
        out = np.empty_like(both)
        A = self.point.condensed.receptance
        out[:, 0] = A[0].real @ both[:, 0]
        for k in range(1, (nh + 1) // 2):
            moved = np.tensordot(A[k], both[:, 2 * k - 1] - 1j * both[:, 2 * k], 1)
            out[:, 2 * k - 1], out[:, 2 * k] = moved.real, -moved.imag
        result = out.reshape(self.n, -1)
        result[:, : self.n] += np.eye(self.n)
        return result


def trust_region(point: LimitPoint, trial: TrialState, seconds: float, wanted: float) -> tuple[float, float, float]:
    """Search with trust-constr; returns value, |R| relative to the linear motion, and processor time [s]."""
    space = FullSpace(point, trial, seconds, wanted)
    constraint = scipy.optimize.NonlinearConstraint(space.balance, 0, 0, jac="2-point", hess=scipy.optimize.BFGS())
    with suppress(Enough):
        scipy.optimize.minimize(
            space.objective,
            space.start,
            jac="2-point",
            hess=scipy.optimize.BFGS(),
            method="trust-constr",
            constraints=[constraint],
            bounds=scipy.optimize.Bounds(*space.bounds),
        )
    return *space.best, space.spent


def interior_point(point: LimitPoint, trial: TrialState, seconds: float, _wanted: float) -> tuple[float, float, float]:
    """Search with IPOPT and exact first derivatives; returns the same as `trust_region`."""
    import casadi

    # IPOPT limits the time itself: an exception in a callback would be printed with all unknowns.
    space = FullSpace(point, trial, np.inf, np.inf)
    n, m = len(space.start), space.n

    class Call(casadi.Callback):
        """Function of z with its Jacobian."""

        def __init__(self, name: str, rows: int, value: object, derivative: object) -> None:
            casadi.Callback.__init__(self)
            self.rows, self.value, self.derivative = rows, value, derivative
            self.construct(name, {})

        def get_n_in(self) -> int:
            return 1

        def get_n_out(self) -> int:
            return 1

        def get_sparsity_in(self, _: int) -> object:
            return casadi.Sparsity.dense(n, 1)

        def get_sparsity_out(self, _: int) -> object:
            return casadi.Sparsity.dense(self.rows, 1)

        def eval(self, given: list[object]) -> list[object]:
            return [casadi.DM(self.value(np.array(given[0]).ravel()))]

        def has_jacobian(self) -> bool:
            return True

        def get_jacobian(
            self, name: str, _inputs: list[str], _outputs: list[str], options: dict[str, object]
        ) -> object:
            self.slope = Slope(name, self.rows, self.derivative, options)
            return self.slope

    class Slope(casadi.Callback):
        def __init__(self, name: str, rows: int, value: object, options: dict[str, object]) -> None:
            casadi.Callback.__init__(self)
            self.rows, self.value = rows, value
            self.construct(name, options)

        def get_n_in(self) -> int:
            return 2

        def get_n_out(self) -> int:
            return 1

        def get_sparsity_in(self, which: int) -> object:
            return casadi.Sparsity.dense(n, 1) if which == 0 else casadi.Sparsity(self.rows, 1)

        def get_sparsity_out(self, _: int) -> object:
            return casadi.Sparsity.dense(self.rows, n)

        def eval(self, given: list[object]) -> list[object]:
            return [casadi.DM(np.atleast_2d(self.value(np.array(given[0]).ravel())))]

    constraint = Call("balance", m, space.balance, space.jacobian)
    goal = Call("goal", 1, space.objective, space.gradient)
    z = casadi.MX.sym("z", n)
    options = {
        "ipopt.hessian_approximation": "limited-memory",
        "ipopt.print_level": 0,
        "print_time": False,
        "ipopt.max_cpu_time": seconds,
        "ipopt.tol": 1e-6,
        "error_on_fail": False,
    }
    solver = casadi.nlpsol("solver", "ipopt", {"x": z, "f": goal(z), "g": constraint(z)}, options)
    with suppress(RuntimeError):
        solver(x0=space.start, lbx=space.bounds[0], ubx=space.bounds[1], lbg=0, ubg=0)
    return *space.best, space.spent


#: Methods of a race besides the local search.
WAYS = (("trust-constr, differences", trust_region), ("IPOPT, exact derivatives", interior_point))
#: `trust_region` stops at this fraction of the best known value.
NEAR = 0.99
#: Smallest relative increase of the value by the local search from the start of a race.
GAIN = 0.02


def start_of_race(problem: LimitProblem, point: LimitPoint) -> TrialState | None:
    """State from which the local search increases the value, or None; at a stuck state the gradient is zero."""
    rest = point.from_rest(problem.box.nominal) or point.from_anywhere(problem.box.nominal)
    random = np.random.default_rng(1)
    for _ in range(60):
        if rest is None:
            return None
        w = problem.box.nominal + random.uniform(-1, 1, problem.box.nominal.shape) * problem.box.reach
        other = point.towards(w, rest)
        other = other and point.settle(other.motion, other.initial_slider)
        if other and local_search(point, other, LimitSide.UPPER).value > (1 + GAIN) * other.value:
            return other
    return None


def race(problem: LimitProblem, limits: ResponseLimits, row: int, at: int, seconds: float) -> None:
    """Print the cost of one upper limit with each method from one start.

    The limit is given by the row of its level and the index of its frequency.
    """
    omega, level, best = float(limits.angular_frequency[at]), float(limits.level[row]), float(limits.upper[row, at])
    print(f"\n{level:g} N, {omega / 2 / pi:.2f} Hz, best known {best * 1e6:.3f} um", flush=True)
    point = problem.at(omega, level)
    start = start_of_race(problem, point)
    if start is None:
        print("  no start from which there is anything to gain")
        return
    began = time.process_time()
    local = local_search(point, start, LimitSide.UPPER).value
    spent = time.process_time() - began
    print(f"  start of the race: {start.value * 1e6:.3f} um; local search: {local * 1e6:.3f} um in {spent:.3f} s")
    for name, method in WAYS:
        value, size, cost = method(point, start, seconds, NEAR * best)
        more = "" if value >= NEAR * best else "more than "
        print(
            f"  {name}: {value * 1e6:.3f} um, |R| {size:.0e}, {cost:.0f} s: {more}{cost / spent:.0f} times",
            flush=True,
        )
