"""Check that other threads and processors give the same numbers, with `stickslip solve` of a case.

    python -m benchmarks.reproducible [--case FILE] [--machine-code]

The default case is the shipped chain. Runs have no stored results: with 1 and 2 threads, and with the linear algebra of
processors with AVX2 and AVX-512 (`OPENBLAS_CORETYPE`, `MKL_ENABLE_INSTRUCTIONS`). With `--machine-code` the program's
own machine code is compiled for these processors too, one minute each. Files are compared byte by byte, and their
numbers relative to the largest of each column. Threads must not change a byte, processors no number by more than 1e-9.
"""

import argparse
import csv
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
#: Largest difference between processors, relative to the largest number of a column [-].
MOST = 1e-9
#: Column of the residual of Newton's method, relative to the forces [-].
RESIDUAL = "residual norm"
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
AVX2 = {"OPENBLAS_CORETYPE": "Haswell", "MKL_ENABLE_INSTRUCTIONS": "AVX2"}
AVX512 = {"OPENBLAS_CORETYPE": "SkylakeX", "MKL_ENABLE_INSTRUCTIONS": "AVX512"}


@dataclass(frozen=True, kw_only=True)
class Variant:
    """Variant of a run, and whether its bytes must equal those of the first variant."""

    name: str
    environment: Mapping[str, str]
    same_bytes: bool


@dataclass(frozen=True, kw_only=True)
class Compared:
    """Comparison of the files of a variant with those of the first one."""

    variant: Variant
    other_bytes: tuple[str, ...]
    difference: float

    @property
    def is_right(self) -> bool:
        """Whether the difference is permitted."""
        return not self.other_bytes if self.variant.same_bytes else self.difference <= MOST


def list_variants(*, machine_code: bool) -> list[Variant]:
    """List the variants; the first, with one thread, is the reference."""
    two = dict.fromkeys(THREADS, "2")
    processors = {"AVX2": (AVX2, "haswell"), "AVX-512": (AVX512, "skylake-avx512")}
    return [
        Variant(name="1 thread", environment={}, same_bytes=True),
        Variant(name="2 threads", environment=two, same_bytes=True),
        *(
            Variant(name=name, environment={**blas, **({"NUMBA_CPU_NAME": cpu, "NUMBA_CPU_FEATURES": ""}
                                                       if machine_code else {})}, same_bytes=False)
            for name, (blas, cpu) in processors.items()
        ),
    ]  # fmt: skip


def solve(case: Path, folder: Path, environment: Mapping[str, str]) -> dict[str, bytes]:
    """Run the command; returns its files by name."""
    name = str(len([*folder.iterdir()]))
    words = [sys.executable, "-m", "stickslip", "solve", str(case), "--out", name, "--cache", f"cache{name}", "--quiet"]
    given = {**os.environ, **dict.fromkeys(THREADS, "1"), "PYTHONPATH": str(ROOT), **environment}
    subprocess.run(words, cwd=folder, env=given, check=True, stdout=subprocess.DEVNULL)
    return {file.name: file.read_bytes() for file in sorted((folder / name).iterdir())}


def compare(variant: Variant, first: Mapping[str, bytes], files: Mapping[str, bytes]) -> Compared:
    """Compare the files of a variant with those of the first one."""
    other = tuple(name for name in {**first, **files} if first.get(name) != files.get(name))
    tables = [name for name in first if name.endswith(".csv")]
    return Compared(
        variant=variant,
        other_bytes=other,
        difference=max(difference(first[name], files.get(name, b"")) for name in tables),
    )


def difference(first: bytes, second: bytes) -> float:
    """Largest difference of two CSV files, relative to the largest number of a column; infinite if the rows differ."""
    rows = [[*csv.reader(content.decode().splitlines())] for content in (first, second)]
    if [len(row) for row in rows[0]] != [len(row) for row in rows[1]]:
        return float("inf")
    columns = [[*zip(*item, strict=True)] for item in rows]
    return max((_column_difference(*pair) for pair in zip(*columns, strict=True)), default=0.0)


def _column_difference(first: Sequence[str], second: Sequence[str]) -> float:
    """Difference of one column relative to its largest number; of a residual, which is round-off, the difference."""
    try:
        a, b = (np.array([float(cell) if cell else np.nan for cell in column[1:]]) for column in (first, second))
    except ValueError:
        return 0.0 if first == second else float("inf")
    if not np.array_equal(np.isnan(a), np.isnan(b)):
        return float("inf")
    largest = 1.0 if first[0] == second[0] == RESIDUAL else np.nanmax(np.abs(a), initial=0.0)
    return float(np.nanmax(np.abs(a - b), initial=0.0) / largest) if largest else float(np.abs(b).max(initial=0.0) > 0)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; returns 1 if a difference is not permitted."""
    words = argparse.ArgumentParser(prog="python -m benchmarks.reproducible", description=__doc__)
    words.add_argument("--case", type=Path, default=ROOT / "study" / "cases" / "solve_chain.toml")
    words.add_argument("--machine-code", action="store_true", help="also of the program's own kernels")
    given = words.parse_args(arguments)
    variants = list_variants(machine_code=given.machine_code)
    case = given.case.resolve()
    with tempfile.TemporaryDirectory() as name:
        runs = {variant.name: solve(case, Path(name), variant.environment) for variant in variants}
    first = runs[variants[0].name]
    result = [compare(variant, first, runs[variant.name]) for variant in variants[1:]]
    print(f"{case.name} beside {variants[0].name}")
    print("| run | files with other bytes | largest difference of a table |\n|---|---|---|")
    for item in result:
        print(f"| {item.variant.name} | {', '.join(item.other_bytes) or 'none'} | {item.difference:.1e} |")
    return int(not all(item.is_right for item in result))


if __name__ == "__main__":
    sys.exit(main())
