"""Processor time and peak memory of the reduction of a blade against the mesh size: fitted exponents and a figure.

    python -m benchmarks.reduction_growth [PICTURE] [--sizes 60x12x3 ...] [--keep FILE] [--limit GB]

`--keep` is the same as in `benchmarks.reduction_race` and may name the same file. The largest default size needs 7 GB.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from benchmarks.reduction_race import Run, kept, measured

SIZES = ("40x8x2", "60x12x3", "80x16x4", "96x20x4", "120x24x5", "140x30x6")
STAGES = {
    "assembly": "assembly",
    "factor": "factorisation",
    "constraint modes: solves": "constraint modes",
    "modes": "150 fixed-interface modes",
}


def power(n: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[float, float]:
    """Factor and exponent of y = c n^p, by least squares of the logarithms over the upper half of the sizes."""
    upper = slice(len(n) // 2 - 1, None)
    exponent, factor = np.polyfit(np.log(n[upper]), np.log(y[upper]), 1)
    return float(np.exp(factor)), float(exponent)


def draw(results: list[Run], limit: float) -> Figure:
    n = np.array([result["n_dof"] for result in results], dtype=float)
    total = np.array([result["seconds"] for result in results])
    memory = np.array([result["peak"] for result in results])
    factor, exponent = power(n, memory)
    largest = (limit / factor) ** (1 / exponent)
    further = np.geomspace(n[len(n) // 2 - 1], largest, 50)
    figure = Figure(figsize=(9, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    for name, label in STAGES.items():
        y = np.array([result["stages"][name] for result in results])
        left.loglog(n, y, "o-", ms=3, lw=1, label=f"{label}, $n^{{{power(n, y)[1]:.2f}}}$")
    c, p = power(n, total)
    left.loglog(n, total, "ko", ms=5)
    left.loglog(further, c * further**p, "k--", lw=1, label=f"whole reduction, $n^{{{p:.2f}}}$")
    left.set(xlabel="degrees of freedom", ylabel="processor time, one thread [s]")
    right.loglog(n, memory, "ko", ms=5)
    right.loglog(further, factor * further**exponent, "k--", lw=1, label=f"peak memory, $n^{{{exponent:.2f}}}$")
    right.axhline(limit, color="0.6", lw=1)
    right.annotate(
        f"{limit:.0f} GB: {largest / 1e6:.2f} million,\n{c * largest**p:.0f} s (extrapolated)",
        (n[0], limit),
        xytext=(4, -6),
        textcoords="offset points",
        ha="left",
        va="top",
        fontsize=9,
    )
    right.set(xlabel="degrees of freedom", ylabel="peak memory of the process [GB]")
    for axes in (left, right):
        axes.grid(True, which="major", lw=0.4, color="0.85")
        axes.spines[["top", "right"]].set_visible(False)
    left.legend(frameon=False, fontsize=8, loc="upper left")
    right.legend(frameon=False, fontsize=9, loc="lower right")
    print(f"time n^{p:.2f}, memory n^{exponent:.2f}")
    print(f"{limit:.0f} GB hold {largest:,.0f} degrees of freedom, {c * largest**p:.0f} s")
    return figure


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("picture", nargs="?", type=Path, default=Path("reduction_growth.png"))
    parser.add_argument("--sizes", nargs="*", default=SIZES)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--limit", type=float, default=20.0, help="GB")
    arguments = parser.parse_args()
    results = []
    checked = {(r["shape"], r["size"]): r for r in kept(arguments.keep) if r["kind"] == "stickslip"}
    for size in arguments.sizes:
        result = checked.get(("twisted", size)) or measured(("unchecked", "twisted", size), arguments.keep)
        print(size, result["n_dof"], f"{result['seconds']:.1f} s {result['peak']:.2f} GB", file=sys.stderr)
        results.append(result)
    draw(sorted(results, key=lambda result: result["n_dof"]), arguments.limit).savefig(arguments.picture, dpi=130)


if __name__ == "__main__":
    main()
