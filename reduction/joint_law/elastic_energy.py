"""Elastic energy of a spring whose force is a function of its displacement alone."""

from collections.abc import Callable

import numpy as np

from reduction.array_type import Row

Law = Callable[[Row], Row]


def spring_energy_about_mean(stored: Law, force: Law, displacement: Row) -> Row:
    """Energy about the mean displacement, V(u) - V(m) - V'(m) (u - m), shape (n,) [J].

    Parameters
    ----------
    stored, force
        V and its derivative, functions of the displacement [J, N].
    displacement
        u, shape (n,) [m].
    """
    mean = displacement.mean()
    return np.asarray(stored(displacement) - stored(mean) - force(mean) * (displacement - mean))
