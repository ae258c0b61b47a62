"""Elastic energy of the vibration, without the energy that a static load stores."""

from collections.abc import Callable

import numpy as np

from reduction.array_type import Row
from reduction.joint_law.registry import Samples

Law = Callable[[Row], Row]
#: Step of differences relative to the range of a variable; the truncation error of the energy is about its square,
#: the round-off error about machine precision divided by it.
STEP = 1e-4


def compute_spring_energy_about_mean(stored: Law, force: Law, displacement: Row) -> Row:
    """Energy about the mean displacement, V(u) - V(m) - V'(m) (u - m), shape (n,) [J].

    Parameters
    ----------
    stored, force
        Energy V and its derivative, functions of the displacement [J, N].
    displacement
        Displacement u, shape (n,) [m].
    """
    mean = displacement.mean()
    return np.asarray(stored(displacement) - stored(mean) - force(mean) * (displacement - mean))


def compute_energy_about_mean(stored: Callable[[Row], float], variables: Samples) -> Row:
    r"""Energy about the mean of all variables, V(x) - V(m) - V'(m) (x - m), shape (n,) [J].

    For springs between variables, such as a displacement and sliders, it is the energy of each spring about its mean
    elongation.

    Parameters
    ----------
    stored
        Energy V, a function of the variables at one instant [J]; its derivatives are computed by central differences.
    variables
        Variables x, such as a displacement and the state of a joint, shape (s, n).
    """
    mean, swing = variables.mean(axis=1), np.ptp(variables, axis=1)
    moved = variables - mean[:, None]
    energy = np.array([stored(x) for x in variables.T]) - stored(mean)
    for number in np.flatnonzero(swing):
        step = np.zeros(len(mean))
        step[number] = STEP * swing[number]
        energy -= (stored(mean + step) - stored(mean - step)) / (2 * step[number]) * moved[number]
    return np.asarray(energy)
