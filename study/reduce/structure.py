"""A reduced model as the structure of a case: its boundary nodes are places."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Dof
from reduction.file.structure_file import StructureMatrices
from reduction.rom import ReducedModel
from study.case.structure import Structure


def reduced_structure(
    rom: ReducedModel,
    points: Float[NDArray[np.float64], "node 3"] | None = None,
    stations: Mapping[str, Float[NDArray[np.float64], "station 3"]] | None = None,
    **more: Any,
) -> Structure:
    """The structure of a reduced model.

    Parameters
    ----------
    rom
        Of one body.
    points
        Coordinates of the mesh's nodes [m]; None if they are not known.
    stations
        Coordinates of boundary sets whose stations lie between nodes [m], by name.
    more
        What else the kind knows, as in `Structure`.
    """
    matrices = StructureMatrices(mass=rom.mass, damping=rom.damping, stiffness=rom.stiffness, rom=rom)
    return Structure(matrices=matrices, dofs=dofs_of_reduced_model(rom, points, stations or {}), **more)


def dofs_of_reduced_model(
    rom: ReducedModel,
    points: Float[NDArray[np.float64], "node 3"] | None = None,
    stations: Mapping[str, Float[NDArray[np.float64], "station 3"]] | None = None,
) -> tuple[Dof, ...]:
    """Degrees of freedom at boundary nodes: the body is the first set that one belongs to; the others are modal."""
    body = dict.fromkeys(range(rom.n_boundary), "boundary")
    for name, members in reversed(list(rom.boundary_sets.items())):
        body |= dict.fromkeys(map(int, members), name)
    places = {} if points is None else {int(node): points[node] for node in rom.boundary_node}
    for name, found in (stations or {}).items():
        nodes = dict.fromkeys(int(rom.boundary_node[member]) for member in rom.boundary_sets[name])
        places |= dict(zip(nodes, found, strict=True))
    boundary = [
        Dof(body=body[number], node=int(node), direction="xyz"[int(axis)], coordinates=places.get(int(node)))
        for number, (node, axis) in enumerate(zip(rom.boundary_node, rom.boundary_direction, strict=True))
    ]
    return (*boundary, *(Dof() for _ in range(rom.n_dof - rom.n_boundary)))
