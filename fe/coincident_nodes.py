"""Find different nodes at the same position, as at seams along which a mesh is not joined."""

import numpy as np
from jaxtyping import Int
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fe.mesh import Mesh

#: Distance, relative to the size of the mesh, below which nodes coincide: files have at least seven digits, and no cell
#: is so small.
SAME_PLACE = 1e-7


def find_coincident_nodes(mesh: Mesh) -> Int[NDArray[np.int64], "pair 2"]:
    """Pairs of nodes at the same position, shape (n_pair, 2) [-]."""
    size = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    return np.asarray(cKDTree(mesh.points).query_pairs(SAME_PLACE * size, output_type="ndarray"), dtype=np.int64)
