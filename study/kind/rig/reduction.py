"""Reduction of a rig to its assembly: each body is a stage, so that finished bodies are kept after an interruption."""

import importlib.metadata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.assembly import assemble_compact
from fe.boundary import Support, SupportReaction, find_reaction, make_unsupported_system, supported_system
from fe.mesh import Mesh
from fe.mesh_quality import check_quality
from fe.mode_check import ModeCheck
from fe.sparse.factor import Symmetric
from fe.station_coordinates import StationCoordinates
from fe.system import LinearSystem
from pipeline.parallel import Task, run_parallel
from pipeline.progress import Progress, ShownStep
from pipeline.store import Outcome, Store, stage
from reduction.assembly import ReducedAssembly, select_lowest_modes, truncated
from reduction.available_memory import read_available_memory
from reduction.craig_bampton import craig_bampton
from reduction.elastic_support import ElasticBody, ElasticSupport, find_elastic_support, put_on_springs
from reduction.errors import RomError
from reduction.memory_estimate import estimate_mesh_memory, refuse_beyond_memory
from reduction.other_material import in_other_material
from reduction.rom import ReducedModel
from reduction.rom_error import check_fixed_interface_modes
from study.kind.rig.model import BODIES, FIXED_SETS, ROOT, MeshedRig, RigModel, Y, find_mirror_image, mesh_in_tetrahedra


@dataclass(frozen=True, kw_only=True, eq=False)
class ReducedBody:
    """A body and its Craig-Bampton model.

    Parameters
    ----------
    rom
        Reduced model of the body, at its position in the rig.
    least_scaled_jacobian
        Smallest scaled Jacobian of its elements, 1 for a rectangular hexahedron [-].
    reactions
        Reaction of each fixed set of nodes, over the reduced coordinates.
    root
        Clamp of the blade, for springs; None for other bodies.
    """

    rom: ReducedModel
    least_scaled_jacobian: float
    reactions: Mapping[str, SupportReaction]
    root: ElasticSupport | None = None


@stage("reduced body of a rig")
def reduced_body(model: RigModel, body: str) -> ReducedBody:
    """Mesh, support and reduce one body; all named node sets of its mesh are retained."""
    meshed = model.meshed()
    mesh, place = meshed.meshes[body], meshed.coordinates.get(body)
    quality = check_quality(mesh)
    mass, stiffness = assemble_compact(mesh, model.material)
    system = _support_in_coordinates(mesh, body, mass, stiffness, place)
    boundary = {name: system.rows(nodes) for name, nodes in mesh.node_sets.items()}
    version = importlib.metadata.version("stickslip")
    provenance = {"body": body, "stickslip": version, "model": repr(model)}
    try:
        rom = craig_bampton(system, boundary, model.modes_of(body), provenance)
    except RomError as error:
        raise RomError(f"{body}: {error}") from error
    if place is not None:
        rom = replace(rom, recovery=place.displacement(system, rom.recovery))
    supports = FIXED_SETS[body.partition("_")[0]]
    reactions = {name: find_reaction(stiffness, mass, mesh.nodes(name), system.free) for name in supports}
    return ReducedBody(
        rom=rom,
        least_scaled_jacobian=float(quality.scaled_jacobian.min()),
        reactions={
            name: SupportReaction(stiffness=item.stiffness @ rom.recovery, mass=item.mass @ rom.recovery)
            for name, item in reactions.items()
        },
        root=find_elastic_support(mesh, ROOT, mass, rom, mesh.points if place is None else place.places)
        if ROOT in supports
        else None,
    )


@stage("check of a reduced body of a rig")
def checked_body(model: RigModel, body: str, rom: ReducedModel) -> ModeCheck:
    """Check the fixed-interface modes of a model that `reduced_body` made."""
    meshed = model.meshed()
    mesh, place = meshed.meshes[body], meshed.coordinates.get(body)
    mass, stiffness = assemble_compact(mesh, model.material)
    system = _support_in_coordinates(mesh, body, mass, stiffness, place)
    if place is not None:
        rom = replace(rom, recovery=place.vectors(system, rom.recovery))
    return check_fixed_interface_modes(system, rom)


def _support_in_coordinates(
    mesh: Mesh, body: str, mass: Symmetric, stiffness: Symmetric, place: StationCoordinates | None
) -> LinearSystem:
    if place is None:
        return make_supported_body(mesh, body, mass, stiffness)
    return make_supported_body(mesh, body, place.matrix(mass), place.matrix(stiffness))


