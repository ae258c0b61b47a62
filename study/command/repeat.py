"""``stickslip repeat``: compute a result again, and compare the numbers."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from study.run_context import DEFAULTS, Answer, Options, Out, make_command_app

app = make_command_app(
    "repeat",
    """Runs the command that made a page again: every page contains this command, hashes of the data, and versions.
    For an output folder without a page, such as that of `solve`, they are in the record of its last run. First,
    one sentence is printed for each file, package or version that has changed. Then the command runs on copies of
    the data, without stored results, into a new folder, and each number is compared. Exit code 1 if one differs.""",
    examples=["stickslip repeat diagnosed/beam_diagnosis.html --out again", "stickslip repeat solved --out again"],
)


@app.default
def repeat(
    result: Annotated[Path, Parameter(help="Page, or output folder of a run.")],
    /,
    *,
    out: Out = Path("repeated"),
    folder: Annotated[Path | None, Parameter(help="Folder from which the command was run, if it has moved.")] = None,
    options: Options = DEFAULTS,
) -> Answer:
    """Make a result again and compare its numbers."""
    from geometry.errors import InputError
    from study.difference import describe_differences
    from study.repeat.run import repeat_result

    if out.exists() and (result.resolve() == out.resolve() or out.resolve() in result.resolve().parents):
        raise InputError(f"--out {out} is the folder of the result: name a new one")
    repeated = repeat_result(result, options.open(out), options.cache_folder, folder)
    lines = describe_differences(repeated.differences)
    verdict = "the numbers are the same" if repeated.same else "the numbers are not the same"
    return Answer(
        document={
            "command": list(repeated.command),
            "changes": list(repeated.changes),
            "same": repeated.same,
            **repeated.differences,
        },
        text="\n".join([f"{verdict}: {lines[0]}", *lines[1:]]),
        exit_code=0 if repeated.same else 1,
    )
