"""The structure of a case: matrices, degrees of freedom, joints and loads that its kind makes from ``[structure]``."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.model import AnySensor, DeadWeight, Dof, LoadCell, StructurePart
from fe.sparse.factor import Symmetric
from reduction.base_excitation import BaseMotion
from reduction.elastic_support import ElasticBody
from reduction.file.structure_file import StructureMatrices
from reduction.joint_law.registry import Joint
from reduction.rom import ReducedModel
from study.case.surface import BodySurface

Row = Float[NDArray[np.float64], " r"]
Matrix = Float[NDArray[np.float64], "r r"]
#: Function that returns initial slider positions of a curve [m], one row per friction history.
Histories = Callable[[int, int], list[Row]]


@dataclass(frozen=True, kw_only=True, eq=False)
class Structure:
    """A structure without the joints, loads and sensors of a case.

    Parameters
    ----------
    matrices
        Mass, damping and stiffness of r degrees of freedom, with the reduced model if they come from one.
    dofs
        Description of each degree of freedom; empty if unknown.
    parts
        Parts of the structure with their contributions to mass and stiffness; empty if unknown.
    stored
        Rows that a case may name, shape (r,) or (n, r).
    places
        Points with a direction that the kind names itself.
    joints, lines
        Joints that belong to the structure, and the joints of each contact line by name.
    static_load
        Load that balances these joints at rest, shape (r,) [N]; None for no load.
    harmonic_force
        Harmonic force at level 1, shape (n, r) [N]; None if the case must give it.
    sensors
        Sensors of a case without tables ``[[sensor]]``.
    load_cells
        Load cells of the structure, by name: a case and a campaign may read them.
    dead_weights
        Dead weights that press contact lines, by name.
    elastic_bodies
        Parts on a support that may be elastic, by the name of the part, over all degrees of freedom.
    suspension
        Stiffness that holds the structure if its contacts are removed for a test, shape (r, r) [N/m].
    loss_factor
        Structural damping, as a fraction of the stiffness without joints [-].
    base
        Function that returns the motion of the degrees of freedom with supports that move along an axis, "x", "y" or
        "z"; None if unknown. It raises `JointError` for a structure without supports.
    damped
        Function that returns the damping matrix with all joints of the case [N s/m]; None for the damping of
        `matrices`.
    histories
        Function of a number of friction histories and a seed that draws slider positions; None if the state of rest is
        unknown.
    surfaces
        Function that makes the outer surface of each body with a mesh, by name; None without meshes.
    details
        Data that the kind needs for its own tables and figures.
    """

    matrices: StructureMatrices
    dofs: tuple[Dof, ...] = ()
    parts: tuple[StructurePart, ...] = ()
    stored: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    places: Mapping[str, Row] = field(default_factory=dict)
    joints: tuple[Joint, ...] = ()
    lines: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    static_load: Row | None = None
    harmonic_force: Complex[NDArray[np.complex128], "n r"] | None = None
    sensors: tuple[AnySensor, ...] = ()
    load_cells: Mapping[str, LoadCell] = field(default_factory=dict)
    dead_weights: Mapping[str, DeadWeight] = field(default_factory=dict)
    elastic_bodies: Mapping[str, ElasticBody] = field(default_factory=dict)
    suspension: Matrix | None = None
    loss_factor: float = 0.0
    base: Callable[[str], BaseMotion] | None = None
    damped: Callable[[Sequence[Joint]], Matrix] | None = None
    histories: Histories | None = None
    surfaces: Callable[[], Mapping[str, BodySurface]] | None = None
    details: Any = None


def make_reduced_structure(
    rom: ReducedModel,
    points: Float[NDArray[np.float64], "node 3"] | None = None,
    stations: Mapping[str, Float[NDArray[np.float64], "station 3"]] | None = None,
    **more: Any,
) -> Structure:
    """Make the structure of a reduced model.

    Parameters
    ----------
    rom
        Reduced model of one body.
    points
        Coordinates of the mesh's nodes [m]; None if unknown.
    stations
        Coordinates of boundary sets whose stations are between nodes [m], by name.
    more
        Further fields of `Structure`.
    """
    matrices = StructureMatrices(mass=rom.mass, damping=rom.damping, stiffness=rom.stiffness, rom=rom)
    return Structure(matrices=matrices, dofs=list_reduced_dofs(rom, points, stations or {}), **more)


def make_mesh_base_motion(rom: ReducedModel, mass: Symmetric, axis: str) -> BaseMotion:
    """Make the motion of a reduced mesh with supports that move along an axis.

    Parameters
    ----------
    rom
        Reduced model of the mesh.
    mass
        Mass of all nodes, including fixed ones, shape (3 n_node, 3 n_node) [kg].
    axis
        "x", "y" or "z".
    """
    motion = np.zeros((3 * rom.n_node, 1))
    motion["xyz".index(axis) :: 3] = 1.0
    return BaseMotion.reduced(rom, motion[rom.free, 0], np.asarray(mass @ motion)[rom.free, 0])


def list_reduced_dofs(
    rom: ReducedModel,
    points: Float[NDArray[np.float64], "node 3"] | None = None,
    stations: Mapping[str, Float[NDArray[np.float64], "station 3"]] | None = None,
) -> tuple[Dof, ...]:
    """List the degrees of freedom of a reduced model: boundary ones, whose body is their first set, then modal ones."""
    body = dict.fromkeys(range(rom.n_boundary), "boundary")
    for name, members in reversed(list(rom.boundary_sets.items())):
        body |= dict.fromkeys(map(int, members), name)
    places = {} if points is None else {int(node): points[node] for node in rom.boundary_node}
    for name, result in (stations or {}).items():
        nodes = dict.fromkeys(int(rom.boundary_node[member]) for member in rom.boundary_sets[name])
        places |= dict(zip(nodes, result, strict=True))
    boundary = [
        Dof(body=body[number], node=int(node), direction="xyz"[int(axis)], coordinates=places.get(int(node)))
        for number, (node, axis) in enumerate(zip(rom.boundary_node, rom.boundary_direction, strict=True))
    ]
    return (*boundary, *(Dof() for _ in range(rom.n_dof - rom.n_boundary)))
