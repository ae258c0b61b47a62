r"""A round patch of a flat face that a stinger pushes, as weights of the nodes.

The pressure falls to nothing at the rim,

.. math:: p(r) = \frac{2}{\pi a^2} \left(1 - \frac{r^2}{a^2}\right), \qquad w_i = \int N_i \, p \, dA ,

and the same weights give the mean displacement under it, which does the work of the force. A force at a node is no
substitute: how much a solid gives way beside it grows without bound as its elements shrink.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.errors import MeshError
from fe.face_integral import Faces, integrate_over_faces
from fe.mesh import Mesh

#: Cosine between normals of faces that count as one flat face.
FLAT_COSINE = 0.999
#: Mean square of the distance from the centre under the pressure, in parts of the radius's square, and by what share of
#: it the points of quadrature may miss it: a disc among larger cells is another one, smaller and askew.
SQUARE, COARSE = 1 / 3, 0.3


def find_disc_weights(
    mesh: Mesh,
    faces: Faces,
    centre: Float[NDArray[np.float64], " 3"],
    normal: Float[NDArray[np.float64], " 3"],
    radius: float,
) -> Float[NDArray[np.float64], " node"]:
    """Weights of the nodes in the mean over a pressed disc; they sum to one, about its centre, shape (n_node,) [-].

    Parameters
    ----------
    mesh
        The body.
    faces
        Those to look at, cell and local face, shape (k, 2) [-].
    centre
        Centre of the disc, on a flat face, shape (3,) [m].
    normal
        Unit normal of that face, out of the body, shape (3,) [-].
    radius
        a [m].

    Raises
    ------
    MeshError
        No face there that looks this way, or cells that are too large for the disc.
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
    # Points of quadrature miss the rim: the pressure is tilted a little, so that its resultant is at the centre.
    moment = (mesh.points - centre).T @ result[:, :4] / radius
    tilt = np.linalg.lstsq(moment[:, 1:], -moment[:, 0], rcond=1e-6)[0]
    weights = result[:, :4] @ np.concatenate([[1.0], tilt])
    return np.asarray(weights / weights.sum())
