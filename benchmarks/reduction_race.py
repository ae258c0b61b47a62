"""Compare the Craig-Bampton reduction of blades with ARPACK, scipy and CalculiX, and each stage with its lower bound.

    python -m benchmarks.reduction_race [--only JOB ...] [--avx2] [--keep FILE]

Each job runs in a separate process with one thread, one after the other. Measured are processor time, peak memory of
the process, and in the same process the speed of the machine (dgemm, reading memory). `--keep` appends each job's line
of JSON to a file and reuses the lines that the file already has. `--avx2` disables AVX-512 in all libraries, for a
speed like that of the machine for which the targets were set.
Needs the program ccx (Debian package calculix-ccx) for the jobs of that name.
"""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

Run = dict[str, Any]
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
AVX2 = {
    "OPENBLAS_CORETYPE": "Haswell",
    "MKL_ENABLE_INSTRUCTIONS": "AVX2",
    "NUMBA_CPU_NAME": "haswell",
    "NUMBA_CPU_FEATURES": "+avx,+avx2,+bmi,+bmi2,+fma,+popcnt,+sse4.2",
}
#: Targets of processor time [s] and memory [GiB], for a core with this speed of dgemm [1e9 operations/s].
TARGET = {("twisted", "96x20x4"): (20.0, 1.8), ("twisted", "140x30x6"): (90.0, 4.8)}
TARGET_DGEMM = 53.0
JOBS = [
    ("stickslip", "twisted", "40x8x2"),
    ("ccx", "twisted", "40x8x2"),
    ("stickslip", "twisted", "60x12x3"),
    ("arpack", "twisted", "60x12x3"),
    ("scipy", "twisted", "60x12x3"),
    ("ccx", "twisted", "60x12x3"),
    ("stickslip", "twisted", "96x20x4"),
    ("arpack", "twisted", "96x20x4"),
    ("pardiso", "twisted", "96x20x4"),
    ("scipy", "twisted", "96x20x4"),
    ("ccx", "twisted", "96x20x4"),
    ("stickslip", "twisted", "140x30x6"),
    ("arpack", "twisted", "140x30x6"),
    ("stickslip", "rig", "5"),
    ("stickslip", "cube", "14"),
]
NAMES = {
    "stickslip": "stickslip",
    "arpack": "ARPACK, same factor",
    "pardiso": "ARPACK, factor of PARDISO",
    "scipy": "scipy alone",
    "ccx": "CalculiX",
}


def kept(file: Path | None) -> list[Run]:
    """Results in a file of earlier runs."""
    return [json.loads(line) for line in file.read_text().splitlines()] if file and file.exists() else []


def measured(job: tuple[str, str, str], keep: Path | None = None, *, avx2: bool = False) -> Run:
    """Results of a job, from the file if it has them."""
    for result in kept(keep):
        if (result["kind"], result["shape"], result["size"]) == job:
            return result
    command = [sys.executable, "-m", "benchmarks.reduction_job", *job]
    environment = {**os.environ, **ONE_THREAD, **(AVX2 if avx2 else {})}
    line = subprocess.run(command, env=environment, stdout=subprocess.PIPE, check=True, text=True).stdout
    if keep:
        with keep.open("a") as file:
            file.write(line)
    return json.loads(line)


def seconds(result: Run) -> float:
    """Processor time of the modes with the factorisation [s]; CalculiX does nothing else."""
    if result["kind"] == "stickslip":
        return result["stages"]["modes"] + result["stages"]["factor"]
    return result["modes"] + result.get("factor", 0.0)


