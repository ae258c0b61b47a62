"""Errors of the parameters of random systems after calibration to their measured families.

    OMP_NUM_THREADS=1 python -m benchmarks.family_calibration [--systems 2000:4000] [--most 30] [--output FILE]

The tangential stiffnesses and the friction coefficient of a specimen differ from those of its model by factors with a
standard deviation of 10 and 15 %. The specimen is measured by time integration as in `benchmarks.family_coverage`, and
both factors are fitted from 1. Friction histories reach 0.9 of the friction limits, or the fraction of --history.

Seeds below 1000 are for development. The errors of both factors are printed for each system, and their medians at the
end. Some levels do not determine the friction coefficient, so the medians are the score.
"""

import argparse
import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import family_coverage
from benchmarks.processor_time import TimeUp, limited
from correlation.family.family import measured_families
from correlation.family.frequencies import choose_frequencies
from correlation.family.noise import estimate_repeat_errors
from correlation.model import Model
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from diagnosis.fit.family_fit import fit_families
from diagnosis.fit.family_target import FamilyGroup, FamilyTarget
from geometry.errors import InputError
from hbsolve.errors import NoSteadyState
from study.case.added import apply_all
from transient.errors import TransientError

#: Standard deviations of the logarithms of the hidden factors.
HIDDEN = {"kt": 0.10, "mu": 0.15}
#: Largest processor time to measure a specimen, and to fit its model [s]; number of frequencies in the fit.
PATIENCE, N_FREQUENCY = 90.0, 10


def calibrate(seed: int) -> Mapping[str, Any] | None:
    """Errors of the factors of one system; None if the seed has no usable system."""
    model = family_coverage.random_model(seed)
    parameters = [] if model is None else [item for item in list_calibration_parameters(model) if item.name in HIDDEN]
    if model is None or len(parameters) < len(HIDDEN):
        return None
    names = [item.name for item in parameters]

    def compose(values: Any) -> Model:
        return apply_all(model, parameters, dict(zip(names, values.tolist(), strict=True)), ())

    random = np.random.default_rng([20261130, seed])
    hidden = np.array([np.exp(HIDDEN[name] * random.standard_normal()) for name in names])
    try:
        with limited(PATIENCE):
            campaign = family_coverage.measure(compose(hidden), random, "none", 0.0)
        families = measured_families(campaign)
        errors = estimate_repeat_errors(campaign, families)
        motion = [item for item in families if item.sensor == "near"]
        group = FamilyGroup(families, choose_frequencies(motion, N_FREQUENCY, N_FREQUENCY))
        target = FamilyTarget(groups=[group], errors=errors, shift=family_coverage.BUDGET.frequency)
        begin = time.process_time()
        with limited(PATIENCE):
            fit = fit_families(compose, parameters, np.ones(len(parameters)), target)
    except (TransientError, TimeUp, SystemError, InputError, NoSteadyState) as error:  # SystemError: from compiled code
        return {"seed": seed, "error": f"{type(error).__name__}: {error}"}
    result = dict(zip(names, (fit.values / hidden - 1).tolist(), strict=True))
    return {"seed": seed, **result, "models": fit.n_evaluation, "seconds": time.process_time() - begin}


def main() -> None:
    """Run the systems and print the medians."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--systems", default="2000:4000", help="seeds, first:last+1; not all are of use")
    options.add_argument("--most", type=int, default=30, help="systems at most")
    options.add_argument("--history", type=float, default=family_coverage.HISTORY, help="share of the friction limits")
    options.add_argument("--output", type=Path, help="one line of JSON for each system")
    given = options.parse_args()
    family_coverage.HISTORY = given.history
    results: list[Mapping[str, Any]] = []
    for seed in range(*map(int, given.systems.split(":"))):
        result = calibrate(seed)
        if result is None:
            continue
        print(json.dumps(result), flush=True)
        if given.output:
            with given.output.open("a") as file:
                file.write(json.dumps(result) + "\n")
        results += [result] if "error" not in result else []
        if len(results) == given.most:
            break
    for name in (*HIDDEN, "models", "seconds"):
        size = np.abs([item[name] for item in results])
        print(f"{name}: median {np.median(size):.3g}, three quarters below {np.quantile(size, 0.75):.3g}")


if __name__ == "__main__":
    main()
