r"""Elastic support: a rigid support on springs, for a reduced body that was reduced on a fixed support.

With the six motions s of the support and the coordinates q, of which T (q - \Phi s) is the motion relative to it,

.. math:: u = \Phi_u s + T (q - \Phi s), \qquad
          s = (\Phi^T K \Phi + \kappa)^{-1} \Phi^T K q = S q ,

since the springs \kappa of a support without inertia carry the force of the body. All energies then depend on q only,

.. math:: \hat K = K - K \Phi S, \qquad
          \hat M = (I - \Phi S)^T M (I - \Phi S) + (I - \Phi S)^T P S + S^T P^T (I - \Phi S) + S^T J S ,

with the inertia P = T^T M_u \Phi_u and J = \Phi_u^T M_u \Phi_u of a rigid motion. Statically this is exact. The
inertia of an independent motion of the support is neglected, which matters near the natural frequencies of the support
with fixed boundary. The springs are given by their compliance, so that 0 is the fixed support without a singularity.

References
----------
Guyan, Reduction of stiffness and mass matrices, AIAA Journal 3 (1965) 380.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.boundary import SupportReaction
from fe.face_integral import integrate_over_faces
from fe.mesh import Mesh
from fe.sparse.factor import Symmetric
from reduction.array_input import freeze_arrays
from reduction.array_type import Matrix, Real
from reduction.errors import RomError
from reduction.rom import ReducedModel


@dataclass(frozen=True, kw_only=True, eq=False)
class ElasticSupport:
    """Motion of a reduced body on its elastic support: three translations, and rotations about the support's centre.

    Parameters
    ----------
    motion
        Motion of each coordinate with the support, zero for modal coordinates, shape (r, 6) [-, m].
    inertia
        Inertia P, shape (r, 6) [kg, kg m].
    mass
        Mass J, shape (6, 6) [kg, kg m, kg m^2].
    springs
        Stiffness of springs that are distributed evenly over the support, with a total of 1 N/m along each axis, shape
        (6, 6) [N/m, N, N m].
    body
        Motion of the rows of the recovery with the support, shape (n, 6) [-, m].
    """

    motion: Float[Real, "r 6"]
    inertia: Float[Real, "r 6"]
    mass: Float[Real, "6 6"]
    springs: Float[Real, "6 6"]
    body: Float[Real, "n 6"]

    def __post_init__(self) -> None:
        freeze_arrays(self, "motion", "inertia", "mass", "springs", "body")

    def support_motion(self, stiffness: Matrix, compliance: float) -> Float[Real, "6 r"]:
        """Motion S of the support per coordinate, shape (6, r) [-, 1/m].

        Parameters
        ----------
        stiffness
            Stiffness of the body on the fixed support, shape (r, r) [N/m].
        compliance
            Total compliance of the springs along an axis [m/N].

        Raises
        ------
        RomError
            A compliance that is negative or not finite.
        """
        if not (np.isfinite(compliance) and compliance >= 0):
            raise RomError(f"the compliance of a support is {compliance:g} m/N: give 0, which is fixed, or more")
        pull = self.motion.T @ stiffness
        return np.asarray(compliance * np.linalg.solve(compliance * pull @ self.motion + self.springs, pull))

    def matrices(self, mass: Matrix, stiffness: Matrix, compliance: float) -> tuple[Matrix, Matrix]:
        """Mass and stiffness on springs, from those on the fixed support, shape (r, r) [kg, N/m]."""
        support_motion = self.support_motion(stiffness, compliance)
        relative = np.eye(len(mass)) - self.motion @ support_motion
        carried = relative.T @ self.inertia @ support_motion
        changed = relative.T @ mass @ relative + carried + carried.T + support_motion.T @ self.mass @ support_motion
        softer = stiffness - stiffness @ self.motion @ support_motion
        return (changed + changed.T) / 2, (softer + softer.T) / 2

    def scaled(self, density_ratio: float, n_boundary: int) -> "ElasticSupport":
        """Support of a body of another density, with modes mass-normalised as in `in_other_material`."""
        size = np.full(len(self.inertia), density_ratio)
        size[n_boundary:] = np.sqrt(density_ratio)
        return replace(self, inertia=size[:, None] * self.inertia, mass=density_ratio * self.mass)

    def truncated(self, n_dof: int) -> "ElasticSupport":
        """Support for the first coordinates only, after modes were removed."""
        return replace(self, motion=self.motion[:n_dof], inertia=self.inertia[:n_dof])


@dataclass(frozen=True, kw_only=True, eq=False)
class ElasticBody:
    """Body on an elastic support whose compliance may change.

    Parameters
    ----------
    mass, stiffness
        Matrices on the fixed support, shape (r, r) [kg, N/m].
    support
        The support.
    compliance
        Total compliance of the springs along an axis [m/N].
    """

    mass: Matrix
    stiffness: Matrix
    support: ElasticSupport
    compliance: float

    def __post_init__(self) -> None:
        freeze_arrays(self, "mass", "stiffness")

    @cached_property
    def matrices(self) -> tuple[Matrix, Matrix]:
        """Mass and stiffness on the springs, shape (r, r) [kg, N/m]."""
        return self.support.matrices(self.mass, self.stiffness, self.compliance)

    @property
    def reaction(self) -> SupportReaction:
        """Force of the springs on the body.

        Raises
        ------
        RomError
            A fixed support; its reaction is that of its nodes.
        """
        if not self.compliance:
            raise RomError("a fixed support has no springs: take the reaction of its nodes")
        support_motion = self.support.support_motion(self.stiffness, self.compliance)
        pushed = -(self.support.springs / self.compliance)[:3] @ support_motion
        return SupportReaction(stiffness=pushed, mass=np.zeros_like(pushed))

    def scale_mass(self, ratio: float) -> "ElasticBody":
        """Body with its mass multiplied by a ratio, in the same coordinates."""
        support = replace(
            self.support, inertia=ratio * self.support.inertia, mass=ratio * np.asarray(self.support.mass)
        )
        return replace(self, mass=ratio * self.mass, support=support)

    def scale_stiffness(self, ratio: float) -> "ElasticBody":
        """Body with its stiffness multiplied by a ratio, on the same springs."""
        return replace(self, stiffness=ratio * self.stiffness)

    def embed(self, n_dof: int, columns: slice) -> "ElasticBody":
        """Body with its matrices expanded to the coordinates of several bodies, without the recovery."""

        def wide(matrix: Matrix, rows: int, both: bool) -> Matrix:
            result = np.zeros((n_dof, rows))
            result[columns, columns if both else slice(None)] = matrix
            return result

        support = replace(
            self.support,
            motion=wide(self.support.motion, 6, False),
            inertia=wide(self.support.inertia, 6, False),
            body=np.zeros((0, 6)),
        )
        return replace(
            self, support=support, mass=wide(self.mass, n_dof, True), stiffness=wide(self.stiffness, n_dof, True)
        )


def find_elastic_support(
    mesh: Mesh, name: str, mass: Symmetric, rom: ReducedModel, places: Float[NDArray[np.float64], "node 3"]
) -> ElasticSupport:
    """Compute the elastic support of a reduced body.

    Parameters
    ----------
    mesh
        Mesh of the body.
    name
        Face set that is fixed in the reduced model.
    mass
        Mass of all nodes, shape (3 n_node, 3 n_node) [kg].
    rom
        Reduced model, with recovery of the nodes.
    places
        Position of each coordinate of the mesh, shape (n_node, 3) [m].

    Raises
    ------
    RomError
        An unknown or empty face set.
    """
    if name not in mesh.face_sets or not len(mesh.face_sets[name]):
        raise RomError(f'the mesh has no faces "{name}", so they cannot be put on springs: name fixed faces')
    faces = mesh.face_sets[name]
    sums = integrate_over_faces(mesh, faces, lambda points, _: np.concatenate([np.ones_like(points), points], axis=-1))
    area, first = sums.sum(axis=0)[0], sums.sum(axis=0)[3:]
    centre = first / area

    def density(points: NDArray[np.float64], _: NDArray[np.float64]) -> NDArray[np.float64]:
        motions = _make_rigid_motions(points, centre)
        return np.asarray(np.einsum("...ik,...il->...kl", motions, motions).reshape(*points.shape[:-1], 36))

    springs = integrate_over_faces(mesh, faces, density).sum(axis=0).reshape(6, 6) / area
    rigid = _make_rigid_motions(mesh.points, centre).reshape(-1, 6)
    carried = np.asarray(mass @ rigid)
    motion = np.zeros((rom.n_dof, 6))
    motion[: rom.n_boundary] = _make_rigid_motions(places, centre)[rom.boundary_node, rom.boundary_direction]
    return ElasticSupport(
        motion=motion, inertia=rom.recovery.T @ carried[rom.free], mass=rigid.T @ carried, springs=springs,
        body=rigid[rom.free],
    )  # fmt: skip


def put_on_springs(rom: ReducedModel, support: ElasticSupport, compliance: float) -> ReducedModel:
    """Put a reduced model on springs, in the same coordinates; its recovery shows the fixed nodes at rest.

    Parameters
    ----------
    rom
        Reduced model on the fixed support, without damping.
    support, compliance
        Support, and the compliance of its springs [m/N].

    Raises
    ------
    RomError
        A model with damping, which would have to be computed again; or a compliance that is negative or not finite.
    """
    if rom.damping.any():
        raise RomError("a body must be put on springs before damping is added: remove the damping")
    mass, stiffness = support.matrices(rom.mass, rom.stiffness, compliance)
    support_motion = support.support_motion(rom.stiffness, compliance)
    recovery = rom.recovery + (support.body - rom.recovery @ support.motion) @ support_motion
    return replace(rom, mass=mass, stiffness=stiffness, recovery=recovery)


def _make_rigid_motions(
    points: Float[NDArray[np.float64], "*n 3"], centre: Float[NDArray[np.float64], "3"]
) -> Float[NDArray[np.float64], "*n 3 6"]:
    """Translations along the axes, and rotations by 1 rad about axes through the centre, shape (..., 3, 6)."""
    about = points - centre
    motions = np.zeros((*points.shape, 6))
    for axis in range(3):
        motions[..., axis, axis] = 1.0
        motions[..., :, 3 + axis] = np.cross(np.eye(3)[axis], about)
    return motions
