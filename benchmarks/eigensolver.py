"""Compare block Lanczos of this package with ARPACK: lowest modes of the clamped blade, from the same factor.

Each solver runs in a process forked after the factorisation, with one thread, one after the other. Run it with

    python benchmarks/eigensolver.py [elements through the thickness ...] [--modes N ...]
"""

import argparse
import multiprocessing
import os
import resource
import sys
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, eigsh

from fe.assembly import assemble
from fe.boundary import Support, supported_system
from fe.element import HEX20
from fe.material import STEEL
from fe.mesher.blade import PadMesh, mesh_blade
from fe.mesher.mesh_rule import MeshRule
from fe.sparse.block_lanczos import block_lanczos
from fe.sparse.solver import Factor, factorise
from fe.system import LinearSystem
from geometry.blade import Blade

REPEATS = 2
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


class CountedFactor:
    """Factor that counts the right-hand sides that it solves."""

    def __init__(self, factor: Factor) -> None:
        self.factor, self.columns = factor, 0

    def solve(
        self, right_hand_side: NDArray[np.float64], out: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        self.columns += 1 if right_hand_side.ndim == 1 else right_hand_side.shape[1]
        return self.factor.solve(right_hand_side, out)


@dataclass(frozen=True, kw_only=True)
class Run:
    """Shortest processor time [s], right-hand sides, memory added [MB], eigenvalues, largest energy-norm residual."""

    seconds: float
    columns: int
    megabytes: float
    lambda_: NDArray[np.float64]
    residual: float


def clamped_blade(through_thickness: int) -> LinearSystem:
    rule = MeshRule(element=HEX20, through_thickness=through_thickness, length_ratio=2.3, length_cap=0.008)
    mesh = mesh_blade(Blade(), rule, PadMesh(band_height=0.009))
    return supported_system(mesh, *assemble(mesh, STEEL), [Support(nodes=mesh.nodes("clamp"))])


def with_stickslip(system: LinearSystem, factor: Factor, n_mode: int) -> tuple[NDArray, NDArray]:
    return block_lanczos(factor, system.mass, n_mode)


def with_arpack(system: LinearSystem, factor: Factor, n_mode: int) -> tuple[NDArray, NDArray]:
    n = system.n_dof
    inverse = LinearOperator((n, n), matvec=factor.solve, dtype=np.float64)
    start = np.random.default_rng(0).standard_normal(n)
    # Fastest of the tolerances 1e-9 and 1e-13 and bases of 2 to 3 times the modes, with residuals as small as those of
    # block Lanczos.
    lambda_, shapes = eigsh(
        system.stiffness, k=n_mode, M=system.mass, sigma=0.0, OPinv=inverse, tol=1e-9, v0=start, ncv=2 * n_mode + 1
    )
    order = np.argsort(lambda_)
    return lambda_[order], shapes[:, order]


SOLVERS = {"stickslip": with_stickslip, "ARPACK": with_arpack}


def measure(name: str, system: LinearSystem, factor: Factor, n_mode: int, answer: "multiprocessing.Queue[Run]") -> None:
    """Measure one solver; run in a separate process."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    seconds = []
    for _ in range(REPEATS):
        counted = CountedFactor(factor)
        start = time.process_time()  # independent of other jobs on the machine, unlike elapsed time
        lambda_, shapes = SOLVERS[name](system, counted, n_mode)
        seconds.append(time.process_time() - start)
    megabytes = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    # ||K x - lambda M x|| in the norm of the inverse stiffness, over ||x|| in the norm of the stiffness.
    rest = factor.solve(system.mass @ shapes) - shapes / lambda_
    residual = np.sqrt(lambda_ * np.einsum("nm,nm->m", rest, system.stiffness @ rest)).max()
    answer.put(
        Run(
            seconds=min(seconds),
            columns=counted.columns,
            megabytes=megabytes,
            lambda_=lambda_,
            residual=float(residual),
        )
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("through_thickness", nargs="*", type=int, default=[2, 5])
    parser.add_argument("--modes", nargs="*", type=int, default=[10, 50, 150])
    arguments = parser.parse_args()
    if any(os.environ.get(name) != "1" for name in ONE_THREAD):
        # Libraries read the variables when they are loaded, so the process is replaced.
        os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, **ONE_THREAD})
    context = multiprocessing.get_context("fork")  # so that both solvers share the factor
    print("| degrees of freedom | modes | solver | processor time | right-hand sides | memory added | residual |")
    print("|---|---|---|---|---|---|---|")
    notes = []
    for through_thickness in arguments.through_thickness:
        system = clamped_blade(through_thickness)
        factor = factorise(system.stiffness)
        for n_mode in arguments.modes:
            runs: dict[str, Run] = {}
            for name in SOLVERS:
                answer = context.Queue()
                process = context.Process(target=measure, args=(name, system, factor, n_mode, answer))
                process.start()
                run = runs[name] = answer.get()
                process.join()
                print(
                    f"| {system.n_dof} | {n_mode} | {name} | {run.seconds:.2f} s | {run.columns} "
                    f"| {run.megabytes:.0f} MB | {run.residual:.0e} |",
                    flush=True,
                )
            ours, theirs = runs["stickslip"], runs["ARPACK"]
            difference = np.abs(ours.lambda_ / theirs.lambda_ - 1).max()
            assert difference < 1e-10, f"the two solvers disagree by {difference:.1e}"
            ratio = theirs.seconds / ours.seconds
            notes.append(f"{system.n_dof}, {n_mode} modes: ratio {ratio:.2f}, eigenvalues within {difference:.0e}")
    print("\n" + "\n".join(notes))


if __name__ == "__main__":
    main()
