"""Compare the memory estimate of a reduction (`reduction.memory_estimate`) with the peak memory of a process.

    OMP_NUM_THREADS=1 python -m benchmarks.memory_estimate [BODY ...]

Bodies are those of `BODIES`; each is reduced in a separate process to 102 boundary degrees of freedom and 150 modes.
The peak is counted from the memory with the matrices. Linux only.
"""

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from fe.allocator import return_freed_memory
from fe.assembly import assemble_compact
from fe.boundary import Support, supported_system
from fe.element import HEX20
from fe.material import STEEL
from fe.mesh import Mesh
from fe.mesher.blade import mesh_blade
from fe.mesher.block import Block, mesh_blocks
from fe.mesher.mesh_rule import MeshRule
from fe.mesher.tetrahedra import TetRule, mesh_solid
from geometry.blade import Blade
from geometry.face_selector import FaceSelector
from geometry.step_part import step_part
from reduction.craig_bampton import craig_bampton
from reduction.memory_estimate import FACTOR, estimate_mesh_memory, estimate_reduction_memory

SCREW = Path(__file__).parents[1] / "examples" / "parts" / "screw.step"
N_NODE, N_MODE = 34, 150


def blade(through_thickness: int, length_ratio: float) -> Mesh:
    rule = MeshRule(element=HEX20, through_thickness=through_thickness, length_ratio=length_ratio, length_cap=0.008)
    return mesh_blade(Blade(), rule)


def cube(n: int) -> Mesh:
    block = Block(shape=lambda u, v, w: (0.02 * u, 0.02 * v, 0.02 * w), counts=(n, n, n), faces={"w0": "clamp"})
    return mesh_blocks([block], HEX20)


def screw(size: float) -> Mesh:
    return mesh_solid(step_part(SCREW, {"clamp": [FaceSelector(normal=(0, 0, -1))]}), TetRule(size=size))


BODIES: dict[str, Callable[[], Mesh]] = {
    "blade-1": lambda: blade(1, 1.6),
    "blade-2": lambda: blade(2, 1.6),
    "blade-3": lambda: blade(3, 1.2),
    "blade-4": lambda: blade(4, 1.2),
    "cube": lambda: cube(16),
    "screw": lambda: screw(2e-3),
}


def held(what: str) -> int:
    result = re.search(rf"{what}:\s+(\d+)", Path("/proc/self/status").read_text())
    assert result is not None
    return 1024 * int(result[1])


def measure(body: str) -> None:
    """Print one row."""
    mesh = BODIES[body]()
    return_freed_memory()  # memory that the mesher freed would otherwise be reused
    before_matrices = held("VmRSS")
    early = estimate_mesh_memory(mesh, 3 * N_NODE, N_MODE)
    clamp = mesh.nodes("clamp")
    system = supported_system(mesh, *assemble_compact(mesh, STEEL), [Support(nodes=clamp)])
    free = np.setdiff1d(mesh.corner_nodes(), clamp)
    kept = np.random.default_rng(0).permutation(free)[:N_NODE]
    estimate = estimate_reduction_memory(system.stiffness, 3 * N_NODE, N_MODE)
    return_freed_memory()
    before = held("VmRSS")
    Path("/proc/self/clear_refs").write_text("5")  # resets the peak
    craig_bampton(system, {"kept": system.rows(kept)}, N_MODE)
    peak = held("VmHWM")
    print(
        f"| {body} | {system.n_dof} | {estimate / 1e9:.2f} | {(peak - before) / 1e9:.2f} | "
        f"{estimate / (peak - before):.2f} | {early / 1e9:.2f} | {(peak - before_matrices) / 1e9:.2f} |",
        flush=True,
    )


def main(bodies: list[str]) -> None:
    print("| body | degrees of freedom | estimate [GB] | peak [GB] | ratio | from the mesh [GB] | with matrices [GB] |")
    print("|---|---|---|---|---|---|---|", flush=True)
    ratios = []
    for body in bodies or BODIES:
        row = subprocess.run(
            [sys.executable, "-m", "benchmarks.memory_estimate", "--one", body],
            capture_output=True,
            text=True,
            check=True,
        ).stdout.strip()
        print(row, flush=True)
        ratios.append(float(row.split("|")[5]))
    if not all(1 / FACTOR < ratio < FACTOR for ratio in ratios):
        sys.exit(f"an estimate is off by more than the factor {FACTOR}")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        measure(sys.argv[2])
    else:
        main(sys.argv[1:])
