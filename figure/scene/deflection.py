"""How much a motion is enlarged to be seen."""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.mesh import Mesh
from geometry.errors import InputError

Motion = Float[NDArray[np.float64], "*frame node 3"]

#: Largest deflection drawn, as a part of the largest dimension of the bodies.
DEFLECTION = 0.10


def enlargement(mesh: Mesh, displacement: Motion, amplitude: float | None) -> float:
    """What a displacement is multiplied by in a picture [-]; 1 where nothing moves.

    Parameters
    ----------
    mesh
        The bodies at rest.
    displacement
        At the nodes, shape (n_node, 3) or (n_frame, n_node, 3).
    amplitude
        Largest deflection drawn [m]; None for `DEFLECTION` times the largest dimension.

    Raises
    ------
    InputError
        Values that are not finite, or an amplitude that is not positive.
    """
    if (lost := int((~np.isfinite(displacement)).sum())) > 0:
        raise InputError(f"displacement has {lost} values that are not finite: solve again")
    if amplitude is not None and not (np.isfinite(amplitude) and amplitude > 0):
        raise InputError(f"amplitude = {amplitude:g} m must be positive: leave it out for a tenth of the bodies' size")
    largest = float(np.linalg.norm(displacement, axis=-1).max())
    wanted = DEFLECTION * float(np.ptp(mesh.points, axis=0).max()) if amplitude is None else amplitude
    return wanted / largest if largest > 0 else 1.0
