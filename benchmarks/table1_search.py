"""Search dimensions of blade, clamp and mesh that reproduce the ten rows of Table 1, with the mesher of the program.

    python benchmarks/table1_search.py [--case study/cases/table1_rig.toml] [--minutes 60] [--seed 0]

A random walk that accepts improvements only. The objective is the largest deviation of a row from its published
frequency, with full FE eigenvalues. It starts from the case file and shows what a longer search gains; `--from-scratch`
starts from a blade with a thick root block (15 mm on each side) instead. Prints every improvement.
"""

import argparse
import time

import numpy as np

from casefile.table import load_case
from study.kind.blade.model import compute_first_frequency
from study.shipped_cases import TABLE1
from study.table1.case import Table1Case
from study.table1.study import make_row_inputs

#: Searched values: key to standard deviation of the step and number of decimals of the result (SI or dimensionless).
STEPS = {
    "blade.length": (0.6e-3, 4),
    "blade.root_thickness": (1.5e-3, 4),
    "mesh.length_ratio": (0.02, 2),
    "mesh.length_cap": (0.5e-3, 4),
    "mesh.pads.band_height": (0.5e-3, 4),
    "root.drop_every": (1.0, 0),
}


def with_values(case: Table1Case, values: dict[str, float]) -> Table1Case:
    """Case with some of its values replaced."""
    data = case.model_dump()
    for key, value in values.items():
        *tables, last = key.split(".")
        table = data
        for name in tables:
            table = table[name]
        table[last] = int(value) if last == "drop_every" else value
    return case.model_copy(
        update={
            "blade": case.blade.model_copy(update=data["blade"]),
            "mesh": case.mesh.model_copy(
                update={**data["mesh"], "pads": case.mesh.pads.model_copy(update=data["mesh"]["pads"])}
            ),
            "root": case.root.model_copy(update=data["root"]),
        }
    )


def current(case: Table1Case) -> dict[str, float]:
    """Searched values of a case."""
    data = case.model_dump()
    result = {}
    for key in STEPS:
        value = data
        for name in key.split("."):
            value = value[name]
        result[key] = float(value)
    return result


def errors(case: Table1Case) -> np.ndarray:
    """Full FE frequency minus the published one, for each row [Hz]."""
    return np.array([compute_first_frequency(make_row_inputs(case, row))[1] - row.paper for row in case.model])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--case", default=str(TABLE1[0]))
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--from-scratch", action="store_true")
    options = parser.parse_args()
    case = load_case(options.case, Table1Case)
    values = current(case)
    if options.from_scratch:
        values |= {"blade.length": 0.25, "blade.root_thickness": 0.04, "mesh.length_ratio": 2.36}
        values |= {"mesh.pads.band_height": 0.006}
    random = np.random.default_rng(options.seed)
    best, start = np.inf, time.monotonic()
    trial = values
    while time.monotonic() - start < 60 * options.minutes:
        try:
            result = errors(with_values(case, trial))
        except ValueError as error:  # a blade that cannot be built
            print(f"skipped: {error}")
            result = np.array([np.inf])
        if np.abs(result).max() < best:
            best, values = float(np.abs(result).max()), trial
            shown = ", ".join(f"{key} {value:g}" for key, value in values.items())
            print(
                f"{time.monotonic() - start:7.0f} s  {best:.3f} Hz  {shown}\n         {np.round(result, 2)}", flush=True
            )
        chosen = random.random(len(STEPS)) < 0.4
        trial = dict(values)
        for (key, (step, digits)), moved in zip(STEPS.items(), chosen, strict=True):
            if moved:
                trial[key] = round(values[key] + step * random.standard_normal(), digits)
        trial["root.drop_every"] = max(2.0, trial["root.drop_every"])


if __name__ == "__main__":
    main()
