"""The stages of a user's part: its solid, tetrahedra and matrices, their reduction, and pictures of its mesh."""

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.assembly import assemble_compact
from fe.boundary import Support, make_unsupported_system, supported_system
from fe.errors import SupportError
from fe.material import Material
from fe.mesh import Mesh
from fe.mesher.tetrahedra import TetRule, mesh_solid
from fe.mode_check import ModeCheck
from fe.sparse.factor import Symmetric
from fe.sparse.node_matrix import NodeMatrix
from fe.sparse.upper_blocks import UpperBlocks
from fe.station_coordinates import StationCoordinates
from fe.system import LinearSystem
from figure.scene.named_faces import named_faces_picture
from geometry.face_selector import FaceSelector
from geometry.part import MILLIMETRES_PER_METRE
from geometry.step_part import read_body, step_part
from geometry.system_library import require_system_libraries
from pipeline.store import stage
from reduction.rom import ReducedModel
from reduction.rom_error import check_fixed_interface_modes
from study.modes.files import contents
from study.modes.shapes import Shapes, add_stress
from study.reduce.comparison import ComparedReduction, compare_reduction

#: Number of modes that are drawn.
N_DRAWN = 6

Nodes = Int[NDArray[np.int64], " k"]
#: Direction from the body to the viewer, by picture.
VIEWS = {"faces.png": (0.80, -0.62, 0.36), "faces_behind.png": (-0.80, 0.62, -0.36)}


