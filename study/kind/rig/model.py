"""The finite-element model of a rig, of hexahedra or tetrahedra: all inputs of its reduction."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from fe.element import REGISTRY, TET10
from fe.face_integral import find_outer_faces
from fe.material import Material
from fe.mesh import Mesh
from fe.mesher.rig import RigMesh, choose_rig_mesh, mesh_rig
from fe.mesher.tetrahedra import TetRule, mesh_solid
from fe.pressed_disc import find_disc_weights
from fe.station_coordinates import (
    StationCoordinates,
    add_mean_coordinate,
    make_node_coordinates,
    make_station_coordinates,
)
from geometry.rig import Rig, named_points, placements, rig_parts
from geometry.system_library import require_system_libraries
from pipeline.parallel import Task, run_parallel
from pipeline.progress import Progress
from pipeline.store import Store, stage

#: The bodies of a rig by name, in the order of its meshes.
BODIES = tuple(placements(Rig()))
#: Fixed sets of nodes, by kind of body; only contacts support the dampers.
FIXED_SETS = {"blade": ("clamp",), "damper": (), "decoupler": ("cell_upper", "cell_lower")}
#: Axis of the span, and axis of vibration, through the blade's thickness.
Z, Y = 2, 1
#: Fixed set of the blade, which may be put on springs.
ROOT = "clamp"
#: Contact lines by kind of body, each with the face that it lies on.
LINES = {
    "blade": {"contact_positive": "groove_positive", "contact_negative": "groove_negative"},
    "damper": {"contact_blade": "cone_blade", "contact_decoupler": "cone_decoupler"},
    "decoupler": {"contact": "groove"},
}
#: Size of cells at faces relative to the size elsewhere [-], and largest size at contact stations 2 mm apart [m].
FINER = {"groove_positive": 0.5, "groove_negative": 0.5, "groove": 0.5, "clamp": 0.7}
LONGEST_AT_STATIONS = 4e-3
#: Face set for points.
SURFACE = "the surface"
#: Relative duration of meshing a body.
WORK = {"blade": 5.0, "damper": 1.0, "decoupler": 2.0}
#: Order of nodes and faces of a mirrored tetrahedron: two corners are exchanged, and two pairs of midside nodes.
MIRRORED_NODES, MIRRORED_FACES = [0, 2, 1, 3, 6, 5, 4, 7, 9, 8], np.array([0, 3, 2, 1])


@dataclass(frozen=True, kw_only=True, eq=False)
class MeshedRig:
    """The meshes of a rig by body, and the station coordinates of bodies whose coordinates are not only nodal."""

    meshes: Mapping[str, Mesh]
    coordinates: Mapping[str, StationCoordinates]


@dataclass(frozen=True, kw_only=True)
class RigModel:
    """Inputs of the reduced bodies of a rig, without contacts, dead weights and damping, which are added later.

    The material of the blade, the springs of its root, the accelerometer and the stinger are applied to the reduced
    blade, so that a change of these requires no new reduction.

    Parameters
    ----------
    rig
        Dimensions of the rig.
    material
        Material of all bodies.
    element
        Name of the element, "hex8", "hex20" or "tet10".
    size
        Approximate length of the elements' edges [m].
    n_mode
        Number of fixed-interface modes of all bodies together, the lowest first, or of each body by name [-].
    tetrahedra
        Meshes by body from `mesh_in_tetrahedra`; empty for hexahedra, and before meshing.
    blade_material
        Material of the blade, with the same Poisson's ratio; that of all bodies by default.
    root_compliance
        Total compliance of the springs of the blade's clamp along an axis [m/N]; 0 for a fixed clamp.
    accelerometer_mass
        Mass at the tip of the blade [kg].
    stinger_stiffness
        Stiffness to the ground along y at the excitation point [N/m].
    """

    rig: Rig
    material: Material
    element: str
    size: float
    n_mode: int | Mapping[str, int]
    tetrahedra: Mapping[str, StationCoordinates] = field(default_factory=dict, repr=False)
    blade_material: Material | None = None
    root_compliance: float = 0.0
    accelerometer_mass: float = 0.0
    stinger_stiffness: float = 0.0

    @property
    def reduced(self) -> "RigModel":
        """The model without the inputs that are applied to the reduced blade."""
        return replace(self, blade_material=None, root_compliance=0.0, accelerometer_mass=0.0, stinger_stiffness=0.0)

    @property
    def cells(self) -> RigMesh:
        """Mesh parameters of the bodies."""
        return choose_rig_mesh(self.rig, REGISTRY[self.element], self.size)

    def meshed(self) -> MeshedRig:
        """Make the meshes of all bodies at their positions, in the order of `BODIES`."""
        if self.tetrahedra:
            made = {body: self.tetrahedra[body] for body in BODIES if body in self.tetrahedra}
            return MeshedRig(meshes={body: item.mesh for body, item in made.items()}, coordinates=made)
        result = mesh_rig(self.rig, self.cells)
        pushed = with_excitation(make_node_coordinates(result["blade"]), self.rig)
        result["blade"] = pushed.mesh
        return MeshedRig(meshes={body: result[body] for body in BODIES}, coordinates={"blade": pushed})

    def meshes(self) -> dict[str, Mesh]:
        """Make the meshes of all bodies."""
        return dict(self.meshed().meshes)

    def modes_of(self, body: str) -> int:
        """Number of modes to compute for a body and its mirror image, from which `n_mode` selects [-]."""
        if not isinstance(self.n_mode, Mapping):
            return self.n_mode
        kind = body.partition("_")[0]
        return max(count for name, count in self.n_mode.items() if name.partition("_")[0] == kind)


def with_excitation(place: StationCoordinates, rig: Rig) -> StationCoordinates:
    """Add to the blade the mean displacement of the disc that the shaker pushes, as the coordinates "excitation".

    Raises
    ------
    MeshError
        The disc is not on a face, or its nodes are fixed or named.
    """
    centre = named_points(rig)["blade"]["excitation"]
    weights = find_disc_weights(
        place.mesh, find_outer_faces(place.mesh), centre, np.array([0.0, 1.0, 0.0]), rig.excitation_radius
    )
    return add_mean_coordinate(place, "excitation", weights, fixed=FIXED_SETS["blade"])


def find_mirror_image(body: str) -> str | None:
    """Name of the right body whose mirror image a left body is; None for all other bodies."""
    kind, _, side = body.partition("_")
    return f"{kind}_right" if side == "left" else None


@stage("tetrahedra of a rig's body")
def body_tetrahedra(rig: Rig, body: str, size: float) -> StationCoordinates:
    """Mesh one body at its position, with contact stations and named points as coordinates.

    Parameters
    ----------
    rig
        Dimensions of the rig.
    body
        Name of the body in `geometry.rig.placements`.
    size
        Edge length of the cells [m].
    """
    require_system_libraries("cad")
    part, kind = rig_parts(rig)[body], body.partition("_")[0]
    near = {name: share * size for name, share in FINER.items() if name in part.faces}
    for face in LINES[kind].values():
        near[face] = min(near.get(face, size), LONGEST_AT_STATIONS)
    mesh = mesh_solid(replace(part, points={}), TetRule(size=size, near=near))
    on = dict(LINES[kind])
    places = {name: part.contact_lines[name].stations for name in on}
    for name, point in named_points(rig)[body].items():
        # Points in the middle of a face are those of the face set; the disc of the excitation is added below.
        if name not in part.faces and name != "excitation":
            places[name], on[name] = point[None], SURFACE
    whole = replace(mesh, face_sets={**mesh.face_sets, SURFACE: find_outer_faces(mesh)})
    result = make_station_coordinates(whole, places, on, fixed=FIXED_SETS[kind])
    result = replace(result, mesh=replace(result.mesh, face_sets=mesh.face_sets))
    return with_excitation(result, rig) if body == "blade" else result


def mesh_in_tetrahedra(model: RigModel, store: Store, progress: Progress) -> RigModel:
    """Add meshes to a model of tetrahedra; a model of hexahedra is returned unchanged.

    Raises
    ------
    InputError
        pytetwild is not installed.
    MeshError
        A body cannot be meshed with cells of this size, or its stations are too close for them.
    """
    if model.element != TET10.name or model.tetrahedra:
        return model
    bodies = [body for body in BODIES if find_mirror_image(body) is None]
    tasks = [
        Task(
            stage=body_tetrahedra,
            inputs={"rig": model.rig, "body": body, "size": model.size},
            label=f"tetrahedra of {body.partition('_')[0]}",
            weight=WORK[body.partition("_")[0]],
        )
        for body in bodies
    ]
    outcomes = run_parallel(tasks, store, progress, "tetrahedra")
    result = {body: outcome.value for body, outcome in zip(bodies, outcomes, strict=True)}
    return replace(
        model,
        tetrahedra={
            body: result[body] if body in result else mirror_tetrahedra(result[find_mirror_image(body) or ""])
            for body in BODIES
        },
    )


def mirror_tetrahedra(place: StationCoordinates) -> StationCoordinates:
    """Mirror a mesh at y = 0; nodes and cells keep their numbers."""
    mesh, signs = place.mesh, np.array([1.0, -1.0, 1.0])
    image = Mesh(
        points=mesh.points * signs,
        cells={kind: cells[:, MIRRORED_NODES] for kind, cells in mesh.cells.items()},
        node_sets=mesh.node_sets,
        face_sets={
            name: np.column_stack([faces[:, 0], MIRRORED_FACES[faces[:, 1]]]) for name, faces in mesh.face_sets.items()
        },
    )
    # The weights of nodes are unchanged, since they do not couple directions.
    return StationCoordinates(mesh=image, to_nodes=place.to_nodes)