def make_supported_body(mesh: Mesh, body: str, mass: Symmetric, stiffness: Symmetric) -> LinearSystem:
    """Make the unreduced system of a body on its supports."""
    supports = FIXED_SETS[body.partition("_")[0]]
    if supports:
        return supported_system(mesh, mass, stiffness, [Support(nodes=mesh.nodes(name)) for name in supports])
    return make_unsupported_system(mesh, mass, stiffness)


@dataclass(frozen=True, kw_only=True, eq=False)
class RigReduction:
    """The reduced bodies of a rig.

    Parameters
    ----------
    meshes
        Mesh of each body.
    assembly
        Assembly of the reduced bodies.
    least_scaled_jacobian
        Smallest scaled Jacobian of each body [-].
    reactions
        Reactions by body and fixed set of nodes, over all coordinates of the assembly.
    coordinates
        Coordinates, by body, of stations between nodes and of the disc that the shaker pushes.
    root
        Blade on its clamp, with the compliance of the clamp's springs.
    """

    meshes: Mapping[str, Mesh]
    assembly: ReducedAssembly
    least_scaled_jacobian: Mapping[str, float]
    reactions: Mapping[str, Mapping[str, SupportReaction]]
    coordinates: Mapping[str, StationCoordinates] = field(default_factory=dict)
    root: ElasticBody | None = None

    @property
    def n_dof(self) -> int:
        """Number of free degrees of freedom of all bodies before the reduction [-]."""
        return sum(len(rom.free) for rom in self.assembly.bodies.values())

    def places(self, body: str) -> Float[NDArray[np.float64], "node 3"]:
        """Positions of the nodes of a body, or of the stations that replace nodes, shape (n_node, 3) [m]."""
        return self.coordinates[body].places if body in self.coordinates else self.meshes[body].points


def reduce_rig(model: RigModel, store: Store, progress: Progress) -> RigReduction:
    """Reduce all bodies in parallel; left bodies are mirror images of right bodies.

    Parameters
    ----------
    model
        Model of the rig.
    store, progress
        See `run_parallel`.

    Raises
    ------
    InvertedCell, RomError
        Errors of the stages.
    """
    model = mesh_in_tetrahedra(model, store, progress)
    meshed = model.meshed()
    tasks = list_reduction_tasks(model, meshed)
    outcomes = run_parallel(tasks, store, progress, "reduction of the rig", memory=read_available_memory())
    return make_rig_reduction(model, meshed, tasks, outcomes)


def list_reduction_tasks(model: RigModel, meshed: MeshedRig) -> list[Task]:
    """List one task for each body that is not a mirror image, weighted by the size of its mesh.

    Raises
    ------
    RomError
        A body requires more memory than is available.
    """
    tasks = []
    for body in BODIES:
        if find_mirror_image(body) is not None:
            continue
        mesh, kind = meshed.meshes[body], body.partition("_")[0]
        n_boundary = 3 * sum(len(nodes) for nodes in mesh.node_sets.values())
        is_compact = body not in meshed.coordinates
        memory = estimate_mesh_memory(mesh, n_boundary, model.modes_of(body), is_compact=is_compact)
        refuse_beyond_memory(memory, f"reducing the {kind} of {3 * mesh.n_node} degrees of freedom")
        tasks.append(
            Task(
                stage=reduced_body,
                inputs={"model": model.reduced, "body": body},
                label=f"reduction of {kind}",
                weight=mesh.n_node / 1e3,
                memory=memory,
            )
        )
    return tasks


def check_bodies(
    model: RigModel, bodies: Mapping[str, ReducedBody], store: Store, progress: Progress
) -> dict[str, ModeCheck]:
    """Check the fixed-interface modes of all reduced bodies that have any, one after the other."""
    return {
        body: ShownStep(f"check of {body.partition('_')[0]}", store, progress).run(checked_body, model, body, own.rom)
        for body, own in bodies.items()
        if model.modes_of(body)
    }


def index_by_body(tasks: Sequence[Task], outcomes: Sequence[Outcome[ReducedBody]]) -> dict[str, ReducedBody]:
    """Return the results of the tasks of `list_reduction_tasks`, by body."""
    return {str(task.inputs["body"]): outcome.value for task, outcome in zip(tasks, outcomes, strict=True)}


