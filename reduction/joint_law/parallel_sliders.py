"""Energy of springs that sliders end, all of them stretched by one motion."""

import numpy as np

from reduction.array_type import Row
from reduction.joint_law.registry import Samples


def compute_vibration_energy(stiffness: Row, displacement: Row, slider: Samples) -> Row:
    """Elastic energy of springs about the mean stretch of each, shape (n,) [J].

    Parameters
    ----------
    stiffness
        Of each spring, shape (s,) [N/m].
    displacement
        Of all springs, shape (n,) [m].
    slider
        The other end of each, shape (s, n) [m].
    """
    stretch = displacement - slider
    varied = stretch - stretch.mean(axis=1, keepdims=True)
    return np.asarray(0.5 * stiffness @ varied**2)
