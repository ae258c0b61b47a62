"""Energy of parallel springs in series with sliders, all elongated by the same displacement."""

import numpy as np

from reduction.array_type import Row
from reduction.joint_law.registry import Samples


def compute_vibration_energy(stiffness: Row, displacement: Row, slider: Samples) -> Row:
    """Elastic energy of springs about the mean elongation of each, shape (n,) [J].

    Parameters
    ----------
    stiffness
        Stiffness of each spring, shape (s,) [N/m].
    displacement
        Displacement of one end of all springs, shape (n,) [m].
    slider
        Displacement of the other end of each spring, shape (s, n) [m].
    """
    stretch = displacement - slider
    varied = stretch - stretch.mean(axis=1, keepdims=True)
    return np.asarray(0.5 * stiffness @ varied**2)
