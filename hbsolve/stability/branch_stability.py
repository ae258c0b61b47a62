"""Stability along a branch, and the bifurcations between its points."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np
from jaxtyping import Complex, Int
from scipy.optimize import brentq

from fe.blas_threads import on_one_blas_thread
from hbsolve.aft import InitialSliders
from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.arclength import Direction, Metric, correct_in_plane, tangent
from hbsolve.continuation.branch import ResponseBranch
from hbsolve.continuation.branch_path import make_path
from hbsolve.continuation.continuation_parameter import equation
from hbsolve.errors import BalanceError
from hbsolve.linear_modes import LinearModes, compute_linear_modes
from hbsolve.solution import recover_state
from hbsolve.stability.stability import Stability, compute_stability, refuse_stiffer_joints
from hbsolve.state import SteadyState
from reduction.array_input import freeze_arrays
from reduction.array_type import Array, Real, Whole

#: Accuracy of the location of a bifurcation, relative to the distance between two points.
LOCATED = 1e-6
#: Imaginary part of a multiplier, relative to its size, below which it counts as real; distance from the unit circle
#: beyond which it has jumped; and largest angle of the multiplier at a fold [rad], which is not 0 where another one is
#: near, in a structure with hardly any damping.
REAL, ON_CIRCLE, NEAR_ONE = 1e-6, 1e-3, 0.5


class Bifurcation(Enum):
    """Event where multipliers leave or enter the unit circle; the value is its description."""

    FOLD = "fold: the curve turns back, and the motion jumps to another branch"
    BRANCH_POINT = "branch point: another branch of the same period crosses here"
    PERIOD_DOUBLING = "period doubling: a motion of twice the period begins"
    NEIMARK_SACKER = "Neimark-Sacker: a motion modulated by a second frequency begins"
    JUMP = "jump: multipliers jump, because a contact starts or stops slipping or touching"
    UNKNOWN = "unknown: no steady state was found between two points whose stability differs"

    @property
    def label(self) -> str:
        """Name of the bifurcation."""
        return self.value.partition(":")[0]


@dataclass(frozen=True, kw_only=True, eq=False)
class BifurcationPoint:
    """A point where the stability of a branch changes."""

    kind: Bifurcation
    index: int
    """Index of the point of the branch before it; it lies between this point and the next."""
    state: SteadyState
    """Steady state at the bifurcation."""
    multiplier: complex
    """Multiplier on the unit circle, or nearest to it at a jump; of a pair, that with a positive imaginary part [-]."""

    @property
    def second_frequency(self) -> float:
        """Frequency of the modulation of a Neimark-Sacker point, modulo that of the excitation [Hz]."""
        return abs(float(np.angle(self.multiplier))) / (2 * np.pi) * self.state.frequency


@dataclass(frozen=True, kw_only=True, eq=False)
class BranchStability:
    """Stability of each of the p points of a branch, and bifurcations."""

    n_unstable: Int[Whole, " p"]
    """Number of multipliers outside the unit circle, shape (p,)."""
    leading: Complex[Array, " p"]
    """Multiplier of the largest size, shape (p,) [-]."""
    bifurcations: tuple[BifurcationPoint, ...]
    """Bifurcations in the order of the branch, one wherever `n_unstable` changes. Two between the same two points may
    cancel and be missed."""

    def __post_init__(self) -> None:
        freeze_arrays(self, "n_unstable", dtype=np.int64)
        freeze_arrays(self, "leading", dtype=np.complex128)

    @property
    def is_stable(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Whether each point is stable, shape (p,)."""
        return np.asarray(self.n_unstable == 0)


@on_one_blas_thread
def branch_stability(
    balance: HarmonicBalance,
    branch: ResponseBranch,
    *,
    n_sample: int = 0,
    report: Callable[[float, float], None] | None = None,
) -> BranchStability:
    """Stability of a branch over frequency or level.

    Sliders that do not move keep their positions between two points.

    Parameters
    ----------
    balance
        Balance with which the branch was found.
    branch
        Branch of `frequency_response` or `level_response`.
    n_sample
        As for `hbsolve.stability.stability.stability`.
    report
        Called with the number of points done and of all points.

    Raises
    ------
    BalanceError
        A branch of another balance, or a branch along which neither frequency nor level alone changes.
    """
    analysis = _BranchFloquetAnalysis(balance, branch, n_sample)
    count = len(branch.angular_frequency)
    results = []
    for index in range(count):
        results.append(analysis.at_point(index))
        if report is not None:
            report(index + 1, count)
    n_unstable = np.array([item.n_unstable for item in results], dtype=np.int64)
    bifurcations = [analysis.locate(index, n_unstable) for index in np.flatnonzero(np.diff(n_unstable)).tolist()]
    return BranchStability(
        n_unstable=n_unstable,
        leading=np.array([item.multipliers[0] if len(item.multipliers) else 0.0 for item in results]),
        bifurcations=tuple(bifurcations),
    )


