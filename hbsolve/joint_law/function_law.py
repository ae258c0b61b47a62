r"""A user's own law: its compiled function is called instant by instant, through periods, until its state repeats.

A period maps the state w to F(w). Sliders repeat after two periods. A state that decays slowly needs many, but F is
then practically linear: with F' its Jacobian, all further periods together move the state by

.. math:: \sum_{m \ge 0} F'^m\, r = (I - F' + P)^{-1} (I - P)\, r, \qquad r = F(w) - w, \qquad P = F'^{\,\infty} ,

which is Newton's method if P = 0. P projects onto the part of the state that no period changes, such as a slider that
sticks: this part keeps its start. Derivatives are carried through all periods, and converge by the same sum. A state
that still creeps after `MAX_PERIOD` periods is reported (`LawOutput.unsettled`). A start by multiplier is a position
between Coulomb's limits, which these laws do not have: the state then starts at zero.
"""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.registry import JACOBIAN, PARAMETERS, SLIP, STICK
from reduction.joint_law.function_pointer import call_step

#: Largest number of periods.
MAX_PERIOD = 200
#: Changes by a period, relative to the largest value of the state, below which it has settled: round-off of a period,
#: and the limit where further periods do not reduce the change.
SETTLED, ROUND_OFF = 1e-13, 1e-11
#: P is the product of F' over 2^DOUBLINGS periods: a part of the state that decays by less than 1e-7 per period has no
#: cycle that double precision can resolve, and keeps its start.
DOUBLINGS = 28


