"""``stickslip runs``: list, compare and remove the runs of a folder."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from study.run_context import DEFAULTS, Answer, Options, format_details, make_command_app

if TYPE_CHECKING:
    from study.run_record import RunRecord

app = make_command_app(
    "runs",
    """A record of each run that writes files is kept: its command line, hashes of its input files, version, machine,
    time and result. `runs` lists the records with output folders in a folder and below, the newest of each
    command and folder. See also the help of `runs compare` and `runs clean`. The stored results of stages, which
    make a second run instant, are managed by `stickslip cache`.""",
    examples=["stickslip runs", "stickslip runs compare solved solved_2", "stickslip runs clean solved --yes"],
)

COMPARE = format_details(
    """Shows which numbers of two results differ, and by how much, after the differences in command, inputs, versions
    and machine.""",
    examples=["stickslip runs compare solved solved_2"],
)
CLEAN = format_details(
    """Lists the files that the last run wrote into an output folder, and removes them with --yes, except files that
    have changed since.""",
    examples=["stickslip runs clean solved", "stickslip runs clean solved --yes"],
)

#: Largest time by which a file of the run may be newer than the record [s].
WRITTEN = 2.0


@app.default
def runs(
    folder: Annotated[Path, Parameter(help="Folder to search; default: the current folder.")] = Path(),
    /,
    *,
    options: Options = DEFAULTS,
) -> Answer:
    """List runs."""
    from geometry.errors import InputError
    from study.command.cache import format_size
    from study.run_record import find_records

    if not folder.is_dir():
        raise InputError(f"{folder} is not a folder: name one that contains output folders")
    records = find_records(options.cache_folder, folder)
    items: list[dict[str, Any]] = [
        {
            "folder": os.path.relpath(record.output),
            "command": list(record.command),
            "finished": record.finished,
            "seconds": record.seconds,
            "bytes": sum(file.stat().st_size for file in _list_files(record)),
            "inputs_changed": _list_changed_inputs(record),
        }
        for record in records
    ]
    if not items:
        return Answer(document={"runs": []}, text=f"no runs in {folder.resolve()} or below")
    lines = [
        f"{item['finished'][:16].replace('T', ' ')}  {item['seconds']:8.1f} s  {format_size(item['bytes']):>8}  "
        f"{item['folder']:20}  {' '.join(item['command'])}"
        + (f"  (changed since: {', '.join(item['inputs_changed'])})" if item["inputs_changed"] else "")
        for item in items
    ]
    return Answer(document={"runs": items}, text="\n".join(["finished (UTC)          took      size  folder", *lines]))


@app.command(name="compare", help_epilogue=COMPARE)
def compare(
    first: Annotated[Path, Parameter(help="Output folder of a run.")],
    second: Annotated[Path, Parameter(help="Output folder of another run.")],
    /,
    *,
    options: Options = DEFAULTS,
) -> Answer:
    """Show which numbers of two answers differ."""
    from study.difference import describe_differences, find_differences
    from study.run_record import find_newest_record

    records = find_newest_record(options.cache_folder, first), find_newest_record(options.cache_folder, second)
    # Names of files are left out, since they contain the folder.
    answers = [{name: value for name, value in record.answer.items() if name != "files"} for record in records]
    context = [
        f"{name}: {getattr(records[0], name)} | {getattr(records[1], name)}"
        for name in ("version", "machine")
        if getattr(records[0], name) != getattr(records[1], name)
    ]
    context += [
        f"{name}: its content differs"
        for name in records[0].inputs.keys() & records[1].inputs.keys()
        if records[0].inputs[name] != records[1].inputs[name]
    ]
    document = {
        "first": str(first),
        "second": str(second),
        "context": context,
        **find_differences(*answers),
    }
    return Answer(document=document, text="\n".join([*context, *describe_differences(document)]))


@app.command(name="clean", help_epilogue=CLEAN)
def clean(
    *folders: Annotated[Path, Parameter(help="Output folder of a run.")],
    yes: Annotated[bool, Parameter(negative="", help="Remove the files; otherwise they are only listed.")] = False,
    options: Options = DEFAULTS,
) -> Answer:
    """Remove the files that runs wrote."""
    from geometry.errors import InputError
    from study.command.cache import format_size
    from study.run_record import find_newest_record

    if not folders:
        raise InputError("name the output folders whose runs are to be removed")
    records = [find_newest_record(options.cache_folder, folder) for folder in folders]
    removed: list[Path] = []
    kept: list[Path] = []
    for record in records:
        written = record.path.stat().st_mtime + WRITTEN
        for file in _list_files(record):
            (removed if file.stat().st_mtime <= written else kept).append(file)
    size = sum(file.stat().st_size for file in removed)
    if yes:
        for file in (*removed, *(record.path for record in records)):
            file.unlink()
        for folder in {Path(record.output) for record in records}:
            if folder != Path.cwd() and not any(folder.iterdir()):
                folder.rmdir()
    lines = [*map(str, removed), *(f"{file} is kept: it was changed after the run" for file in kept)]
    lines.append(f"{'removed' if yes else 'would remove'} {len(removed)} files, {format_size(size)}")
    if not yes:
        lines.append("add --yes to remove them")
    document = {"removed": yes, "files": list(map(str, removed)), "kept": list(map(str, kept)), "bytes": size}
    return Answer(document=document, text="\n".join(lines))


def _list_files(record: "RunRecord") -> list[Path]:
    """List the existing files that a run wrote."""
    output = Path(record.output)
    # Names of files outside the folder, from a manipulated record, are ignored.
    return [output / name for name in record.files if Path(name).name == name and (output / name).is_file()]


def _list_changed_inputs(record: "RunRecord") -> list[str]:
    from study.provenance import hash_content

    return [name for name, known in record.inputs.items() if hash_content(Path(record.folder) / name) != known]
