"""Newton's method for a state close to a known one, which gives up early.

Steps in the sliders often leave the branch of a solution, and a search that waits for `hbsolve.newton` to try all it
can spends most of its time on states that do not exist.
"""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.aft import joint_forces
from hbsolve.contact.law import JACOBIAN
from hbsolve.limits.sliders import cone
from hbsolve.newton import RELATIVE, apply_receptance, newton_step

#: Trials of a step, by how much each is shorter, and the decrease that ends them; the last is taken in any case.
TRIALS, SHORTER, DECREASE = 4, 0.4, 1e-4


@compiled
def newton_near(
    x: Any, linear: Any, omega: float, receptance: Any, table: Any, first: Any, count: Any, start: Any, sampling: Any,
    sliders: Any, tolerance: float, limit: int, patience: int, hopeless: float,
) -> Any:  # fmt: skip
    """Solve R(x) = 0 from x: motion, |R|, joint forces with their Jacobian, and where the sliders stick.

    Gives up where |R| is not below the share `hopeless` of the first one after `patience` iterations, or its square
    after twice as many.
    """
    forces = joint_forces(x, omega, table, start, sampling, JACOBIAN)
    R = x - linear + apply_receptance(receptance, forces.coefficients)
    norm = np.sqrt((R * R).sum())
    most, iteration = norm, 0
    while norm > tolerance and iteration < limit:
        iteration += 1
        dx = -newton_step(forces, receptance, first, count, R, RELATIVE)
        step, new = 1.0, norm
        for trial in range(TRIALS):
            forces = joint_forces(x + step * dx, omega, table, start, sampling, JACOBIAN)
            R = x + step * dx - linear + apply_receptance(receptance, forces.coefficients)
            new = np.sqrt((R * R).sum())
            if new < (1.0 - DECREASE * step) * norm or new < tolerance or trial == TRIALS - 1:
                break
            step *= SHORTER
        x = x + step * dx
        norm = new
        if iteration % patience == 0:
            most *= hopeless
            if norm > most:
                break
        if not np.isfinite(norm):
            break
    return x, norm, forces, cone(x, sliders, sampling.evaluate)
