"""The finite-element model of a blade: its inputs, its clamped system, its CAD solid and its reduction."""

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import pi
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from casefile.table import CaseModel, located
from fe.assembly import assemble_compact
from fe.boundary import Support, supported_system
from fe.damping import rayleigh_damping
from fe.element import ELEMENTS, HEX20, REGISTRY
from fe.material import Material
from fe.mesh import Mesh
from fe.mesh_quality import check_quality
from fe.mesher.blade import PadMesh
from fe.mesher.mesh_rule import MeshRule
from fe.modal import modes
from fe.node_sets import thin_nodes
from fe.solid import jacobian
from fe.system import LinearSystem
from geometry.blade import Blade
from geometry.blade_solid import blade_part
from geometry.plain_blade import PlainBlade, plain_blade_part
from geometry.step_io import write_step
from geometry.system_library import require_system_libraries
from hbsolve.continuation.peak import ResonancePeak, resonance_peak, undamped_from_peak
from hbsolve.dynamic_stiffness import DynamicStiffness
from hbsolve.forced_response import HarmonicForce, forced_response
from pipeline.store import stage
from reduction.craig_bampton import craig_bampton
from reduction.memory_estimate import estimate_reduction_memory, refuse_beyond_memory
from reduction.rom import ReducedModel, with_rayleigh_damping
from reduction.rom_error import rom_error
from study.kind.blade.table import BladeTables, mesh_any, with_thickness
from study.reduce.comparison import N_FREQUENCY, ComparedReduction

#: Node sets that a reduced model retains, if the mesh has them.
BOUNDARY = ("excitation", "response", "contact_positive", "contact_negative")
#: Elements through the thickness of the mesh whose volume is compared with that of the CAD solid. The elements are
#: quadratic, since faces with straight edges would change the volume of a curved groove.
THROUGH_THICKNESS = 2
#: Excitation and response act along y, the thickness.
THICKNESS_DIRECTION = 1
#: Relative half-width of the search range for the first peak around the reduced frequency; the second mode is outside.
BAND = 0.2


@dataclass(frozen=True, kw_only=True)
class BladeModel:
    """Inputs of a model of a blade.

    Parameters
    ----------
    blade, material
        Dimensions and material of the blade.
    element, through_thickness, length_ratio, length_cap, subdivisions, pads
        Name of the element, and mesh parameters of `fe.mesher.mesh_rule.MeshRule` and `fe.mesher.blade.PadMesh`.
    drop_every
        Thinning of the clamp: every n-th vertex node is free; 0 for the full clamp [-].
    n_mode
        Number of fixed-interface modes [-].
    damping_ratio
        Damping ratio of the first mode [-].
    """

    blade: Blade | PlainBlade
    material: Material
    element: str
    through_thickness: int
    length_ratio: float
    length_cap: float
    pads: PadMesh
    drop_every: int
    n_mode: int
    damping_ratio: float
    subdivisions: int = 1

    @property
    def rule(self) -> MeshRule:
        """Meshing rule."""
        return MeshRule(
            element=REGISTRY[self.element],
            through_thickness=self.through_thickness,
            length_ratio=self.length_ratio,
            length_cap=self.length_cap,
            subdivisions=self.subdivisions,
        )


def make_blade_model(
    case: CaseModel,
    table: BladeTables,
    *path: str,
    element: str,
    through_thickness: int,
    drop_every: int = 0,
    thickness_factor: float = 1.0,
) -> BladeModel:
    """Make and check the model of a blade of a case.

    Parameters
    ----------
    case
        Case returned by `load_case`.
    table, path
        Tables of the blade, and their path in the case.
    element, through_thickness, drop_every
        See `BladeModel`.
    thickness_factor
        Factor on the thickness, see `with_thickness` [-].

    Raises
    ------
    CaseError
        The blade, its material or its mesh cannot be built from the values of the case.
    """
    with located(case, *path, "blade"):
        blade = table.blade.blade()
    with located(case, *path, "material"):
        material = table.material.material()
    with located(case, *path, "mesh", "pads"):
        pads = table.mesh.pads.pads()
    model = BladeModel(
        blade=with_thickness(blade, thickness_factor),
        material=material,
        element=element,
        through_thickness=through_thickness,
        length_ratio=table.mesh.length_ratio,
        length_cap=table.mesh.length_cap,
        pads=pads,
        drop_every=drop_every,
        n_mode=table.reduction.modes,
        damping_ratio=table.damping.ratio,
    )
    with located(case, *path, "mesh"):
        model.rule  # noqa: B018 - refuses sizes without a valid rule before any computation
    return model


@stage("mesh size")
def count_mesh_dofs(model: BladeModel) -> int:
    """Count the degrees of freedom of the mesh, including fixed ones [-], as a measure of work and memory."""
    return 3 * mesh_any(model.blade, model.rule, model.pads).n_node


def clamped(model: BladeModel) -> tuple[Mesh, LinearSystem, int]:
    """Mesh, clamped system without damping, and the number of fixed nodes."""
    mesh = mesh_any(model.blade, model.rule, model.pads)
    check_quality(mesh)
    mass, stiffness = assemble_compact(mesh, model.material)
    nodes = find_fixed_nodes(mesh, model.drop_every)
    return mesh, supported_system(mesh, mass, stiffness, [Support(nodes=nodes)]), len(nodes)


