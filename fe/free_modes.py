"""Modes of a body that nothing holds: rigid-body modes at zero frequency, then the elastic ones."""

from dataclasses import replace
from math import sqrt

import numpy as np

from fe.material import Material
from fe.mesh import Mesh
from fe.modal import ModeSet, modes
from fe.system import LinearSystem

#: The shift is this share of shear-wave speed over size: below the first elastic mode even of a slender body, and far
#: above what round-off leaves of a rigid-body mode.
SHARE = 0.05
#: Squared frequencies below this share of the shift are round-off: rigid-body modes come out near 1e-9 of it.
RIGID = 1e-5


def compute_free_modes(system: LinearSystem, mesh: Mesh, material: Material, n_mode: int) -> ModeSet:
    """The lowest modes of a system whose supports, if any, leave rigid-body motions.

    The mass times a shift is added to the stiffness, which makes it definite, and the shift is taken off the squared
    frequencies again. Rigid-body modes come out as exactly zero.

    Parameters
    ----------
    system
        Of the whole mesh or of a part of its degrees of freedom.
    mesh, material
        Give the scale of frequency, shear-wave speed over size.
    n_mode
        How many modes, the rigid-body ones included [-].
    """
    size = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    shift = (SHARE * sqrt(material.shear / material.density) / size) ** 2
    found = modes(system.shifted(shift), n_mode)
    squared = found.angular_frequency**2 - shift
    frequency = np.sqrt(np.where(squared > RIGID * shift, squared, 0.0))
    # The ratio was made with the shifted frequency; a rigid-body mode has none.
    ratio = found.damping_ratio * found.angular_frequency
    ratio = np.divide(ratio, frequency, out=np.zeros_like(ratio), where=frequency > 0)
    return replace(found, angular_frequency=frequency, damping_ratio=ratio)
