"""The finite-element model of a rig: what its reduction depends on, and nothing else."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fe.element import REGISTRY
from fe.face_integral import outer_faces
from fe.material import Material
from fe.mesh import Mesh
from fe.mesher.rig import RigMesh, mesh_rig, rig_mesh
from fe.pressed_disc import disc_weights
from fe.station_coordinates import StationCoordinates, at_nodes, with_mean
from geometry.rig import Rig, named_points, placements

#: The bodies of a rig by name, in the order of its meshes.
BODIES = tuple(placements(Rig()))
#: Sets of nodes that are held, by kind of body; contact alone holds the dampers.
HELD = {"blade": ("clamp",), "damper": (), "decoupler": ("cell_upper", "cell_lower")}


@dataclass(frozen=True, kw_only=True, eq=False)
class MeshedRig:
    """The meshes of a rig by body, and the coordinates of those bodies that have other ones than their nodes'."""

    meshes: Mapping[str, Mesh]
    coordinates: Mapping[str, StationCoordinates]


@dataclass(frozen=True, kw_only=True)
class RigModel:
    """All that the reduced bodies of a rig depend on; contacts, dead weights and damping are put on them later.

    Parameters
    ----------
    rig
        Its dimensions.
    material
        Of all bodies.
    element
        Name of the element, "hex8", "hex20" or "tet10".
    size
        Length of the elements' edges, about [m].
    n_mode
        Fixed-interface modes of all bodies together, the lowest first, or of each body by name [-].
    tetrahedra
        Meshes by body that were made before, see `study.kind.rig.tetrahedra`; none where bricks are made, or cut.
    """

    rig: Rig
    material: Material
    element: str
    size: float
    n_mode: int | Mapping[str, int]
    tetrahedra: Mapping[str, StationCoordinates] = field(default_factory=dict, repr=False)

    @property
    def cells(self) -> RigMesh:
        """How the bodies are meshed."""
        return rig_mesh(self.rig, REGISTRY[self.element], self.size)

    def meshed(self) -> MeshedRig:
        """All bodies in their places, in the order of `BODIES`."""
        if self.tetrahedra:
            made = {body: self.tetrahedra[body] for body in BODIES if body in self.tetrahedra}
            return MeshedRig(meshes={body: each.mesh for body, each in made.items()}, coordinates=made)
        found = mesh_rig(self.rig, self.cells)
        pushed = with_excitation(at_nodes(found["blade"]), self.rig)
        found["blade"] = pushed.mesh
        return MeshedRig(meshes={body: found[body] for body in BODIES}, coordinates={"blade": pushed})

    def meshes(self) -> dict[str, Mesh]:
        """Their meshes alone."""
        return dict(self.meshed().meshes)

    def modes_of(self, body: str) -> int:
        """So many modes of a body are enough to choose from [-]: that of its mirror image counts too."""
        if not isinstance(self.n_mode, Mapping):
            return self.n_mode
        kind = body.partition("_")[0]
        return max(count for name, count in self.n_mode.items() if name.partition("_")[0] == kind)


def with_excitation(place: StationCoordinates, rig: Rig) -> StationCoordinates:
    """The blade with the mean over the disc that the shaker pushes as the coordinates "excitation".

    Raises
    ------
    MeshError
        The disc is on no face, or its nodes are held or named.
    """
    centre = named_points(rig)["blade"]["excitation"]
    weights = disc_weights(
        place.mesh, outer_faces(place.mesh), centre, np.array([0.0, 1.0, 0.0]), rig.excitation_radius
    )
    return with_mean(place, "excitation", weights, fixed=HELD["blade"])


def mirror_image(body: str) -> str | None:
    """The body on the right of which a body on the left is the mirror image; None for all others."""
    kind, _, side = body.partition("_")
    return f"{kind}_right" if side == "left" else None