@dataclass(frozen=True, kw_only=True, eq=False)
class SolidSummary:
    """Summary of the solid in a STEP file.

    Parameters
    ----------
    volume, longest
        Volume of the solid, and longest side of its bounding box [m^3, m].
    healing
        Repairs, one clause each.
    """

    volume: float
    longest: float
    healing: tuple[str, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class NamedFaces:
    """The faces of a solid with one name.

    Parameters
    ----------
    n_face
        Number of faces [-].
    area
        Total area [m^2].
    centre
        Mean position, weighted by area, shape (3,) [m].
    """

    n_face: int
    area: float
    centre: Float[NDArray[np.float64], " 3"]


@dataclass(frozen=True, kw_only=True, eq=False)
class PartReduction:
    """A reduced part and its first modes.

    Parameters
    ----------
    compared
        Reduced model, compared with the full model.
    shapes
        First modes of the reduced model, on the nodes of the mesh.
    """

    compared: ComparedReduction
    shapes: Shapes


@stage("solid of a STEP file")
def solid_summary(file: Path) -> SolidSummary:
    """Read and check the solid."""
    require_system_libraries("cad")
    body = read_body(file)
    box = body.solid.BoundingBox()
    return SolidSummary(
        volume=float(body.solid.Volume()) / MILLIMETRES_PER_METRE**3,
        longest=max(box.xlen, box.ylen, box.zlen) / MILLIMETRES_PER_METRE,
        healing=body.healing,
    )


@stage("named faces of a STEP file")
def named_faces(file: Path, faces: Mapping[str, Sequence[FaceSelector]]) -> dict[str, NamedFaces]:
    """Find the faces of each name."""
    require_system_libraries("cad")
    return {
        name: NamedFaces(n_face=len(region.faces), area=region.area, centre=region.centre)
        for name, region in step_part(file, faces).faces.items()
    }


@stage("tetrahedra of a STEP file")
def step_mesh(file: Path, faces: Mapping[str, Sequence[FaceSelector]], rule: TetRule) -> Mesh:
    """Mesh the solid; runs of the mesher differ, so that later runs use the stored mesh."""
    require_system_libraries("cad")
    return mesh_solid(step_part(file, faces), rule)


@stage("matrices of a part")
def part_matrices(mesh: Mesh, material: Material) -> tuple[NodeMatrix, UpperBlocks]:
    """Assemble mass and stiffness of all nodes [kg, N/m]."""
    return assemble_compact(mesh, material)


@stage("reduced part")
def reduced_part(
    mesh: Mesh,
    material: Material,
    matrices: tuple[Symmetric, Symmetric],
    to_nodes: sp.csr_array | None,
    supports: Sequence[Support],
    boundary: Mapping[str, Support],
    n_mode: int,
    damping_ratio: float | None,
    provenance: Mapping[str, str],
) -> PartReduction:
    """Support and reduce a part, with its stations as coordinates.

    Parameters
    ----------
    mesh, material
        Mesh and material of the part.
    matrices
        Mass and stiffness of all nodal displacements [kg, N/m].
    to_nodes
        Matrix from coordinates to nodal displacements, see `StationCoordinates`; None if only nodes are retained.
    supports
        Fixed nodes and directions; nothing is fixed if empty.
    boundary
        Retained nodes and directions, by name.
    n_mode, damping_ratio, provenance
        See `compare_reduction`.

    Raises
    ------
    SupportError
        Supports that leave a rigid motion, or a boundary whose nodes are all fixed.
    RomError
        See `compare_reduction`.
    """
    place = None if to_nodes is None else StationCoordinates(mesh=mesh, to_nodes=to_nodes)
    system = _make_supported_system(mesh, matrices, place, supports)
    rows = {name: system.rows(retained.nodes, retained.directions) for name, retained in boundary.items()}
    free = {name: result[result >= 0] for name, result in rows.items()}
    for name, result in free.items():
        if not len(result):
            raise SupportError(f'all nodes of "{name}" are fixed: remove it from the boundary or from the support')
    compared = compare_reduction(system, free, n_mode, damping_ratio, provenance)
    if place is not None:
        rom = replace(compared.rom, recovery=place.displacement(system, compared.rom.recovery))
        compared = replace(compared, rom=rom)
    return PartReduction(compared=compared, shapes=_make_shapes(mesh, material, compared))


@stage("check of a reduced part")
def checked_part(
    mesh: Mesh,
    matrices: tuple[Symmetric, Symmetric],
    to_nodes: sp.csr_array | None,
    supports: Sequence[Support],
    rom: ReducedModel,
) -> ModeCheck:
    """Check the fixed-interface modes of a model that `reduced_part` made of the same mesh, matrices and supports."""
    place = None if to_nodes is None else StationCoordinates(mesh=mesh, to_nodes=to_nodes)
    system = _make_supported_system(mesh, matrices, place, supports)
    if place is not None:
        rom = replace(rom, recovery=place.vectors(system, rom.recovery))
    return check_fixed_interface_modes(system, rom)


def _make_supported_system(
    mesh: Mesh,
    matrices: tuple[Symmetric, Symmetric],
    place: StationCoordinates | None,
    supports: Sequence[Support],
) -> LinearSystem:
    mass, stiffness = matrices if place is None else (place.matrix(item) for item in matrices)
    if supports:
        # The boundary may fix rigid motions that the supports leave free; otherwise the reduction raises an error.
        return supported_system(mesh, mass, stiffness, list(supports), may_move=True)
    return make_unsupported_system(mesh, mass, stiffness)


def _make_shapes(mesh: Mesh, material: Material, compared: ComparedReduction) -> Shapes:
    rom = compared.rom
    n_drawn = min(N_DRAWN, len(compared.rom_frequency))
    displacement = np.asarray(rom.displacement(rom.modes(n_drawn).mode_shapes).real, dtype=np.float64)
    return add_stress(mesh, material, compared.n_dof, compared.rom_frequency[:n_drawn], displacement)


@stage("pictures of a part")
def face_pictures(
    mesh: Mesh,
    faces: Mapping[str, Int[NDArray[np.int64], "_ 2"]],
    stations: Float[NDArray[np.float64], "station 3"],
    title: str,
    nodes: Mapping[str, Float[NDArray[np.float64], "_ 3"]],
) -> dict[str, NDArray[np.uint8]]:
    """Draw "faces.png" and "faces_behind.png", and return the bytes of each file by name."""
    with tempfile.TemporaryDirectory(prefix="stickslip-") as name:
        for file, towards_eye in VIEWS.items():
            eye = np.array(towards_eye)
            named_faces_picture(mesh, faces, stations, Path(name) / file, title=title, towards_eye=eye, nodes=nodes)
        return contents(Path(name))
