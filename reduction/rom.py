"""The reduced model: small dense matrices, the names of what they act on, and the way back to the full mesh."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True, eq=False)
class ReducedModel:
    """A Craig-Bampton model: boundary degrees of freedom first, then fixed-interface modal coordinates.

    Parameters
    ----------
    mass, damping, stiffness
        Symmetric, shape (r, r) [kg, N s/m, N/m; modal rows in the units that mass-normalised modes imply].
    boundary_node, boundary_direction
        Mesh node and direction (0, 1, 2) of each boundary degree of freedom, shape (b,) [-].
    boundary_sets
        Rows of the reduced system by boundary name, each of shape (k,) [-].
    fixed_interface_frequency
        Of the retained fixed-interface modes, ascending, shape (m,) [Hz]; r = b + m.
    recovery
        Full free displacement = recovery @ reduced coordinates, shape (n, r) [- and m].
    free
        Mesh degree of freedom (3 node + direction) of each row of `recovery`, shape (n,) [-].
    n_node
        Nodes of the mesh [-].
    provenance
        Where the model comes from: case, versions, date, anything the user wants to find again.
    """

    mass: Float[NDArray[np.float64], "r r"]
    damping: Float[NDArray[np.float64], "r r"]
    stiffness: Float[NDArray[np.float64], "r r"]
    boundary_node: Int[NDArray[np.int64], " b"]
    boundary_direction: Int[NDArray[np.int64], " b"]
    boundary_sets: Mapping[str, Int[NDArray[np.int64], " k"]]
    fixed_interface_frequency: Float[NDArray[np.float64], " m"]
    recovery: Float[NDArray[np.float64], "n r"]
    free: Int[NDArray[np.int64], " n"]
    n_node: int
    provenance: Mapping[str, str] = field(default_factory=dict)
