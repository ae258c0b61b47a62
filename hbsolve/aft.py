"""Alternating frequency/time: from the motion of the joint directions to the coefficients of the joint forces.

All quantities are relative to the linear reference: g = f - D x (`hbsolve.joint_law.registry`).

References
----------
Cameron and Griffin, J. Appl. Mech. 56 (1989).
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), section 3.1.
"""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Int

from fe.compiled import compiled
from hbsolve.joint_arrays import FUNCTION, JointTable, call_force, call_function_force
from hbsolve.joint_law.registry import JACOBIAN, MAX_DIRECTION, PARAMETERS, LawOutput
from hbsolve.sampling import Sampling
from reduction.array_type import Real, Whole


class InitialSliders(NamedTuple):
    """Initial state of the sliders."""

    value: Real
    """Positions at the first instant, or multipliers m of eq. 11, shape (s,) [m or -]."""
    by_multiplier: Whole
    """1 where the value is a multiplier, shape (s,)."""


class BalanceArrays(NamedTuple):
    """Joints and instants of a balance as arguments of compiled code; d directions."""

    table: JointTable
    """Joints as arrays."""
    joint_start: Int[Whole, " d"]
    """First direction of the joint of each direction, shape (d,)."""
    joint_size: Int[Whole, " d"]
    """Number of directions of this joint, shape (d,)."""
    sampling: Sampling
    """Basis on the instants of a period."""


class JointForces(NamedTuple):
    """Forces and states of the joints in a given motion; d directions, nh = 2 H + 1, n instants."""

    coefficients: Real
    """g, shape (d, nh) [N]."""
    jacobian: Real
    """Jacobian of g, rows by direction, columns the directions of the same joint, shape (d, nh, 3 nh) [N/m]."""
    active: Whole
    """Number of leading rows of each direction's Jacobian that are not zero, shape (d,)."""
    by_parameter: Real
    """Derivative of g by each parameter (in the order of the table), shape (p, 3, nh): directions of its joint."""
    by_start: Real
    """Derivative of g by each slider's start, shape (s, 3, nh)."""
    by_frequency: Real
    """Derivative of g by Omega at fixed coefficients, shape (d, nh)."""
    slider: Real
    """Slider positions, shape (s, n) [m]."""
    status: Whole
    """State at each instant, two rows per joint, shape (2 n_joint, n)."""
    force: Real
    """f - D u in time, shape (d, n) [N]."""
    unsettled: Whole
    """1 for a joint whose state does not repeat every period, so that the motion is not periodic, shape (n_joint,)."""


@compiled
def joint_forces(x: Any, omega: float, table: Any, start: Any, sampling: Any, want: int) -> Any:
    """Evaluate all joints for the motion x of their directions, shape (d, nh)."""
    d, nh = x.shape
    n = sampling.evaluate.shape[1]
    n_joint = len(table.kind)
    n_parameter, n_slider = len(table.value), len(start.value)
    u = np.dot(x, sampling.evaluate)
    velocity = omega * np.dot(x, sampling.differentiate) if table.uses_velocity else np.empty((d, 0))
    force, status = np.zeros((d, n)), np.zeros((2 * n_joint, n), np.int64)
    unsettled = np.zeros(n_joint, np.int64)
    jacobian = np.zeros((d if want >= JACOBIAN else 0, nh, MAX_DIRECTION * nh))
    active = np.zeros(d, np.int64)
    derive = want >= PARAMETERS
    by_parameter = np.zeros((n_parameter if derive else 0, MAX_DIRECTION, nh))
    by_start = np.zeros((n_slider if derive else 0, MAX_DIRECTION, nh))
    by_frequency = np.zeros((d, n if derive else 0))
    slider = np.zeros((n_slider, n))
    most_parameter, most_slider = 0, 0
    for j in range(n_joint if derive else 0):
        most_parameter = max(most_parameter, table.parameter[j + 1] - table.parameter[j])
        most_slider = max(most_slider, table.slider[j + 1] - table.slider[j])
    law_parameter, law_start = np.zeros((most_parameter, MAX_DIRECTION, n)), np.zeros((most_slider, MAX_DIRECTION, n))
    for j in range(n_joint):
        d0, d1 = table.direction[j], table.direction[j + 1]
        p0, p1 = table.parameter[j], table.parameter[j + 1]
        s0, s1 = table.slider[j], table.slider[j + 1]
        if derive:
            law_parameter[:] = 0.0
            law_start[:] = 0.0
        out = LawOutput(
            force[d0:d1], jacobian[d0:d1], active[d0:d1], law_parameter, law_start, by_frequency[d0:d1],
            slider[s0:s1], status[2 * j : 2 * j + 2], unsettled[j : j + 1],
        )  # fmt: skip
        given = (
            u[d0:d1], velocity[d0:d1], omega, table.reference[d0:d1], table.value[p0:p1], start.value[s0:s1],
            start.by_multiplier[s0:s1], sampling, want, out,
        )  # fmt: skip
        if table.kind[j] == FUNCTION:
            call_function_force(table.force[j], (table.address[j], *given))
        else:
            call_force(table.force[j], given)
        if derive:
            for p in range(p1 - p0):
                by_parameter[p0 + p] = _project(law_parameter[p], sampling)
            for s in range(s1 - s0):
                by_start[s0 + s] = _project(law_start[s], sampling)
    coefficients = _project(force, sampling)
    frequency = _project(by_frequency, sampling) if derive else np.zeros((d, nh))
    return JointForces(
        coefficients, jacobian, active, by_parameter, by_start, frequency, slider, status, force, unsettled
    )


@compiled
def _project(force: Any, sampling: Any) -> Any:
    """Coefficients of forces; constant forces, such as those of most contacts, which stick, take no projection."""
    d, n = force.shape
    varied, n_varied = np.empty(d, np.int64), 0
    coefficients = np.zeros((d, sampling.project.shape[1]))
    for i in range(d):
        coefficients[i, 0] = force[i, 0]
        varies = False
        for k in range(1, n):
            varies |= force[i, k] != force[i, 0]
        if varies:
            varied[n_varied] = i
            n_varied += 1
    if n_varied:
        projected = np.dot(force[varied[:n_varied]], sampling.project)
        for i in range(n_varied):
            coefficients[varied[i]] = projected[i]
    return coefficients