class _BranchFloquetAnalysis:
    """Floquet multipliers at the points of a branch and between them."""

    def __init__(self, balance: HarmonicBalance, branch: ResponseBranch, n_sample: int) -> None:
        if branch.coefficients.shape[1:] != (balance.n_harmonic, balance.system.n_dof):
            raise BalanceError(
                f"the branch has {branch.coefficients.shape[1]} harmonics with the mean and "
                f"{branch.coefficients.shape[2]} degrees of freedom, the balance {balance.n_harmonic} and "
                f"{balance.system.n_dof}: give the balance with which it was found"
            )
        names = tuple(joint.name for joint in balance.system.joints)
        n_slider = branch.periodic_slider.shape[1]
        if branch.joint_names != names or n_slider != balance.n_slider:
            raise BalanceError(
                f"the branch has the joints {', '.join(branch.joint_names) or 'none'} with {n_slider} "
                f"sliders, the balance {', '.join(names) or 'none'} with {balance.n_slider}: give the balance with "
                "which it was found"
            )
        refuse_stiffer_joints(balance)
        self.balance, self.branch, self.n_sample = balance, branch, n_sample
        self.path, self.value = make_path(balance, branch)
        self.modes: LinearModes = compute_linear_modes(balance)

    def motion(self, index: int) -> Real:
        """Real coefficients of the joint directions at a point."""
        return self.branch.start(self.balance, index)

    def sliders(self, index: int) -> InitialSliders:
        """Sliders of a point."""
        place = np.array(self.branch.periodic_slider[index])
        return InitialSliders(place, np.zeros(len(place), dtype=np.int64))

    def at(self, angular_frequency: float, motion: Real, sliders: InitialSliders) -> Stability:
        """Stability of a motion; it does not depend on the level."""
        return compute_stability(self.balance, self.modes, angular_frequency, motion, sliders, self.n_sample)

    def at_point(self, index: int) -> Stability:
        """Stability of a point."""
        return self.at(float(self.branch.angular_frequency[index]), self.motion(index), self.sliders(index))

    def locate(self, index: int, n_unstable: Int[Whole, " p"]) -> BifurcationPoint:
        """The bifurcation after a point."""
        x, sliders, value = self.motion(index), self.sliders(index), self.value
        way = Direction(self.motion(index + 1) - x, float(value[index + 1] - value[index]))
        amplitude = float(np.linalg.norm(x)) or 1.0
        metric = Metric(amplitude, float(np.ptp(value)) or 1.0)
        length = metric.length(way)
        t = Direction(way.motion / length, way.value / length)
        number = int(max(n_unstable[index], n_unstable[index + 1])) - 1
        best = x, float(value[index]), self.at_point(index)

        def beyond(share: float) -> float:
            nonlocal best
            ahead = Direction(share * way.motion, share * way.value)
            result = correct_in_plane(self.path, x, float(value[index]), t, share * length, metric, sliders, ahead)
            if result is None:
                raise _NoState
            here = self.at(result.at.condensed.angular_frequency, result.motion, sliders)
            distance = _compute_distance(here, number)
            if abs(distance) < abs(_compute_distance(best[2], number)):
                best = result.motion, result.value, here
            return distance

        try:
            brentq(beyond, 0.0, 1.0, xtol=LOCATED)
            located = True
        except (_NoState, ValueError):
            located = False
        motion, at, here = best
        multiplier = complex(here.multipliers[number]) if number < len(here.multipliers) else complex("nan")
        kind = self._kind(index, multiplier, t, metric) if located else Bifurcation.UNKNOWN
        balance, condensed = self.path.at(at)
        return BifurcationPoint(
            kind=kind,
            index=index,
            state=recover_state(balance, condensed, motion, sliders, 0.0, 0),
            multiplier=multiplier if multiplier.imag >= 0 else multiplier.conjugate(),
        )

    def _kind(self, index: int, multiplier: complex, way: Direction, metric: Metric) -> Bifurcation:
        if abs(abs(multiplier) - 1) > ON_CIRCLE:
            return Bifurcation.JUMP
        # Tangents in the direction of travel: at a fold their component along the parameter changes its sign.
        near = range(max(index - 1, 0), min(index + 3, len(self.value)))
        ways = []
        for at in near:
            here = equation(self.path, float(self.value[at]), self.motion(at), self.sliders(at))
            way, _ = tangent(here, way, metric, 0)
            ways.append(way.value)
        if min(ways) < 0 < max(ways) and abs(np.angle(multiplier)) < NEAR_ONE:
            return Bifurcation.FOLD
        if abs(multiplier.imag) > REAL * abs(multiplier):
            return Bifurcation.NEIMARK_SACKER
        return Bifurcation.PERIOD_DOUBLING if multiplier.real < 0 else Bifurcation.BRANCH_POINT


def _compute_distance(here: Stability, number: int) -> float:
    """Logarithm of the size of a multiplier, positive outside the unit circle; sliders at rest have no multiplier."""
    size = np.abs(here.multipliers[number]) if number < len(here.multipliers) else 0.0
    return float(np.log(max(size, np.finfo(float).tiny)))


class _NoState(Exception):
    """No steady state was found between two points."""
