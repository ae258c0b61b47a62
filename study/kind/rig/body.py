"""One body of a rig, reduced, as a stage: finished bodies survive an interruption."""

import importlib.metadata
from collections.abc import Mapping
from dataclasses import dataclass, replace

from fe.assembly import assemble_compact
from fe.boundary import Support, supported_system, unsupported_system
from fe.mesh import Mesh
from fe.mesh_quality import check_quality
from fe.mode_check import ModeCheck
from fe.reaction import SupportReaction, reaction
from fe.sparse.factor import Symmetric
from fe.station_coordinates import StationCoordinates
from fe.system import LinearSystem
from pipeline.store import stage
from reduction.craig_bampton import craig_bampton
from reduction.errors import RomError
from reduction.rom import ReducedModel
from reduction.rom_error import check_fixed_interface_modes
from study.kind.rig.model import HELD, RigModel


@dataclass(frozen=True, kw_only=True, eq=False)
class ReducedBody:
    """A body and its Craig-Bampton model.

    Parameters
    ----------
    rom
        In its place in the rig.
    least_scaled_jacobian
        Of its elements, 1 for a brick [-].
    reactions
        Of each held set of nodes, over the reduced coordinates.
    """

    rom: ReducedModel
    least_scaled_jacobian: float
    reactions: Mapping[str, SupportReaction]


@stage("reduced body of a rig")
def reduced_body(model: RigModel, body: str) -> ReducedBody:
    """Mesh, hold and reduce one body; every named set of its mesh stays physical."""
    meshed = model.meshed()
    mesh, place = meshed.meshes[body], meshed.coordinates.get(body)
    quality = check_quality(mesh)
    mass, stiffness = assemble_compact(mesh, model.material)
    system = _in_coordinates(mesh, body, mass, stiffness, place)
    boundary = {name: system.rows(nodes) for name, nodes in mesh.node_sets.items()}
    version = importlib.metadata.version("stickslip")
    provenance = {"body": body, "stickslip": version, "model": repr(model)}
    try:
        rom = craig_bampton(system, boundary, model.modes_of(body), provenance)
    except RomError as error:
        raise RomError(f"{body}: {error}") from error
    if place is not None:
        rom = replace(rom, recovery=place.displacement(system, rom.recovery))
    held = HELD[body.partition("_")[0]]
    reactions = {name: reaction(stiffness, mass, mesh.nodes(name), system.free) for name in held}
    return ReducedBody(
        rom=rom,
        least_scaled_jacobian=float(quality.scaled_jacobian.min()),
        reactions={
            name: SupportReaction(stiffness=each.stiffness @ rom.recovery, mass=each.mass @ rom.recovery)
            for name, each in reactions.items()
        },
    )


@stage("check of a reduced body of a rig")
def checked_body(model: RigModel, body: str, rom: ReducedModel) -> ModeCheck:
    """Check the fixed-interface modes of what `reduced_body` made."""
    meshed = model.meshed()
    mesh, place = meshed.meshes[body], meshed.coordinates.get(body)
    mass, stiffness = assemble_compact(mesh, model.material)
    system = _in_coordinates(mesh, body, mass, stiffness, place)
    if place is not None:
        rom = replace(rom, recovery=place.vectors(system, rom.recovery))
    return check_fixed_interface_modes(system, rom)


def _in_coordinates(
    mesh: Mesh, body: str, mass: Symmetric, stiffness: Symmetric, place: StationCoordinates | None
) -> LinearSystem:
    if place is None:
        return held_body(mesh, body, mass, stiffness)
    return held_body(mesh, body, place.matrix(mass), place.matrix(stiffness))


def held_body(mesh: Mesh, body: str, mass: Symmetric, stiffness: Symmetric) -> LinearSystem:
    """A body in full, on its supports."""
    held = HELD[body.partition("_")[0]]
    if held:
        return supported_system(mesh, mass, stiffness, [Support(nodes=mesh.nodes(name)) for name in held])
    return unsupported_system(mesh, mass, stiffness)