@compiled
def instant(address: int, u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force of a law without memory at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    result = np.zeros((3 + len(parameters), 1))
    call_step(address, u, velocity, parameters, parameters, result, 2 + len(parameters))
    for i in range(len(slope)):
        slope[i] = result[1 + i, 0]
    return float(result[0, 0])


@compiled
def step_slopes(
    address: int, before: Any, after: Any, velocity: Any, slider: Any, parameters: Any, out: Any
) -> None:  # fmt: skip
    """A step of a law with memory; see `hbsolve.joint_law.registry.CompiledLaw`."""
    s = len(slider)
    result = np.zeros((3 + s + len(parameters), 1 + s))
    call_step(address, after[0], velocity[0], slider, parameters, result, 2 + s)
    for row in range(1 + s):
        out[row, 0], out[row, 1] = result[1, row], result[2, row]
        for i in range(s):
            out[row, 3 + i] = result[3 + i, row]


@compiled
def force(
    address: int, u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """One direction; see `hbsolve.joint_law.registry`; `address` is that of a compiled function."""
    n, nh = u.shape[1], sampling.evaluate.shape[0]
    s, p = len(start), len(parameters)
    derive, with_parameters = want >= JACOBIAN, want >= PARAMETERS
    # Columns: coefficients of u, and, where they are wanted, parameters, starts, Omega; last, the state before the
    # period.
    lead = (nh + (p + s + 1 if with_parameters else 0)) if derive else 0
    S, traces = np.zeros((s, lead + s)), np.zeros((n if derive else 1, lead + s))
    before = np.zeros((s, lead))
    state, begin, largest, last_state, last_S = np.zeros(s), np.zeros(s), np.zeros(s), np.zeros(s), np.zeros_like(S)
    for i in range(s):
        if not by_multiplier[i]:
            state[i] = start[i]
            if with_parameters:
                S[i, nh + p + i] = 1.0
    changed, least = 0.0, np.inf
    for number in range(MAX_PERIOD if s else 1):
        begin[:] = state
        before[:] = S[:, :lead]
        for i in range(s):
            S[i, lead:] = 0.0
            S[i, lead + i] = 1.0
        track = derive or number > 1
        _period(
            address, u, velocity, omega, reference, parameters, sampling, lead, derive, with_parameters, track, state,
            S, traces, largest, out,
        )  # fmt: skip
        changed = 0.0
        for i in range(s):
            if state[i] != begin[i]:
                part = abs(state[i] - begin[i]) / largest[i]
                changed = max(changed, part if np.isfinite(part) else np.inf)
        if changed == np.inf and least < np.inf:  # extrapolated to where the law is not defined: only iterate
            state[:], S[:], least = last_state, last_S, 0.0
        elif changed <= SETTLED or (changed <= ROUND_OFF and changed >= least):
            break
        elif track and changed < least:
            least = changed
            last_state[:], last_S[:] = state, S
            state += _further_periods(S[:, lead:], (state - begin).reshape(s, 1))[:, 0]
    out.unsettled[0] = not changed <= ROUND_OFF
    if not derive:
        return
    if not np.array_equal(before, S[:, :lead]):
        by_begin = S[:, :lead] - before
        by_begin += _further_periods(S[:, lead:], by_begin)
        traces[:, :lead] += np.dot(np.ascontiguousarray(traces[:, lead:]), by_begin)
    # A joint with the slope of its linear reference at every instant, such as a sticking one, has no active rows.
    if not np.array_equal(traces[:, :nh], reference[0] * sampling.instants):
        out.active[0] = nh
        out.jacobian[0, :, :nh] = np.dot(sampling.project.T, np.ascontiguousarray(traces[:, :nh]))
        for a in range(nh):
            out.jacobian[0, a, a] -= reference[0]
    if with_parameters:
        for k in range(n):
            for i in range(p):
                out.by_parameter[i, 0, k] = traces[k, nh + i]
            for i in range(s):
                out.by_start[i, 0, k] = traces[k, nh + p + i]
            out.by_frequency[0, k] = traces[k, lead - 1]


@compiled
def _period(
    address: int, u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, sampling: Any, lead: int,
    derive: bool, with_parameters: bool, track: bool, state: Any, S: Any, traces: Any, largest: Any, out: Any,
) -> None:  # fmt: skip
    """Move the state through a period and, if `track`, its derivatives S."""
    n, nh, s, p = u.shape[1], sampling.evaluate.shape[0], len(state), len(parameters)
    width = S.shape[1]
    count = (2 + s + (p if with_parameters else 0)) if track else 0
    moved, result = np.zeros((s, width)), np.zeros((3 + s + p, 1 + s))
    largest[:] = 0.0
    for k in range(n):
        call_step(address, u[0, k], velocity[0, k], state, parameters, result, count)
        out.force[0, k] = result[0, 0] - reference[0] * u[0, k]
        for r in range(1 + s if track else 0):
            if r == 0 and not derive:
                continue
            row = traces[k] if r == 0 else moved[r - 1]
            row[:] = 0.0
            if derive:
                by_u, by_velocity = result[1, r], omega * result[2, r]
                for a in range(nh):
                    row[a] = by_u * sampling.instants[k, a]
                if by_velocity != 0.0:
                    for a in range(nh):
                        row[a] += by_velocity * sampling.differentiate[a, k]
            if with_parameters:
                for a in range(p):
                    row[nh + a] = result[3 + s + a, r]
                row[lead - 1] = result[2, r] * velocity[0, k] / omega
            for i in range(s):
                if result[3 + i, r] != 0.0:
                    for a in range(width):
                        row[a] += result[3 + i, r] * S[i, a]
        if track:
            S[:] = moved
        status = STICK
        for i in range(s):
            if result[0, 1 + i] != state[i]:
                status = SLIP
            state[i] = out.slider[i, k] = result[0, 1 + i]
            largest[i] = max(largest[i], abs(state[i]))
        out.status[:, k] = status


@compiled
def _further_periods(F: Any, change: Any) -> Any:
    """Sum of the changes by all further periods, for each column of the last change; zero if it diverges."""
    size = len(F)
    kept = F.copy()
    for _ in range(DOUBLINGS):
        kept = np.dot(kept, kept)
    if not np.isfinite(kept).all():
        return np.zeros_like(change)
    whole = np.eye(size) - F + kept
    return np.linalg.solve(whole, change - np.dot(kept, change)) - change
