r"""A law whose state follows a rate equation: the cycle in which its state repeats every period, and its derivatives.

A law defines one step from an instant to the next, `step` below, and `rate_law` makes the rest. The first state is the
position of a slider; the others are reset at each instant. A period maps the slider w to F(w), and F' is the product of
the derivatives of the steps with respect to it, between 0 and 1. Newton's method finds the cycle :math:`w = F(w)` in a
few periods, also for F' near 1, and in the cycle :math:`dw = F' dw + b`, with b the change of a period that begins with
the same w. Time integration converges to this cycle after many periods. A joint that hardly moves keeps its slider at
its start, without a unique cycle.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from fe.compiled import compiled_template
from hbsolve.joint_law.registry import JACOBIAN, PARAMETERS, SLIP, STICK, CompiledLaw

#: Largest number of periods.
MAX_PERIOD = 100
#: Changes by a period, relative to the largest value of the state: round-off, below which the state has settled, and
#: the limit above which it is reported after `MAX_PERIOD` periods.
SETTLED, ROUND_OFF = 1e-13, 1e-11
#: Least 1 - F' of a cycle that double precision can resolve.
STILL = 1e-7
#: Derivative of the slider by the displacement from which on the slider counts as slipping.
FOLLOWS = 0.5


def step(before: float, after: float, velocity: float, state: Any, parameters: Any, value: Any, slope: Any) -> None:
    """Placeholder for the step of a law.

    Parameters
    ----------
    before, after
        Displacements at both instants [m].
    velocity
        Velocity at the second instant [m/s]; 0 for a law that does not use it.
    state
        State before the step, shape (s,).
    parameters
        Parameters of the joint, shape (p,).
    value
        Output: the force [N] and the state after the step, shape (1 + s,).
    slope
        Output: derivatives of both, shape (1 + s, 3 + s + p), by the displacement after, the velocity, the displacement
        before, each state and each parameter. It arrives as zeros.
    """


@compiled_template
def period(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, sampling: Any, state: Any, S: Any,
    traces: Any, out: Any,
) -> None:  # fmt: skip
    """Move the state and its derivatives S through a period; S has one column, or those of `force`."""
    n, s, p, nh, width = u.shape[1], len(state), len(parameters), sampling.evaluate.shape[0], S.shape[1]
    value, slope, moved = np.empty(1 + s), np.empty((1 + s, 3 + s + p)), np.empty((s, width))
    for k in range(n):
        slope[:] = 0.0
        speed = velocity[0, k] if velocity.shape[1] else 0.0
        step(u[0, k - 1], u[0, k], speed, state, parameters, value, slope)
        for r in range(1 + s):
            if r == 0 and len(traces) == 0:
                continue
            row, by = traces[k] if r == 0 else moved[r - 1], slope[r]
            row[:] = 0.0
            if width > 1:
                for a in range(nh):
                    row[a] = by[0] * sampling.instants[k, a] + by[2] * sampling.instants[k - 1, a]
                    row[a] += by[1] * omega * sampling.differentiate[a, k]
                row[nh : nh + p] = by[3 + s :]
                row[nh + p] = by[1] * speed / omega
            for i in range(s):
                if by[3 + i] != 0.0:
                    for c in range(width):
                        row[c] += by[3 + i] * S[i, c]
        S[:] = moved
        state[:] = value[1:]
        out.slider[:, k] = state
        out.force[0, k] = value[0] - reference[0] * u[0, k]
        out.status[:, k] = STICK if slope[1, 0] < FOLLOWS else SLIP


@compiled_template
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """Write the force of one direction; see `hbsolve.joint_law.registry`. A start by multiplier begins at zero."""
    n, s, p, nh = u.shape[1], len(start), len(parameters), sampling.evaluate.shape[0]
    state = np.zeros(s)
    for i in range(s):
        if not by_multiplier[i]:
            state[i] = start[i]
    first = state[0]
    still, moved, least = False, 0.0, np.inf
    kept, no_trace = np.zeros((s, 1)), np.zeros((0, 1))
    for number in range(MAX_PERIOD):
        begin = state[0]
        kept[:, 0] = 0.0
        kept[0, 0] = 1.0
        period(u, velocity, omega, reference, parameters, sampling, state, kept, no_trace, out)
        forgotten, moved = 1.0 - kept[0, 0], state[0] - begin
        if number == 0 and forgotten < STILL:
            still = True
            break
        if abs(moved) <= SETTLED * np.abs(out.slider[0]).max():
            break
        if forgotten >= STILL and abs(moved) < least:
            least = abs(moved)
            state[0] += moved * kept[0, 0] / forgotten
    else:
        out.unsettled[0] = not abs(moved) <= ROUND_OFF * np.abs(out.slider[0]).max()
    if want < JACOBIAN:
        return
    if not still:
        first = state[0]
    # Columns: coefficients of u, parameters, Omega, the first state at the start of the period.
    width = nh + p + 2
    S, traces = np.zeros((s, width)), np.zeros((n, width))
    for _ in range(1 if s == 1 else 2):  # in the second pass, the other states come from the period before
        state[0] = first
        S[0] = 0.0
        S[0, width - 1] = 1.0
        period(u, velocity, omega, reference, parameters, sampling, state, S, traces, out)
    if not still and 1.0 - S[0, width - 1] >= STILL:
        by = S[0].copy() / (1.0 - S[0, width - 1])
        for k in range(n):
            for c in range(width - 1):
                traces[k, c] += traces[k, width - 1] * by[c]
            traces[k, width - 1] = 0.0
    out.active[0] = nh
    out.jacobian[0, :, :nh] = np.dot(sampling.project.T, np.ascontiguousarray(traces[:, :nh]))
    for a in range(nh):
        out.jacobian[0, a, a] -= reference[0]
    if want >= PARAMETERS:
        for k in range(n):
            for i in range(p):
                out.by_parameter[i, 0, k] = traces[k, nh + i]
            out.by_frequency[0, k] = traces[k, nh + p]
            if not by_multiplier[0]:
                out.by_start[0, 0, k] = traces[k, width - 1]


@compiled_template
def step_slopes(before: Any, after: Any, velocity: Any, slider: Any, parameters: Any, out: Any) -> None:
    """See `hbsolve.joint_law.registry.CompiledLaw`."""
    s = len(slider)
    value, slope = np.empty(1 + s), np.zeros((1 + s, 3 + s + len(parameters)))
    step(before[0], after[0], velocity[0], slider, parameters, value, slope)
    out[:, :] = slope[:, : 3 + s]


def rate_law(name: str, step: Callable[..., None], *, uses_velocity: bool = False) -> CompiledLaw:
    """Make a law with one direction from its compiled `step`, as part of the module of `step`."""
    module = step.__module__
    return CompiledLaw(
        name=name,
        force=force(module, period=period(module, step=step)),
        instant=None,
        step_slopes=step_slopes(module, step=step),
        uses_velocity=uses_velocity,
    )
