"""Mesh any closed CAD solid with tetrahedra of ten nodes, with its named faces as face sets.

fTetWild fills the triangulated solid, but keeps its surface within an envelope only. Every triangle on the boundary is
therefore assigned to a CAD face, and its corner nodes and midside nodes are moved onto faces, edges and corners. The
area of every named face and the volume are then checked against the solid.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from math import isfinite

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fe.element import TET10
from fe.errors import MeshError
from fe.face_integral import find_outer_faces, integrate_areas, integrate_volume
from fe.mesh import Mesh
from fe.mesh_quality import check_quality
from fe.mesher.face_labels import label_faces
from fe.mesher.ftetwild import fill_with_tetrahedra, make_size_field
from fe.mesher.snapping import add_midside_nodes, snap_corners, sort_edges
from fe.node_sets import add_named_points
from geometry.part import Part
from geometry.solid_skin import Facets, SolidSkin

#: Envelope, and largest distance of the triangles for fTetWild from the solid, relative to the smallest cell.
ENVELOPE, DEFLECTION = 0.03, 0.01
#: Largest distance by which a node may be moved to its face, relative to the smallest cell.
LONGEST_WAY = 0.3
#: Growth of the cell size per distance from a face with smaller cells.
GROWTH = 0.5
#: Largest relative error of the area of each named face, and of the volume.
AREA, VOLUME = 2e-3, 5e-4


@dataclass(frozen=True, kw_only=True)
class TetRule:
    """Sizes of the cells.

    Parameters
    ----------
    size
        Length of edges [m].
    near
        Length of edges at named faces that need smaller cells [m], such as at the root of a blade.

    Raises
    ------
    MeshError
        A size that is not positive.
    """

    size: float
    near: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for what, size in {
            "size": self.size,
            **{f'size near "{name}"': size for name, size in self.near.items()},
        }.items():
            if not (isfinite(size) and size > 0):
                raise MeshError(f"tetrahedra: {what} = {size * 1e3:g} mm is not positive: 3 mm is a usual value")

    def check_names(self, part: str, faces: Collection[str]) -> None:
        """Refuse a size near a face that the part lacks.

        Raises
        ------
        MeshError
            An unknown face; the message lists the faces of the part.
        """
        unknown = [name for name in self.near if name not in faces]
        if unknown:
            known = ", ".join(sorted(faces)) or "none"
            raise MeshError(
                f'{part}: a cell size is given near the face "{unknown[0]}", but the part has {known}: name one of them'
            )


def mesh_solid(part: Part, rule: TetRule) -> Mesh:
    """Mesh a part.

    The mesh is not reproducible: store the mesh that was used.

    Parameters
    ----------
    part
        Closed solid with named faces and points.
    rule
        Sizes of cells.

    Returns
    -------
    Quadratic tetrahedra; a face set for each named face, and a node set of one corner node for each named point, except
    points with the name of a face.

    Raises
    ------
    InputError
        pytetwild is not installed.
    MeshError
        A size near a face that the part lacks, a solid that cannot be filled, or a mesh that does not fit the solid.
    """
    rule.check_names(part.name, part.faces)
    smallest = min([rule.size, *rule.near.values()])
    skin = SolidSkin(part.solid)
    facets = skin.facets(DEFLECTION * smallest)
    raw, cells = fill_with_tetrahedra(
        facets.points,
        facets.triangles,
        size=rule.size,
        envelope=ENVELOPE * smallest,
        sizes=_choose_sizes(part, rule, skin, facets),
    )
    surface = find_outer_faces(_make_linear_mesh(raw, cells))
    corners = np.array([face[:3] for face in TET10.faces])
    triangles = cells[surface[:, :1], corners[surface[:, 1]]]
    label = label_faces(raw, triangles, facets)
    points = snap_corners(raw, cells, _list_faces_at_nodes(triangles, label), skin, LONGEST_WAY * smallest)
    mesh = add_midside_nodes(points, cells, _list_faces_at_edges(cells, triangles, label), skin)
    number = {face: i for i, face in enumerate(skin.faces)}
    face_sets = {
        name: surface[np.isin(label, [number[face] for face in region.faces])] for name, region in part.faces.items()
    }
    mesh = replace(mesh, face_sets=face_sets)
    check_quality(mesh)
    _check_areas_and_volume(mesh, part)
    # A point with the name of a face is the middle of the face; the face set is used instead.
    named = {name: point for name, point in part.points.items() if name not in part.faces}
    return add_named_points(mesh, named) if named else mesh


def _choose_sizes(
    part: Part, rule: TetRule, skin: SolidSkin, facets: Facets
) -> tuple[Float[NDArray[np.float64], "at 3"], Int[NDArray[np.int64], "cell 4"], Float[NDArray[np.float64], " at"]]:
    """Size field: points and cells of a coarse mesh around the part, and lengths of edges at the points."""
    if not rule.near:
        return np.zeros((0, 3)), np.zeros((0, 4), dtype=np.int64), np.zeros(0)
    at, cells = make_size_field(facets.points, rule.size)
    sizes = np.full(len(at), rule.size)
    number = {face: i for i, face in enumerate(skin.faces)}
    for name, size in rule.near.items():
        members = np.isin(facets.face, [number[face] for face in part.faces[name].faces])
        distance, _ = cKDTree(_spread(facets.points[facets.triangles[members]], rule.size)).query(at)
        sizes = np.minimum(sizes, size + GROWTH * distance)
    return at, cells, sizes


def _spread(triangles: Float[NDArray[np.float64], "t 3 3"], spacing: float) -> Float[NDArray[np.float64], "p 3"]:
    """Points on triangles, at a distance of about the spacing or less."""
    result = [triangles.reshape(-1, 3)]
    for corners in triangles:
        n = int(np.ceil(max(np.linalg.norm(corners[k] - corners[k - 1]) for k in range(3)) / spacing))
        inside = np.array([(i, j, n - i - j) for i in range(n + 1) for j in range(n + 1 - i)]) / n
        result.append(inside @ corners)
    return np.concatenate(result)


def _make_linear_mesh(points: Float[NDArray[np.float64], "k 3"], cells: Int[NDArray[np.int64], "cell 4"]) -> Mesh:
    """Mesh of the raw cells with straight edges."""
    edges, which = sort_edges(cells)
    middles = (points[edges[:, 0]] + points[edges[:, 1]]) / 2
    return Mesh(
        points=np.vstack([points, middles]), cells={TET10.cell_type: np.column_stack([cells, len(points) + which])}
    )


def _list_faces_at_nodes(
    triangles: Int[NDArray[np.int64], "k 3"], label: Int[NDArray[np.int64], " k"]
) -> dict[int, frozenset[int]]:
    result: dict[int, set[int]] = {}
    for nodes, face in zip(triangles.tolist(), label.tolist(), strict=True):
        for node in nodes:
            result.setdefault(node, set()).add(face)
    return {node: frozenset(faces) for node, faces in result.items()}


def _list_faces_at_edges(
    cells: Int[NDArray[np.int64], "cell 4"],
    triangles: Int[NDArray[np.int64], "k 3"],
    label: Int[NDArray[np.int64], " k"],
) -> dict[int, frozenset[int]]:
    edges, _ = sort_edges(cells)
    place = {(first, second): k for k, (first, second) in enumerate(edges.tolist())}
    result: dict[int, set[int]] = {}
    for (a, b, c), face in zip(np.sort(triangles, axis=1).tolist(), label.tolist(), strict=True):
        for edge in ((a, b), (b, c), (a, c)):
            result.setdefault(place[edge], set()).add(face)
    return {edge: frozenset(faces) for edge, faces in result.items()}


def _check_areas_and_volume(mesh: Mesh, part: Part) -> None:
    """Refuse a mesh whose named faces or volume are not those of the part."""
    for name, region in part.faces.items():
        error = integrate_areas(mesh, mesh.face_sets[name]).sum() / region.area - 1
        if abs(error) > AREA:
            raise MeshError(
                f'{part.name}: the mesh misses the area of the face "{name}" by {error:.2%}: give smaller cells, or '
                "name faces that end at sharp edges"
            )
    error = integrate_volume(mesh) / part.volume - 1
    if abs(error) > VOLUME:
        raise MeshError(f"{part.name}: the mesh misses the volume of the solid by {error:.2%}: give smaller cells")
