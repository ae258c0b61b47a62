r"""A friction loop resolved into Jenkins elements in parallel, by non-negative least squares.

A spring and a slider in series with the limit :math:`k \rho N(t)` follow :math:`k\, J_\rho(t)`, where J depends on
the motion and on the normal force, but not on k. Any contact of Coulomb friction without lift-off (Iwan's model) is
therefore a sum

.. math:: T(t) = T_0 + \sum_j k_j\, J_{\rho_j}(t), \qquad k_j \ge 0

on a grid of rho. Its stiffness in full stick is the sum of k_j, and its friction coefficient in gross slip the sum of
k_j rho_j. Parts that slip immediately after a reversal are indistinguishable from noise; the grid begins beyond them.

References
----------
Iwan, A distributed-element model for hysteresis and its steady-state dynamic response, J. Appl. Mech. 33 (1966) 893.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from correlation.signal.mean_loop import MeanLoop

Vector = Float[NDArray[np.float64], " m"]
Elements = Float[NDArray[np.float64], " j"]
Slips = Bool[NDArray[np.bool_], " j"]

#: Ratio of neighbouring limits of the grid; a finer grid would change nothing [-].
RATIO = 1.15
#: First guess of the shortest slip as a fraction of the half stroke, and smallest tried value [-].
FIRST, SHORTEST = 0.5, 0.005
#: Shorter slips are blurred by noise [standard deviations of the displacement].
BLURRED = 4.0
#: Least decrease of chi-squared by a finer grid: a chance of 1 in 300.
IMPROVES = 9.0
#: Number of refinements of the grid around the significant elements, to RATIO^(1/16), and largest number of these [-].
REFINEMENTS, MOST_REFINED = 4, 8
#: Number of elements at the end of the grid that represent immediate slip [-].
END = 4
#: Draws of the bootstrap; a quantile of 2.5 % is the sixth of them.
DRAWS = 240


@dataclass(frozen=True, kw_only=True, eq=False)
class Resolution:
    """Elements of a loop.

    Parameters
    ----------
    slip
        rho_j, descending, shape (j,) [m/N]; infinite for a spring.
    stiffness
        k_j, shape (j,) [N/m].
    slips
        Whether an element slips in both directions, shape (j,).
    offset
        T_0 [N].
    model
        Force of the elements at the points of the loop, shape (m,) [N].
    finest
        Stiffness with all elements of the grid, down to the shortest slip that noise allows [N/m]; noise biases it
        high.
    resolved
        Whether the first slip is beyond that shortest slip; otherwise the stiffness is a lower bound.
    draws
        Stiffness, friction coefficient, stiffness of elements that do not slip, offset, and `finest`, of bootstrap
        samples, shape (b, 5).
    """

    slip: Elements
    stiffness: Elements
    slips: Slips
    offset: float
    model: Vector
    finest: float
    resolved: bool
    draws: Float[NDArray[np.float64], "b 5"]

    def numbers(self) -> Vector:
        """Stiffness, friction coefficient, stiffness of elements that do not slip, offset, `finest`, shape (5,)."""
        return np.array([*_sum_elements(self.slip, self.slips, self.stiffness), self.offset, self.finest])


class _Grid:
    """Columns of a grid of elements without their means, and their weighted least squares."""

    def __init__(self, loop: MeanLoop, slip: Elements) -> None:
        self.slip, self.weight = slip, loop.weight
        columns, self.slips = simulate(loop, slip)
        self.means = np.average(columns, axis=0, weights=loop.weight)
        self.scale = float(np.abs(columns).max())
        self.columns = (columns - self.means) / self.scale

    def fit(self, force: Vector, count: int | None = None) -> tuple[Elements, float]:
        """Stiffnesses of the first elements of the grid, and the residual sum of squares."""
        from scipy.optimize import nnls

        root = np.sqrt(self.weight)
        stiffness, norm = nnls(self.columns[:, :count] * root[:, None], force * root)
        return stiffness / self.scale, float(norm**2)

    def force(self, stiffness: Elements) -> Vector:
        """Force of the elements without its mean, shape (m,)."""
        return np.asarray(self.scale * self.columns[:, : len(stiffness)] @ stiffness)


def resolve(loop: MeanLoop, seed: int = 0) -> Resolution:
    """Elements of a mean loop.

    Parameters
    ----------
    loop
        The loop with its noise.
    seed
        Seed of the bootstrap.
    """
    half = float(np.ptp(loop.displacement)) / 2
    mean = float(loop.samples.mean())
    force = loop.force - mean
    shortest = max(SHORTEST, BLURRED * loop.displacement_deviation / half)
    power = np.arange(np.log(2) / np.log(RATIO), np.log(shortest) / np.log(RATIO), -1)
    whole = _Grid(loop, np.append(np.inf, half * RATIO**power / float(np.median(loop.normal))))
    finest, least = whole.fit(force)
    variance = _estimate_noise(loop.samples - mean - whole.force(finest)[loop.point])
    count = int((RATIO**power >= FIRST).sum()) + 1
    best, left = whole.fit(force, count)
    for trial in range(count + 1, len(whole.slip) + 1):
        stiffness, residual = whole.fit(force, trial)
        if left - residual > IMPROVES * variance:
            count, best, left = trial, stiffness, residual
    # Whether the end of the grid is needed at all.
    resolved = whole.fit(force, len(whole.slip) - END)[1] - least < IMPROVES * variance
    grid = _Grid(loop, _refine(loop, whole.slip[:count], best, force))
    best, _ = grid.fit(force)
    return Resolution(
        slip=grid.slip,
        stiffness=best,
        slips=grid.slips,
        offset=float(mean - grid.means @ best),
        model=grid.force(best) + mean,
        finest=float(finest.sum()),
        resolved=bool(resolved),
        draws=_bootstrap(loop, (grid, whole), best, float(np.sqrt(variance)), np.random.default_rng(seed)),
    )


def _estimate_noise(residual: Vector) -> float:
    """Variance of white noise with the same effect on averages as a correlated residual in the order of the record."""
    power = np.abs(np.fft.rfft(residual)) ** 2
    white = power[1:].mean()
    slow = power[1 : max(len(power) // 10, 8)].mean()
    return float((residual**2).mean() * max(slow / white, 1.0)) if white > 0 else 0.0


def _refine(loop: MeanLoop, slip: Elements, stiffness: Elements, force: Vector) -> Elements:
    """The grid with more elements around those with stiffness, if these are few."""
    spacing = RATIO
    for _ in range(REFINEMENTS):
        used = slip[(stiffness > 0) & np.isfinite(slip)]
        if len(used) > MOST_REFINED:
            break
        spacing = np.sqrt(spacing)
        slip = np.unique(np.concatenate([slip, used * spacing, used / spacing]))[::-1]
        stiffness, _ = _Grid(loop, slip).fit(force)
    return slip


def simulate(loop: MeanLoop, slip: Elements) -> tuple[Float[NDArray[np.float64], "m j"], Slips]:
    """J of every element over a settled period, shape (m, j) [m], and whether each slips in both directions."""
    x, spring = loop.displacement, np.isinf(slip)
    limit = np.maximum(loop.normal, 0.0)[:, None] * np.where(spring, 0.0, slip)
    limit[:, spring] = np.inf
    stretch = np.zeros(len(slip))
    columns = np.zeros((len(x), len(slip)))
    up, down = np.zeros(len(slip), dtype=bool), np.zeros(len(slip), dtype=bool)
    for turn in range(2):
        for i in range(len(x)):
            stretch = stretch + (x[i] - x[i - 1])
            if turn:
                up |= stretch > limit[i]
                down |= stretch < -limit[i]
            stretch = np.clip(stretch, -limit[i], limit[i])
            columns[i] = stretch
    return columns, up & down


def _sum_elements(slip: Elements, slips: Slips, stiffness: Elements) -> list[float]:
    """Stiffness, friction coefficient, and stiffness of elements that do not slip."""
    return [float(stiffness.sum()), float(stiffness[slips] @ slip[slips]), float(stiffness[~slips].sum())]


def _bootstrap(
    loop: MeanLoop, grids: tuple[_Grid, _Grid], stiffness: Elements, noise: float, random: np.random.Generator
) -> Float[NDArray[np.float64], "b 5"]:
    """Numbers of fits to the model with new noise of the force, and of the displacement through the local slope."""
    from scipy.optimize import nnls

    grid, whole = grids
    model, root = grid.force(stiffness), np.sqrt(loop.weight)
    m = len(model)
    motion = np.gradient(loop.displacement)
    moves = np.abs(motion) > 1e-3 * np.abs(motion).max()
    slope = np.where(moves, np.gradient(model) / np.where(moves, motion, 1.0), 0.0).clip(0, stiffness.sum())
    phase = 2 * np.pi * np.cumsum(loop.weight) / loop.weight.sum()
    waves = np.array([wave(k * phase) for k in range(1, 6) for wave in (np.cos, np.sin)])
    size = loop.displacement_deviation * np.sqrt(2 / len(waves))
    factors = [np.linalg.qr(item.columns * root[:, None]) for item in grids]
    draws = []
    for _ in range(DRAWS):
        blur = size * random.standard_normal(len(waves)) @ waves
        drawn = root * (model - slope * blur) + noise * random.standard_normal(m)
        (own, _), (finest, _) = (nnls(r, q.T @ drawn) for q, r in factors)
        own, offset = (
            own / grid.scale,
            loop.samples.mean() + noise * random.standard_normal() / np.sqrt(len(loop.samples)),
        )
        draws.append(
            [*_sum_elements(grid.slip, grid.slips, own), offset - grid.means @ own, finest.sum() / whole.scale]
        )
    return np.array(draws)
