"""`python -m benchmarks.next_test --seeds 60:90`: measure as advised and at random, and print the score."""

import argparse
import json
from pathlib import Path

from benchmarks.next_test.score import make_table, summarise

#: Seeds of development are below this number; sealed seeds from it on are for a final score.
DEVELOPMENT = 1000


def main() -> None:
    """Run the seeds and print the score."""
    words = argparse.ArgumentParser(prog="python -m benchmarks.next_test", description=__doc__)
    words.add_argument("--seeds", default="60:70", help="first:last+1, or several single ones as 48,65,66")
    words.add_argument("--sealed", action="store_true", help=f"allows seeds from {DEVELOPMENT} on")
    words.add_argument("--output", type=Path, help="file of records, one JSON object a line; those in it are kept")
    given = words.parse_args()
    text = str(given.seeds)
    seeds = [int(item) for item in text.split(",")] if ":" not in text else [*range(*map(int, text.split(":")))]
    if max(seeds) >= DEVELOPMENT and not given.sealed:
        words.error(f"seeds {text}: take those below {DEVELOPMENT}, or say --sealed")
    from benchmarks.next_test.trial import run

    lines = given.output.read_text(encoding="utf-8").splitlines() if given.output and given.output.exists() else []
    records = [record for record in map(json.loads, lines) if record["seed"] in seeds]
    for seed in seeds:
        if seed in {record["seed"] for record in records}:
            continue
        record = run(seed)
        records.append(record)
        print(summarise(record), flush=True)
        if given.output:
            with given.output.open("a", encoding="utf-8") as file:
                file.write(json.dumps(record) + "\n")
    print(make_table(records))


if __name__ == "__main__":
    main()
