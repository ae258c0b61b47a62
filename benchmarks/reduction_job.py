"""One measurement of `benchmarks/reduction_race.py`, in a separate process, so that its peak memory is its own.

    python -m benchmarks.reduction_job KIND SHAPE SIZE

prints one line of JSON. KIND: stickslip, unchecked (the same without the check of its modes), arpack (on the same
factor), pardiso (ARPACK on the factor of PARDISO), scipy or ccx. SHAPE and SIZE: see SHAPES.
"""

import json
import mmap
import resource
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg.blas import dgemm
from scipy.sparse.linalg import LinearOperator, eigsh

import fe.sparse.krylov_basis
import reduction.craig_bampton
from fe.allocator import return_freed_memory
from fe.assembly import assemble_compact
from fe.boundary import make_unsupported_system
from fe.calculix_run import run_frequency
from fe.element import HEX20
from fe.material import STEEL
from fe.mesh import Mesh
from fe.mesher.blade import PadMesh, mesh_blade
from fe.mesher.block import Block, mesh_blocks
from fe.mesher.mesh_rule import MeshRule
from fe.sparse.block_lanczos import COLUMNS_PER_MODE
from fe.sparse.compile_ahead import compile_kernels
from fe.sparse.solver import Backend, Factor, factorise
from fe.sparse.symmetric_part import part
from fe.system import LinearSystem
from geometry.blade import Blade
from reduction.rom_error import check_fixed_interface_modes

#: Number of boundary nodes (102 degrees of freedom) and of fixed-interface modes.
N_BOUNDARY, N_MODE = 34, 150
clock = time.process_time


