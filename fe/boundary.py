"""Supports: fixed degrees of freedom and grounded springs, and the proof that no rigid-body motion is left."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from fe.damping import RayleighDamping
from fe.errors import SupportError
from fe.mesh import Mesh
from fe.system import LinearSystem

MOTIONS = (
    "translation along x",
    "translation along y",
    "translation along z",
    "rotation about x",
    "rotation about y",
    "rotation about z",
)
#: A rigid motion counts as free when the supports resist it this much less than the one they resist best.
FREE_MOTION = 1e-10


@dataclass(frozen=True, kw_only=True, eq=False)
class Support:
    """Nodes that are held still in the given directions.

    Parameters
    ----------
    nodes
        Node numbers, shape (k,) [-].
    directions
        Held directions: 0, 1, 2 for x, y, z.
    """

    nodes: Int[NDArray[np.int64], " k"]
    directions: tuple[int, ...] = (0, 1, 2)


@dataclass(frozen=True, kw_only=True, eq=False)
class GroundedSpring:
    """A linear spring from each node to the ground.

    Parameters
    ----------
    nodes
        Node numbers, shape (k,) [-].
    stiffness
        Of each node's spring in x, y and z [N/m], none negative.
    """

    nodes: Int[NDArray[np.int64], " k"]
    stiffness: tuple[float, float, float]

    def __post_init__(self) -> None:
        if min(self.stiffness) < 0 or not np.all(np.isfinite(self.stiffness)):
            raise SupportError(f"grounded spring stiffness {self.stiffness} N/m must be finite and not negative")


def supported_system(
    mesh: Mesh,
    mass: sp.csr_array,
    stiffness: sp.csr_array,
    supports: Sequence[Support] = (),
    springs: Sequence[GroundedSpring] = (),
    damping: RayleighDamping | None = None,
) -> LinearSystem:
    """Matrices on the free degrees of freedom, with grounded springs and Rayleigh damping added.

    The springs are part of the stiffness that beta multiplies.

    Parameters
    ----------
    mesh
        The mesh.
    mass, stiffness
        From `fe.assembly.assemble`, shape (3 n_node, 3 n_node) [kg, N/m].
    supports, springs
        What holds the body.
    damping
        Rayleigh coefficients; none means no damping.

    Raises
    ------
    SupportError
        A support without nodes, or supports that leave a body of the mesh a rigid motion; the message names it.
    """
    for support in supports:
        if not len(support.nodes):
            raise SupportError("a support holds no node: name a set that has nodes")
    held = np.zeros((mesh.n_node, 3), dtype=bool)
    for support in supports:
        for direction in support.directions:
            held[support.nodes, direction] = True
    grounded = np.zeros((mesh.n_node, 3))
    for spring in springs:
        np.add.at(grounded, spring.nodes, np.asarray(spring.stiffness))
    _refuse_rigid_motion(mesh, stiffness, held, grounded)
    free = np.flatnonzero(~held.ravel())
    K = (stiffness + sp.diags_array(grounded.ravel())).tocsr()[free][:, free]
    M = mass[free][:, free]
    C = sp.csr_array(M.shape) if damping is None else damping.mass_factor * M + damping.stiffness_factor * K
    return LinearSystem(
        mass=sp.csr_array(M), damping=sp.csr_array(C), stiffness=sp.csr_array(K), free=free, n_node=mesh.n_node
    )


def rigid_motions(points: Float[NDArray[np.float64], "node 3"]) -> Float[NDArray[np.float64], "node 3 6"]:
    """Three translations and three rotations about the centroid, shape (n_node, 3, 6) [- and m].

    Rotations are scaled by the size of the body, so that all six are of one magnitude.
    """
    centred = points - points.mean(axis=0)
    size = max(float(np.linalg.norm(centred, axis=1).max()), np.finfo(float).tiny)
    motions = np.zeros((len(points), 3, 6))
    for axis in range(3):
        motions[:, axis, axis] = 1
        motions[:, :, 3 + axis] = np.cross(np.eye(3)[axis], centred) / size
    return motions


def _refuse_rigid_motion(
    mesh: Mesh,
    stiffness: sp.csr_array,
    held: NDArray[np.bool_],
    grounded: Float[NDArray[np.float64], "node 3"],
) -> None:
    # Rows of one node couple as a block, so the graph of the x rows is the graph of the bodies.
    graph = stiffness[::3][:, ::3]
    n_body, body_of_node = connected_components(graph, directed=False)
    for body in range(n_body):
        nodes = np.flatnonzero(body_of_node == body)
        motions = rigid_motions(mesh.points[nodes])
        spring_scale = grounded[nodes].max() or 1.0
        weight = held[nodes] + grounded[nodes] / spring_scale
        resisted = np.einsum("nik,ni,nil->kl", motions, weight, motions)
        value, vector = np.linalg.eigh(resisted)
        if value[0] > FREE_MOTION * max(value[-1], 1e-300):
            continue
        free = [MOTIONS[k] for k in range(6) if resisted[k, k] <= FREE_MOTION * max(value[-1], 1e-300)]
        motion = ", ".join(free) or f"a motion that is mostly {MOTIONS[int(np.abs(vector[:, 0]).argmax())]}"
        which = "the body" if n_body == 1 else f"body {body + 1} of {n_body} ({len(nodes)} nodes)"
        raise SupportError(
            f"the supports leave {which} free in {motion}: hold {'nodes' if not held.any() else 'more nodes'} "
            "or add grounded springs"
        )
