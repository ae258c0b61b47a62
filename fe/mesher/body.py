"""Meshes of bodies: from blocks in local axes to a mesh at its placement, and several bodies as one mesh."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fe.element import Element
from fe.errors import MeshError
from fe.mesh import Mesh
from fe.mesher.block import Block, Coordinates, Lattice, Map, mesh_blocks, subdivide
from fe.node_sets import add_named_points, add_stations
from geometry.interface import ContactLine
from geometry.part import Point
from geometry.placement import Placement


def mesh_body(
    blocks: Sequence[Block],
    element: Element,
    *,
    points: Mapping[str, Point],
    lines: Mapping[str, ContactLine],
    placement: Placement | None = None,
    subdivisions: int = 1,
) -> Mesh:
    """Mesh a body.

    Parameters
    ----------
    blocks
        Blocks in the body's local axes; cells of mirrored blocks are made right-handed.
    element
        Any element; tetrahedra are cut from the hexahedra.
    points, lines
        Points and lines that get node sets, in the body's local axes [m].
    placement
        Placement in the rig; the body's local axes by default.
    subdivisions
        Number of parts into which each element is divided along each edge [-].

    Raises
    ------
    MeshError
        The stations of a line are not on corner nodes.
    """
    place = placement or Placement()
    placed = [replace(block, shape=_move_map(block.shape, place)) for block in subdivide(blocks, subdivisions)]
    mesh = mesh_blocks(placed, element)
    mesh = add_named_points(mesh, {name: place.points(point) for name, point in points.items()})
    return add_stations(mesh, {name: place.points(line.stations) for name, line in lines.items()})


def _move_map(shape: Map, placement: Placement) -> Map:
    def moved(u: Lattice, v: Lattice, w: Lattice) -> Coordinates:
        points = placement.points(np.stack(np.broadcast_arrays(*shape(u, v, w)), axis=-1))
        return points[..., 0], points[..., 1], points[..., 2]

    return moved


def join_meshes(meshes: Mapping[str, Mesh]) -> Mesh:
    """Join meshes of several bodies to one mesh; nodes and cells are in the order of the bodies.

    Parameters
    ----------
    meshes
        Meshes by the name of their body.

    Returns
    -------
    A mesh with one cell set per body; its other sets are called "body.set".

    Raises
    ------
    MeshError
        Cells of several types: cells are numbered by type, so that the cells of a body would not be consecutive.
    """
    kinds = sorted({cell_type for mesh in meshes.values() for cell_type in mesh.cells})
    if len(kinds) != 1:
        raise MeshError(f"cells of the types {', '.join(kinds)} do not make one mesh: mesh all bodies with one element")
    (kind,) = kinds
    cells: list[NDArray[np.int64]] = []
    node_sets: dict[str, NDArray[np.int64]] = {}
    face_sets: dict[str, NDArray[np.int64]] = {}
    cell_sets: dict[str, NDArray[np.int64]] = {}
    node = cell = 0
    for body, mesh in meshes.items():
        cells.append(mesh.cells[kind] + node)
        node_sets |= {f"{body}.{name}": nodes + node for name, nodes in mesh.node_sets.items()}
        face_sets |= {f"{body}.{name}": faces + np.array([cell, 0]) for name, faces in mesh.face_sets.items()}
        cell_sets[body] = cell + np.arange(mesh.n_cell)
        node += mesh.n_node
        cell += mesh.n_cell
    return Mesh(
        points=np.concatenate([mesh.points for mesh in meshes.values()]),
        cells={kind: np.concatenate(cells)},
        node_sets=node_sets,
        face_sets=face_sets,
        cell_sets=cell_sets,
    )
