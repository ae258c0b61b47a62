"""Segalman's four-parameter Iwan joint: sliders in parallel on one displacement."""

from math import log
from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.parallel_sliders import parallel_sliders
from hbsolve.joint_law.registry import FORCES, CompiledLaw
from hbsolve.joint_law.slider import slider_slopes
from reduction.joint_law.iwan_joint import CELLS, FIRST


@compiled
def cells(parameters: Any, spring: Any, reach: Any, spring_by: Any, reach_by: Any) -> None:
    """Stiffness and displacement at slip of each slider, shape (CELLS + 1,), with derivatives, shape (CELLS + 1, 4).

    See `reduction.joint_law.iwan_joint.make_cells`. With a = chi + 1 and c = a / (a + 1) the spring of the cell from y
    to Y is K (Y^a - y^a) / (1 + beta), and its reach F (1 + beta) / (K (beta + c)) times the centroid
    c (Y^(a+1) - y^(a+1)) / (Y^a - y^a).
    """
    K, F, a, beta = parameters[0], parameters[1], parameters[2] + 1.0, parameters[3]
    c = a / (a + 1.0)
    c_by = 1.0 / (a + 1.0) ** 2
    largest = F * (1.0 + beta) / (K * (beta + c))
    growth, low, low_a, low_log = FIRST ** (-1.0 / (CELLS - 1)), 0.0, 0.0, 0.0
    for i in range(CELLS + 1):
        if i < CELLS:
            high = FIRST * growth**i
            high_log = log(high)
            high_a = high**a
            share, moment = high_a - low_a, high_a * high - low_a * low
            share_by, moment_by = high_a * high_log - low_a * low_log, high_a * high * high_log - low_a * low * low_log
            place = c * moment / share
            place_by = (c_by * moment + c * moment_by) / share - place * share_by / share
            low, low_a, low_log = high, high_a, high_log
        else:
            share, share_by, place, place_by = beta, 0.0, 1.0, 0.0
        spring[i], reach[i] = K * share / (1.0 + beta), largest * place
        by = spring_by[i]
        by[0], by[1], by[2] = spring[i] / K, 0.0, K * share_by / (1.0 + beta)
        by[3] = (K - spring[i] if i == CELLS else -spring[i]) / (1.0 + beta)
        by = reach_by[i]
        by[0], by[1] = -reach[i] / K, reach[i] / F
        by[2] = largest * (place_by - place * c_by / (beta + c))
        by[3] = reach[i] * (1.0 / (1.0 + beta) - 1.0 / (beta + c))


@compiled
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """One direction; see `hbsolve.joint_law.registry`."""
    spring, reach = np.empty(CELLS + 1), np.empty(CELLS + 1)
    spring_by, reach_by = np.empty((CELLS + 1, 4)), np.empty((CELLS + 1, 4))
    cells(parameters, spring, reach, spring_by, reach_by)
    parallel_sliders(
        u, parameters[0] - reference[0], spring, reach, spring_by, reach_by, start, by_multiplier, sampling, want, out
    )


@compiled
def step_slopes(before: Any, after: Any, velocity: Any, slider: Any, parameters: Any, out: Any) -> None:
    """See `hbsolve.joint_law.registry.CompiledLaw`."""
    spring, reach = np.empty(CELLS + 1), np.empty(CELLS + 1)
    spring_by, reach_by = np.empty((CELLS + 1, 4)), np.empty((CELLS + 1, 4))
    cells(parameters, spring, reach, spring_by, reach_by)
    for i in range(CELLS + 1):
        slider_slopes(0, 0, i, after[0], slider[i], spring[i] * reach[i], spring[i], 0.0, out)


FORCES.register(CompiledLaw(name="iwan4", force=force, instant=None, step_slopes=step_slopes))
