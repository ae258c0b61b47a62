"""Linear system of an assembled and supported body: sparse M, C, K on the free degrees of freedom."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.sparse.factor import Symmetric
from geometry.read_only_array import freeze_fields


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearSystem:
    """Mass, damping and stiffness on the free degrees of freedom of a mesh.

    A degree of freedom of the whole mesh has the number 3 * node + direction.

    Parameters
    ----------
    mass, stiffness
        Symmetric matrices, shape (n, n) [kg, N/m]: SciPy's CSR arrays with both triangles, or the results of
        `fe.assembly.assemble_compact`, with which a reduction needs less memory.
    damping
        Symmetric matrix, CSR, both triangles, shape (n, n) [N s/m].
    free
        Mesh degree of freedom of each row, ascending, shape (n,) [-].
    n_node
        Number of nodes of the mesh [-]; the whole mesh has 3 n_node degrees of freedom.
    """

    mass: Symmetric
    damping: sp.csr_array
    stiffness: Symmetric
    free: Int[NDArray[np.int64], " n"]
    n_node: int

    def __post_init__(self) -> None:
        freeze_fields(self, "free", kind=np.int64)

    @property
    def n_dof(self) -> int:
        """Number of free degrees of freedom [-]."""
        return len(self.free)

    def rows(self, nodes: Int[NDArray[np.int64], " k"], directions: tuple[int, ...] = (0, 1, 2)) -> NDArray[np.int64]:
        """Row of each node and direction, nodes outermost, shape (k * n_direction,); -1 if it is fixed."""
        dofs = (3 * np.asarray(nodes)[:, None] + np.asarray(directions)).ravel()
        place = np.searchsorted(self.free, dofs).clip(max=self.n_dof - 1)
        return np.where(self.free[place] == dofs, place, -1)

    def shifted(self, shift: float) -> "LinearSystem":
        """System with the stiffness K + shift M, definite even without supports; the shift is in rad^2/s^2."""
        return replace(self, stiffness=sp.csr_array(self.stiffness.tocsr() + shift * self.mass.tocsr()))

    def on_mesh(self, vectors: Float[NDArray[np.float64], "n m"]) -> Float[NDArray[np.float64], "node 3 m"]:
        """Expand vectors on the free degrees of freedom to all nodes, zero where fixed, shape (n_node, 3, m)."""
        full = np.zeros((3 * self.n_node, vectors.shape[1]), dtype=vectors.dtype)
        full[self.free] = vectors
        return full.reshape(self.n_node, 3, -1)