def comparison(results: list[Run]) -> None:
    print(
        "\n| body, degrees of freedom | solver | modes | with the factor | ours is faster | peak | residual | missed |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for result in results:
        own = [r for r in results if r["kind"] == "stickslip" and r["shape"] == result["shape"]]
        ours = next((r for r in own if r["size"] == result["size"]), None)
        modes = result["stages"]["modes"] if result["kind"] == "stickslip" else result["modes"]
        faster = told = ""
        if result is ours:
            told = f"{result['residual']:.0e} | {result['missed']} of {result['counted']}"
        elif ours:
            # With a factor of this package or of PARDISO only the modes are compared, otherwise also the factorisation.
            alone = result["kind"] in {"arpack", "pardiso"}
            ratio = modes / ours["stages"]["modes"] if alone else seconds(result) / seconds(ours)
            difference = np.abs(np.array(result["frequency"]) / np.array(ours["frequency"]) - 1).max()
            faster, told = f"{ratio:.1f}x", f"frequencies within {difference:.0e} | "
        with_factor = "" if result["kind"] == "ccx" else f"{seconds(result):.1f} s"
        name = NAMES[result["kind"]]
        print(
            f"| {result['shape']}, {result['n_dof']:,} | {name} | {modes:.1f} s | {with_factor} | {faster} "
            f"| {result['peak']:.2f} GB | {told} |"
        )


def stages(result: Run) -> None:
    """Print the time of each stage and its lower bound on this machine."""
    own, dgemm, read = result["stages"], 1e9 * result["dgemm"], 1e9 * result["read"]
    print(
        f"\n{result['shape']} {result['size']}: {result['n_dof']:,} degrees of freedom, {result['n_boundary']} on the "
        f"boundary, {len(result['frequency'])} modes: {result['seconds']:.1f} s, {result['peak']:.2f} GB "
        f"({1e9 * result['peak'] / 2**30:.2f} GiB); dgemm "
        f"{result['dgemm']:.0f} GF/s, memory read at {result['read']:.0f} GB/s; {result['system']:.1f} s of the time "
        f"are the system's, which hands out memory at {result['touch']:.2f} s/GiB; the check of the modes "
        f"{result['check']:.1f} s more"
    )
    if target := TARGET.get((result["shape"], result["size"])):
        scaled = target[0] * TARGET_DGEMM / result["dgemm"]
        print(
            f"target {target[0]:.0f} s at {TARGET_DGEMM:.0f} GF/s, {scaled:.1f} s scaled to this dgemm, {target[1]} GiB"
        )
    if result["work"] is None:
        return
    entries, operations = result["work"]
    columns, calls = result["columns"], result["calls"]
    n, m = result["n_dof"] - result["n_boundary"], columns["modes: solves"]

    def solves(stage: str, passes: int) -> float:
        key = f"{stage}: solves"
        # Each pass reads the factor once per block, with two operations per entry and column.
        return passes * max(2 * entries * columns[key] / dgemm, 8 * entries * calls[key] / read)

    bound = {
        "assembly": None,
        "factor": operations / dgemm,
        # The forward pass uses little of the factor, because the forces are near the boundary.
        "constraint modes: solves": solves("constraint modes", 1),
        "modes: solves": solves("modes", 2),
        # Against all previous columns, twice per block: 2 n m^2 operations, the basis is read twice.
        "orthogonality": max(2 * n * m**2 / dgemm, 8 * n * m**2 / (m / calls["modes: solves"]) / read),
    }
    told = sum(own[name] for name in bound)
    print("\n| stage | processor time | share | bound | of the bound |\n|---|---|---|---|---|")
    for name, least in bound.items():
        limit = "" if least is None else f"{least:.2f} s"
        reached = "" if least is None else f"{least / own[name]:.0%}"
        print(f"| {name} | {own[name]:.2f} s | {own[name] / result['seconds']:.0%} | {limit} | {reached} |")
    rest = result["seconds"] - told
    print(f"| blocks made orthonormal, Ritz vectors, projection | {rest:.2f} s | {rest / result['seconds']:.0%} | | |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="*", default=[], help="stickslip, arpack, scipy, ccx, or a size")
    parser.add_argument(
        "--avx2", action="store_true", help="do without AVX-512; keep these runs in a file of their own"
    )
    parser.add_argument("--keep", type=Path)
    arguments = parser.parse_args()
    results = []
    for job in JOBS:
        if arguments.only and not set(job) & set(arguments.only):
            continue
        results.append(measured(job, arguments.keep, avx2=arguments.avx2))
        print(*job, f"{results[-1].get('seconds', seconds(results[-1])):.1f} s", file=sys.stderr, flush=True)
    comparison(results)
    for result in results:
        if result["kind"] == "stickslip":
            stages(result)


if __name__ == "__main__":
    main()
