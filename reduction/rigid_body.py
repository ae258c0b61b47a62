"""A body that contact alone holds: how stiffly its six rigid-body motions are resisted, and which one is not."""

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

#: The six motions, about the centre of mass: translations [N/m], then rotations [N m/rad].
MOTIONS = ("x", "y", "z", "rotation about x", "rotation about y", "rotation about z")
#: Share of the stiffest motion's squared frequency below which a motion counts as free: round-off of a singular matrix.
FREE = 1e-10
#: Share of a free motion's kinetic energy in a rotation above which it turns the body.
TURNS = 1e-6
#: Share of the largest stiffness beyond which a rigid motion is resisted: by supports, and not by round-off.
SUPPORTED = 1e-6


@dataclass(frozen=True, kw_only=True, eq=False)
class RigidBody:
    """A body as if it were rigid, on the springs of its contacts; the bodies beside it do not move.

    Arrays are copied and read-only.
    """

    body: str
    """Its name."""
    mass: float
    """[kg]."""
    centre: Float[Real, "3"]
    """Its centre of mass, shape (3,) [m]."""
    stiffness: Six
    """Of each of `MOTIONS` while the other five are prevented, shape (6,) [N/m and N m/rad]."""
    frequency: Six
    """The six natural frequencies, rising, shape (6,) [Hz]."""
    shape: Float[Real, "6 6"]
    """The motions that belong to them, about the centre of mass, mass-normalised, shape (6, 6), one per column."""

    def __post_init__(self) -> None:
        freeze_arrays(self, "centre", "stiffness", "frequency", "shape")

    @property
    def free(self) -> tuple[str, ...]:
        """What nothing resists, by the motion that has most of the energy; none in a rig that holds its parts."""
        largest = float(self.frequency[-1])
        loose = np.flatnonzero(self.frequency**2 <= FREE * largest**2)
        energy = np.abs(self.shape * np.linalg.inv(self.shape).T)[:, loose]
        turning = np.abs(energy[3:]).max(axis=0, initial=0.0) > TURNS
        # A body that rolls about a line moves its centre as well: it is a rotation that is free.
        energy[:3, turning] = 0.0
        names, modes = linear_sum_assignment(-energy)
        return tuple(MOTIONS[int(name)] for name in names[np.argsort(modes)])


def make_rigid_body(assembly: ReducedAssembly, body: str, points: Float[Real, "node 3"], springs: Matrix) -> RigidBody:
    """How the contact springs hold a body.

    Parameters
    ----------
    assembly, body
        The model, and the name of the body.
    points
        Nodes of the body's mesh, shape (n_node, 3) [m].
    springs
        Stiffness of all contacts, with no other body's elasticity in it, shape (r, r) [N/m].

    Raises
    ------
    RomError
        No such body, or one that is supported: it has no rigid-body motion.
    """
    own = assembly.columns(body)
    motion = make_unit_motions(assembly, body, points, np.zeros(3))
    mass, stiffness = assembly.mass[own, own], assembly.stiffness[own, own]
    # Physical coordinates alone: modal ones have squared frequencies for stiffness, and stay at rest.
    retained = slice(assembly.bodies[body].n_boundary)
    resisting = float(np.abs(stiffness[retained, retained] @ motion[own][retained]).max(initial=0.0))
    if resisting > SUPPORTED * float(np.abs(stiffness[retained, retained]).max(initial=0.0)):
        raise RomError(f"{body} is supported: rigid-body motions are for a body that is held only by contacts")
    inertia = motion[own].T @ mass @ motion[own]
    # m times the vector to the centre stands as a cross product in the coupling of translations and rotations.
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
    """Refuse bodies with a rigid-body motion that nothing resists.

    Raises
    ------
    RomError
        Every motion that nothing resists, by body.
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

    Those of the boundary; fixed-interface modes stay at rest.

    Parameters
    ----------
    assembly, body, points
        As for `make_rigid_body`.
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