def make_rig_reduction(
    model: RigModel, meshed: MeshedRig, tasks: list[Task], outcomes: list[Outcome[ReducedBody]]
) -> RigReduction:
    """Make the reduction of the rig from the results of `list_reduction_tasks`.

    This adds the mirror images, selects the requested modes, and applies to the blade its material, the springs of its
    clamp, accelerometer and stinger.
    """
    result = index_by_body(tasks, outcomes)
    result["blade"] = _with_own_material(result["blade"], model)
    bodies = {
        body: result[body].rom if body in result else mirror_model(result[find_mirror_image(body) or ""].rom, body)
        for body in BODIES
    }
    if isinstance(model.n_mode, Mapping):
        counts = {body: min(n, len(bodies[body].fixed_interface_frequency)) for body, n in model.n_mode.items()}
        bodies = {body: truncated(rom, counts[body]) for body, rom in bodies.items()}
    else:
        bodies = select_lowest_modes(bodies, model.n_mode)
    root = _make_root(bodies["blade"], result["blade"].root, model.root_compliance)
    if root is not None and root.compliance:
        bodies["blade"] = put_on_springs(bodies["blade"], root.support, root.compliance)
        result["blade"] = replace(result["blade"], reactions={ROOT: root.reaction})
    bodies["blade"] = _with_attachments(bodies["blade"], model)
    assembly = ReducedAssembly(bodies=bodies)
    return RigReduction(
        meshes=meshed.meshes,
        assembly=assembly,
        least_scaled_jacobian={body: result[find_mirror_image(body) or body].least_scaled_jacobian for body in BODIES},
        coordinates=meshed.coordinates,
        root=root,
        reactions={
            body: _make_reactions(assembly, body, result[find_mirror_image(body) or body].reactions) for body in BODIES
        },
    )


def _with_own_material(body: ReducedBody, model: RigModel) -> ReducedBody:
    """Apply the blade's material to its reduced model and its reactions."""
    own, common = model.blade_material or model.material, model.material
    density, modulus = own.density / common.density, own.young / common.young
    rom = in_other_material(body.rom, density, modulus)
    size = np.ones(rom.n_dof)
    size[rom.n_boundary :] = density**-0.5
    return replace(
        body,
        rom=rom,
        root=None if body.root is None else body.root.scaled(density, rom.n_boundary),
        reactions={
            name: SupportReaction(stiffness=modulus * item.stiffness * size, mass=density * item.mass * size)
            for name, item in body.reactions.items()
        },
    )


def _with_attachments(rom: ReducedModel, model: RigModel) -> ReducedModel:
    """Add to the blade the accelerometer at its tip and the stinger at the excitation point."""
    if not (model.accelerometer_mass or model.stinger_stiffness):
        return rom
    mass, stiffness = np.array(rom.mass), np.array(rom.stiffness)
    tip, pushed = rom.rows("response"), rom.rows("excitation", Y)
    mass[tip, tip] += model.accelerometer_mass
    stiffness[pushed, pushed] += model.stinger_stiffness
    return replace(rom, mass=mass, stiffness=stiffness)


def _make_root(rom: ReducedModel, support: ElasticSupport | None, compliance: float) -> ElasticBody | None:
    if support is None:
        return None
    own = support.truncated(rom.n_dof)
    return ElasticBody(mass=rom.mass, stiffness=rom.stiffness, support=own, compliance=compliance)


def _make_reactions(
    assembly: ReducedAssembly, body: str, own: Mapping[str, SupportReaction]
) -> dict[str, SupportReaction]:
    """Expand the reactions of a body to the assembly's coordinates, with changed signs along y for a mirror image."""
    rom, columns = assembly.bodies[body], assembly.columns(body)
    rows, across = np.ones((3, 1)), np.ones(rom.n_dof)
    if find_mirror_image(body) is not None:
        rows[1], across = -1.0, _compute_signs(rom)

    def over_all(part: NDArray[np.float64]) -> NDArray[np.float64]:
        result = np.zeros((3, assembly.n_dof))
        # The modes that were not selected are the last ones.
        result[:, columns] = rows * part[:, : rom.n_dof] * across
        return result

    return {
        name: SupportReaction(stiffness=over_all(item.stiffness), mass=over_all(item.mass))
        for name, item in own.items()
    }


def mirror_model(rom: ReducedModel, body: str) -> ReducedModel:
    """Make the reduced model of a body's mirror image at y = 0, whose mesh has the same node numbers.

    Displacements along y change their sign, on the boundary and on the mesh; the modal coordinates are unchanged.
    """
    boundary, full = _compute_signs(rom), np.where(rom.free % 3 == 1, -1.0, 1.0)
    signs = np.outer(boundary, boundary)
    return replace(
        rom,
        mass=signs * rom.mass,
        damping=signs * rom.damping,
        stiffness=signs * rom.stiffness,
        recovery=full[:, None] * rom.recovery * boundary,
        provenance={**rom.provenance, "body": body},
    )


def _compute_signs(rom: ReducedModel) -> Float[NDArray[np.float64], " r"]:
    """Signs of the reduced coordinates under a reflection at y = 0 [-]."""
    result = np.ones(rom.n_dof)
    result[: rom.n_boundary][rom.boundary_direction == 1] = -1.0
    return result
