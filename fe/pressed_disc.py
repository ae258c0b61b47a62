r"""Force of a stinger on a circular patch of a flat face, as weights of the nodes.

The pressure decreases to zero at the rim,

.. math:: p(r) = \frac{2}{\pi a^2} \left(1 - \frac{r^2}{a^2}\right), \qquad w_i = \int N_i \, p \, dA ,

and the same weights give the mean displacement of the patch, which is conjugate to the force. A force at a node cannot
replace it: the displacement at the node grows without bound as the elements get smaller.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.errors import MeshError
from fe.face_integral import Faces, integrate_over_faces
from fe.mesh import Mesh

#: Smallest cosine between normals of faces that belong to the same flat face.
FLAT_COSINE = 0.999
#: Pressure-weighted mean square of the distance from the centre over the squared radius, and largest relative error of
#: its quadrature; among larger cells the disc would be smaller and off-centre.
SQUARE, COARSE = 1 / 3, 0.3


def find_disc_weights(
    mesh: Mesh,
    faces: Faces,
    centre: Float[NDArray[np.float64], " 3"],
    normal: Float[NDArray[np.float64], " 3"],
    radius: float,
) -> Float[NDArray[np.float64], " node"]:
    """Weights of the nodes in the mean over a pressed disc; their sum is one, their mean position the centre.

    Parameters
    ----------
    mesh
        Mesh of the body.
    faces
        Cell and local face of the candidate faces, shape (k, 2) [-].
    centre
        Centre of the disc, on a flat face, shape (3,) [m].
    normal
        Outward unit normal of that face, shape (3,) [-].
    radius
        Radius a of the disc [m].

    Returns
    -------
    Weights, shape (n_node,) [-].

    Raises
    ------
    MeshError
        No face with this normal at the centre, or cells that are too large for the disc.
    """

    def pressure(
        points: Float[NDArray[np.float64], "*k 3"], outward: Float[NDArray[np.float64], "*k 3"]
    ) -> Float[NDArray[np.float64], "*k n"]:
        about = (points - centre) / radius
        one = np.where(outward @ normal > FLAT_COSINE, np.maximum(1 - (about**2).sum(axis=-1), 0), 0)
        square = (about**2).sum(axis=-1, keepdims=True)
        return np.asarray(one[..., None] * np.concatenate([np.ones_like(square), about, square], axis=-1))

    result = integrate_over_faces(mesh, faces, pressure)
    total = result.sum(axis=0)
    if not total[0] > 0 or abs(total[4] / total[0] - SQUARE) > COARSE * SQUARE:
        raise MeshError(
            f"the disc of {1e3 * radius:g} mm radius about ({', '.join(f'{1e3 * x:g}' for x in centre)}) mm is not on "
            "a flat face of the mesh, or cells there are too large for it: move or widen it, or mesh with smaller cells"
        )
    # Quadrature is inexact at the rim: a small linear correction puts the resultant of the pressure at the centre.
    moment = (mesh.points - centre).T @ result[:, :4] / radius
    tilt = np.linalg.lstsq(moment[:, 1:], -moment[:, 0], rcond=1e-6)[0]
    weights = result[:, :4] @ np.concatenate([[1.0], tilt])
    return np.asarray(weights / weights.sum())
