"""Supports: fixed degrees of freedom, grounded springs and reactions; check that no rigid-body motion is free."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.damping import RayleighDamping, add_damping
from fe.errors import SupportError, UnsupportedBody
from fe.mesh import Mesh
from fe.sparse.factor import Symmetric
from fe.sparse.symmetric_part import part
from fe.sparse.upper_blocks import UpperBlocks
from fe.system import LinearSystem

MOTIONS = (
    "translation along x",
    "translation along y",
    "translation along z",
    "rotation about x",
    "rotation about y",
    "rotation about z",
)
#: Resistance of the supports to a rigid motion, relative to the motion with the largest resistance, below which the
#: motion is free.
FREE_MOTION = 1e-10


@dataclass(frozen=True, kw_only=True, eq=False)
class Support:
    """Nodes that are fixed in the given directions.

    Parameters
    ----------
    nodes
        Node numbers, shape (k,) [-].
    directions
        Fixed directions: 0, 1, 2 for x, y, z.

    Raises
    ------
    SupportError
        No direction, or an invalid direction.
    """

    nodes: Int[NDArray[np.int64], " k"]
    directions: tuple[int, ...] = (0, 1, 2)

    def __post_init__(self) -> None:
        if not self.directions or not set(self.directions) <= {0, 1, 2}:
            raise SupportError(f"support directions {self.directions} must be some of 0, 1 and 2, for x, y and z")


@dataclass(frozen=True, kw_only=True, eq=False)
class GroundedSpring:
    """Linear spring from each node to the ground.

    Parameters
    ----------
    nodes
        Node numbers, shape (k,) [-].
    stiffness
        Stiffness of the spring of each node in x, y and z [N/m], not negative.

    Raises
    ------
    SupportError
        A stiffness that is negative or not finite.
    """

    nodes: Int[NDArray[np.int64], " k"]
    stiffness: tuple[float, float, float]

    def __post_init__(self) -> None:
        if min(self.stiffness) < 0 or not np.all(np.isfinite(self.stiffness)):
            raise SupportError(f"grounded spring stiffness {self.stiffness} N/m must be finite and not negative")


def supported_system(
    mesh: Mesh,
    mass: Symmetric,
    stiffness: Symmetric,
    supports: Sequence[Support] = (),
    springs: Sequence[GroundedSpring] = (),
    damping: RayleighDamping | None = None,
    may_move: bool = False,
) -> LinearSystem:
    """Make the linear system on the free degrees of freedom, with grounded springs and Rayleigh damping.

    The stiffness-proportional damping includes the springs.

    Parameters
    ----------
    mesh
        The mesh.
    mass, stiffness
        Matrices from `fe.assembly.assemble` or `assemble_compact`, shape (3 n_node, 3 n_node) [kg, N/m].
    supports, springs
        Supports and springs of the body.
    damping
        Rayleigh coefficients; no damping by default.
    may_move
        Whether the supports may leave rigid motions free, for example if the boundary of a reduction fixes them.

    Raises
    ------
    SupportError
        A support without nodes or with nodes that do not exist; supports that leave a rigid motion of a body free,
        which the message names (`UnsupportedBody` if there are several bodies); or no free degree of freedom.
    """
    for support in supports:
        if not len(support.nodes):
            raise SupportError("a support fixes no node: name a set that contains nodes")
    for nodes in [support.nodes for support in supports] + [spring.nodes for spring in springs]:
        if np.size(nodes) and not 0 <= np.min(nodes) <= np.max(nodes) < mesh.n_node:
            bad = np.max(nodes) if np.max(nodes) >= mesh.n_node else np.min(nodes)
            raise SupportError(f"a support names node {bad}, but the mesh has the nodes 0 to {mesh.n_node - 1}")
    fixed = np.zeros((mesh.n_node, 3), dtype=bool)
    for support in supports:
        for direction in support.directions:
            fixed[support.nodes, direction] = True
    grounded = np.zeros((mesh.n_node, 3))
    for spring in springs:
        np.add.at(grounded, spring.nodes, np.asarray(spring.stiffness))
    if not may_move:
        _refuse_rigid_motion(mesh, stiffness, fixed, grounded)
    free = np.flatnonzero(~fixed.ravel())
    if not free.size:
        raise SupportError("the supports fix every degree of freedom of the mesh: leave some nodes free")
    if grounded.any():
        stiffness = _add_diagonal(stiffness, grounded.ravel())
    system = LinearSystem(
        mass=part(mass, free),
        damping=sp.csr_array((len(free), len(free))),
        stiffness=part(stiffness, free),
        free=free,
        n_node=mesh.n_node,
    )
    return system if damping is None else add_damping(system, damping)


def make_unsupported_system(mesh: Mesh, mass: Symmetric, stiffness: Symmetric) -> LinearSystem:
    """Make the linear system on all degrees of freedom of a mesh; arguments as in `supported_system`."""
    n = 3 * mesh.n_node
    return LinearSystem(
        mass=mass, damping=sp.csr_array((n, n)), stiffness=stiffness, free=np.arange(n), n_node=mesh.n_node
    )


def make_rigid_motions(
    points: Float[NDArray[np.float64], "node 3"], centre: Float[NDArray[np.float64], " 3"] | None = None
) -> Float[NDArray[np.float64], "node 3 6"]:
    """Three translations and three rotations about a centre, by default the centroid, shape (n_node, 3, 6) [-].

    Rotations are divided by the largest distance from the centre, so that all six motions are of the same magnitude.
    """
    centred = points - (points.mean(axis=0) if centre is None else centre)
    size = max(float(np.linalg.norm(centred, axis=1).max()), np.finfo(float).tiny)
    motions = np.zeros((len(points), 3, 6))
    for axis in range(3):
        motions[:, axis, axis] = 1
        motions[:, :, 3 + axis] = np.cross(np.eye(3)[axis], centred) / size
    return motions


def _add_diagonal(matrix: Symmetric, added: Float[NDArray[np.float64], " n"]) -> Symmetric:
    if isinstance(matrix, UpperBlocks):
        return matrix.plus_diagonal(added)
    return sp.csr_array(matrix.tocsr() + sp.diags_array(added))


def _refuse_rigid_motion(
    mesh: Mesh,
    stiffness: Symmetric,
    fixed: NDArray[np.bool_],
    grounded: Float[NDArray[np.float64], "node 3"],
) -> None:
    from scipy.sparse.csgraph import connected_components  # imports all solvers of scipy; most commands have no mesh

    # The check depends on geometry only: soft springs count as stiff ones.
    resisting = fixed | (grounded > 0)
    # Rows of one node couple as a block, so the graph of the x rows is the graph of the bodies.
    graph = stiffness.graph() if isinstance(stiffness, UpperBlocks) else stiffness.tocsr()[::3][:, ::3]
    n_body, body_of_node = connected_components(graph, directed=False)
    by_body = np.split(np.argsort(body_of_node, kind="stable"), np.cumsum(np.bincount(body_of_node))[:-1])
    for body, nodes in enumerate(by_body):
        if resisting[nodes].all():
            continue
        if len(nodes) == 1:
            raise SupportError(f"node {nodes[0]} belongs to no cell and is not fixed: remove it from the mesh")
        # About the centre of the supported nodes, a free motion is usually a pure rotation.
        where = nodes[resisting[nodes].any(axis=1)]
        motions = make_rigid_motions(mesh.points[nodes], mesh.points[where].mean(axis=0) if where.size else None)
        resisted = np.einsum("nik,ni,nil->kl", motions, resisting[nodes].astype(np.float64), motions)
        value, vector = np.linalg.eigh(resisted)
        if value[0] > FREE_MOTION * value[-1]:
            continue
        free = [MOTIONS[k] for k in range(6) if resisted[k, k] <= FREE_MOTION * value[-1]]
        motion = ", ".join(free) or f"a motion that is mostly {MOTIONS[int(np.abs(vector[:, 0]).argmax())]}"
        which = "the body" if n_body == 1 else f"body {body + 1} of {n_body} ({len(nodes)} nodes)"
        error = SupportError if n_body == 1 else UnsupportedBody
        raise error(
            f"the supports leave {which} free in {motion}: fix {'more nodes' if resisting.any() else 'nodes'} "
            "or add grounded springs"
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class SupportReaction:
    """Force of the supports of a set of nodes on a body, along x, y and z.

    Parameters
    ----------
    stiffness, mass
        Rows that multiply displacements and accelerations, shape (3, n) [N/m, kg].
    """

    stiffness: Float[NDArray[np.float64], "3 n"]
    mass: Float[NDArray[np.float64], "3 n"]


def find_reaction(
    stiffness: Symmetric, mass: Symmetric, nodes: Int[NDArray[np.int64], " k"], free: Int[NDArray[np.int64], " n"]
) -> SupportReaction:
    r"""Rows of the reaction of a set of fixed nodes, summed for each direction.

    With the free displacements q, and zero displacements of the fixed nodes, the force of the supports on the body is
    :math:`R = K_{sf} q + M_{sf} \ddot q`.

    Parameters
    ----------
    stiffness, mass
        Matrices of the whole mesh, before supports, shape (3 n_node, 3 n_node) [N/m, kg].
    nodes
        Nodes that are fixed in all directions, shape (k,) [-].
    free
        Free degrees of freedom of the mesh, the columns of the rows, shape (n,) [-].
    """
    picked = np.zeros((3, stiffness.shape[0]))
    for direction in range(3):
        picked[direction, 3 * nodes + direction] = 1.0
    # The matrices are symmetric, so their columns are their rows.
    return SupportReaction(stiffness=(stiffness @ picked.T)[free].T, mass=(mass @ picked.T)[free].T)
