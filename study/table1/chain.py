"""The chain of one row: mesh, matrices, full modes, Craig-Bampton modes, harmonic-balance peak."""

import resource
import sys
import time
from dataclasses import dataclass
from math import pi

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.assembly import assemble
from fe.blade_mesher import PadMesh
from fe.boundary import Support, supported_system
from fe.damping import rayleigh_damping
from fe.material import Material
from fe.mesh import Mesh
from fe.mesh_quality import check_quality
from fe.mesh_rule import MeshRule
from fe.modal import lowest_eigenpairs, modes
from fe.system import LinearSystem
from fe.thinning import thinned
from geometry.blade import Blade
from geometry.plain_blade import PlainBlade
from hbsolve.dynamic_stiffness import DynamicStiffness
from hbsolve.forced_response import forced_response
from hbsolve.harmonic_force import HarmonicForce
from hbsolve.peak import Peak, resonance_peak, undamped_from_peak
from reduction.craig_bampton import craig_bampton
from reduction.rom import ReducedModel
from reduction.rom_error import rom_error
from study.blade_case import ELEMENT_BY_NAME, mesh_any
from study.store import stage

ROOMS = ("geometry", "fe", "reduction", "hbsolve")
#: Frequencies that each row compares; the peak is sought for the first.
N_FREQUENCY = 10
#: Excitation and response act along y, the thickness.
THICKNESS_DIRECTION = 1
#: The peak is sought this far on each side of the reduced frequency; the second mode is farther.
BAND = 0.2
#: Nodes that stay physical in the reduced model, where the mesh has them.
BOUNDARY = ("excitation", "response", "contact_positive", "contact_negative")


@dataclass(frozen=True, kw_only=True, eq=False)
class RowInput:
    """All that a row's result depends on.

    Parameters
    ----------
    blade, material
        What is meshed.
    element, through_thickness, length_ratio, length_cap, subdivisions, pads
        How: the name of the element and the numbers of `fe.mesh_rule.MeshRule` and `fe.blade_mesher.PadMesh`.
    drop_every
        Thinning of the clamp; 0 for the full clamp [-].
    n_mode
        Fixed-interface modes [-].
    damping_ratio
        On the first mode [-].
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
        """The meshing rule."""
        return MeshRule(
            element=ELEMENT_BY_NAME[self.element],
            through_thickness=self.through_thickness,
            length_ratio=self.length_ratio,
            length_cap=self.length_cap,
            subdivisions=self.subdivisions,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class RowResult:
    """Frequencies three ways, and what they cost.

    Parameters
    ----------
    frequency, rom_frequency
        The first ten, full and reduced, shape (10,) [Hz].
    rom_error
        Estimated relative truncation error of each reduced frequency, shape (10,) [-].
    peak
        Frequency of the interpolated peak of the harmonic-balance response [Hz].
    peak_natural
        The natural frequency that the peak stands for, its damping shift taken out [Hz].
    n_cell, n_dof, n_held, n_reduced
        Cells, free degrees of freedom, held nodes, reduced degrees of freedom [-].
    seconds, memory
        Wall-clock time and peak memory of the process [s, byte].
    """

    frequency: Float[NDArray[np.float64], " m"]
    rom_frequency: Float[NDArray[np.float64], " m"]
    rom_error: Float[NDArray[np.float64], " m"]
    peak: float
    peak_natural: float
    n_cell: int
    n_dof: int
    n_held: int
    n_reduced: int
    seconds: float
    memory: float


@stage("mesh-study row", rooms=ROOMS)
def row(inputs: RowInput) -> RowResult:
    """Compute one row of the mesh study."""
    start = time.perf_counter()
    mesh, system, n_held = clamped(inputs)
    full = modes(system, N_FREQUENCY)
    rom = craig_bampton(system, boundary_rows(mesh, system), inputs.n_mode)
    reduced = rom.modes(N_FREQUENCY)
    peak = first_peak(rom, float(reduced.frequency[0]))
    return RowResult(
        frequency=full.frequency,
        rom_frequency=reduced.frequency,
        rom_error=rom_error(system, rom, N_FREQUENCY),
        peak=peak.frequency,
        peak_natural=undamped_from_peak(peak, inputs.damping_ratio) / (2 * pi),
        n_cell=mesh.n_cell,
        n_dof=system.n_dof,
        n_held=n_held,
        n_reduced=len(rom.stiffness),
        seconds=time.perf_counter() - start,
        memory=peak_memory(),
    )


def clamped(inputs: RowInput) -> tuple[Mesh, LinearSystem, int]:
    """Mesh, clamped and damped system, and the number of held nodes."""
    mesh = mesh_any(inputs.blade, inputs.rule, inputs.pads)
    check_quality(mesh)
    mass, stiffness = assemble(mesh, inputs.material)
    nodes = held_nodes(mesh, inputs.drop_every)
    support = [Support(nodes=nodes)]
    undamped = supported_system(mesh, mass, stiffness, support)
    first = float(np.sqrt(lowest_eigenpairs(undamped.stiffness, undamped.mass, 1)[0][0])) / (2 * pi)
    damping = rayleigh_damping(inputs.damping_ratio, first)
    return mesh, supported_system(mesh, mass, stiffness, support, damping=damping), len(nodes)


def first_frequency(inputs: RowInput) -> tuple[Mesh, float, int]:
    """Mesh, first frequency [Hz] and free degrees of freedom of a model, nothing else."""
    mesh = mesh_any(inputs.blade, inputs.rule, inputs.pads)
    check_quality(mesh)
    mass, stiffness = assemble(mesh, inputs.material)
    system = supported_system(mesh, mass, stiffness, [Support(nodes=held_nodes(mesh, inputs.drop_every))])
    return mesh, float(modes(system, 1).frequency[0]), system.n_dof


def held_nodes(mesh: Mesh, drop_every: int) -> NDArray[np.int64]:
    """Clamped nodes: all of the face set "clamp", or thinned."""
    nodes = mesh.nodes("clamp")
    return thinned(mesh, nodes, drop_every) if drop_every else nodes


def boundary_rows(mesh: Mesh, system: LinearSystem) -> dict[str, NDArray[np.int64]]:
    """Rows of excitation, response and contact nodes, by name."""
    return {name: system.rows(mesh.node_sets[name]) for name in BOUNDARY if name in mesh.node_sets}


def first_peak(rom: ReducedModel, frequency: float) -> Peak:
    """Peak of the tip's harmonic-balance response to a force at the excitation point, near a frequency [Hz]."""
    structure = DynamicStiffness.of(rom)
    coefficients = np.zeros((2, rom.n_dof), dtype=np.complex128)
    coefficients[1, rom.rows("excitation", THICKNESS_DIRECTION)] = 1.0  # the response is linear: any force will do
    force = HarmonicForce(coefficients=coefficients)
    seen = rom.rows("response", THICKNESS_DIRECTION)

    def amplitude(angular_frequency: Float[NDArray[np.float64], " p"]) -> Float[NDArray[np.float64], " p"]:
        branch = forced_response(structure, force, angular_frequency)
        return np.abs(branch.coefficients[:, 1, seen]).ravel()

    return resonance_peak(amplitude, 2 * pi * frequency * (1 - BAND), 2 * pi * frequency * (1 + BAND))


def peak_memory() -> float:
    """Most memory that this process has held so far [byte]."""
    unit = 1 if sys.platform == "darwin" else 1024  # Linux counts kilobytes
    return float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit)
