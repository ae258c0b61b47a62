"""Cost and accuracy of one search for the limits of the output and all contact forces, against one search for each.

    OMP_NUM_THREADS=1 python -m benchmarks.all_limits [--contacts "blade 1" "ground 2"] [--samples 100]

The separate searches are those of `stickslip limits` with one objective; the common search has objective = "all". Both
run in this process, with the frequencies and levels of the shipped wedge damper.
"""

import argparse
import os
import time

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(threads, "1")  # before numpy reads them

import numpy as np  # noqa: E402

from hbsolve.limits.result import ResponseLimits  # noqa: E402
from study.limits.curve import search_limits  # noqa: E402
from study.limits.model import make_limit_search  # noqa: E402
from study.limits.run import read_limited_case  # noqa: E402
from study.limits.several.quantity import Quantity  # noqa: E402
from study.limits.several.search import make_several_search, search_several_limits  # noqa: E402
from study.limits.table import LimitsTable  # noqa: E402
from study.run_context import silent_run  # noqa: E402
from study.shipped_cases import LIMITS  # noqa: E402


def compare(alone: ResponseLimits, together: ResponseLimits) -> tuple[float, float, float]:
    """Compare the limits of two searches, relative to the larger limit at a level and frequency.

    Returns
    -------
    tuple
        Largest differences by which the common search ends further inside and further outside, and fraction of the
        limits that differ by more than 0.5 %.
    """
    scale = np.maximum(np.abs(alone.value).max(axis=0), 1e-3 * np.abs(alone.value).max())
    outward = np.array([-1, 1])[:, None, None] * (together.value - alone.value) / scale
    return float(max(0.0, -outward.min())), float(max(0.0, outward.max())), float((np.abs(outward) > 5e-3).mean())


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--contacts", nargs="+", default=["blade 1", "ground 2"])
    parser.add_argument("--samples", type=int, default=100)
    chosen = parser.parse_args()
    opened, model = read_limited_case(LIMITS, silent_run())
    case = opened.case
    table = case.limits.model_copy(update={"objective": "all", "samples": chosen.samples})
    search, everything = make_several_search(case, table, case.sweep, model)
    kept = [number for number, item in enumerate(everything) if _is_asked(item, chosen.contacts)]
    search = type(search)(
        first=search.first,
        names=tuple(search.names[number] for number in kept),
        objectives=tuple(search.objectives[number] for number in kept),
    )
    quantities = [everything[number] for number in kept]
    search_limits.compute(make_limit_search(case, _small(quantities[0]), case.sweep, model))  # loads compiled kernels
    begin = time.process_time()
    together = search_several_limits.compute(search)
    common = time.process_time() - begin
    total = 0.0
    print("| quantity | alone [s] | common search inside by | outside by | differ by more than 0.5 % |")
    print("|---|---|---|---|---|")
    for item in quantities:
        begin = time.process_time()
        alone = search_limits.compute(make_limit_search(case, item.table, case.sweep, model)).limits
        spent = time.process_time() - begin
        total += spent
        inside, outside, share = compare(alone, together[item.name])
        print(f"| {item.name} | {spent:.1f} | {inside:.2%} | {outside:.2%} | {share:.1%} |", flush=True)
    print(f"\n{len(quantities)} searches: {total:.1f} s of processor time; one search for all: {common:.1f} s")


def _is_asked(item: Quantity, contacts: list[str]) -> bool:
    return item.output is not None or item.table.contact in contacts


def _small(item: Quantity) -> LimitsTable:
    return item.table.model_copy(update={"population": 2, "samples": 2, "levels": (1.0,)})


if __name__ == "__main__":
    main()
