"""Convergence of the rig with its mesh, and error of its reduction: blade, stuck rig and reduced assembly.

    python -m benchmarks.rig_convergence

1. First frequency of the blade without contacts on nested meshes, each cell cut into 2 and 4 along each edge: limit and
   observed order by Richardson's extrapolation.
2. First bending frequency of the rig with all contacts stuck and unreduced bodies, on meshes of several sizes and on a
   nested pair. Stations are nodes, so contact forces act at points, where the local compliance grows without limit as
   the mesh is refined. The frequency therefore does not converge; it keeps decreasing slowly.
3. Reduced assembly of the case at 5 mm against its unreduced bodies.

Takes some minutes and 3 GB.
"""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from benchmarks.rig_calculix import contact_springs, held
from fe.assembly import assemble
from fe.boundary import Support, supported_system
from fe.element import HEX20
from fe.mesh import Mesh
from fe.mesher.blade import mesh_blade
from fe.mesher.body import join_meshes
from fe.mesher.rig import choose_rig_mesh, mesh_rig
from fe.modal import modes
from pipeline.cache_folder import default_folder
from pipeline.progress import SilentProgress
from pipeline.store import Store
from reduction.assembly_error import assembly_error
from reduction.joined_bodies import join_bodies
from study.case.tables import Case
from study.kind.registry import open_case
from study.kind.rig.contact import make_line_pairs
from study.kind.rig.model import BODIES, RigModel
from study.kind.rig.reduction import make_supported_body, reduce_rig
from study.kind.rig.table import RigTable, make_rig_model
from study.shipped_cases import RIG
from study.table1.stages import richardson

#: Element size of the coarsest nested mesh [m], and number of parts of its cells along each edge [-].
COARSE, CUTS = 10e-3, (1, 2, 4)
#: Element sizes of the rig, and element size of the coarser mesh of its nested pair [m].
SIZES, NESTED = (5e-3, 3e-3, 2.5e-3), 8e-3
#: Element size of the reduced assembly [m], number of modes, and frequencies between its resonances [Hz].
REDUCED, N_MODE, BAND = 5e-3, 8, (50.0, 150.0, 200.0, 260.0, 350.0, 450.0, 600.0, 800.0, 1000.0, 1200.0)


def free_blade(model: RigModel) -> None:
    """Print the convergence of the blade on nested meshes."""
    print("\n| cells cut into | degrees of freedom | blade without contacts [Hz] |\n|---|---|---|")
    result = []
    for cut in CUTS:
        cells = choose_rig_mesh(model.rig, HEX20, COARSE, cut)
        mesh = mesh_blade(model.rig.blade, cells.blade, cells.pads)
        system = make_supported_body(mesh, "blade", *assemble(mesh, model.material))
        result.append(float(modes(system, 1).frequency[0]))
        print(f"| {cut} | {system.n_dof} | {result[-1]:.4f} |", flush=True)
    limit = richardson(result, 2.0, 2)
    print(f"\nLimit {limit.frequency:.3f} Hz, observed order {limit.order:.2f}. {limit.warning}")


def first_bending(case: Case[RigTable], model: RigModel, meshes: dict[str, Mesh]) -> tuple[float, int]:
    """Frequency of the first bending mode with all contacts stuck [Hz], and number of degrees of freedom.

    It is the mode of the first four that moves most at the response.
    """
    whole = join_meshes(meshes)
    mass, stiffness = assemble(whole, model.material)
    rows, columns, values = [], [], []
    for spring in contact_springs(case, model.rig, whole):
        dofs = np.concatenate([3 * spring.node + np.arange(3), 3 * spring.other + np.arange(3)])
        along = np.concatenate([spring.direction, -np.asarray(spring.direction)])
        rows.append(np.repeat(dofs, 6))
        columns.append(np.tile(dofs, 6))
        values.append(spring.stiffness * np.outer(along, along).ravel())
    places = np.concatenate(rows), np.concatenate(columns)
    stuck = sp.csr_array(stiffness + sp.coo_array((np.concatenate(values), places), shape=stiffness.shape))
    system = supported_system(whole, mass, stuck, [Support(nodes=np.unique(held(whole)[:, 0]))])
    result = modes(system, 4)
    driven = system.rows(whole.nodes("blade.response"), (1,))
    return float(result.frequency[np.abs(result.mode_shapes[driven]).sum(axis=0).argmax()]), system.n_dof


def stuck_rig(case: Case[RigTable], model: RigModel) -> None:
    """Print the frequency of the stuck rig for all sizes and for a nested pair of meshes."""
    print("\n| mesh | degrees of freedom | first bending, stuck [Hz] | beside the finest size |\n|---|---|---|---|")
    sizes = {f"{1e3 * size:g} mm": mesh_rig(model.rig, choose_rig_mesh(model.rig, HEX20, size)) for size in SIZES}
    pair = {
        f"{1e3 * NESTED:g} mm, cut into {cut}": mesh_rig(model.rig, choose_rig_mesh(model.rig, HEX20, NESTED, cut))
        for cut in CUTS[:2]
    }
    result = {}
    for name, meshes in (sizes | pair).items():
        result[name] = first_bending(case, model, {body: meshes[body] for body in BODIES})
    finest, _ = result[f"{1e3 * SIZES[-1]:g} mm"]
    for name, (frequency, n_dof) in result.items():
        print(f"| {name} | {n_dof} | {frequency:.4f} | {frequency / finest - 1:+.3%} |", flush=True)


def reduced_rig(case: Case[RigTable], model: RigModel) -> None:
    """Print the errors of the reduced assembly against the full one."""
    model = replace(model, size=REDUCED)
    reduction = reduce_rig(model, Store(default_folder()), SilentProgress())
    assembly = reduction.assembly
    systems = {
        body: make_supported_body(mesh, body, *assemble(mesh, model.material))
        for body, mesh in reduction.meshes.items()
    }
    springs = join_bodies(assembly, make_line_pairs(case, model.rig), tangents=case.structure.contact.sliding).springs
    result = assembly_error(systems, assembly, springs, N_MODE, np.array(BAND))
    print(f"\n{reduction.n_dof} degrees of freedom reduced to {assembly.n_dof}, all contacts stuck\n")
    print("| mode | full [Hz] | error of the reduced frequency | 1 - MAC |\n|---|---|---|---|")
    rows = zip(result.frequency, result.frequency_error, result.mac, strict=True)
    for number, (frequency, error, mac) in enumerate(rows, start=1):
        print(f"| {number} | {frequency:.4f} | {error:.1e} | {1 - mac:.1e} |")
    print("\n| frequency [Hz] | " + " | ".join(f"{item:g}" for item in result.receptance_frequency) + " |")
    print("|---" * (len(result.receptance_frequency) + 1) + "|")
    print("| error of the receptance | " + " | ".join(f"{item:.0e}" for item in result.receptance_error) + " |")


def main() -> None:
    case = open_case(RIG).case
    model = make_rig_model(case)
    free_blade(model)
    stuck_rig(case, model)
    reduced_rig(case, model)


if __name__ == "__main__":
    main()
