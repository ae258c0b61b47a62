"""Springs with sliders in parallel, and a spring that never slips."""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.parallel_sliders import parallel_sliders
from hbsolve.joint_law.registry import FORCES, PARAMETERS, CompiledLaw
from hbsolve.joint_law.slider import slider_slopes


@compiled
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """One direction; see `hbsolve.joint_law.registry`."""
    count = len(start)
    spring, reach = parameters[:count].copy(), np.empty(count)
    spring_by, reach_by = np.zeros((count, 2 * count)), np.zeros((count, 2 * count))
    for i in range(count):
        reach[i] = parameters[count + i] / spring[i]
        spring_by[i, i], reach_by[i, i], reach_by[i, count + i] = 1.0, -reach[i] / spring[i], 1.0 / spring[i]
    beyond = spring.sum() + parameters[2 * count] - reference[0]
    parallel_sliders(u, beyond, spring, reach, spring_by, reach_by, start, by_multiplier, sampling, want, out)
    if want >= PARAMETERS:
        out.by_parameter[2 * count, 0, :] = u[0]


@compiled
def step_slopes(before: Any, after: Any, velocity: Any, slider: Any, parameters: Any, out: Any) -> None:
    """See `hbsolve.joint_law.registry.CompiledLaw`."""
    count = len(slider)
    for i in range(count):
        slider_slopes(0, 0, i, after[0], slider[i], parameters[count + i], parameters[i], 0.0, out)
    out[0, 0] += parameters[2 * count]


FORCES.register(CompiledLaw(name="jenkins_chain", force=force, instant=None, step_slopes=step_slopes))
