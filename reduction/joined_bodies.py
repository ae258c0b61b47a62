"""Join reduced bodies along contact lines: from an assembly to the system for the solver.

Three steps: `join_bodies` puts contact elements between the bodies, `JoinedBodies.static_state` computes the contact
forces under the dead weights, and `make_jointed_system` makes the system about this static state, with damping and a
harmonic force.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from jaxtyping import Complex, Int

from geometry.interface import ContactLine
from reduction.array_input import freeze_arrays
from reduction.array_type import Array, Matrix, Row, Whole
from reduction.assembly import ReducedAssembly
from reduction.errors import JointError
from reduction.jointed_system import FrictionContact, JointedSystem
from reduction.line_contact import (
    LineStiffness,
    Tangents,
    make_contact_directions,
    make_fixed_tangent_stiffness,
    make_line_contacts,
)
from reduction.rom import ReducedModel
from reduction.static_contact import StaticState, static_state
from reduction.stuck import stuck_damping, stuck_stiffness

#: Eigenvalue of a stiffness scaled to a diagonal of ones, relative to the largest, below which it is zero.
RIGID = 1e-10


@dataclass(frozen=True, kw_only=True, eq=False)
class LinePair:
    """Pair of coincident contact lines of two bodies, with the parameters of the contact."""

    name: str
    """Name of the pair."""
    body: str
    other: str
    """Names of the two bodies."""
    line: ContactLine
    """Line of the first body; its normals point into the second body."""
    line_set: str
    other_set: str
    """Boundary sets of the stations' nodes on each body, in the same order."""
    stiffness: LineStiffness
    """Contact stiffness of the line."""
    friction_coefficient: float
    """Friction coefficient mu [-]."""
    gaps: Sequence[float] | None = None
    """Initial gap at each station [m]; none by default."""


@dataclass(frozen=True, kw_only=True, eq=False)
class JoinedBodies:
    """Bodies with contact elements between them, unloaded; arrays are copied and read-only."""

    mass: Matrix
    bodies: Matrix
    """Mass and stiffness of the bodies without contacts, shape (r, r) [kg, N/m]."""
    stiffness: Matrix
    """Stiffness of the bodies with the springs of tangents that do not slide, shape (r, r) [N/m]."""
    contacts: tuple[FrictionContact, ...]
    """Contact elements of all lines."""
    lines: Mapping[str, tuple[str, ...]]
    """Names of the contact elements by line."""
    springs: Matrix
    """Stiffness of all contacts closed and stuck, shape (r, r) [N/m]."""

    def __post_init__(self) -> None:
        freeze_arrays(self, "mass", "bodies", "stiffness", "springs")
        object.__setattr__(self, "contacts", tuple(self.contacts))
        object.__setattr__(self, "lines", MappingProxyType(dict(self.lines)))

    @property
    def stuck(self) -> Matrix:
        """Stiffness with all contacts closed and stuck, shape (r, r) [N/m]."""
        return stuck_stiffness(self.stiffness, self.contacts)

    def static_state(self, load: Row) -> StaticState:
        """Displacement and contact forces under dead weights; see `reduction.static_contact.static_state`.

        Parameters
        ----------
        load
            Dead weights, shape (r,) [N].

        Raises
        ------
        JointError
            A body leaves its groove under this load, or has no equilibrium.
        """
        return static_state(self.stiffness, self.contacts, load, self.lines)


