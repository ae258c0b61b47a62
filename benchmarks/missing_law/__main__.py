"""`python -m benchmarks.missing_law --seeds 0:20`: make campaigns, recover their laws, and print the score."""

import argparse
import json
import time
from pathlib import Path
from typing import Any

#: Seeds of development are below the first number; seeds of the score.
DEVELOPMENT, SCORE = 1000, range(10000, 10040)


def run(seed: int) -> dict[str, Any]:
    """Make the campaign of a seed, recover its law and return the record."""
    from benchmarks.missing_law.campaign import make
    from benchmarks.missing_law.score import are_words_right, score_law
    from correlation.noise.nuisance import Budget
    from diagnosis.fit.arrangement import arrange
    from diagnosis.fit.calibration_parameter import list_calibration_parameters
    from diagnosis.missing_law.basis import EVEN
    from diagnosis.missing_law.curves import compute_curves
    from diagnosis.missing_law.description import describe
    from diagnosis.missing_law.recover import recover_law

    trial = make(seed)
    calibration = list_calibration_parameters(trial.model, deviation={"E": 0.005})
    budget = Budget(frequency=5e-4, compliance=0.0, shares=0.0)
    arrangement = arrange(trial.campaign, trial.model, calibration, budget)
    begin = time.process_time()
    result = recover_law(arrangement)
    record: dict[str, Any] = {
        "seed": seed, "kind": trial.hidden.kind, "contacts": trial.n_contact, "sensors": len(trial.model.sensors),
        "harmonics": trial.harmonics, "chi2": arrangement.fit.chi2 / arrangement.fit.n_number,
        "law": result is not None, "seconds": time.process_time() - begin,
    }  # fmt: skip
    if result is None:
        return record
    own = next((law for law in result.places if law.name == trial.hidden.place), None)
    words = describe(compute_curves(result.best))
    record |= {"placed": trial.hidden.place in result.credible, "credible": result.credible, "words": words.words}
    if own is not None:
        sees_even = bool(own.posterior.is_seen[EVEN])
        error, covered = score_law(own, trial)
        record |= {
            "error": error, "covered": covered, "noise": own.posterior.noise,
            "right": are_words_right(describe(compute_curves(own)).words, trial.hidden.kind, sees_even=sees_even),
        }  # fmt: skip
    return record


def main() -> None:
    """Run the seeds and print the score."""
    words = argparse.ArgumentParser(prog="python -m benchmarks.missing_law", description=__doc__)
    words.add_argument("--seeds", help="first:last+1, below 1000 for development; by default those of the score")
    words.add_argument("--output", type=Path, help="file of records, one JSON object a line; those in it are kept")
    given = words.parse_args()
    seeds = SCORE
    if given.seeds:
        seeds = range(*map(int, given.seeds.split(":")))
        if seeds.stop > DEVELOPMENT:
            words.error(f"seeds {given.seeds}: take those below {DEVELOPMENT}, or leave it out for the score")
    from benchmarks.missing_law.score import make_table

    lines = given.output.read_text(encoding="utf-8").splitlines() if given.output and given.output.exists() else []
    records = [record for record in map(json.loads, lines) if record["seed"] in seeds]
    for seed in seeds:
        if seed in {record["seed"] for record in records}:
            continue
        records.append(run(seed))
        print(json.dumps(records[-1]), flush=True)
        if given.output:
            with given.output.open("a", encoding="utf-8") as file:
                file.write(json.dumps(records[-1]) + "\n")
    print(make_table(records))


if __name__ == "__main__":
    main()
