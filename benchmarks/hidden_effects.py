"""Hidden-effect test: does a diagnosis name the effect that the virtual test bench planted in a campaign?

    python -m benchmarks.hidden_effects --workers 2

makes and diagnoses 20 campaigns for each kind of effect, 100 without an effect, and 20 for each of three effects that
are missing from the catalogue; seeds from 130000 on. Each campaign is a line of `records.jsonl` in the folder; an
interrupted run continues when it is started again. Then, or with `--score` alone, it writes the score: `score.md`
(tables with Wilson's intervals of 95 %) and `confusion.png`.

    python -m benchmarks.hidden_effects --groups

writes `hidden_effects_groups.toml`: effects that this layout of tests cannot separate. It is run before any scoring.
"""

import argparse
from functools import partial
from pathlib import Path

from benchmarks.hidden_effects_groups import FILE, Groups, make_groups, read_groups
from benchmarks.hidden_effects_plan import ROWS, cases
from benchmarks.hidden_effects_record import Record, read
from benchmarks.hidden_effects_run import Work, run


def main(arguments: list[str] | None = None, work: Work | None = None, groups: Groups | None = None) -> None:
    """Run the command.

    Parameters
    ----------
    arguments
        Arguments of the command line.
    work, groups
        Function that makes a record, and groups; by default bench and diagnosis, and the groups of the file.
    """
    options = _options(arguments)
    if options.groups:
        result = make_groups()
        alike = sum(cosine >= result.same for cosine in result.pairs.values())
        print(f"{alike} pairs of effects cannot be told apart: {FILE}")
        return
    groups = groups or read_groups()
    planned = cases(options.seeds, options.nothing, options.first_seed, options.only)
    if options.score:
        wanted = {(case.row, case.seed) for case in planned}
        records = [record for record in read(options.folder / "records.jsonl") if (record.row, record.seed) in wanted]
    else:
        from benchmarks.hidden_effects_campaign import examine, summary

        records = run(
            planned,
            options.folder,
            work or partial(examine, groups=groups),
            workers=options.workers,
            most_seconds=60 * options.most_minutes,
            again=options.again,
            say=partial(print, flush=True),
            told=summary,
        )
    if not records:
        raise SystemExit(f"{options.folder} holds no record of these campaigns: run without --score")
    write_score(records, groups, options.folder)


def write_score(records: list[Record], groups: Groups, folder: Path) -> None:
    """Write `score.md` and `confusion.png`."""
    from benchmarks.hidden_effects_score import score
    from benchmarks.hidden_effects_table import markdown, picture

    result = score(records, groups)
    text = markdown(result)
    (folder / "score.md").write_text(text, encoding="utf-8")
    (folder / "confusion.png").write_bytes(picture(result.confusion))
    print(f"\n{text}\n{folder / 'score.md'}, {folder / 'confusion.png'}")


def _options(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.hidden_effects", description=__doc__.partition("\n")[0])
    parser.add_argument("--workers", type=int, default=2, help="processes; 0 works in this one")
    parser.add_argument("--folder", type=Path, default=Path("build/hidden_effects"), help="of records and score")
    parser.add_argument("--seeds", type=int, default=20, help="campaigns for each effect")
    parser.add_argument("--nothing", type=int, default=100, help="campaigns without any")
    parser.add_argument(
        "--only", action="append", default=[], choices=[*ROWS], help="rows of the score; may be repeated"
    )
    parser.add_argument("--first-seed", type=int, default=130_000)
    parser.add_argument("--most-minutes", type=float, default=float("inf"), help="begin no campaign after so long")
    parser.add_argument("--again", action="store_true", help="try again what failed")
    parser.add_argument("--score", action="store_true", help="score what is there")
    parser.add_argument("--groups", action="store_true", help="find the effects that cannot be told apart")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        raise SystemExit("interrupted: run it again to go on; --score scores what is there") from None