def twisted(size: str) -> Mesh:
    """Tapered plate of 300 x 60 x 8 mm, twisted by half a radian; size: cells along, across and through, as 96x20x4."""

    def shape(u: NDArray, v: NDArray, w: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        across, through, turn = (1 - 0.3 * u) * 0.06 * (v - 0.5), (1 - 0.3 * u) * 0.008 * (w - 0.5), 0.5 * u
        return (
            0.3 * u,
            across * np.cos(turn) - through * np.sin(turn),
            across * np.sin(turn) + through * np.cos(turn),
        )

    nx, ny, nz = (int(count) for count in size.split("x"))
    return mesh_blocks([Block(shape=shape, counts=(nx, ny, nz), faces={"u0": "root"})], HEX20)


def rig_blade(size: str) -> Mesh:
    """Blade of the rig; size: number of cells through the thickness."""
    rule = MeshRule(element=HEX20, through_thickness=int(size), length_ratio=2.3, length_cap=0.0038)
    return mesh_blade(Blade(), rule, PadMesh(band_height=0.009))


def cube(size: str) -> Mesh:
    """Cube; size: number of cells along each edge. Its frequencies come in pairs and triples."""
    n = int(size)
    box = Block(shape=lambda u, v, w: (0.1 * u, 0.1 * v, 0.1 * w), counts=(n, n, n), faces={"u0": "root"})
    return mesh_blocks([box], HEX20)


SHAPES: dict[str, Callable[[str], Mesh]] = {"twisted": twisted, "rig": rig_blade, "cube": cube}


def boundary_nodes(mesh: Mesh, shape: str) -> NDArray[np.int64]:
    """Nodes spread over the root (the clamp of the rig's blade); for the cube all corner nodes, for symmetry."""
    root = np.intersect1d(mesh.nodes("clamp" if shape == "rig" else "root"), mesh.corner_nodes())
    return root if shape == "cube" else root[np.unique(np.linspace(0, len(root) - 1, N_BOUNDARY).round().astype(int))]


class Stopwatch:
    """Processor time of functions that are replaced by timed ones, and number of right-hand sides."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.columns: dict[str, int] = {}
        self.calls: dict[str, int] = {}
        self.work: tuple[float, float] | None = None
        self.stage = ""

    def watch(self, owner: Any, name: str, stage: str) -> None:
        function = getattr(owner, name)

        def timed(*arguments: Any, **options: Any) -> Any:
            outer, self.stage = self.stage, stage
            start = clock()
            result = function(*arguments, **options)
            self.seconds[stage] = self.seconds.get(stage, 0.0) + clock() - start
            self.stage = outer
            return result

        setattr(owner, name, timed)


class TimedFactor:
    """Factor with timed solutions. The stopwatch has no reference to it, so the reduction can free it."""

    def __init__(self, factor: Factor, watch: Stopwatch) -> None:
        self.factor, self.watch = factor, watch
        watch.work = getattr(factor, "work", None)

    def solve(
        self, right_hand_side: NDArray[np.float64], out: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        watch = self.watch
        start = clock()
        solution = self.factor.solve(right_hand_side, out)
        width = 1 if right_hand_side.ndim == 1 else right_hand_side.shape[1]
        key = f"{watch.stage or 'constraint modes'}: solves"
        watch.seconds[key] = watch.seconds.get(key, 0.0) + clock() - start
        watch.columns[key] = watch.columns.get(key, 0) + width
        watch.calls[key] = watch.calls.get(key, 0) + 1
        return solution


def machine() -> dict[str, float]:
    """Speed of dgemm [1e9 operations/s] and of reading from memory [1e9 byte/s], each the best of three."""
    square = np.asfortranarray(np.random.default_rng(0).standard_normal((2000, 2000)))
    long = np.ones(50_000_000)
    flops, read = [], []
    for _ in range(3):
        start = clock()
        dgemm(1.0, square, square)
        flops.append(2 * 2000**3 / (clock() - start) / 1e9)
        start = clock()
        long.sum()
        read.append(long.nbytes / (clock() - start) / 1e9)
    del square, long
    return_freed_memory()  # otherwise it would count for the job
    return {"dgemm": max(flops), "read": max(read)}


def first_touch() -> float:
    """Time in which the operating system provides a GiB of memory [s]."""
    n = 1 << 29
    with mmap.mmap(-1, n, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS) as memory:
        start = clock()
        for page in range(0, n, mmap.PAGESIZE):
            memory[page] = 1
        return (clock() - start) * 2**30 / n


def system_time() -> float:
    """Processor time of the operating system for this process [s]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_stime


def peak(who: int = resource.RUSAGE_SELF) -> float:
    """Peak memory of this process or of its children [GB]."""
    return resource.getrusage(who).ru_maxrss * 1024 / 1e9


def with_stickslip(shape: str, mesh: Mesh, is_checked: bool) -> dict[str, Any]:
    watch = Stopwatch()
    start, system_before = clock(), system_time()
    system = unsupported(mesh)
    watch.seconds["assembly"] = clock() - start
    boundary = {"root": system.rows(boundary_nodes(mesh, shape))}
    module = reduction.craig_bampton
    plain = module.factorise
    module.factorise = lambda matrix, **options: TimedFactor(plain(matrix, **options), watch)
    watch.watch(module, "factorise", "factor")
    watch.watch(module, "fixed_interface_modes", "modes")
    basis = fe.sparse.krylov_basis.KrylovBasis
    for name, stage in (("_without", "orthogonality"), ("_orthonormalise", "block of orthonormal columns")):
        watch.watch(basis, name, stage)
    start = clock()
    rom = module.craig_bampton(system, boundary, N_MODE)
    total, memory = clock() - start, peak()
    result = {
        "n_dof": system.n_dof,
        "n_boundary": rom.n_boundary,
        "seconds": total + watch.seconds["assembly"],
        "system": system_time() - system_before,
        "peak": memory,
        "stages": watch.seconds,
        "columns": watch.columns,
        "calls": watch.calls,
        "work": watch.work,
        "frequency": list(rom.fixed_interface_frequency),
    }
    if is_checked:
        start = clock()
        check = check_fixed_interface_modes(system, rom)
        result |= {"residual": float(check.residual.max()), "missed": check.n_missed, "counted": check.n_below}
        result["check"] = clock() - start
    return result


def unsupported(mesh: Mesh) -> LinearSystem:
    return make_unsupported_system(mesh, *assemble_compact(mesh, STEEL))


def with_eigsh(shape: str, mesh: Mesh, backend: Backend | None) -> dict[str, Any]:
    """ARPACK on a factor, by default that of stickslip; the times of factor and modes are separate."""
    system = unsupported(mesh)
    interior = np.setdiff1d(np.arange(system.n_dof), system.rows(boundary_nodes(mesh, shape)))
    mass, stiffness = (part(item, interior).tocsr() for item in (system.mass, system.stiffness))
    del system
    start = clock()
    factor = factorise(stiffness, backend=backend, n_column=COLUMNS_PER_MODE * N_MODE)
    factored = clock() - start
    n = len(interior)
    inverse = LinearOperator((n, n), matvec=factor.solve, dtype=np.float64)
    begin = np.random.default_rng(0).standard_normal(n)
    start = clock()
    # Settings of benchmarks/eigensolver.py: the fastest with residuals as small as those of stickslip.
    lambda_, _ = eigsh(stiffness, k=N_MODE, M=mass, sigma=0.0, OPinv=inverse, tol=1e-9, v0=begin, ncv=2 * N_MODE + 1)
    modes = clock() - start
    return {
        "n_dof": n,
        "factor": factored,
        "modes": modes,
        "peak": peak(),
        "frequency": list(np.sqrt(np.sort(lambda_)) / 2 / np.pi),
    }


def with_calculix(shape: str, mesh: Mesh) -> dict[str, Any]:
    nodes = boundary_nodes(mesh, shape)
    fixed = np.stack([np.repeat(nodes, 3), np.tile(np.arange(3), len(nodes))], axis=1)
    frequency = run_frequency(mesh, STEEL, fixed, N_MODE)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return {
        "n_dof": 3 * mesh.n_node,
        "modes": used.ru_utime + used.ru_stime,
        "peak": peak(resource.RUSAGE_CHILDREN),
        "frequency": list(frequency),
    }


def main() -> None:
    kind, shape, size = sys.argv[1:]
    mesh = SHAPES[shape](size)
    measured = machine()
    # MKL and the kernels of stickslip are loaded before the timing, as those of scipy are.
    factorise(sp.eye_array(10, format="csr"))
    compile_kernels()
    jobs: dict[str, Callable[[], dict[str, Any]]] = {
        "stickslip": lambda: with_stickslip(shape, mesh, True),
        "unchecked": lambda: with_stickslip(shape, mesh, False),
        "arpack": lambda: with_eigsh(shape, mesh, None),
        "pardiso": lambda: with_eigsh(shape, mesh, Backend.PARDISO),
        "scipy": lambda: with_eigsh(shape, mesh, Backend.SUPERLU),
        "ccx": lambda: with_calculix(shape, mesh),
    }
    result = jobs[kind]()
    measured["touch"] = first_touch()  # last, because memory that was used before is provided faster
    print(json.dumps({"kind": kind, "shape": shape, "size": size, **measured, **result}))


if __name__ == "__main__":
    main()
