"""What a kind of case makes of its ``[structure]``: matrices, and what is known of their degrees of freedom."""

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
#: Slider positions at which a curve begins [m], one row per friction history.
Histories = Callable[[int, int], list[Row]]


@dataclass(frozen=True, kw_only=True, eq=False)
class Structure:
    """A structure before a case puts joints, loads and sensors on it.

    Parameters
    ----------
    matrices
        Mass, damping and stiffness of r degrees of freedom, and the reduced model if they come from one.
    dofs
        Description of each degree of freedom; unknown if empty.
    parts
        Named shares of mass and stiffness; none if they are not known.
    stored
        Rows that a case may name, shape (r,) or (n, r).
    places
        Points with a direction that the kind names itself.
    joints, lines
        Joints that belong to the structure, and those of each contact line by name.
    static_load
        That balances these joints at rest, shape (r,) [N]; none if empty.
    harmonic_force
        At level 1, shape (n, r) [N]; None where the case must say it.
    sensors
        Sensors of a case that names none.
    load_cells
        Load cells of the structure, by name: a case and a campaign may read them.
    dead_weights
        Dead weights that press lines, by name.
    elastic_bodies
        Parts on a support that may give way, by the name of the part, over all degrees of freedom.
    suspension
        Stiffness that holds the structure when its contacts are taken away for a test, shape (r, r) [N/m].
    loss_factor
        Structural damping, as a share of the stiffness without its joints [-].
    base
        How the degrees of freedom follow supports that move along an axis, "x", "y" or "z"; None where that is not
        known. It raises `JointError` for a structure without supports.
    damped
        Damping matrix with all joints of the case [N s/m]; None keeps that of `matrices`.
    histories
        Draws slider positions for a number of friction histories by a seed; None where rest is not known.
    surfaces
        Makes the outside of each body that has a mesh, by name; None where there is none.
    details
        Data that the kind needs again for its own tables and figures.
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
    """The structure of a reduced model.

    Parameters
    ----------
    rom
        Reduced model of one body.
    points
        Coordinates of the mesh's nodes [m]; None if they are not known.
    stations
        Coordinates of boundary sets whose stations lie between nodes [m], by name.
    more
        Further fields of `Structure`.
    """
    matrices = StructureMatrices(mass=rom.mass, damping=rom.damping, stiffness=rom.stiffness, rom=rom)
    return Structure(matrices=matrices, dofs=list_reduced_dofs(rom, points, stations or {}), **more)


def make_mesh_base_motion(rom: ReducedModel, mass: Symmetric, axis: str) -> BaseMotion:
    """How a reduced mesh follows supports that move along an axis.

    Parameters
    ----------
    rom
        Reduced model of the mesh.
    mass
        Mass of all nodes, the fixed ones too, shape (3 n_node, 3 n_node) [kg].
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
    """Degrees of freedom at boundary nodes: the body is the first set that one belongs to; the others are modal."""
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
