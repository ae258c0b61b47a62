"""Bounds of the sliders' displacements by the loading history, random slider states, and start states of a search.

Without a bound there are no limits: bodies held by friction alone can be dragged anywhere, and their contacts jammed
without limit. The box bounds the distance of the sliders from their positions under the static load.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.optimize
from jaxtyping import Float

from hbsolve.balance import HarmonicBalance
from hbsolve.condensed import Condensed
from hbsolve.errors import BalanceError
from hbsolve.limits.sliders import SliderTable, compute_stick_intervals, make_slider_table
from hbsolve.solution import solve_at
from hbsolve.state import make_initial_sliders
from reduction.array_input import check_array, check_real_number
from reduction.array_type import Real

Sliders = Float[Real, " s"]

#: Distance of a slider from its bound, relative to the reach, up to which it counts as at the bound.
ON_BOUND = 1e-6
#: Radius assumed for a slider without load at rest, relative to the mean radius.
UNLOADED = 0.3
#: Effect of static friction on a direction of normal forces, relative to the largest, below which it is left out.
WEAK = 0.1
#: Weight of opening a contact, against gains of normal forces scaled to one.
OPENING = 100.0
#: Without a box random states reach further, by a factor of up to 2^DOUBLINGS.
DOUBLINGS = 5.0
#: Number of kinds of `make_random_sliders`; the last two are corners of the box.
N_KIND = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class SliderBox:
    """Initial slider states |w - nominal| <= reach."""

    nominal: Sliders
    """Centre of the box, shape (s,) [m]."""
    reach: Sliders
    """w_max of each slider, infinite without bounds, shape (s,) [m]."""
    radius: Sliders
    """mu N / k_t of each slider at rest: largest stretch of its spring, shape (s,) [m]."""
    middle: Sliders
    """Position with a force-free spring at rest: the middle of Coulomb's cone, shape (s,) [m]."""

    @property
    def bounded(self) -> bool:
        """Whether the box has finite bounds."""
        return bool(np.isfinite(self.reach).all())

    @property
    def span(self) -> Sliders:
        """Length scales of slider moves, bounded or not, shape (s,) [m]."""
        return np.asarray(self.reach if self.bounded else np.full(len(self.radius), 4.0 * float(self.radius.mean())))

    @property
    def static(self) -> Sliders:
        """Largest distance of each slider from the middle by static forces within Coulomb's cone, shape (s,) [m].

        These are the radii, with an assumed one for sliders without load at rest.
        """
        return np.asarray(np.maximum(self.radius, UNLOADED * self.radius.mean()))

    def clip(self, w: Sliders) -> Sliders:
        """The nearest state in the box."""
        return np.clip(w, self.nominal - self.reach, self.nominal + self.reach)

    def drift(self, w: Sliders) -> float:
        """Largest |w - nominal| [m]."""
        return float(np.abs(w - self.nominal).max())

    def active(self, w: Sliders) -> int:
        """Number of sliders at the bound."""
        return int((np.abs(w - self.nominal) >= (1 - ON_BOUND) * self.reach).sum())


def make_slider_box(
    balance: HarmonicBalance,
    condensed: Condensed,
    nominal: Sequence[float] | Sliders | None = None,
    reach: float | Sequence[float] | Sliders | None = None,
) -> SliderBox:
    """A box about the state of rest, with the structure at any frequency; see `limit_problem` for centre and reach.

    Raises
    ------
    BalanceError
        A centre that does not fit, or a reach that is not positive.
    NoSteadyState
        No state of rest under the static load.
    """
    given = make_initial_sliders(balance, nominal)
    rest = solve_at(balance.at_level(0.0), condensed, None, given)
    intervals = compute_stick_intervals(rest.motion, make_slider_table(balance), balance.sampling.evaluate)
    radius = np.maximum(intervals.high - intervals.low, 0.0) / 2
    centre = given.value if nominal is not None else rest.periodic_slider
    middle = (intervals.low + intervals.high) / 2
    return SliderBox(nominal=np.array(centre), reach=_reach(reach, radius), radius=radius, middle=middle)


def _reach(given: float | Sequence[float] | Sliders | None, radius: Sliders) -> Sliders:
    """Reach of each slider, shape (s,) [m]."""
    if given is None or np.ndim(given) == 0:
        wide = float(radius.mean()) if given is None else check_real_number(given, "reach", BalanceError)
        if not wide > 0:
            default = " (by default mu N / k_t at rest, but no contact has a friction limit there)"
            raise BalanceError(
                f"reach = {wide:g} m must be positive: it is the largest initial displacement of the sliders"
                + (default if given is None else "")
            )
        return np.full(len(radius), wide)
    reach = np.array(check_array(given, "reach", BalanceError))
    if reach.shape != radius.shape or not (reach > 0).all():
        raise BalanceError(f"reach must be one positive number, or one of each of {len(radius)} sliders: {reach}")
    return reach


