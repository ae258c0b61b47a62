"""Places on the mesh of a part: the supports, points, lines and sets of its case."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from jaxtyping import Int
from numpy.typing import NDArray

from casefile.table import Mistakes, at_key
from fe.boundary import Support
from fe.errors import MeshError, PointOffSurface
from fe.face_integral import find_outer_faces
from fe.file.dof_table import N_TRANSLATION
from fe.host_face import find_named_faces, find_station_normals
from fe.mesh import Mesh
from fe.station_coordinates import make_station_coordinates
from fe.surface_line import line_along_edge, line_between
from geometry.interface import ContactLine
from study.case.tables import Case
from study.kind.part.table import TRANSLATIONS, PartTable, StationLineTable

#: Face set for points that name no face.
SURFACE = "the surface"
#: Node set of all fixed nodes, while stations are assigned to nodes that they can replace.
FIXED = "what is fixed"
#: Tables of a case that name a boundary.
NAMING = ("point", "line", "boundary")


@dataclass(frozen=True, kw_only=True, eq=False)
class Places:
    """The mesh of a part with the places that its case names.

    Parameters
    ----------
    mesh
        Mesh with a node set for each retained name: nodes, or the nodes that stations replace.
    to_nodes
        Matrix from coordinates to nodal displacements; None if only nodes are retained.
    supports
        Fixed nodes and directions.
    boundary
        Retained nodes and directions, by name.
    lines
        Stations with their frames, by name; a point has one station, with zero tangents and zero length.
    """

    mesh: Mesh
    to_nodes: sp.csr_array | None
    supports: tuple[Support, ...]
    boundary: dict[str, Support]
    lines: dict[str, ContactLine]


def check_names(case: Case[PartTable], known: frozenset[str], what: str) -> None:
    """Refuse unknown names and duplicate names of boundaries, before any computation.

    Parameters
    ----------
    case
        Case of a part.
    known
        Names of existing sets.
    what
        Owner of these sets as a clause, such as "the case names".

    Raises
    ------
    CaseError
        If there are such names; the error lists all of them.
    """
    mistakes = Mistakes(case)

    def check(name: str, *path: str | int) -> None:
        with mistakes.at(), at_key(case, "structure", *path):
            if name not in known:
                raise MeshError(f'"{name}" does not exist: {what} {", ".join(sorted(known)) or "none"}')

    taken: set[str] = set()
    for table in NAMING:
        for number, entry in enumerate(getattr(case.structure, table)):
            with mistakes.at(), at_key(case, "structure", table, number, "name"):
                if entry.name in taken:
                    raise MeshError(
                        f'"{entry.name}" is used twice: give each point, line and boundary a different name'
                    )
            taken.add(entry.name)
            if entry.on is not None:
                check(entry.on, table, number, "on")
            for name in (entry.edge or ()) if isinstance(entry, StationLineTable) else ():
                check(name, table, number, "edge")
    for number, support in enumerate(case.structure.support):
        for name in support.on:
            check(name, "support", number, "on")
    if not taken:
        with mistakes.at():
            raise MeshError(
                "no degree of freedom is retained: add a [[structure.point]], [[structure.line]] or "
                "[[structure.boundary]] for joints, loads and sensors"
            )
    mistakes.raise_if_any()


def find_places(case: Case[PartTable], mesh: Mesh) -> Places:
    """Find all places of a case on the mesh.

    Raises
    ------
    CaseError
        If the case has mistakes; the error lists all of them: points off the part, invalid lines, different sets of the
        same name, and stations too close for the mesh.
    """
    mistakes = Mistakes(case)
    mesh = replace(mesh, face_sets={**mesh.face_sets, SURFACE: find_outer_faces(mesh)})
    supports, boundary, lines, faces = [], {}, {}, {}
    for number, support in enumerate(case.structure.support):
        with mistakes.at(), at_key(case, "structure", "support", number, "on"):
            nodes = np.unique(np.concatenate([_find_nodes(mesh, name) for name in support.on]))
            supports.append(Support(nodes=nodes, directions=support.numbers))
    for number, retained in enumerate(case.structure.boundary):
        with mistakes.at(), at_key(case, "structure", "boundary", number, "on"):
            nodes = _find_nodes(mesh, retained.on)
            boundary[retained.name] = Support(nodes=nodes, directions=_number_directions(retained.directions))
            _check_free(retained.name, boundary[retained.name], supports)
    for number, point in enumerate(case.structure.point):
        with mistakes.at(), at_key(case, "structure", "point", number, "at"):
            faces[point.name] = point.on or SURFACE
            lines[point.name] = _make_single_station(mesh, point.name, faces[point.name], point.at)
    for number, table in enumerate(case.structure.line):
        faces[table.name] = table.on or (table.edge or ("",))[0]
        wrong = len(mistakes.problems)
        for key, end in (("from", table.start), ("to", table.end)):
            if table.edge is None and end is not None:
                with mistakes.at(), at_key(case, "structure", "line", number, key):
                    _make_single_station(mesh, table.name, faces[table.name], end)
        if len(mistakes.problems) > wrong:
            continue
        # A mistake of a whole straight line is reported at its key "to".
        with mistakes.at(), at_key(case, "structure", "line", number, "to" if table.edge is None else "edge"):
            lines[table.name] = _make_line(mesh, table)
    mistakes.raise_if_any()
    sets = {name: retained.nodes for name, retained in boundary.items()}
    bare = replace(mesh, node_sets=sets)
    to_nodes = None
    if lines:
        fixed = np.unique(np.concatenate([item.nodes for item in supports] or [np.zeros(0, dtype=np.int64)]))
        stations = {name: line.stations for name, line in lines.items()}
        with mistakes.at():
            result = make_station_coordinates(replace(bare, node_sets={**sets, FIXED: fixed}), stations, faces)
            bare, to_nodes = replace(bare, node_sets={**sets, **_find_pivots(result.mesh, lines)}), result.to_nodes
        mistakes.raise_if_any()
        for name in lines:
            directions = next((point.directions for point in case.structure.point if point.name == name), TRANSLATIONS)
            boundary[name] = Support(nodes=bare.node_sets[name], directions=_number_directions(directions))
    kept_faces = {name: part for name, part in bare.face_sets.items() if name != SURFACE}
    return Places(
        mesh=replace(bare, face_sets=kept_faces),
        to_nodes=to_nodes,
        supports=tuple(supports),
        boundary=boundary,
        lines=lines,
    )


def _find_pivots(mesh: Mesh, lines: dict[str, ContactLine]) -> dict[str, NDArray[np.int64]]:
    return {name: mesh.node_sets[name] for name in lines}


def _check_free(name: str, retained: Support, supports: Sequence[Support]) -> None:
    fixed = [_number_dofs(item) for item in supports]
    if fixed and np.isin(_number_dofs(retained), np.concatenate(fixed)).all():
        along = ", ".join(TRANSLATIONS[item] for item in retained.directions)
        raise MeshError(
            f'all {len(retained.nodes)} nodes of "{name}" are fixed along {along}: retain another set, or remove what '
            "fixes them from [[structure.support]]"
        )


def _number_dofs(retained: Support) -> Int[NDArray[np.int64], " k"]:
    return np.ravel(N_TRANSLATION * retained.nodes[:, None] + np.array(retained.directions, dtype=np.int64))


def _number_directions(directions: tuple[str, ...]) -> tuple[int, ...]:
    return tuple(TRANSLATIONS.index(item) for item in directions)


def _find_nodes(mesh: Mesh, name: str) -> NDArray[np.int64]:
    """Find the nodes of a face set or a node set; those of a node set in its order."""
    if name not in mesh.node_sets:
        return mesh.nodes(name)
    if name in mesh.face_sets:
        alone = Mesh(points=mesh.points, cells=mesh.cells, face_sets={name: mesh.face_sets[name]})
        if not np.array_equal(alone.nodes(name), mesh.nodes(name)):
            raise MeshError(
                f'two sets are called "{name}", one of nodes and one of faces, with different nodes: rename one'
            )
    return mesh.node_sets[name]


def _make_single_station(mesh: Mesh, name: str, on: str, place: tuple[float, float, float]) -> ContactLine:
    """Make a contact line of one station for a point; the error of a point off the face does not mention stations."""
    at = np.array([place])
    try:
        normal = find_station_normals(mesh, name, find_named_faces(mesh, name, on), at)
    except PointOffSurface as error:
        # Rounded to a nanometre, far below any tolerance.
        x, y, z = (f"{round(1e3 * item, 6) + 0.0:.12g} mm" for item in error.nearest)
        raise MeshError(
            f'it lies {error.distance * 1e3:.4g} mm off the face; the nearest point of the face is ["{x}", "{y}", '
            f'"{z}"]: give that, or another point of the face'
        ) from error
    return ContactLine(
        name=name, stations=at, normal=normal, tangents=np.zeros((1, 2, 3)), tributary_length=np.zeros(1)
    )


def _make_line(mesh: Mesh, table: StationLineTable) -> ContactLine:
    start = None if table.start is None else np.array(table.start)
    if table.edge is not None:
        return line_along_edge(mesh, table.name, table.edge, table.stations, start)
    assert table.on is not None
    assert start is not None
    assert table.end is not None
    try:
        return line_between(mesh, table.name, table.on, (start, np.array(table.end)), table.stations)
    except PointOffSurface as error:
        raise MeshError(
            f"station {error.number} of 0 to {table.stations - 1} lies {error.distance * 1e3:.4g} mm off the face, "
            "although both ends lie on it: give two points whose connecting line stays on the face, or an edge"
        ) from error
