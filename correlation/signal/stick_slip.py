r"""Tangential stiffness and friction coefficient from friction loops: the initial guesses of section 4.1 of the paper.

After each reversal the whole contact sticks, and the force follows :math:`\Delta T = k_t\, \Delta u`; the slope
decreases as parts begin to slip. In gross slip :math:`|T| = \mu N`. Both are obtained from the Jenkins elements of the
mean loop (`jenkins_elements`), which use all of its points and allow for a varying normal force.

References
----------
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), section 4.1.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Int
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.signal.jenkins_elements import Resolution, resolve
from correlation.signal.loop import Loops, analyse_loop, check_pair
from correlation.signal.mean_loop import MeanLoop, average_loops
from correlation.signal.record import Samples, check_channels
from correlation.uncertainty.interval import TWO_SIDED_95

#: Stiffness of the elements that never slip, as a fraction of the whole, below which a contact slips as a whole [-].
SLIPS = 0.05
#: Normal forces below this fraction of the largest are not used for friction [-].
LEAST_NORMAL = 0.1
#: Relative errors of stiffness and friction by the grid of elements and the points of the mean loop [-].
NUMERICAL = (2e-3, 1e-3)
#: Factor on the distance of the lower end of the interval of the stiffness by noise alone: elements that slip early are
#: added only if the data require them [-].
PARSIMONY = 1.5


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """A number with its uncertainty.

    Parameters
    ----------
    value
        Estimate.
    deviation
        Standard deviation.
    interval
        95 % interval; infinite on one side for a bound.
    """

    value: float
    deviation: float
    interval: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class StickSlip:
    """Initial guesses of a friction contact.

    Parameters
    ----------
    tangential_stiffness
        Slope of the loop at a reversal [N/m], including springs parallel to the contact.
    unslipped_stiffness
        Part of it that never slips [N/m]: springs parallel to the contact, or parts of the contact that still stick.
    friction_force
        Friction force in gross slip at the mean normal force [N]; otherwise the largest force, a lower bound.
    friction_coefficient
        Ratio of friction and normal force in gross slip, otherwise the largest abs(T / N), a lower bound; None without
        a normal force.
    force_offset
        Middle of both slip branches [N]: offset of the sensor, or a static force.
    gross_slip
        Whether the contact slips as a whole.
    n_period
        Number of periods used [-].
    suspicions
        Flags in words.
    """

    tangential_stiffness: Estimate
    unslipped_stiffness: Estimate
    friction_force: Estimate
    friction_coefficient: Estimate | None
    force_offset: Estimate
    gross_slip: bool
    n_period: int
    suspicions: tuple[str, ...] = ()


def estimate_stick_slip(displacement: Any, force: Any, normal_force: Any | None = None) -> StickSlip:
    """Initial guesses of stiffness and friction from the settled loops of the largest amplitude.

    Parameters
    ----------
    displacement
        Relative displacement of the two sides, shape (n,) [m].
    force
        Tangential force that resists it, shape (n,) [N].
    normal_force
        Normal force, positive in compression, shape (n,) or one number [N]; None if unknown.

    Raises
    ------
    CampaignError
        Less than one period, samples that are not finite, a force in the direction of the displacement, or a normal
        force without any compression.
    """
    x, f = check_pair(displacement, force)
    normal = _fill_normal_force(normal_force, len(x))
    loops = analyse_loop(x, f)
    loop = average_loops(x, f, normal, _find_settled_periods(loops))
    resolution = resolve(loop)
    return _make_stick_slip(loop, resolution, loops.suspicions, normal_force is not None)


def _fill_normal_force(normal_force: Any | None, n: int) -> Samples:
    """Normal force at every sample; 1 N if none is given."""
    if normal_force is None:
        return np.ones(n)
    given = np.asarray(normal_force, dtype=np.float64)
    normal = np.full(n, float(given)) if given.ndim == 0 else check_channels(given, "the normal force")[0]
    if len(normal) != n:
        raise CampaignError(
            f"the normal force has {len(normal)} samples, the loop {n}: give one per sample, or a number"
        )
    if not np.median(normal) > 0:
        raise CampaignError(
            f"the median of the normal force is {np.median(normal):.6g} N: compression is positive, change its sign"
        )
    return normal


def _find_settled_periods(loops: Loops) -> Int[NDArray[np.int64], " p"]:
    """Bounds of the periods of the plateau with the largest amplitude; of the last period if there is none."""
    if not loops.plateaus:
        return np.array([loops.first[-1], loops.last[-1]])
    best = max(loops.plateaus, key=lambda plateau: plateau.amplitude[0])
    return np.append(loops.first[best.first : best.last + 1], loops.last[best.last])


def _make_stick_slip(
    loop: MeanLoop, resolution: Resolution, suspicions: tuple[str, ...], has_normal: bool
) -> StickSlip:
    """The estimates with their intervals, and messages on their limits."""
    stiffness, friction, unslipped, offset, _ = resolution.numbers().tolist()
    if not stiffness > 0:
        raise CampaignError(
            "the force acts with the displacement instead of against it: change the sign of one of them (sign = -1)"
        )
    low, high = _compute_intervals(resolution)
    deviation = resolution.draws.std(axis=0).tolist()
    words = list(suspicions)
    low[0] = stiffness - PARSIMONY * (stiffness - low[0]) - NUMERICAL[0] * stiffness
    high[0] = max(high[0], high[4]) + NUMERICAL[0] * stiffness
    half = float(np.ptp(loop.displacement)) / 2
    if not resolution.resolved:
        high[0] = np.inf
        words.append(
            "parts of the contact slip right after each reversal, too early to identify their stiffness: the "
            "tangential stiffness is a lower bound"
        )
    normal = float(np.average(loop.normal, weights=loop.weight))
    gross = bool(unslipped < SLIPS * stiffness)
    if gross:
        margin = NUMERICAL[1] * friction
        coefficient = Estimate(
            value=friction,
            deviation=float(np.hypot(deviation[1], margin / 2)),
            interval=(low[1] - margin, high[1] + margin),
        )
        force = _scale_estimate(coefficient, normal)
    else:
        words.append(
            f"{unslipped / stiffness:.2g} of the stiffness, {unslipped:.4g} N/m, never slips within "
            f"+-{1e6 * half:.4g} um: gross slip is not reached, and the largest force is a lower bound of friction; or "
            "a spring of that stiffness acts in parallel to the contact, and is part of the tangential stiffness"
        )
        force, coefficient = _lower_bounds(loop, resolution, deviation[3])
    return StickSlip(
        tangential_stiffness=Estimate(value=stiffness, deviation=deviation[0], interval=(low[0], high[0])),
        unslipped_stiffness=Estimate(value=unslipped, deviation=deviation[2], interval=(max(low[2], 0.0), high[2])),
        friction_force=force,
        friction_coefficient=coefficient if has_normal else None,
        force_offset=Estimate(value=offset, deviation=deviation[3], interval=(low[3], high[3])),
        gross_slip=gross,
        n_period=loop.n_period,
        suspicions=tuple(words),
    )


def _compute_intervals(resolution: Resolution) -> tuple[list[float], list[float]]:
    """95 % intervals: the union of the bootstrap's percentiles and of those mirrored at the estimate, five each."""
    value = resolution.numbers()
    low, high = np.quantile(resolution.draws, [0.025, 0.975], axis=0)
    return np.minimum(low, 2 * value - high).tolist(), np.maximum(high, 2 * value - low).tolist()


def _scale_estimate(estimate: Estimate, factor: float) -> Estimate:
    low, high = estimate.interval
    return Estimate(
        value=estimate.value * factor, deviation=estimate.deviation * factor, interval=(low * factor, high * factor)
    )


def _lower_bounds(loop: MeanLoop, resolution: Resolution, deviation: float) -> tuple[Estimate, Estimate]:
    """Largest force and largest ratio to the normal force, without the offset: lower bounds of the friction limits."""
    force = np.abs(resolution.model - resolution.offset)
    loaded = loop.normal > LEAST_NORMAL * loop.normal.max()
    ratio = force[loaded] / loop.normal[loaded]
    top = int(np.argmax(ratio))
    bounds = [
        Estimate(value=value, deviation=spread, interval=(value - TWO_SIDED_95 * spread, np.inf))
        for value, spread in (
            (float(force.max()), deviation),
            (float(ratio[top]), deviation / float(loop.normal[loaded][top])),
        )
    ]
    return bounds[0], bounds[1]
