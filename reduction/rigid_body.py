"""Body that is held by contact only: stiffness of its six rigid-body motions, and free motions."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from jaxtyping import Float
from scipy.optimize import linear_sum_assignment

from reduction.array_input import freeze_arrays
from reduction.array_type import Matrix, Real
from reduction.assembly import ReducedAssembly
from reduction.errors import RomError

Six = Float[Real, "6"]

#: Names of the six motions about the centre of mass: translations [N/m], then rotations [N m/rad].
MOTIONS = ("x", "y", "z", "rotation about x", "rotation about y", "rotation about z")
#: Squared frequency, relative to the highest, below which a motion is free: round-off of a singular matrix.
FREE = 1e-10
#: Fraction of the kinetic energy of a free motion in a rotation above which it is a rotation.
TURNS = 1e-6
#: Resistance to a rigid motion, relative to the largest stiffness, above which it comes from supports, not round-off.
SUPPORTED = 1e-6


@dataclass(frozen=True, kw_only=True, eq=False)
class RigidBody:
    """Body treated as rigid, on the springs of its contacts; neighbouring bodies are fixed.

    Arrays are copied and read-only.
    """

    body: str
    """Name of the body."""
    mass: float
    """Mass [kg]."""
    centre: Float[Real, "3"]
    """Centre of mass, shape (3,) [m]."""
    stiffness: Six
    """Stiffness of each of `MOTIONS` with the other five fixed, shape (6,) [N/m and N m/rad]."""
    frequency: Six
    """Six natural frequencies, ascending, shape (6,) [Hz]."""
    shape: Float[Real, "6 6"]
    """Mode shapes about the centre of mass, mass-normalised, shape (6, 6), one per column."""

    def __post_init__(self) -> None:
        freeze_arrays(self, "centre", "stiffness", "frequency", "shape")

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the free motions, each by the motion with most of its energy; empty if the body is held."""
        largest = float(self.frequency[-1])
        loose = np.flatnonzero(self.frequency**2 <= FREE * largest**2)
        energy = np.abs(self.shape * np.linalg.inv(self.shape).T)[:, loose]
        turning = np.abs(energy[3:]).max(axis=0, initial=0.0) > TURNS
        # A body that rolls about a line also moves its centre; the free motion is still a rotation.
        energy[:3, turning] = 0.0
        names, modes = linear_sum_assignment(-energy)
        return tuple(MOTIONS[int(name)] for name in names[np.argsort(modes)])


def make_rigid_body(assembly: ReducedAssembly, body: str, points: Float[Real, "node 3"], springs: Matrix) -> RigidBody:
    """Compute mass, stiffness and frequencies of a body as rigid on its contact springs.

    Parameters
    ----------
    assembly, body
        Reduced assembly, and name of the body.
    points
        Nodes of the body's mesh, shape (n_node, 3) [m].
    springs
        Stiffness of all contacts, without the elasticity of other bodies, shape (r, r) [N/m].

    Raises
    ------
    RomError
        An unknown body, or a supported body, which has no rigid-body motion.
    """
    own = assembly.columns(body)
    motion = make_unit_motions(assembly, body, points, np.zeros(3))
    mass, stiffness = assembly.mass[own, own], assembly.stiffness[own, own]
    # Physical coordinates only: the stiffness of modal coordinates is a squared frequency, and they are at rest.
    retained = slice(assembly.bodies[body].n_boundary)
    resisting = float(np.abs(stiffness[retained, retained] @ motion[own][retained]).max(initial=0.0))
    if resisting > SUPPORTED * float(np.abs(stiffness[retained, retained]).max(initial=0.0)):
        raise RomError(f"{body} is supported: rigid-body motions are for a body that is held only by contacts")
    inertia = motion[own].T @ mass @ motion[own]
    # The coupling of translations and rotations is the cross product with m times the vector to the centre.
    centre = np.array([inertia[1, 5], inertia[2, 3], inertia[0, 4]]) / inertia[0, 0]
    motion = make_unit_motions(assembly, body, points, centre)
    inertia = motion[own].T @ mass @ motion[own]
    seen = motion.T @ springs @ motion
    lambda_, shape = scipy.linalg.eigh((seen + seen.T) / 2, (inertia + inertia.T) / 2)
    return RigidBody(
        body=body,
        mass=float(inertia[0, 0]),
        centre=centre,
        stiffness=np.diag(seen),
        frequency=np.sqrt(lambda_.clip(min=0)) / (2 * np.pi),
        shape=shape,
    )


def check_supported(bodies: Sequence[RigidBody]) -> None:
    """Refuse bodies with a free rigid-body motion.

    Raises
    ------
    RomError
        A free motion; the message lists all free motions by body.
    """
    loose = [f"{item.body}: {' and '.join(item.free)}" for item in bodies if item.free]
    if loose:
        raise RomError(
            f"not held: {'; '.join(loose)} (about the centre of mass): give that line contact more than one station, "
            "a stiffness in both tangents, or the spring that holds it in the rig"
        )


def make_unit_motions(
    assembly: ReducedAssembly, body: str, points: Float[Real, "node 3"], about: Real
) -> Float[Real, "r 6"]:
    """Reduced coordinates of the six unit motions `MOTIONS` of a body, shape (r, 6) [m/m and m/rad].

    Only boundary coordinates move; those of fixed-interface modes are zero.

    Parameters
    ----------
    assembly, body, points
        As in `make_rigid_body`.
    about
        Point where the axes of rotation meet, shape (3,) [m].
    """
    rom, own = assembly.bodies[body], assembly.columns(body)
    motion = np.zeros((assembly.n_dof, 6))
    place, direction = points[rom.boundary_node] - about, rom.boundary_direction
    rows = own.start + np.arange(rom.n_boundary)
    motion[rows, direction] = 1.0
    for axis in range(3):
        motion[rows, 3 + axis] = np.cross(np.eye(3)[axis], place)[np.arange(rom.n_boundary), direction]
    return motion
