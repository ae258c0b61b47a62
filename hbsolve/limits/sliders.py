r"""The sliders of a system as arrays, and the interval in which each of them sticks.

A slider that starts at w stays there, in a given motion of period T, if Coulomb's cone permits it at every instant:

.. math:: \max_t\, (u - \mu N / k_t) = w_\mathrm{low} \le w \le w_\mathrm{high} = \min_t\, (u + \mu N / k_t) .

Outside the interval it is dragged to the nearer end and stays there; with an empty interval it slips in every period,
and its start has no influence.

References
----------
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), eqs 6-8 and 11.
"""

import re
from typing import Any, NamedTuple

import numpy as np

from fe.compiled import compiled
from hbsolve.balance import HarmonicBalance
from hbsolve.errors import BalanceError
from reduction.array_type import Real, Whole
from reduction.joint_law.registry import SliderInterval


class SliderTable(NamedTuple):
    """Sliders as arrays, shape (s,) each."""

    tangent: Whole
    """Direction along which each slides."""
    normal: Whole
    """Direction of its normal load; -1 for a constant limit."""
    stiffness: Real
    """k_t [N/m]."""
    constant: Real
    """mu (N_0 - k_n g), or the constant limit [N]."""
    by_normal: Real
    """mu k_n [N/m], 0 for a constant limit."""
    line: Whole
    """Number of the line (and tangent) of a slider: contacts of a line have names that differ only in a last number."""


class StickIntervals(NamedTuple):
    """Intervals in which sliders stick in one motion, shape (s,) each."""

    low: Real
    high: Real
    """w_low and w_high [m]."""
    at_low: Whole
    at_high: Whole
    """Instants that determine the ends."""
    limit_slope_low: Real
    limit_slope_high: Real
    """d(mu N / k_t)/dv at these instants: 0 where the contact is open [-]."""


def make_slider_table(balance: HarmonicBalance) -> SliderTable:
    """Sliders of a balance, in order of joints and tangents.

    Refused (`BalanceError`) are a system without sliders, tangents coupled by one Coulomb limit, a disc without
    intervals, and joints stiffer than the linear reference.
    """
    if (stiffer := balance.find_stiffer_joint()) is not None:
        name, stiffness, most = stiffer
        raise BalanceError(
            f'joint "{name}" has a stiffness of {stiffness:.3g} N/m, which is too stiff for response limits with this '
            f"structure: give {most:.3g} N/m, which are practically rigid there"
        )
    rows: list[SliderInterval] = []
    lines: list[str] = []
    for joint, first in zip(balance.system.joints, balance.table.direction, strict=False):
        intervals, line = joint.slider_intervals, re.sub(r"[\s._-]*\d+$", "", joint.name)
        if isinstance(intervals, str):
            raise BalanceError(
                f'response limits need an interval in which each slider sticks, but "{joint.name}" {intervals}'
            )
        for item in intervals:
            normal = -1 if item.normal < 0 else int(first) + item.normal
            rows.append(item._replace(tangent=int(first) + item.tangent, normal=normal))
            lines.append(line if item.normal < 0 else f"{line} {item.tangent}")
    if not rows:
        raise BalanceError(
            "the system has no sliders, so its response does not depend on friction history: "
            "add a joint that slides, or compute its response curves"
        )
    columns = [np.array(item) for item in zip(*rows, strict=True)]
    names = list(dict.fromkeys(lines))
    return SliderTable(
        tangent=columns[0],
        normal=columns[1],
        stiffness=columns[2],
        constant=columns[3],
        by_normal=columns[4],
        line=np.array([names.index(line) for line in lines]),
    )


@compiled
def compute_stick_intervals(x: Any, sliders: Any, evaluate: Any) -> Any:
    """Intervals in the motion x of the joint directions, shape (d, nh)."""
    s, n = len(sliders.tangent), evaluate.shape[1]
    u = np.dot(x, evaluate)
    low, high = np.full(s, -np.inf), np.full(s, np.inf)
    at_low, at_high = np.zeros(s, np.int64), np.zeros(s, np.int64)
    slope_low, slope_high = np.zeros(s), np.zeros(s)
    for i in range(s):
        kt, slope = sliders.stiffness[i], sliders.by_normal[i] / sliders.stiffness[i]
        for k in range(n):
            limit = sliders.constant[i] / kt
            if sliders.normal[i] >= 0:
                limit += slope * u[sliders.normal[i], k]
            closed = limit > 0.0
            radius = limit if closed else 0.0
            if u[sliders.tangent[i], k] - radius > low[i]:
                low[i], at_low[i], slope_low[i] = u[sliders.tangent[i], k] - radius, k, slope if closed else 0.0
            if u[sliders.tangent[i], k] + radius < high[i]:
                high[i], at_high[i], slope_high[i] = u[sliders.tangent[i], k] + radius, k, slope if closed else 0.0
    return StickIntervals(low, high, at_low, at_high, slope_low, slope_high)


def multipliers(sliders: SliderTable, x: Real, w: Real, evaluate: Real) -> Real:
    """Multipliers m of eq. 11, T / (mu N) at the first instant, shape (s,) in [-1, 1]; 0 for an open contact."""
    first = x @ evaluate[:, 0]
    limit = sliders.constant + np.where(sliders.normal >= 0, sliders.by_normal * first[sliders.normal], 0.0)
    force = sliders.stiffness * (first[sliders.tangent] - w)
    return np.clip(np.divide(force, limit, out=np.zeros_like(force), where=limit > 0), -1.0, 1.0)