def compute_first_frequency(model: BladeModel) -> tuple[Mesh, float, int]:
    """Compute mesh, first frequency [Hz] and number of free degrees of freedom of a model."""
    mesh, system, _ = clamped(model)
    return mesh, float(modes(system, 1).frequency[0]), system.n_dof


def find_fixed_nodes(mesh: Mesh, drop_every: int) -> NDArray[np.int64]:
    """Find the clamped nodes: all nodes of the face set "clamp", or a part of them."""
    nodes = mesh.nodes("clamp")
    return thin_nodes(mesh, nodes, drop_every) if drop_every else nodes


def find_boundary_rows(mesh: Mesh, system: LinearSystem) -> dict[str, NDArray[np.int64]]:
    """Find the rows of the node sets `BOUNDARY` in the system, by name."""
    return {name: system.rows(mesh.node_sets[name]) for name in BOUNDARY if name in mesh.node_sets}


@dataclass(frozen=True, kw_only=True)
class SolidCheck:
    """Comparison of a blade's CAD solid with its mesh.

    Parameters
    ----------
    cad_volume, mesh_volume
        Volumes of the CAD solid and of the mesh [m^3].
    step
        Content of the STEP file.
    """

    cad_volume: float
    mesh_volume: float
    step: str


@stage("CAD solid")
def solid_check(inputs: BladeModel) -> SolidCheck:
    """Build the solid, write it as STEP and compare volumes."""
    require_system_libraries("cad")
    part = blade_part(inputs.blade) if isinstance(inputs.blade, Blade) else plain_blade_part(inputs.blade)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "blade.step"
        write_step(part, file)
        step = file.read_text(encoding="utf-8")
    quadratic = replace(inputs, element=HEX20.name, through_thickness=THROUGH_THICKNESS)
    mesh = mesh_any(inputs.blade, quadratic.rule, inputs.pads)
    volume = 0.0
    for cell_type, nodes in mesh.cells.items():
        at, weights = ELEMENTS[cell_type].rule
        volume += float((jacobian(ELEMENTS[cell_type], mesh.points[nodes], at)[0] @ weights).sum())
    return SolidCheck(cad_volume=part.volume, mesh_volume=volume, step=step)


@dataclass(frozen=True, kw_only=True, eq=False)
class Reduction(ComparedReduction):
    """A reduced blade, compared with the full model.

    Parameters
    ----------
    mesh
        Mesh of the blade.
    n_fixed
        Number of fixed nodes [-].
    peak_natural
        First natural frequency from the interpolated peak of the harmonic-balance response, corrected for damping [Hz].
    """

    mesh: Mesh
    n_fixed: int
    peak_natural: float


def reduce_blade(model: BladeModel, provenance: Mapping[str, str] | None = None) -> Reduction:
    """Mesh, clamp, damp and reduce a blade, and compare with the full model.

    Parameters
    ----------
    model
        Model of the blade.
    provenance
        Provenance that is stored in the reduced model.
    """
    mesh, system, n_fixed = clamped(model)
    rows = find_boundary_rows(mesh, system)
    n_boundary = sum(len(item) for item in rows.values())
    needed = estimate_reduction_memory(system.stiffness, n_boundary, model.n_mode)
    refuse_beyond_memory(needed, f"reducing {system.n_dof} degrees of freedom to {n_boundary} and modes")
    full = modes(system, N_FREQUENCY)
    damping = rayleigh_damping(model.damping_ratio, float(full.frequency[0]))
    rom = with_rayleigh_damping(craig_bampton(system, rows, model.n_mode, provenance), damping)
    reduced = rom.modes(N_FREQUENCY)
    peak = find_first_peak(rom, float(reduced.frequency[0]))
    return Reduction(
        mesh=mesh,
        rom=rom,
        n_fixed=n_fixed,
        frequency=full.frequency,
        rom_frequency=reduced.frequency,
        rom_error=rom_error(system, rom, N_FREQUENCY),
        peak_natural=undamped_from_peak(peak, model.damping_ratio) / (2 * pi),
    )


def find_first_peak(rom: ReducedModel, frequency: float) -> ResonancePeak:
    """Find the peak near a frequency [Hz] of the tip's harmonic-balance response to a force at the excitation point."""
    structure = DynamicStiffness.of(rom)
    force = make_unit_force(rom)
    seen = rom.rows("response", THICKNESS_DIRECTION)

    def amplitude(angular_frequency: Float[NDArray[np.float64], " p"]) -> Float[NDArray[np.float64], " p"]:
        branch = forced_response(structure, force, angular_frequency)
        return np.abs(branch.coefficients[:, 1, seen]).ravel()

    return resonance_peak(amplitude, 2 * pi * frequency * (1 - BAND), 2 * pi * frequency * (1 + BAND))


def make_unit_force(rom: ReducedModel) -> HarmonicForce:
    """Make a harmonic force of 1 N at the excitation point."""
    coefficients = np.zeros((2, rom.n_dof), dtype=np.complex128)
    coefficients[1, rom.rows("excitation", THICKNESS_DIRECTION)] = 1.0
    return HarmonicForce(coefficients=coefficients)