def join_bodies(
    assembly: ReducedAssembly,
    pairs: Sequence[LinePair],
    *,
    tangents: Tangents = Tangents.ALONG,
) -> JoinedBodies:
    """Put contact elements between bodies without damping; `make_jointed_system` adds the damping.

    Parameters
    ----------
    assembly
        Reduced bodies.
    pairs
        Pairs of lines in contact.
    tangents
        Tangents in which all lines slide.

    Raises
    ------
    RomError
        An unknown body or boundary set.
    JointError
        Gaps or nodes that are not one per station, two pairs of the same name, bodies with damping, or a group of
        touching bodies without a support.
    """
    if assembly.damping.any():
        raise JointError("the bodies already have damping, which would be lost: reduce them without damping")
    names = [pair.name for pair in pairs]
    for number, name in enumerate(names):
        if name in names[:number]:
            raise JointError(f'two pairs of lines are called "{name}": give each a different name')
    n_dof = assembly.n_dof
    contacts: list[FrictionContact] = []
    fixed, lines = np.zeros((n_dof, n_dof)), {}
    for pair in pairs:
        rows = _find_rows(assembly, pair, pair.body, pair.line_set)
        others = _find_rows(assembly, pair, pair.other, pair.other_set)
        directions = make_contact_directions(n_dof, pair.line, rows, others)
        result = make_line_contacts(
            pair.name, pair.line, directions, pair.stiffness, pair.friction_coefficient,
            tangents=tangents, gaps=pair.gaps,
        )  # fmt: skip
        contacts += result
        lines[pair.name] = tuple(item.name for item in result)
        if tangents is Tangents.ALONG:
            fixed += make_fixed_tangent_stiffness(pair.line, directions, pair.stiffness)
    _refuse_unsupported(assembly, pairs)
    return JoinedBodies(
        mass=assembly.mass,
        bodies=assembly.stiffness,
        stiffness=assembly.stiffness + fixed,
        contacts=tuple(contacts),
        lines=lines,
        springs=stuck_stiffness(fixed, contacts),
    )


def _refuse_unsupported(assembly: ReducedAssembly, pairs: Sequence[LinePair]) -> None:
    """Refuse a group of touching bodies without a support, which has a common rigid-body motion."""
    groups = [{body} for body in assembly.bodies]
    for pair in pairs:
        touching = [group for group in groups if group & {pair.body, pair.other}]
        groups = [group for group in groups if group not in touching] + [set[str]().union(*touching)]
    for group in groups:
        if not any(_is_supported(assembly.bodies[body]) for body in group):
            names = [body for body in assembly.bodies if body in group]
            if len(names) == 1:
                raise JointError(f"{names[0]} is not supported: give it a support, or contact with a body that has one")
            raise JointError(
                f"{' and '.join(names)}, which touch each other, are not supported: give one of them a support"
            )


def _is_supported(rom: ReducedModel) -> bool:
    """Whether the stiffness of a body has fewer than six zero eigenvalues, those of its rigid motions."""
    stiffness = rom.stiffness[: rom.n_boundary, : rom.n_boundary]
    scale = np.sqrt(np.diag(stiffness).clip(min=np.finfo(float).tiny))
    size = np.linalg.eigvalsh(stiffness / np.outer(scale, scale))
    return int(np.count_nonzero(size < RIGID * size[-1])) < 6


def _find_rows(assembly: ReducedAssembly, pair: LinePair, body: str, name: str) -> Int[Whole, "station 3"]:
    """Coordinates in x, y and z of the node of each station."""
    result = assembly.rows(body, name)
    if len(result) != 3 * pair.line.n_station:
        raise JointError(
            f'pair "{pair.name}": boundary set "{name}" of {body} keeps {len(result)} degrees of freedom, but the line '
            f"has {pair.line.n_station} stations with three each: keep one node per station"
        )
    return result.reshape(-1, 3)


def make_jointed_system(
    bodies: JoinedBodies, rest: StaticState, damping_ratio: float, harmonic_force: Complex[Array, "harmonic r"]
) -> JointedSystem:
    """Make the system about its static equilibrium.

    Parameters
    ----------
    bodies
        Bodies and contacts.
    rest
        Equilibrium under the dead weights, from which motion is measured.
    damping_ratio
        Damping ratio of the first mode with all contacts closed and stuck that the force excites [-], see
        `reduction.stuck.stuck_damping`. The stiffness-proportional part uses the stiffness of the bodies and of
        tangents that do not slide, so that modes without contacts remain uncoupled.
    harmonic_force
        Force at level 1, shape (n_harmonic, r) [N].
    """
    return JointedSystem(
        mass=bodies.mass,
        damping=stuck_damping(bodies.mass, bodies.stiffness, bodies.stuck, damping_ratio, seen=harmonic_force),
        stiffness=bodies.stiffness,
        joints=rest.contacts,
        static_load=rest.load,
        harmonic_force=harmonic_force,
    )