def make_random_sliders(table: SliderTable, box: SliderBox, random: np.random.Generator, kind: int) -> Sliders:
    """A random state in the box, of one of eight kinds: each slider, each line, lines with a slope, corners."""
    n, line = len(table.line), table.line
    n_line = int(line.max()) + 1
    # From -1 to 1 along each line.
    along = np.zeros(n)
    for number in range(n_line):
        along[line == number] = np.linspace(-1, 1, int((line == number).sum())) if (line == number).sum() > 1 else 0.0

    def of_line(largest: float) -> Sliders:
        return random.uniform(-largest, largest, n_line)[line]

    patterns: list[Callable[[], Sliders]] = [
        lambda: random.uniform(-1, 1, n),
        lambda: of_line(1),
        lambda: of_line(3) + random.uniform(-1, 1, n),
        lambda: random.choice([-1, 1], n_line)[line] * random.uniform(0.5, 4),
        lambda: of_line(3) + of_line(3) * along,
        lambda: random.normal(size=n) * 3,
        lambda: random.choice([-1.0, 1.0], n_line)[line],
        lambda: random.choice([-1.0, 1.0], n),
    ]
    pattern = np.asarray(patterns[kind % N_KIND]())
    if not box.bounded:
        pattern *= 2 ** random.uniform(0, DOUBLINGS)
    if kind % N_KIND >= 6:
        return box.nominal + pattern * box.span
    return box.clip(box.nominal - pattern * box.static)


def choose_starting_sliders(
    balance: HarmonicBalance, condensed: Condensed, table: SliderTable, box: SliderBox, count: int, seed: int
) -> list[Sliders]:
    """A population: rest, vertices of the static friction polytope, random states; the last two depend on the seed."""
    random = np.random.default_rng(seed)
    answer = [box.nominal.copy(), *_find_static_vertices(balance, condensed, table, box, random, count // 2 - 1)]
    kinds = [2 * k if k % 2 == 0 else k + 6 for k in range(count - len(answer))]
    return answer[:count] + [make_random_sliders(table, box, random, kind) for kind in kinds]


def _find_static_vertices(
    balance: HarmonicBalance,
    condensed: Condensed,
    table: SliderTable,
    box: SliderBox,
    random: np.random.Generator,
    count: int,
) -> list[Sliders]:
    """States within Coulomb's cone at rest, with extreme normal forces in some direction.

    Normal and tangential forces are linear in w while contacts stay closed; the directions are the singular vectors of
    dN/dw, both ways, then random mixtures of them.
    """
    n = len(table.tangent)
    pressed = [
        int(first) + joint.normal_direction
        for joint, first in zip(balance.system.joints, balance.table.direction, strict=False)
        if joint.normal_direction is not None
    ]
    if not pressed or count < 1:
        return []
    # Forces with all contacts closed and stuck, where every direction has its reference stiffness.
    rest = balance.linear(condensed, 0.0)[:, 0]
    A = condensed.receptance[0].real
    g = np.concatenate([joint.stuck_force for joint in balance.system.joints])
    x0 = rest - A @ g
    by_w = A[:, table.tangent] * table.stiffness
    T0, T_by_w = table.stiffness * x0[table.tangent], table.stiffness[:, None] * (by_w[table.tangent] - np.eye(n))
    limit0 = table.constant + np.where(table.normal >= 0, table.by_normal * x0[table.normal], 0.0)
    limit_by_w = np.where(table.normal >= 0, table.by_normal, 0.0)[:, None] * by_w[table.normal]
    N_by_w = balance.table.reference[pressed][:, None] * by_w[pressed]
    rows = np.vstack([T_by_w - limit_by_w, -T_by_w - limit_by_w])
    bound = np.concatenate([limit0 - T0, limit0 + T0])
    size = np.abs(rows).max(axis=1)
    slack = -np.vstack([np.eye(n), np.eye(n)])
    U, strength, _ = np.linalg.svd(N_by_w, full_matrices=False)
    retained = max(2, int((strength > WEAK * strength[0]).sum()))
    directions = [sign * U[:, k] for k in range(min(retained, U.shape[1])) for sign in (1, -1)]
    reach = box.reach if box.bounded else 2**DOUBLINGS * box.span
    unit = float(box.span.max())
    ends = np.column_stack([box.nominal - reach, box.nominal + reach]) / unit
    bounds = [*ends.tolist(), *[(0, None)] * n]
    answer: list[Sliders] = []
    for k in range(4 * count):
        if len(answer) == count:
            break
        direction = (
            directions[k] if k < len(directions) else U[:, :retained] @ random.normal(size=min(retained, U.shape[1]))
        )
        gain = direction @ N_by_w
        cost = np.concatenate([-gain / max(np.abs(gain).max(), np.finfo(float).tiny), np.full(n, OPENING)])
        result = scipy.optimize.linprog(
            cost, A_ub=np.hstack([rows / size[:, None], slack]), b_ub=bound / size / unit, bounds=bounds, method="highs"
        )
        if result.status == 0:
            answer.append(np.asarray(result.x)[:n] * unit)
    return answer
