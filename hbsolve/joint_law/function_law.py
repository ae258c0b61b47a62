"""A user's own law: its compiled function is called instant by instant, and periods are marched until it repeats.

What the joint remembers may need many periods to settle, so the derivative is carried through all of them: it is exact
for what was computed. A start by multiplier is a place between Coulomb's limits, which such a law does not have: it
then begins with a state of zeros.
"""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.registry import JACOBIAN, PARAMETERS, SLIP, STICK
from reduction.joint_law.function_pointer import call_step

#: Periods at most; a state that creeps on after these is left where it is.
MAX_PERIOD = 200
#: A state has settled when a period changes it by less than this part of its largest value.
SETTLED = 1e-11


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
    # Columns: coefficients of u, and, where they are wanted, parameters, starts, Omega.
    width = nh + (p + s + 1 if with_parameters else 0)
    count = (2 + s + (p if with_parameters else 0)) if derive else 0
    S, moved, traces = np.zeros((s, width)), np.zeros((s, width)), np.zeros((n if derive else 1, width))
    result = np.zeros((3 + s + p, 1 + s))
    state, begin, largest = np.zeros(s), np.zeros(s), np.zeros(s)
    for i in range(s):
        if not by_multiplier[i]:
            state[i] = start[i]
            if with_parameters:
                S[i, nh + p + i] = 1.0
    for _ in range(MAX_PERIOD if s else 1):
        begin[:] = state
        for k in range(n):
            call_step(address, u[0, k], velocity[0, k], state, parameters, result, count)
            out.force[0, k] = result[0, 0] - reference[0] * u[0, k]
            for r in range(1 + s if derive else 0):
                row = traces[k] if r == 0 else moved[r - 1]
                by_u, by_velocity = result[1, r], omega * result[2, r]
                for a in range(nh):
                    row[a] = by_u * sampling.instants[k, a]
                if by_velocity != 0.0:
                    for a in range(nh):
                        row[a] += by_velocity * sampling.differentiate[a, k]
                if with_parameters:
                    for a in range(p):
                        row[nh + a] = result[3 + s + a, r]
                    row[nh + p : nh + p + s] = 0.0
                    row[width - 1] = result[2, r] * velocity[0, k] / omega
                for i in range(s):
                    if result[3 + i, r] != 0.0:
                        for a in range(width):
                            row[a] += result[3 + i, r] * S[i, a]
            if derive:
                S[:] = moved
            status = STICK
            for i in range(s):
                if result[0, 1 + i] != state[i]:
                    status = SLIP
                state[i] = out.slider[i, k] = result[0, 1 + i]
                largest[i] = max(largest[i], abs(state[i]))
            out.status[:, k] = status
        settled = True
        for i in range(s):
            if abs(state[i] - begin[i]) > SETTLED * largest[i]:
                settled = False
        if settled:
            break
    if not derive:
        return
    # A joint that is its linear reference at every instant, such as one that sticks, has no rows.
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
            out.by_frequency[0, k] = traces[k, width - 1]
