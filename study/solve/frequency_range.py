"""Warning of frequencies above all natural frequencies of a model, where only its inertia is represented."""

import warnings
from collections.abc import Iterable
from math import pi

import numpy as np
from scipy.linalg import eigh

from geometry.errors import InputWarning
from reduction.jointed_system import JointedSystem
from reduction.stuck import stuck_stiffness

#: Ratio to the highest natural frequency at which the stiffness is a millionth of the inertia [-].
INERTIA_ALONE = 1e3


def warn_of_high_frequency(system: JointedSystem, angular_frequency: Iterable[float]) -> None:
    """Warn if all frequencies are above the highest natural frequency with stuck joints, or one is far above it.

    Parameters
    ----------
    system
        System that is solved.
    angular_frequency
        Requested frequencies [rad/s].

    Warns
    -----
    InputWarning
        The frequencies are too high.
    """
    asked = [omega for omega in angular_frequency if omega > 0]
    if not asked:
        return
    n = system.n_dof
    stuck = stuck_stiffness(system.stiffness, system.joints)
    (highest,) = eigh(stuck, system.mass, subset_by_index=[n - 1, n - 1], eigvals_only=True)
    limit = float(np.sqrt(max(highest, 0.0)))
    if min(asked) > limit or max(asked) > INERTIA_ALONE * limit:
        warnings.warn(
            f"frequencies of {min(asked) / (2 * pi):.4g} to {max(asked) / (2 * pi):.4g} Hz are requested, but the "
            f"highest natural frequency of the model is {limit / (2 * pi):.4g} Hz: above it only the inertia of the "
            "masses is represented; check the unit of the frequencies, or keep more modes",
            InputWarning,
            stacklevel=2,
        )
