"""Compare the assembly of mass and stiffness with scikit-fem, on the same mesh of 20-node hexahedra.

Each package assembles in a separate process with one thread, one after the other; the two pairs of matrices are then
compared entry by entry. Run it with

    python benchmarks/assembly.py [cells along each side]
"""

import multiprocessing
import os
import resource
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fe.assembly import assemble
from fe.element import HEX8, HEX20
from fe.material import STEEL
from fe.mesh import Mesh
from fe.mesher.block import Block, mesh_blocks

#: Corner k of a scikit-fem hexahedron is corner VTK_CORNER[k] of this package.
VTK_CORNER = [0, 4, 3, 1, 7, 5, 2, 6]
REPEATS = {"stickslip": 5, "scikit-fem": 2}


@dataclass(frozen=True, kw_only=True)
class Run:
    """Shortest processor time [s], memory added to the process [MB], and matrices in the order of this package."""

    seconds: float
    megabytes: float
    mass: sp.csr_array
    stiffness: sp.csr_array


def distorted_box(n: int) -> Mesh:
    """Mesh a box of n^3 cells with displaced inner corners; edges are straight, as the geometry of scikit-fem needs."""
    size = np.array([0.1, 0.08, 0.06])
    block = Block(shape=lambda u, v, w: (size[0] * u, size[1] * v, size[2] * w), counts=(n, n, n))
    mesh = mesh_blocks([block], HEX20)
    cells = mesh.cells["hexahedron20"]
    inside = (mesh.points > 1e-9) & (mesh.points < size - 1e-9)
    points = mesh.points + 0.2 * size / n * inside * np.random.default_rng(0).uniform(-1, 1, mesh.points.shape)
    points[cells] = np.einsum("ac,eci->eai", HEX8.shape(HEX20.nodes), points[cells[:, :8]])
    return Mesh(points=points, cells=mesh.cells)


def with_stickslip(mesh: Mesh) -> Callable[[], tuple[sp.csr_array, sp.csr_array]]:
    return lambda: assemble(mesh, STEEL)


def with_scikit_fem(mesh: Mesh) -> Callable[[], tuple[sp.csr_array, sp.csr_array]]:
    from skfem import Basis, BilinearForm, ElementHexS2, ElementVector, MeshHex
    from skfem.helpers import dot
    from skfem.models.elasticity import linear_elasticity

    corners = mesh.corner_nodes()
    number = np.full(mesh.n_node, -1)
    number[corners] = np.arange(len(corners))
    theirs = MeshHex(mesh.points[corners].T.copy(), number[mesh.cells["hexahedron20"][:, VTK_CORNER]].T.copy())
    density = STEEL.density

    @BilinearForm
    def mass(u, v, _):  # type: ignore[no-untyped-def]
        return density * dot(u, v)

    def both() -> tuple[sp.csr_array, sp.csr_array]:
        # Degree 5 is the 3 x 3 x 3 Gauss rule of this package. The basis is timed, as this package times its own.
        basis = Basis(theirs, ElementVector(ElementHexS2()), intorder=5)
        both.places = basis.doflocs.T  # type: ignore[attr-defined]
        return mass.assemble(basis), linear_elasticity(STEEL.lame, STEEL.shear).assemble(basis)

    return both


def measure(name: str, n: int, answer: "multiprocessing.Queue[Run]") -> None:
    """Measure one package; run in a separate process."""
    mesh = distorted_box(n)
    job = {"stickslip": with_stickslip, "scikit-fem": with_scikit_fem}[name](mesh)
    # First on one cell, so that imports and caches are not timed.
    {"stickslip": with_stickslip, "scikit-fem": with_scikit_fem}[name](distorted_box(1))()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    seconds = []
    for _ in range(REPEATS[name]):
        start = time.process_time()  # independent of other jobs on the machine, unlike elapsed time
        mass, stiffness = job()
        seconds.append(time.process_time() - start)
    megabytes = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    order = dof_order(mesh, getattr(job, "places", None))
    in_order = (sp.csr_array(sp.csr_array(matrix)[order][:, order]) for matrix in (mass, stiffness))
    mass, stiffness = in_order
    answer.put(Run(seconds=min(seconds), megabytes=megabytes, mass=mass, stiffness=stiffness))


def dof_order(mesh: Mesh, places: NDArray[np.float64] | None) -> NDArray[np.int64]:
    """Index of each degree of freedom of this package in the matrices of the other package."""
    if places is None:
        return np.arange(3 * mesh.n_node)
    distance, node = cKDTree(mesh.points).query(places)
    assert distance.max() < 1e-12, "the two packages do not have the same nodes"
    # Each node has three degrees of freedom in the order x, y, z.
    order = np.empty(len(places), dtype=np.int64)
    order[3 * node + np.arange(len(places)) % 3] = np.arange(len(places))
    return order


def main() -> None:
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[threads] = "1"  # the processes below read them when they import numpy
    context = multiprocessing.get_context("spawn")
    runs: dict[str, Run] = {}
    for name in REPEATS:
        answer = context.Queue()
        process = context.Process(target=measure, args=(name, n, answer))
        process.start()
        runs[name] = answer.get()
        process.join()
    mesh = distorted_box(n)
    ours, theirs = runs["stickslip"], runs["scikit-fem"]
    print(
        f"{mesh.n_cell} distorted hex20 cells, {3 * mesh.n_node} degrees of freedom, mass and stiffness, one thread\n"
    )
    print("| package | processor time | a cell | memory added |\n|---|---|---|---|")
    for name, run in runs.items():
        microseconds = 1e6 * run.seconds / mesh.n_cell
        print(f"| {name} | {run.seconds:.3f} s | {microseconds:.0f} us | {run.megabytes:.0f} MB |")
    print(f"\nratio: {theirs.seconds / ours.seconds:.0f}")
    for name in ("mass", "stiffness"):
        a, b = getattr(ours, name), getattr(theirs, name)
        difference = abs(a - b).max() / abs(b).max()
        print(f"{name}: largest difference {difference:.1e} of the largest entry")
        assert difference < 1e-12, f"the two packages disagree about the {name}"


if __name__ == "__main__":
    main()
