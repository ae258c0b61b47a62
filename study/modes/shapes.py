"""Mode shapes and their stress, for pictures and files."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.assembly import assemble_compact
from fe.boundary import Support, make_unsupported_system, supported_system
from fe.material import Material
from fe.mesh import Mesh
from fe.modal import ModeSet, compute_free_modes, modes
from fe.stress import compute_nodal_stress, compute_von_mises
from fe.system import LinearSystem
from pipeline.store import stage


@dataclass(frozen=True, kw_only=True, eq=False)
class Shapes:
    """Lowest modes on a mesh.

    Parameters
    ----------
    mesh
        Mesh.
    n_dof
        Number of free degrees of freedom [-].
    frequency
        Natural frequencies, shape (m,) [Hz].
    displacement
        Mass-normalised mode shapes, shape (m, n_node, 3) [kg^-1/2].
    von_mises
        Von Mises stress of the same shapes, shape (m, n_node) [Pa m^-1 kg^-1/2]; only its distribution has a meaning.
    """

    mesh: Mesh
    n_dof: int
    frequency: Float[NDArray[np.float64], " m"]
    displacement: Float[NDArray[np.float64], "m node 3"]
    von_mises: Float[NDArray[np.float64], "m node"]

    @property
    def fields(self) -> dict[str, Float[NDArray[np.float64], "node 3"]]:
        """Displacement of each mode, by its name in a mesh file: number and frequency."""
        return {f"mode {k + 1}: {f:.6g} Hz": self.displacement[k] for k, f in enumerate(self.frequency)}


@stage("mode shapes of a mesh")
def compute_mesh_shapes(mesh: Mesh, material: Material, fixed: tuple[str, ...], n_mode: int) -> Shapes:
    """Compute the lowest modes of a mesh, fixed at the named sets, or free if there are none."""
    mass, stiffness = assemble_compact(mesh, material)
    if fixed:
        system = supported_system(mesh, mass, stiffness, [Support(nodes=mesh.nodes(name)) for name in fixed])
        return make_shapes(mesh, material, system, modes(system, n_mode))
    system = make_unsupported_system(mesh, mass, stiffness)
    return make_shapes(mesh, material, system, compute_free_modes(system, mesh, material, n_mode))


def make_shapes(mesh: Mesh, material: Material, system: LinearSystem, result: ModeSet) -> Shapes:
    """Expand the modes of a system to its mesh, with their stress."""
    return add_stress(mesh, material, system.n_dof, result.frequency, system.on_mesh(result.mode_shapes))


def add_stress(
    mesh: Mesh,
    material: Material,
    n_dof: int,
    frequency: Float[NDArray[np.float64], " m"],
    displacement: Float[NDArray[np.float64], "node 3 m"],
) -> Shapes:
    """Compute the stress of mode shapes on a mesh."""
    shapes = np.moveaxis(displacement, 2, 0)
    stress = [compute_von_mises(compute_nodal_stress(mesh, material, shape)) for shape in shapes]
    return Shapes(mesh=mesh, n_dof=n_dof, frequency=frequency, displacement=shapes, von_mises=np.stack(stress))
