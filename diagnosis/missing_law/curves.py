r"""Curves of a recovered law with their posterior scatter: loops, stiffness and work against amplitude, spring force.

Along u = A cos(omega t) with the force f,

.. math:: k(A) = \frac{2}{n A} \sum_j f_j \cos\theta_j, \qquad
          W(A) = \oint f\, du = -\frac{2 \pi A}{n} \sum_j f_j \sin\theta_j

are the secant stiffness and the work per cycle. The spring force is the mean of both branches of the largest loop. All
of them are linear in the coefficients, from which draws are taken.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.noise.symmetric_root import symmetric_root
from diagnosis.candidate.place import PlaceUnits
from diagnosis.missing_law.basis import EVEN, GROUPS, N_INSTANT, follow
from diagnosis.missing_law.place_law import PlaceLaw

Draws = Float[NDArray[np.float64], "d ..."]

#: Number of draws of the coefficients, number of amplitudes, and seed of the draws.
N_DRAW, N_AMPLITUDE, SEED = 400, 16, 20261127
#: Quantiles of a 95 % band.
BAND = (0.025, 0.975)


@dataclass(frozen=True, kw_only=True, eq=False)
class CurveWithBand:
    """A curve with its 95 % band, shape (n,) each.

    Parameters
    ----------
    x
        Abscissa.
    mean, low, high
        Most probable values and the band.
    """

    x: Float[NDArray[np.float64], " n"]
    mean: Float[NDArray[np.float64], " n"]
    low: Float[NDArray[np.float64], " n"]
    high: Float[NDArray[np.float64], " n"]


@dataclass(frozen=True, kw_only=True, eq=False)
class RecoveredLoop:
    """Force along the strongest measured motion of a level.

    Parameters
    ----------
    level
        Level [N].
    displacement, velocity
        Motion at the instants of the period, shape (n,) [m, m/s].
    force
        Force less its mean [N]; `x` is the phase over 2 pi [-].
    """

    level: float
    displacement: Float[NDArray[np.float64], " n"]
    velocity: Float[NDArray[np.float64], " n"]
    force: CurveWithBand


@dataclass(frozen=True, kw_only=True, eq=False)
class LawCurves:
    """Curves of a law over the excited range, and their draws.

    Parameters
    ----------
    loops
        Loop of each level, lowest first.
    stiffness, work
        Secant stiffness [N/m] and work per cycle [J] against the amplitude [m].
    spring
        Spring force [N] against the displacement [m], from the smallest to the largest.
    damper
        Force of the velocity alone [N] against the velocity [m/s].
    stiffness_draws, work_draws, spring_draws
        The same curves for each draw, shape (d, n).
    memory_share
        Share of the cells in the work at the largest amplitude, for each draw, shape (d,) [-].
    units
        Units at the place of the law; the units above are those for a displacement.
    sees_even
        Whether the data determine an even force.
    """

    loops: tuple[RecoveredLoop, ...]
    stiffness: CurveWithBand
    work: CurveWithBand
    spring: CurveWithBand
    damper: CurveWithBand
    stiffness_draws: Draws
    work_draws: Draws
    spring_draws: Draws
    memory_share: Float[NDArray[np.float64], " d"]
    units: PlaceUnits
    sees_even: bool


def compute_curves(law: PlaceLaw) -> LawCurves:
    """Curves of a law at a place."""
    basis, posterior = law.basis, law.posterior
    draws, sees_even = draw_coefficients(law), bool(posterior.is_seen[EVEN])
    loops, amplitudes = [], []
    for level in sorted({key[1] for key in law.table.keys}):
        at = [number for number, key in enumerate(law.table.keys) if key[1] == level]
        strongest = max(at, key=lambda number: abs(law.motion[number, 1]))
        amplitudes.append((abs(law.motion[strongest, 1]), law.angular_frequency[strongest]))
        u, v = follow(law.motion[[strongest]], law.angular_frequency[[strongest]])
        functions = basis.forces(u, v)[0]
        functions = functions - functions.mean(axis=0)
        phase = np.arange(N_INSTANT) / N_INSTANT
        loops.append(
            RecoveredLoop(
                level=level,
                displacement=u[0],
                velocity=v[0],
                force=_make_curve(phase, functions, posterior.mean, draws),
            )
        )
    amplitude, omega = np.array(sorted(amplitudes)).T
    grid = np.linspace(amplitude[0], amplitude[-1], N_AMPLITUDE)
    theta = 2 * np.pi * np.arange(N_INSTANT) / N_INSTANT
    speed = np.interp(grid, amplitude, omega)
    functions = basis.forces(grid[:, None] * np.cos(theta), -(grid * speed)[:, None] * np.sin(theta))
    secant = 2 / N_INSTANT * np.einsum("anb,n->ab", functions, np.cos(theta)) / grid[:, None]
    work = -2 * np.pi / N_INSTANT * np.einsum("anb,n->ab", functions, np.sin(theta)) * grid[:, None]
    x, spring = _average_branches(grid[-1], theta, functions[-1])
    velocity = np.linspace(0, basis.speed, 25)
    still = basis.forces(np.zeros((1, 25)), velocity[None])[0]
    still[:, basis.is_positive] = 0.0
    of_cells = work[-1] * (basis.group == GROUPS.index("memory"))
    whole = draws @ work[-1]
    return LawCurves(
        loops=tuple(loops), stiffness=_make_curve(grid, secant, posterior.mean, draws),
        work=_make_curve(grid, work, posterior.mean, draws), spring=_make_curve(x, spring, posterior.mean, draws),
        damper=_make_curve(velocity, still, posterior.mean, draws), stiffness_draws=draws @ secant.T,
        work_draws=draws @ work.T, spring_draws=draws @ spring.T, sees_even=sees_even,
        units=law.units, memory_share=(draws @ of_cells) / np.where(np.abs(whole) > 0, np.abs(whole), np.inf),
    )  # fmt: skip


def draw_coefficients(law: PlaceLaw, count: int = N_DRAW) -> Float[NDArray[np.float64], "d b"]:
    """Draws of the coefficients; those that must not be negative are clipped at zero, shape (d, b) [N]."""
    posterior, random = law.posterior, np.random.default_rng(SEED)
    scatter = random.standard_normal((count, len(posterior.mean))) @ symmetric_root(posterior.covariance)
    draws = posterior.mean + scatter
    return np.asarray(np.where(law.basis.is_positive, np.maximum(draws, 0.0), draws))


def _average_branches(
    amplitude: float, theta: Float[NDArray[np.float64], " n"], functions: Float[NDArray[np.float64], "n b"]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Displacements, and the mean of both branches of a loop less its value at zero, shape (x, b)."""
    n = len(theta)
    half = n // 2
    back = functions[(-np.arange(half + 1)) % n]
    mean = (functions[: half + 1] + back) / 2
    mean = mean - mean[half // 2]
    return (amplitude * np.cos(theta[: half + 1]))[::-1], mean[::-1]


def _make_curve(
    x: NDArray[np.float64], functions: Float[NDArray[np.float64], "n b"], mean: NDArray[np.float64], draws: Draws
) -> CurveWithBand:
    low, high = np.quantile(draws @ functions.T, BAND, axis=0)
    best = functions @ mean
    return CurveWithBand(x=x, mean=best, low=np.minimum(low, best), high=np.maximum(high, best))
